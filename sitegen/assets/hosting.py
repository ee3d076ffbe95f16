"""What hosts are told: headers, the Content-Security-Policy, and the service worker with its list of files."""

from __future__ import annotations

import base64
import json
import re
from collections.abc import Iterable, Mapping
from pathlib import Path

from sitegen.cache.files import digest, fingerprint, short_hash


def policy(style: str = "", script: str = "") -> str:
    """The Content-Security-Policy. style, script: hashes of what stands in a page itself.

    A worker may be made of a blob: that one has its page's policy, others only what a host sends along with their file.
    """
    scripts = ["'self'", "'wasm-unsafe-eval'", *([script] if script else [])]
    styles = ["'self'", *([style] if style else [])]
    return (
        f"default-src 'none'; script-src {' '.join(scripts)}; style-src {' '.join(styles)}; img-src 'self' data:; "
        "font-src 'self'; connect-src 'self'; worker-src 'self' blob:; manifest-src 'self'; base-uri 'none'; "
        "form-action 'none'"
    )


def source_of(text: str) -> str:
    """What a policy calls a style or a script that stands in a page."""
    return f"'{integrity(digest(text.encode()))}'"


def integrity(hashed: str) -> str:
    """A sha256 in hex as browsers want it."""
    return "sha256-" + base64.b64encode(bytes.fromhex(hashed)).decode()


POLICY = policy()
IMMUTABLE = ("assets/", "images/", "runtime/", "tapes/")
"""The folders whose files are named by their content: kept for ever by browsers, hosts and the service worker."""
FOR_HOSTS = ("404.html", "sitemap.xml")  # what no reader asks for; a host may answer for the first as it says: by a 404
MAP = ".map"  # for whoever looks into a script with a browser's tools; no reader's browser asks for it


def immutable(folder: str) -> str:
    """The rule of `_headers` for one of the folders."""
    return f"/{folder}*\n  Cache-Control: public, max-age=31536000, immutable\n"


def headers(policy: str) -> str:
    """`_headers`: what hosts shall send along."""
    return f"""\
/*
  Content-Security-Policy: {policy}; frame-ancestors 'none'
  X-Content-Type-Options: nosniff
  Referrer-Policy: strict-origin-when-cross-origin
{"".join(map(immutable, IMMUTABLE))}/sw.js
  Cache-Control: no-cache
"""


def service_worker(
    root: Path, files: Mapping[str, bytes], runtime: Iterable[tuple[str, int, str]]
) -> bytes | None:
    """The service worker with all that it keeps filled in; None where templates/assets has none.

    runtime: name, bytes and sha256 in hex of the files of Python. A change of any file, or of the worker, is a version.
    """
    path = root / "templates" / "assets" / "sw.js"
    if not path.is_file():
        return None
    code = path.read_bytes()
    pages = {name: data for name, data in files.items() if name not in FOR_HOSTS and not name.endswith(MAP)}
    filled = {
        "VERSION": fingerprint((name, digest(data).encode()) for name, data in [*pages.items(), ("sw.js", code)])[:16],
        "FILES": _listed((name, len(data), digest(data)) for name, data in pages.items()),
        "RUNTIME": (python := _listed(runtime)),
        "RUNTIME_VERSION": short_hash(python.encode()),
        "IMMUTABLE": json.dumps(IMMUTABLE),
    }
    return re.sub(r"__([A-Z_]+)__", lambda match: filled[match[1]], code.decode()).encode()


def _listed(files: Iterable[tuple[str, int, str]]) -> str:
    """Name, bytes and integrity of each file as JSON, a line a file."""
    lines = [json.dumps([name, size, integrity(hashed)]) for name, size, hashed in sorted(files)]
    return "[\n" + "".join(f"  {line},\n" for line in lines).removesuffix(",\n") + "\n]"
