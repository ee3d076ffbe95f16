# What numpy's random generator uses of it; the rest would import hmac, base64 and Python's own generator.
from os import urandom


def randbits(k):
    return int.from_bytes(urandom((k + 7) // 8)) >> (-k % 8)
