"""The built site on loopback, with doors: a test can hold or forbid the files that a browser requests."""

from __future__ import annotations

import re
import shutil
import threading
from http import HTTPStatus
from pathlib import Path

from sitegen.serve.static_files import TYPES, StaticHandler, StaticServer


class Doorkeeper(StaticHandler):
    """Serves what the doors let through."""

    server: SiteServer

    def do_GET(self) -> None:
        server = self.server
        server.asked.append(self.path)
        if server.held and server.held.search(self.path):
            server.open.wait()
        if server.forbidden and server.forbidden.search(self.path):
            self.missing()
        elif server.extensionless and self.path.endswith(".html"):
            self.send_response(HTTPStatus.PERMANENT_REDIRECT)
            self.send_header("Location", re.sub(r"(?<=/)index$", "", self.path.removesuffix(".html")))
            self.send_header("Content-Length", "0")
            self.end_headers()
        else:
            if server.extensionless and "." not in self.path and not self.path.endswith("/"):
                self.path += ".html"
            super().do_GET()

    def answer(self, status: HTTPStatus, data: bytes, kind: str, headers: dict[str, str]) -> None:
        spoil = self.server.spoilt.get(self.path.rpartition("/")[2])
        if spoil == "typed":
            kind = "text/plain"
        elif spoil == "flipped":
            at = len(data) // 2
            data = data[:at] + bytes([data[at] ^ 1]) + data[at + 1 :]
        elif spoil == "short":
            data = data[: len(data) * 2 // 3]
        elif spoil == "empty":
            data = b""
        elif spoil == "page":
            data, kind = b"<!doctype html><title>Sign in</title><p>Sign in to this network.", TYPES[".html"]
        elif spoil == "broken":
            status = HTTPStatus.INTERNAL_SERVER_ERROR
        elif spoil == "reset":
            self.close_connection = True
            return
        elif spoil == "cut":
            self.cut(data)
            return
        super().answer(status, data, kind, headers)

    def headers_of(self, path: str) -> dict[str, str]:
        return {} if self.server.bare else super().headers_of(path)

    def cut(self, data: bytes) -> None:
        """Send half of the answer, then close the connection."""
        self.close_connection = True
        self.send_response(HTTPStatus.OK)
        self.send_header("Content-Type", "text/javascript")
        self.send_header("Content-Length", str(len(data)))
        self.end_headers()
        self.wfile.write(data[: len(data) // 2])


class SiteServer(StaticServer):
    """Serves `root`; `hold(pattern)` keeps requests waiting until `release()`, `forbid(pattern)` answers 404.

    A `spoilt` file arrives wrong: with another type, with a flipped bit, too short, cut off, empty, as some other page,
    with the status 500, or not at all. A `bare` server sends none of the site's headers, like GitHub Pages. An
    `extensionless` one has each page at an address without .html and redirects from the other, like Cloudflare Pages.
    `asked` are the paths of all requests.
    """

    def __init__(self, root: Path, handler: type[Doorkeeper] = Doorkeeper) -> None:
        self.held: re.Pattern[str] | None = None
        self.forbidden: re.Pattern[str] | None = None
        self.spoilt: dict[str, str] = {}  # a file's name → typed, flipped, short, cut, empty, page, broken or reset
        self.bare = self.extensionless = False
        self.asked: list[str] = []
        self.open = threading.Event()
        super().__init__(root, ("127.0.0.1", 0), handler)
        threading.Thread(target=self.serve_forever, kwargs={"poll_interval": 0.05}, daemon=True).start()

    def hold(self, pattern: str) -> None:
        self.held = re.compile(pattern)
        self.open.clear()

    def release(self) -> None:
        self.held = None
        self.open.set()

    def forbid(self, pattern: str | None) -> None:
        self.forbidden = re.compile(pattern) if pattern else None

    def stop(self) -> None:
        """Stop the server, also for requests that wait at a door."""
        self.release()
        super().stop()


def published_anew(site: Path, folder: Path) -> Path:
    """A copy of the site in the folder as another build would leave it: its worker has another name."""
    new = folder / "site"
    shutil.copytree(site, new)
    (worker,) = new.glob("assets/worker.*.mjs")
    new_path = worker.rename(worker.with_name("worker.0000000000.mjs"))
    for path in new.glob("*.html"):
        path.write_text(path.read_text("utf-8").replace(worker.name, new_path.name), "utf-8")
    return new
