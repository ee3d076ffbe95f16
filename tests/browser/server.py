"""The built site on loopback, with doors: a test can hold, forbid or count the files that a browser asks for."""

from __future__ import annotations

import re
import socket
import threading
from pathlib import Path
from typing import Any

from sitegen.static import StaticHandler, StaticServer


class Doorkeeper(StaticHandler):
    """Serves what the doors let through."""

    server: DoorServer

    def do_GET(self) -> None:
        server = self.server
        server.asked.append(self.path)
        if server.held and server.held.search(self.path):
            server.open.wait()
        if server.forbidden and server.forbidden.search(self.path):
            self.missing()
        else:
            super().do_GET()


class DoorServer(StaticServer):
    """A static server that knows its doors and its callers."""

    def __init__(self, root: Path) -> None:
        self.asked: list[str] = []
        self.held: re.Pattern[str] | None = None
        self.forbidden: re.Pattern[str] | None = None
        self.open = threading.Event()
        self.open.set()
        self.callers: list[socket.socket] = []
        super().__init__(root, ("127.0.0.1", 0), Doorkeeper)

    def get_request(self) -> tuple[socket.socket, Any]:
        caller, address = super().get_request()
        self.callers.append(caller)
        return caller, address


class SiteServer:
    """Serves `root`; `hold(pattern)` keeps requests waiting until `release()`, `forbid(pattern)` answers 404."""

    def __init__(self, root: Path) -> None:
        self._server = DoorServer(root)
        self.origin = self._server.origin
        self.asked = self._server.asked
        serve = {"poll_interval": 0.05}
        threading.Thread(target=self._server.serve_forever, kwargs=serve, daemon=True).start()

    def hold(self, pattern: str) -> None:
        self._server.held = re.compile(pattern)
        self._server.open.clear()

    def release(self) -> None:
        self._server.held = None
        self._server.open.set()

    def forbid(self, pattern: str | None) -> None:
        self._server.forbidden = re.compile(pattern) if pattern else None

    def stop(self) -> None:
        """The server is gone, also for those who are still connected."""
        self.release()
        self._server.shutdown()
        self._server.server_close()
        for caller in self._server.callers:
            try:
                caller.shutdown(socket.SHUT_RDWR)
            except OSError:  # closed long ago
                continue
