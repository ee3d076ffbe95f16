"""`serve` with real requests, real edits and a small generator that can fail, and that renames like the real one."""

from __future__ import annotations

import http.client
import json
import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from sitegen.cli.main import parse
from sitegen.serve import live
from sitegen.serve.static_files import StaticServer, content_type, headers_for, locate, serving
from tests.sitegen.serve.conftest import PATIENCE


class Events:
    """The event stream that a page listens to."""

    def __init__(self, site: live.LiveSite) -> None:
        self.connection = http.client.HTTPConnection(*site.server.server_address[:2], timeout=PATIENCE)  # type: ignore[arg-type]
        self.connection.request("GET", "/.ladder/events")
        self.answer = self.connection.getresponse()
        assert self.answer.headers["Content-Type"] == "text/event-stream"

    def next(self) -> dict[str, Any]:
        """Wait for the next event."""
        while line := self.answer.readline():
            if line.startswith(b"data: "):
                return json.loads(line[6:])  # type: ignore[no-any-return]
        raise AssertionError("the stream has ended")

    def close(self) -> None:
        self.answer.close()
        self.connection.close()


@pytest.fixture
def events(live_site: live.LiveSite) -> Iterator[Events]:
    with closing(Events(live_site)) as stream:
        yield stream


def get(site: Any, path: str = "/", **headers: str) -> tuple[int, http.client.HTTPMessage, str]:
    server = getattr(site, "server", site)
    with closing(http.client.HTTPConnection(*server.server_address[:2], timeout=PATIENCE)) as connection:
        connection.request("GET", path, headers={name.replace("_", "-"): value for name, value in headers.items()})
        answer = connection.getresponse()
        return answer.status, answer.headers, answer.read().decode()


def test_a_page_carries_the_reload_script_and_the_built_file_does_not(
    live_site: live.LiveSite, small_checkout: Path
) -> None:
    """The script is a file of the same origin, so the site's own policy allows it; caches never keep pages."""
    status, headers, text = get(live_site)
    assert status == 200
    tag = f'type="module" src="/.ladder/follow.js" data-build="{live_site.live.build}" blocking="render"'
    assert f"<script {tag}></script></head>" in text
    assert headers["Content-Security-Policy"].startswith("default-src 'none'; script-src 'self'")
    assert headers["Cache-Control"] == "no-cache"
    assert ".ladder" not in (small_checkout / "site" / "index.html").read_text("utf-8")
    for name in ("follow.js", "messages.js", "place.js", "swap.js"):
        assert get(live_site, f"/.ladder/{name}")[1]["Content-Type"] == "text/javascript; charset=utf-8"


def test_an_edit_is_built_and_told(live_site: live.LiveSite, events: Events, small_checkout: Path) -> None:
    """The stream sends the state at once, then a new build after an edit of content, and after one of Python, which
    alone needs a fresh process."""
    first, process = events.next(), get(live_site)[2].partition("<!--")[2]
    assert first == {"build": live_site.live.build, "title": first["title"], "lines": [], "edited": []}
    (small_checkout / "content" / "page.md").write_text("second", "utf-8")
    second = events.next()
    assert second["build"] != first["build"]
    assert second["edited"] == [{"file": "page.md", "page": "index.html"}]
    assert "second." in get(live_site)[2]
    assert get(live_site)[2].endswith(process)
    (small_checkout / "sitegen" / "tone.py").write_text("TONE = '!'\n", "utf-8")
    assert events.next()["build"] != second["build"]
    assert "second!" in get(live_site)[2]
    assert not get(live_site)[2].endswith(process)


def test_an_author_sees_drafts(live_site: live.LiveSite) -> None:
    """`serve` builds them, as `new chapter` says."""
    assert "first. A draft." in get(live_site)[2]


def test_a_failed_build_is_told_and_leaves_the_page(
    live_site: live.LiveSite, events: Events, small_checkout: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """File, line, column and message reach the page and the terminal; the next good build removes them."""
    good = events.next()
    (small_checkout / "content" / "page.md").write_text("all wrong", "utf-8")
    failure = events.next()
    assert failure["lines"] == ["content/page.md:1:5: this is wrong"]
    assert failure["title"] == "The build found 1 problem"
    assert failure["build"] == good["build"]
    assert "first." in get(live_site)[2]
    (small_checkout / "content" / "page.md").write_text("right", "utf-8")
    repair = events.next()
    assert repair["lines"] == []
    assert repair["build"] != good["build"]
    assert live_site.idle.wait(PATIENCE)
    assert "content/page.md:1:5: this is wrong" in capfd.readouterr().err


def test_a_mistake_in_python_is_told_with_its_traceback(events: Events, small_checkout: Path) -> None:
    """Even in the module that reports problems; and correcting it is enough."""
    events.next()
    (small_checkout / "sitegen" / "tone.py").write_text("TONE = 1 / 0\n", "utf-8")
    assert "ZeroDivisionError: division by zero" in events.next()["lines"]
    (small_checkout / "sitegen" / "tone.py").write_text("TONE = '.'\n", "utf-8")
    assert events.next()["lines"] == []
    reports = small_checkout / "sitegen" / "problems.py"
    text = reports.read_text("utf-8")
    reports.write_text(text + "\nraise RuntimeError('half an edit')\n", "utf-8")
    assert "RuntimeError: half an edit" in events.next()["lines"]
    reports.write_text(text, "utf-8")
    assert events.next()["lines"] == []


def test_a_request_during_the_swap_waits_for_the_new_site(
    live_site: live.LiveSite, small_checkout: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """While the folder is away, no request gets a 404 or half a page."""
    slowly, original = small_checkout / "slowly", live_site.live.settled

    def waits() -> None:
        slowly.unlink(missing_ok=True)  # the swap continues once a request has found nothing
        original()

    monkeypatch.setattr(live_site.live, "settled", waits)
    slowly.touch()
    (small_checkout / "content" / "page.md").write_text("swapped", "utf-8")
    deadline = time.monotonic() + PATIENCE
    while not (small_checkout / "swapping").exists():
        assert time.monotonic() < deadline
    assert not (small_checkout / "site").exists()
    try:
        status, _, text = get(live_site)
    finally:
        slowly.unlink(missing_ok=True)
    assert status == 200
    assert "swapped." in text


def test_the_end_does_not_wait_for_open_pages(small_checkout: Path) -> None:
    """With a page listening, closing takes only moments, and the page's stream ends."""
    site = live.LiveSite(small_checkout, small_checkout / "site")
    site.rebuild()
    with closing(Events(site)) as events:
        events.next()
        start = time.monotonic()
        site.close()
        assert time.monotonic() - start < 5.0
        assert events.answer.read().strip() == b""


def test_a_service_worker_of_an_earlier_visit_is_sent_away(live_site: live.LiveSite) -> None:
    """Otherwise it would answer with the pages of that visit, whatever is edited."""
    status, _, text = get(live_site, "/sw.js", Service_Worker="script")
    assert status == 200
    assert "unregister" in text


def test_a_taken_port_leads_to_the_next(small_checkout: Path) -> None:
    """A range without a free port is an error that says so."""
    with socket.socket() as occupant:
        occupant.bind(("127.0.0.1", 0))
        occupant.listen()
        port = occupant.getsockname()[1]
        server = live.listening(small_checkout, "127.0.0.1", port, live.Live())
        assert server.server_address[1] > port
        server.server_close()
    with pytest.raises(OSError, match="ports 70000 to"):
        live.listening(small_checkout, "127.0.0.1", 70000, live.Live())


def test_files_are_served_as_a_static_host_does(tmp_path: Path) -> None:
    """Types, 304s, the rules of _headers, and nothing from outside the folder."""
    site = tmp_path / "site"
    site.mkdir()
    (tmp_path / "secret.txt").write_text("secret")
    (site / "code.mjs").write_text("export {};")
    (site / "index.html").write_text("<p>hello")
    (site / "_headers").write_text("# rules\n/*\n  X-A: 1\n  X-B: 1\n/*.mjs\n  X-B: 2\n  Cache-Control: max-age=9\n")
    with serving(site) as server:
        status, headers, text = get(server, "/code.mjs")
        assert (status, text) == (200, "export {};")
        assert headers["Content-Type"].startswith("text/javascript")
        assert (headers["X-A"], headers["X-B"], headers["Cache-Control"]) == ("1", "2", "max-age=9")
        assert get(server, "/code.mjs", If_None_Match=headers["ETag"])[0] == 304
        status, headers, text = get(server, "/")
        assert (text, headers["Cache-Control"]) == ("<p>hello", "no-cache")
        assert get(server, "/gone.html")[0] == 404
        for sneaky in ("/../secret.txt", "/%2e%2e/secret.txt", "/..%2fsecret.txt", "//etc/passwd", "//[", "/a%00b"):
            assert get(server, sneaky)[0] == 404, sneaky


@pytest.mark.parametrize(
    ("name", "kind"),
    [("a.wasm", "application/wasm"), ("a.woff2", "font/woff2"), ("a.svg", "image/svg"), ("a.mjs", "text/javascript")],
)
def test_types_do_not_depend_on_the_machine(name: str, kind: str) -> None:
    """Browsers refuse modules and streaming compilation of the wrong type."""
    assert content_type(Path(name)).startswith(kind)


def test_header_patterns_match_as_hosts_do() -> None:
    """A star matches anything; later rules win."""
    rules: list[Any] = [("/*", (("A", "1"),)), ("/runtime/*", (("A", "2"),))]
    assert headers_for("/index.html", rules) == {"A": "1"}
    assert headers_for("/runtime/x/y.wasm", rules) == {"A": "2"}


SNEAKY = [
    "/../secret.txt",
    "/../../etc/passwd",
    "/%2e%2e/secret.txt",
    "/..%2fsecret.txt",
    "/%2e%2e%2fsecret.txt",
    "/%252e%252e/secret.txt",
    "/a/../../secret.txt",
    "/./.././secret.txt",
    "/..\\secret.txt",
    "/..%5csecret.txt",
    "/%5c..%5csecret.txt",
    "//etc/passwd",
    "///etc/passwd",
    "/%2fetc/passwd",
    "/C:/Windows/win.ini",
    "/C:%5cWindows%5cwin.ini",
    "/file:///etc/passwd",
    "//[",
    "/index.html%00.png",
    "/a%00b",
    "/link.txt",
    "/linked/secret.txt",
    "/site/../../secret.txt",
    "/%c0%ae%c0%ae/secret.txt",
    "/" + "../" * 60 + "etc/passwd",
    "/" + "a/" * 3000,
]


@pytest.fixture
def server(tmp_path: Path) -> Iterator[StaticServer]:
    """A site beside a secret, with links that lead out of the site."""
    site = tmp_path / "site"
    site.mkdir()
    (tmp_path / "secret.txt").write_text("secret")
    (site / "index.html").write_text("<p>hello")
    (site / "link.txt").symlink_to(tmp_path / "secret.txt")
    (site / "linked").symlink_to(tmp_path, target_is_directory=True)
    with serving(site) as server:
        yield server


def raw(server: StaticServer, path: str, host: str = "localhost") -> tuple[int, bytes]:
    """Send a request that no client library would write; return its status and body."""
    with socket.create_connection(server.server_address[:2], timeout=PATIENCE) as connection:
        connection.sendall(f"GET {path} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n".encode("latin-1"))
        with connection.makefile("rb") as stream:
            return int(stream.readline().split()[1]), stream.read()


@pytest.mark.parametrize("path", SNEAKY)
def test_nothing_outside_of_the_site_is_served(server: StaticServer, path: str) -> None:
    """However it is requested: dots, their escapes, backslashes, absolute names, NUL, links that lead out."""
    status, body = raw(server, path)
    assert status in (400, 404, 414), body
    assert b"secret" not in body.replace(b"secret.txt", b"")
    assert b"root:" not in body


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    st.lists(
        st.sampled_from(["..", ".", "/", "\\", "%2e", "%2f", "%5c", "%00", "linked", "secret.txt", "~"]), max_size=9
    )
)
def test_no_path_leads_out(tmp_path: Path, steps: list[str]) -> None:
    """A URL's path is inside the folder, or is nothing."""
    site = tmp_path / "site"
    site.mkdir(exist_ok=True)
    (tmp_path / "secret.txt").touch()
    if not (site / "linked").is_symlink():
        (site / "linked").symlink_to(tmp_path, target_is_directory=True)
    result = locate(site, "/" + "".join(steps))
    assert result is None or result[1].resolve().is_relative_to(site.resolve())


def test_a_foreign_name_for_loopback_is_turned_away(server: StaticServer) -> None:
    """A page of evil.example whose name is rebound to 127.0.0.1 learns nothing."""
    port = server.server_address[1]
    for host in ("localhost", f"localhost:{port}", f"127.0.0.1:{port}", f"[::1]:{port}", "LOCALHOST"):
        assert raw(server, "/", host)[0] == 200
        assert raw(server, "/", host)[1].endswith(b"\r\n\r\n<p>hello")
    for host in (
        "evil.example",
        f"evil.example:{port}",
        "localhost.evil.example",
        "127.0.0.1.evil.example",
        "",
        "[::2]",
    ):
        status, body = raw(server, "/", host)
        assert status == 421, host
        assert b"hello" not in body


def wait_for(condition: Callable[[], bool]) -> None:
    deadline = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.01)


def connection(server: StaticServer) -> socket.socket:
    return socket.create_connection(server.server_address[:2], timeout=PATIENCE)


GET = b"GET / HTTP/1.1\r\nHost: localhost\r\n\r\n"


def test_who_asks_for_nothing_is_sent_away(server: StaticServer) -> None:
    """A client that never sends a request, one that stays after its answer, and one that sends a byte at a time: each
    connection ends, and so does its thread."""
    before = threading.active_count()
    server.patience = 2.0  # a busy machine takes a while to accept all of them
    with ExitStack() as stack:
        silent = [stack.enter_context(connection(server)) for _ in range(40)]
        active, slow = (stack.enter_context(connection(server)) for _ in range(2))
        active.sendall(GET)
        for letter in GET[:-2] + b"X-Word: " + b"a" * 40_000:
            try:
                slow.sendall(bytes([letter]))
                time.sleep(0.01)
            except OSError:
                break
        else:
            raise AssertionError("a request that takes ten minutes is listened to")
        assert all(s.recv(1) == b"" for s in silent)
        with active.makefile("rb") as stream:
            assert stream.readline().startswith(b"HTTP/1.1 200")
            assert stream.read().endswith(b"<p>hello")
        wait_for(lambda: threading.active_count() <= before)


def test_who_takes_long_gets_all(server: StaticServer) -> None:
    """A large file that is read slowly arrives whole; a client that reads none of it is disconnected."""
    size = 40_000_000
    (server.root / "large.bin").write_bytes(bytes(size))
    server.patience = 0.5
    ask = GET.replace(b"GET /", b"GET /large.bin")
    before = threading.active_count()
    with connection(server) as slow, connection(server) as silent:
        for client in (slow, silent):
            client.sendall(ask)
        start, count = time.monotonic(), 0
        while count < size:
            data = slow.recv(1 << 18)
            assert data, f"cut off after {count} bytes and {time.monotonic() - start:.1f} s"
            count += len(data)
            time.sleep(0.01)
        assert time.monotonic() - start > 2 * server.patience
        wait_for(lambda: threading.active_count() <= before)


def test_a_page_that_listens_is_not_sent_away(live_site: live.LiveSite, events: Events, small_checkout: Path) -> None:
    """However long nothing is edited."""
    live_site.server.patience = 0.2
    with closing(Events(live_site)) as second:
        first = second.next()
        with connection(live_site.server) as silent:
            assert silent.recv(1) == b"", "it has been longer than that"
        (small_checkout / "content" / "page.md").write_text("second", "utf-8")
        assert second.next()["build"] != first["build"]


def test_the_dev_server_is_for_this_machine_unless_told_otherwise(tmp_path: Path) -> None:
    """By default it is bound to loopback and checks names; `--host 0.0.0.0` answers to any name."""
    arguments = parse(["serve"])
    with live.listening(tmp_path, arguments.host, 0, live.Live()) as server:
        assert server.server_address[0] == "127.0.0.1"
        assert server.local
    with live.listening(tmp_path, "0.0.0.0", 0, live.Live()) as server:
        assert not server.local
