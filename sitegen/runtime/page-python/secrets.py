# What numpy's random generator asks of it; the rest brings hmac, base64 and the other generator.
from os import urandom


def randbits(k):
    return int.from_bytes(urandom((k + 7) // 8)) >> (-k % 8)
