"""Files for hosts and browsers: headers, the Content-Security-Policy, and the service worker with its list of files."""

from __future__ import annotations

import base64
import json
import re
from collections.abc import Iterable, Mapping
from pathlib import Path

from sitegen.cache.files import digest, fingerprint, short_hash


def policy(styles: Iterable[str] = (), scripts: Iterable[str] = ()) -> str:
    """The Content-Security-Policy. styles, scripts: the inline ones that it allows.

    Workers may be made from a blob: such a worker has its page's policy, others only the headers sent with their file.
    """
    scripts = ["'self'", "'wasm-unsafe-eval'", *map(source_of, scripts)]
    styles = ["'self'", *map(source_of, styles)]
    return (
        f"default-src 'none'; script-src {' '.join(scripts)}; style-src {' '.join(styles)}; img-src 'self' data:; "
        "font-src 'self'; connect-src 'self'; worker-src 'self' blob:; manifest-src 'self'; base-uri 'none'; "
        "form-action 'none'"
    )


def source_of(text: str) -> str:
    """The policy source of an inline style or script."""
    return f"'{integrity(digest(text.encode()))}'"


def integrity(hashed: str) -> str:
    """A hexadecimal sha256 in the form that browsers take."""
    return "sha256-" + base64.b64encode(bytes.fromhex(hashed)).decode()


POLICY = policy()
IMMUTABLE = ("assets/", "images/", "runtime/", "tapes/")
"""Folders whose files are named by their content: browsers, hosts and the service worker may keep them for ever."""
FOR_HOSTS = ("404.html", "sitemap.xml")  # not requested by readers; hosts may serve the first with the status 404
MAP = ".map"  # source maps, for a browser's developer tools only


def immutable(folder: str) -> str:
    """The rule in `_headers` for one of the folders."""
    return f"/{folder}*\n  Cache-Control: public, max-age=31536000, immutable\n"


def headers(policy: str) -> str:
    """The file `_headers`: the headers that hosts should send."""
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
    """The service worker with its lists of files filled in; None if templates/assets has none.

    runtime: name, bytes and hexadecimal sha256 of Python's files. Any change of a file or of the worker is a new
    version.
    """
    path = root / "templates" / "assets" / "sw.js"
    if not path.is_file():
        return None
    code = path.read_bytes()
    pages = {name: data for name, data in files.items() if name not in FOR_HOSTS and not name.endswith(MAP)}
    filled = {
        "VERSION": fingerprint((name, digest(data).encode()) for name, data in [*pages.items(), ("sw.js", code)])[:16],
        "FILES": _file_list((name, len(data), digest(data)) for name, data in pages.items()),
        "RUNTIME": (python := _file_list(runtime)),
        "RUNTIME_VERSION": short_hash(python.encode()),
        "IMMUTABLE": json.dumps(IMMUTABLE),
    }
    return re.sub(r"__([A-Z_]+)__", lambda match: filled[match[1]], code.decode()).encode()


def _file_list(files: Iterable[tuple[str, int, str]]) -> str:
    """Name, bytes and integrity of each file as JSON, one line per file."""
    lines = [json.dumps([name, size, integrity(hashed)]) for name, size, hashed in sorted(files)]
    return "[\n" + "".join(f"  {line},\n" for line in lines).removesuffix(",\n") + "\n]"
