"""`serve`: the site on loopback, rebuilt on every edit; pages update themselves and show the problems of a build.

A build after an edit of code runs in a new process. Pages learn of builds by server-sent events; the script that
listens is added to HTML as it is served, never to the built files.
"""

from __future__ import annotations

import json
import os
import sys
import time
import webbrowser
from collections.abc import Iterable, Iterator
from contextlib import suppress
from functools import partial
from http import HTTPStatus
from pathlib import Path
from threading import Condition, Event, Thread
from typing import Any

import watchfiles

from sitegen.pipeline.attempt import Outcome, tell
from sitegen.serve.rebuilder import Builder
from sitegen.serve.static_files import StaticHandler, StaticServer, content_type

WATCHED = ("content", "templates", "widgets", "solvers", "sitegen", "tests")
SETTLE_MS = 20  # an editor's save is complete when nothing has changed for this long
SWAP_SECONDS = 30.0  # how long a request waits for a build that has just moved its file away
PORTS = 50
PREVIEW = Path(__file__).with_name("preview")
SCRIPTS = {f"/.ladder/{path.name}": path for path in PREVIEW.glob("*.js")}
FOLLOW = "/.ladder/follow.js"  # imports the others

# A service worker from an earlier visit would answer from its cache; this one replaces it and unregisters itself.
NO_SERVICE_WORKER = b"""\
addEventListener("install", () => skipWaiting());
addEventListener("activate", (event) => event.waitUntil(registration.unregister()));
"""


class Live:
    """The state that pages receive: which build is published, and the problems of the last one."""

    def __init__(self) -> None:
        self._change = Condition()
        self._start_ns = time.time_ns()  # tells this server's builds from an earlier one's, whose pages may be open
        self._good = 0
        self._lines: list[str] = []
        self._title = ""
        self._edited: list[dict[str, str]] = []
        self._count = 0
        self._building = False
        self._closed = False

    @property
    def build(self) -> str:
        """The published build's name."""
        return f"{self._start_ns:x}-{self._good}"

    def begin(self) -> None:
        """Note that a build has begun: files may be missing for a moment."""
        with self._change:
            self._building = True

    def end(self, outcome: Outcome, edited: Iterable[str] = ()) -> None:
        """Note that a build is over; tell the pages its outcome and which chapters were edited since the last one."""
        with self._change:
            self._building = False
            self._count += 1
            self._good += outcome.good
            self._lines = outcome.lines()
            count = len(outcome.problems)
            self._title = f"The build found {count} problem{'s' * (count != 1)}" if count else "The build failed"
            files = sorted(set(edited) & outcome.sources.keys())
            self._edited = [{"file": Path(file).name, "page": outcome.sources[file]} for file in files]
            self._change.notify_all()

    def close(self) -> None:
        """End all event streams."""
        with self._change:
            self._closed = True
            self._change.notify_all()

    def settled(self) -> None:
        """Wait until no build is running, for at most SWAP_SECONDS."""
        with self._change:
            self._change.wait_for(lambda: not self._building or self._closed, SWAP_SECONDS)

    def _is_past(self, count: int) -> bool:
        return self._closed or self._count != count

    def messages(self, beat: float = 15.0) -> Iterator[str]:
        """Yield the state as JSON, now and after every build; "" every `beat` seconds, to detect dead connections."""
        last = -1
        while True:
            with self._change:
                news = self._change.wait_for(partial(self._is_past, last), beat)
                if self._closed:
                    return
                last = self._count
                state = {"build": self.build, "title": self._title, "lines": self._lines, "edited": self._edited}
                text = json.dumps(state)
            yield text if news else ""


class LiveServer(StaticServer):
    """A server of the site's folder and of the live state."""

    def __init__(self, root: Path, address: tuple[str, int], live: Live) -> None:
        self.live = live
        # On Windows this option would let two servers share a port instead of only skipping a wait.
        self.allow_reuse_address = os.name != "nt"
        super().__init__(root, address, LiveHandler)


class LiveHandler(StaticHandler):
    """Static files, the reload script in every page, and the stream of events."""

    server: LiveServer

    def do_GET(self) -> None:
        # Taken before the file is read: a page may then be newer than the build it names, and just reloads once more.
        self.build = self.server.live.build
        path = self.path.partition("?")[0]
        if self.headers.get("Service-Worker") == "script":
            self.answer(HTTPStatus.OK, NO_SERVICE_WORKER, content_type(Path(FOLLOW)), {})
        elif path in SCRIPTS:
            self.answer(HTTPStatus.OK, SCRIPTS[path].read_bytes(), content_type(SCRIPTS[path]), {})
        elif path == "/.ladder/events":
            self.stream()
        else:
            super().do_GET()

    def read(self, file: Path) -> bytes | None:
        data = super().read(file)
        if data is None:
            self.server.live.settled()
            data = super().read(file)
        return data

    def answer(self, status: HTTPStatus, data: bytes, kind: str, headers: dict[str, str]) -> None:
        if kind.startswith("text/html"):
            # Painting waits for this script, so that a reloaded page appears at the author's place.
            tag = f'<script type="module" src="{FOLLOW}" data-build="{self.build}" blocking="render"></script>'.encode()
            front, head, body = data.partition(b"</head>")
            data = front + tag + head + body
            headers = {name: value for name, value in headers.items() if name.lower() != "cache-control"}
        super().answer(status, data, kind, headers)

    def stream(self) -> None:
        """Send events until the page or the server closes."""
        self.close_connection = True
        self.send_response(HTTPStatus.OK)
        self.send_header("Content-Type", "text/event-stream")
        self.send_header("Cache-Control", "no-store")
        self.send_header("Connection", "close")
        self.end_headers()
        for text in self.server.live.messages():
            self.wfile.write((f"data: {text}\n\n" if text else ":\n\n").encode())
            self.wfile.flush()


class LiveSite:
    """The server, builder and watcher of one checkout."""

    def __init__(self, root: Path, dest: Path, host: str = "127.0.0.1", port: int = 0) -> None:
        self.root = root
        self._stop = Event()
        self._edits = self._watch()
        next(self._edits)  # starts the watcher: from here on no edit is missed
        self.live = Live()
        self.server = listening(dest, host, port, self.live)
        self.builder = Builder(root, dest)
        self.idle = Event()  # set while nothing is being built and the next build can start at once
        self._thread = Thread(target=self.server.serve_forever, kwargs={"poll_interval": 0.05}, daemon=True)
        self._thread.start()

    def rebuild(self, edited: Iterable[str] = ()) -> Outcome:
        """Build after an edit of these files (relative to the root), and tell the pages and the terminal."""
        self.idle.clear()
        self.live.begin()
        outcome = Outcome(trouble="the build was interrupted")
        try:
            outcome = self.builder.build()
        finally:
            self.live.end(outcome, edited)
        tell(outcome, self.builder.dest)
        self.builder.renew()
        self.idle.set()
        return outcome

    def watch(self) -> None:
        """Rebuild at every edit, until stop()."""
        for changes in self._edits:
            if changes:
                names = sorted({Path(path).relative_to(self.root).as_posix() for _, path in changes})
                print(f"\n{', '.join(names[:3])}{' …' * (len(names) > 3)} changed", flush=True)
                self.rebuild(names)

    def _watch(self) -> Iterator[set[tuple[watchfiles.Change, str]]]:
        return watchfiles.watch(
            *[self.root / name for name in WATCHED if (self.root / name).is_dir()],
            stop_event=self._stop,
            step=SETTLE_MS,
            debounce=20 * SETTLE_MS,
            rust_timeout=8 * SETTLE_MS,
            yield_on_timeout=True,  # so that watching can start before the first build, which is slow
        )

    def stop(self) -> None:
        """Stop watching, after a running build is done."""
        self._stop.set()

    def close(self) -> None:
        """Stop everything at once. A thread that runs watch() must have ended before."""
        self.stop()
        self.live.close()
        self.server.stop()
        self.builder.close()


def listening(dest: Path, host: str, port: int, live: Live) -> LiveServer:
    """A server on the port, or on the next free one. Raises OSError if there is none."""
    last: Any = None
    for candidate in range(port, port + PORTS) if port else [0]:
        try:
            return LiveServer(dest, (host, candidate), live)
        except (OSError, OverflowError) as error:
            last = error
    raise OSError(f"cannot serve on {host}, ports {port} to {port + PORTS - 1}: {last}")


def can_open() -> bool:
    """Whether a graphical browser can be opened (without a screen, Python may start a text browser in the terminal)."""
    if sys.platform.startswith("linux"):
        return any(os.environ.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER"))
    return True


def serve(root: Path, host: str, port: int, *, opens: bool = True) -> int:
    """Build and serve until Ctrl-C. The exit code is 1 if there is no port to serve on."""
    try:
        site = LiveSite(root, root / "site", host, port)
    except OSError as error:
        print(error, file=sys.stderr)
        return 1
    try:
        site.rebuild()
        print(f"{site.server.origin}/ shows the site and follows every edit; Ctrl-C stops it", flush=True)
        if opens and can_open():
            webbrowser.open(f"{site.server.origin}/")
        site.watch()
    except KeyboardInterrupt:
        with suppress(OSError):  # the terminal may be closed
            print("\nstopped", flush=True)
    finally:
        site.close()
    return 0
