"""The built site on loopback, with doors: a test can hold, forbid or count the files that a browser asks for."""

from __future__ import annotations

import http.server
import re
import threading
from pathlib import Path
from typing import ClassVar

TYPES = {".mjs": "text/javascript", ".js": "text/javascript", ".wasm": "application/wasm", ".woff2": "font/woff2"}


class SiteServer:
    """Serves `root`; `hold(pattern)` keeps requests waiting until `release()`, `forbid(pattern)` answers 404."""

    def __init__(self, root: Path) -> None:
        self.asked: list[str] = []
        self._held: re.Pattern[str] | None = None
        self._forbidden: re.Pattern[str] | None = None
        self._open = threading.Event()
        self._open.set()
        door = self

        class Handler(http.server.SimpleHTTPRequestHandler):
            extensions_map: ClassVar[dict[str, str]] = {**http.server.SimpleHTTPRequestHandler.extensions_map, **TYPES}
            protocol_version = "HTTP/1.1"

            def __init__(self, *args: object) -> None:
                super().__init__(*args, directory=str(root))  # type: ignore[arg-type]

            def do_GET(self) -> None:
                door.asked.append(self.path)
                if door._held and door._held.search(self.path):
                    door._open.wait()
                if door._forbidden and door._forbidden.search(self.path):
                    self.send_error(404)
                    return
                try:
                    super().do_GET()
                except (BrokenPipeError, ConnectionResetError):  # the reader left
                    self.close_connection = True

            def log_message(self, *args: object) -> None:
                pass

        class Quiet(http.server.ThreadingHTTPServer):
            daemon_threads = True

            def handle_error(self, request: object, client_address: object) -> None:
                pass

        self._server = Quiet(("127.0.0.1", 0), Handler)
        self.origin = f"http://127.0.0.1:{self._server.server_port}"
        threading.Thread(target=self._server.serve_forever, daemon=True).start()

    def hold(self, pattern: str) -> None:
        self._held = re.compile(pattern)
        self._open.clear()

    def release(self) -> None:
        self._open.set()
        self._held = None

    def forbid(self, pattern: str | None) -> None:
        self._forbidden = re.compile(pattern) if pattern else None

    def stop(self) -> None:
        self.release()
        self._server.shutdown()
        self._server.server_close()
