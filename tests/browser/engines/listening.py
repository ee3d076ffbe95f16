"""The built site on loopback with a listener in every page, for a driver that does not report errors."""

from __future__ import annotations

from pathlib import Path

from tests.browser.server import Doorkeeper

NAME = "listening.js"
LISTENER = b"""\
globalThis.complaints = [];
addEventListener("error", (event) => complaints.push(event.message || `not loaded: ${event.target.outerHTML}`), true);
addEventListener("unhandledrejection", (event) => complaints.push(`unhandled: ${event.reason}`));
addEventListener("securitypolicyviolation", (event) => complaints.push(`refused: ${event.blockedURI}`));
for (const level of ["error", "warn"]) console[level] = (...said) => complaints.push(said.join(" "));
"""


class Listening(Doorkeeper):
    """Serve pages with the listener as their first script; requests that store pages get them as they were built."""

    def read(self, file: Path) -> bytes | None:
        if file.name == NAME:
            return LISTENER
        data = super().read(file)
        tag = f'<head><script src="{NAME}"></script>'.encode()
        is_page = file.suffix == ".html" and "text/html" in self.headers.get("Accept", "")
        return data.replace(b"<head>", tag, 1) if data and is_page else data
