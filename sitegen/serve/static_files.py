"""A folder served over HTTP as a static host would: content types, the headers of its `_headers` file, and 304s."""

from __future__ import annotations

import fnmatch
import hashlib
import math
import mimetypes
import socket
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Thread
from typing import Any
from urllib.parse import unquote
from weakref import WeakKeyDictionary

# Listed here because the tables of different machines disagree on these types or lack them.
TYPES = {
    ".css": "text/css; charset=utf-8",
    ".html": "text/html; charset=utf-8",
    ".ico": "image/x-icon",
    ".ipynb": "application/x-ipynb+json",
    ".jpg": "image/jpeg",
    ".js": "text/javascript; charset=utf-8",
    ".json": "application/json; charset=utf-8",
    ".mjs": "text/javascript; charset=utf-8",
    ".png": "image/png",
    ".svg": "image/svg+xml; charset=utf-8",
    ".txt": "text/plain; charset=utf-8",
    ".wasm": "application/wasm",
    ".webmanifest": "application/manifest+json",
    ".webp": "image/webp",
    ".whl": "application/zip",
    ".woff2": "font/woff2",
    ".xml": "application/xml; charset=utf-8",
}

Rule = tuple[str, tuple[tuple[str, str], ...]]


def content_type(path: Path) -> str:
    """The Content-Type for a file's name."""
    guess = mimetypes.guess_type(path.name)[0]
    return TYPES.get(path.suffix.lower()) or guess or "application/octet-stream"


def header_rules(root: Path) -> list[Rule]:
    """Read the rules of `_headers` as static hosts do: a path pattern, then indented `Name: value` lines."""
    file = root / "_headers"
    rules: list[Rule] = []
    for line in file.read_text("utf-8").splitlines() if file.is_file() else []:
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        if not line[0].isspace():
            rules.append((line.strip(), ()))
        elif rules and ":" in line:
            name, _, value = line.strip().partition(":")
            rules[-1] = (rules[-1][0], (*rules[-1][1], (name.strip(), value.strip())))
    return rules


def headers_for(path: str, rules: list[Rule]) -> dict[str, str]:
    """The headers that the rules set for a request path ("/kabsch.html"); a later rule wins."""
    return {name: value for pattern, headers in rules if fnmatch.fnmatchcase(path, pattern) for name, value in headers}


REQUEST_SECONDS = 30.0  # a client that has not sent the complete head of its next request by then is disconnected
CHUNK = 1 << 16  # bytes of a response that a client must accept within the same time

LOOPBACK = ("localhost", "127.0.0.1", "::1")


def named(host: str) -> str:
    """The host name in a Host header, without its port and an address's brackets."""
    if host.startswith("["):
        return host[1:].partition("]")[0].lower()
    return host.partition(":")[0].lower()


def locate(root: Path, url: str) -> tuple[str, Path] | None:
    """The request path and the file below `root` that a URL names; None if it would lead outside of `root`."""
    request = unquote(url.partition("?")[0])  # urlsplit takes "//x" for a host and raises on "//["
    if "\0" in request or "\\" in request:  # Windows treats a backslash as a slash
        return None
    file = (root / request.lstrip("/")).resolve()
    if not file.is_relative_to(root.resolve()):
        return None
    if request.endswith("/"):
        return request + "index.html", file / "index.html"
    return request, file


class StaticHandler(BaseHTTPRequestHandler):
    """GET and HEAD of the files below the server's `root`."""

    protocol_version = "HTTP/1.1"
    disable_nagle_algorithm = True  # head and body are two writes: the second must not wait for the first's ACK
    server: StaticServer

    def setup(self) -> None:
        """Limit each read and write to the server's patience. A response in many chunks may take longer in total."""
        super().setup()
        self.connection.settimeout(self.server.patience)

    def do_HEAD(self) -> None:
        self.do_GET()

    def handle_one_request(self) -> None:
        """Handle the next request, whose head must arrive in time."""
        self.server.expect(self.connection)
        super().handle_one_request()

    def parse_request(self) -> bool:
        """Refuse requests for another host name: otherwise a foreign page could read from loopback (DNS rebinding)."""
        if not super().parse_request():
            return False
        self.server.expect(self.connection, math.inf)
        if self.server.local and named(self.headers.get("Host", "")) not in LOOPBACK:
            self.send_error(HTTPStatus.MISDIRECTED_REQUEST, "This server answers this machine only")
            return False
        return True

    def do_GET(self) -> None:
        location = locate(self.server.root, self.path)
        data = self.read(location[1]) if location else None
        if location is None or data is None:
            self.missing()
        else:
            self.answer(HTTPStatus.OK, data, content_type(location[1]), self.headers_of(location[0]))

    def read(self, file: Path) -> bytes | None:
        """Read the whole file at once, so that no response mixes two builds; None if it cannot be read."""
        try:
            return file.read_bytes()
        except OSError:
            return None

    def headers_of(self, path: str) -> dict[str, str]:
        """The headers for a request path."""
        return headers_for(path, header_rules(self.server.root))

    def missing(self) -> None:
        """Answer 404, with the site's own page if it has one."""
        page = self.read(self.server.root / "404.html") or b"<!doctype html><title>404</title><p>No such page."
        self.answer(HTTPStatus.NOT_FOUND, page, TYPES[".html"], self.headers_of("/404.html"))

    def answer(self, status: HTTPStatus, data: bytes, kind: str, headers: dict[str, str]) -> None:
        """Send a complete response, or a 304 if the browser already has these bytes."""
        tag = f'"{hashlib.sha256(data).hexdigest()[:20]}"'
        fresh = status == HTTPStatus.OK and self.headers.get("If-None-Match") == tag
        self.send_response(HTTPStatus.NOT_MODIFIED if fresh else status)
        for name, value in {"Cache-Control": "no-cache", **headers, "Content-Type": kind, "ETag": tag}.items():
            self.send_header(name, value)
        if not fresh:
            self.send_header("Content-Length", str(len(data)))
        self.end_headers()
        if not fresh and self.command != "HEAD":
            for at in range(0, len(data), CHUNK):
                self.wfile.write(data[at : at + CHUNK])

    def log_message(self, format: str, *args: Any) -> None:
        """Log nothing: a line per request would be noise."""


class StaticServer(ThreadingHTTPServer):
    """A server of one folder; its threads do not keep the process alive."""

    daemon_threads = True

    def __init__(self, root: Path, address: tuple[str, int], handler: type[StaticHandler] = StaticHandler) -> None:
        self.root = root
        self.local = address[0] in LOOPBACK
        if ":" in address[0]:
            self.address_family = socket.AF_INET6
        self.patience = REQUEST_SECONDS
        self._callers: WeakKeyDictionary[socket.socket, float] = WeakKeyDictionary()  # connection → when its time is up
        super().__init__(address, handler)

    def get_request(self) -> tuple[socket.socket, Any]:
        """Accept a connection and start its deadline."""
        caller, address = super().get_request()
        self.expect(caller)
        return caller, address

    def expect(self, caller: socket.socket, seconds: float | None = None) -> None:
        """Set a client's deadline for its next step; the default suits the head of a request."""
        self._callers[caller] = time.monotonic() + (self.patience if seconds is None else seconds)

    def service_actions(self) -> None:
        """Disconnect clients whose time is up. The server's loop calls this on every iteration."""
        now = time.monotonic()
        for caller, until in list(self._callers.items()):
            if until < now:
                self._callers[caller] = math.inf
                hang_up(caller)

    def stop(self) -> None:
        """Stop the server and disconnect everyone. It must be running in another thread."""
        self.shutdown()
        self.server_close()
        for caller in list(self._callers):
            hang_up(caller)

    @property
    def origin(self) -> str:
        """The URL to open."""
        host, port = str(self.server_address[0]), self.server_address[1]
        address = {"0.0.0.0": "127.0.0.1", "::": "::1"}.get(host, host)
        return f"http://{f'[{address}]' if ':' in address else address}:{port}"

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Ignore a browser that disconnects in the middle of a response; report everything else."""
        if not isinstance(sys.exc_info()[1], ConnectionError):
            super().handle_error(request, client_address)


def hang_up(caller: socket.socket) -> None:
    """Shut a connection down; its thread then finds nothing more to read and ends."""
    with suppress(OSError):  # already closed
        caller.shutdown(socket.SHUT_RDWR)


@contextmanager
def serving(root: Path, handler: type[StaticHandler] = StaticHandler) -> Iterator[StaticServer]:
    """Serve the folder on a free loopback port for the duration of the context."""
    server = StaticServer(root, ("127.0.0.1", 0), handler)
    thread = Thread(target=server.serve_forever, kwargs={"poll_interval": 0.05}, daemon=True)
    thread.start()
    try:
        yield server
    finally:
        server.stop()
        thread.join()
