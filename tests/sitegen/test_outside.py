"""Outside files: whichever source has them, verified, atomic, and a message that says what was tried."""

from __future__ import annotations

import contextlib
import hashlib
import json
import socket
import threading
import zipfile
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import pytest

from sitegen import outside
from sitegen.outside import OutsideError, gather, licences, read_manifest

RIGHT = b"what it should be"
WRONG = b"something else"


class Web:
    """Answers `files` over HTTP on loopback and remembers what it was asked for."""

    def __init__(self) -> None:
        self.files: dict[str, bytes] = {}
        self.asked: list[str] = []
        web = self

        class Handler(BaseHTTPRequestHandler):
            def do_GET(self) -> None:
                web.asked.append(self.path)
                data = web.files.get(self.path)
                self.send_response(404 if data is None else 200)
                self.end_headers()
                with contextlib.suppress(ConnectionError):  # who has read enough hangs up
                    self.wfile.write(data or b"")

            def log_message(self, *args: object) -> None:
                pass

        self.server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self.origin = f"http://127.0.0.1:{self.server.server_port}/"
        threading.Thread(target=self.server.serve_forever, kwargs={"poll_interval": 0.02}, daemon=True).start()


@pytest.fixture
def web() -> Iterator[Web]:
    running = Web()
    yield running
    running.server.shutdown()
    running.server.server_close()


def manifest(folder: Path, sources: str, names: str, file: str = "a.txt", data: bytes = RIGHT) -> Path:
    path = folder / "outside.toml"
    path.write_text(
        f"""{sources}
[bundle.thing]
title = "A thing"
version = "1"
licence = "MIT"
licence_texts = ["file:a.txt"]
sources = {names}
[bundle.thing.files]
"{file}" = {{ size = {len(data)}, sha256 = "{hashlib.sha256(data).hexdigest()}" }}
""",
        "utf-8",
    )
    return path


def test_a_file_comes_once_and_then_from_the_cache(tmp_path: Path, web: Web) -> None:
    web.files["/a.txt"] = RIGHT
    given = manifest(tmp_path, f'[source.web]\nurl = "{web.origin}"', '["web"]')
    seen: list[tuple[str, int, int]] = []
    for _ in range(2):
        found = gather(["thing"], cache=tmp_path / "c", progress=lambda *a: seen.append(a), manifest=given)
        assert found["thing/a.txt"].read_bytes() == RIGHT
    assert web.asked == ["/a.txt"]
    assert seen[-1] == ("a.txt", len(RIGHT), len(RIGHT))
    (licence,) = licences(["thing"], cache=tmp_path / "c", manifest=given)
    assert licence.text == RIGHT.decode()


def test_a_wrong_file_is_not_taken_and_the_next_source_is_asked(tmp_path: Path, web: Web) -> None:
    web.files |= {"/bad/a.txt": WRONG, "/good/a.txt": RIGHT}
    sources = f'[source.bad]\nurl = "{web.origin}bad/"\n[source.good]\nurl = "{web.origin}good/"'
    given = manifest(tmp_path, sources, '["bad", "good"]')
    assert gather(["thing"], cache=tmp_path / "c", manifest=given)["thing/a.txt"].read_bytes() == RIGHT
    assert web.asked == ["/bad/a.txt", "/good/a.txt"]


def test_when_no_source_has_it_the_message_names_the_file_and_all_sources(tmp_path: Path, web: Web) -> None:
    web.files["/bad/a.txt"] = WRONG
    sources = f'[source.bad]\nurl = "{web.origin}bad/"\n[source.none]\nurl = "{web.origin}none/"'
    given = manifest(tmp_path, sources, '["bad", "none"]')
    with pytest.raises(OutsideError) as error:
        gather(["thing"], cache=tmp_path / "c", manifest=given)
    message = str(error.value)
    assert "A thing 1: a.txt could not be had" in message
    assert f"bad ({web.origin}bad/): a.txt has sha256 {hashlib.sha256(WRONG).hexdigest()[:16]}" in message
    assert "none (" in message
    assert "404" in message
    assert not list((tmp_path / "c").rglob("*.txt"))


def test_a_spoilt_file_in_the_cache_is_loaded_anew(tmp_path: Path, web: Web) -> None:
    web.files["/a.txt"] = RIGHT
    given = manifest(tmp_path, f'[source.web]\nurl = "{web.origin}"', '["web"]')
    path = gather(["thing"], cache=tmp_path / "c", manifest=given)["thing/a.txt"]
    path.write_bytes(WRONG)
    assert gather(["thing"], cache=tmp_path / "c", manifest=given)["thing/a.txt"].read_bytes() == RIGHT
    web.files.clear()
    path.write_bytes(WRONG)
    with pytest.raises(OutsideError, match=r"the cache: a\.txt has sha256"):
        gather(["thing"], cache=tmp_path / "c", manifest=given)


def test_a_host_that_says_nothing_is_left_for_the_next(
    tmp_path: Path, web: Web, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(outside, "URL_TIMEOUT", 0.2)
    web.files["/a.txt"] = RIGHT
    with socket.create_server(("127.0.0.1", 0)) as silent:
        port = silent.getsockname()[1]
        sources = f'[source.silent]\nurl = "http://127.0.0.1:{port}/"\n[source.web]\nurl = "{web.origin}"'
        given = manifest(tmp_path, sources, '["silent", "web"]')
        assert gather(["thing"], cache=tmp_path / "c", manifest=given)["thing/a.txt"].read_bytes() == RIGHT


def test_an_answer_without_end_is_cut_off(tmp_path: Path, web: Web) -> None:
    web.files["/a.txt"] = RIGHT + b"x" * 10_000_000
    given = manifest(tmp_path, f'[source.web]\nurl = "{web.origin}"', '["web"]')
    with pytest.raises(OutsideError, match=f"{len(RIGHT) + 1} bytes, not"):
        gather(["thing"], cache=tmp_path / "c", manifest=given)


def test_a_file_out_of_a_wheel_through_pip(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    index = tmp_path / "index"
    index.mkdir()
    with zipfile.ZipFile(index / "thing-1.0-py3-none-any.whl", "w") as wheel:
        wheel.writestr("thing/data/a.txt", RIGHT)
        wheel.writestr("thing-1.0.dist-info/METADATA", "Metadata-Version: 2.1\nName: thing\nVersion: 1.0\n")
        wheel.writestr("thing-1.0.dist-info/WHEEL", "Wheel-Version: 1.0\nRoot-Is-Purelib: true\nTag: py3-none-any\n")
        wheel.writestr("thing-1.0.dist-info/RECORD", "")
    monkeypatch.setenv("PIP_NO_INDEX", "1")
    monkeypatch.setenv("PIP_FIND_LINKS", str(index))
    given = manifest(tmp_path, '[source.pip]\npip = "thing==1.0"\nfolder = "thing/data"', '["pip"]')
    assert gather(["thing"], cache=tmp_path / "c", manifest=given)["thing/a.txt"].read_bytes() == RIGHT
    given = manifest(tmp_path, '[source.pip]\npip = "thing==2.0"\nfolder = "thing/data"', '["pip"]')
    with pytest.raises(OutsideError, match=r"pip \(thing==2\.0\): its client ended with code 1"):
        gather(["thing"], cache=tmp_path / "other", manifest=given)


def test_a_file_out_of_a_package_through_npm(tmp_path: Path) -> None:
    package = tmp_path / "package"
    package.mkdir()
    (package / "package.json").write_text(json.dumps({"name": "thing", "version": "1.0.0"}), "utf-8")
    (package / "a.txt").write_bytes(RIGHT)
    given = manifest(tmp_path, f'[source.npm]\nnpm = "{package.as_posix()}"\nfolder = "package"', '["npm"]')
    assert gather(["thing"], cache=tmp_path / "c", manifest=given)["thing/a.txt"].read_bytes() == RIGHT
    given = manifest(tmp_path, f'[source.npm]\nnpm = "{package.as_posix()}"\nfolder = "other"', '["npm"]')
    with pytest.raises(OutsideError, match=r"it has no a\.txt"):
        gather(["thing"], cache=tmp_path / "other", manifest=given)


def test_what_is_no_manifest_or_no_bundle_is_said(tmp_path: Path) -> None:
    (tmp_path / "a.toml").write_text("[source.x]\nurl = 1\n[bundle.y]\ntitle = 'no more'\n", "utf-8")
    with pytest.raises(OutsideError, match=r"a\.toml: KeyError: 'version'"):
        read_manifest(tmp_path / "a.toml")
    (tmp_path / "b.toml").write_text("[source.x]\nftp = 'x'\n[bundle]\n", "utf-8")
    with pytest.raises(OutsideError, match="source x: one of npm, pip or url"):
        read_manifest(tmp_path / "b.toml")
    with pytest.raises(OutsideError, match="names no bundle nonsense; it has numpy, pyodide"):
        gather(["nonsense"], cache=tmp_path)


def test_the_manifest_pins_every_file_and_every_licence_has_its_text() -> None:
    bundles = read_manifest()
    for bundle in bundles.values():
        assert bundle.sources
        for file in bundle.files:
            assert len(file.sha256) == 64
            assert file.size > 0
    shown = {licence.title: licence for licence in licences(bundles)}
    assert "Mozilla Public License" in shown["Pyodide, with CPython and its standard library"].text
    assert "PYTHON SOFTWARE FOUNDATION LICENSE" in shown["Pyodide, with CPython and its standard library"].text
    assert "NumPy Developers" in shown["NumPy"].text
    assert "lapack_lite/LICENSE.txt" in shown["NumPy"].text
    for font in ("Source Serif 4", "Source Sans 3", "STIX Two Math"):
        assert "SIL OPEN FONT LICENSE" in shown[font].text.upper()
