"""Outside files: taken from any source that has them, verified, atomic; failures list what was tried."""

from __future__ import annotations

import contextlib
import hashlib
import io
import json
import shutil
import socket
import tarfile
import threading
import tracemalloc
import zipfile
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

import pytest

from sitegen.external import clients
from sitegen.external.fetch import gather, licences
from sitegen.external.pins import OutsideError, read_manifest

RIGHT = b"what it should be"
WRONG = b"something else"


class Web:
    """Serves `files` over HTTP on loopback and records the requests."""

    def __init__(self) -> None:
        self.files: dict[str, bytes] = {}
        self.paths: list[str] = []
        web = self

        class Handler(BaseHTTPRequestHandler):
            def do_GET(self) -> None:
                web.paths.append(self.path)
                data = web.files.get(self.path)
                self.send_response(404 if data is None else 200)
                self.end_headers()
                with contextlib.suppress(ConnectionError):  # a client that has read enough closes the connection
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
    pins = manifest(tmp_path, f'[source.web]\nurl = "{web.origin}"', '["web"]')
    steps: list[tuple[str, int, int]] = []
    for _ in range(2):
        result = gather(["thing"], cache=tmp_path / "c", progress=lambda *a: steps.append(a), manifest=pins)
        assert result["thing/a.txt"].read_bytes() == RIGHT
    assert web.paths == ["/a.txt"]
    assert steps[-1] == ("a.txt", len(RIGHT), len(RIGHT))
    (licence,) = licences(["thing"], cache=tmp_path / "c", manifest=pins)
    assert licence.text == RIGHT.decode()


def test_a_wrong_file_is_not_taken_and_the_next_source_is_asked(tmp_path: Path, web: Web) -> None:
    web.files |= {"/bad/a.txt": WRONG, "/good/a.txt": RIGHT}
    sources = f'[source.bad]\nurl = "{web.origin}bad/"\n[source.good]\nurl = "{web.origin}good/"'
    pins = manifest(tmp_path, sources, '["bad", "good"]')
    assert gather(["thing"], cache=tmp_path / "c", manifest=pins)["thing/a.txt"].read_bytes() == RIGHT
    assert web.paths == ["/bad/a.txt", "/good/a.txt"]


def test_when_no_source_has_it_the_message_names_the_file_and_all_sources(tmp_path: Path, web: Web) -> None:
    web.files["/bad/a.txt"] = WRONG
    sources = f'[source.bad]\nurl = "{web.origin}bad/"\n[source.none]\nurl = "{web.origin}none/"'
    pins = manifest(tmp_path, sources, '["bad", "none"]')
    with pytest.raises(OutsideError) as error:
        gather(["thing"], cache=tmp_path / "c", manifest=pins)
    message = str(error.value)
    assert "A thing 1: a.txt could not be obtained" in message
    assert f"bad ({web.origin}bad/): a.txt: expected sha256 {hashlib.sha256(RIGHT).hexdigest()[:16]}" in message
    assert f"got {hashlib.sha256(WRONG).hexdigest()[:16]}" in message
    assert "none (" in message
    assert "404" in message
    assert not list((tmp_path / "c").rglob("*.txt"))


def test_a_spoilt_file_in_the_cache_is_loaded_anew(tmp_path: Path, web: Web) -> None:
    web.files["/a.txt"] = RIGHT
    pins = manifest(tmp_path, f'[source.web]\nurl = "{web.origin}"', '["web"]')
    path = gather(["thing"], cache=tmp_path / "c", manifest=pins)["thing/a.txt"]
    path.write_bytes(WRONG)
    assert gather(["thing"], cache=tmp_path / "c", manifest=pins)["thing/a.txt"].read_bytes() == RIGHT
    web.files.clear()
    path.write_bytes(WRONG)
    with pytest.raises(OutsideError, match=r"the cache: a\.txt: expected sha256"):
        gather(["thing"], cache=tmp_path / "c", manifest=pins)


def test_a_host_that_says_nothing_is_left_for_the_next(
    tmp_path: Path, web: Web, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(clients, "URL_TIMEOUT", 0.2)
    web.files["/a.txt"] = RIGHT
    with socket.create_server(("127.0.0.1", 0)) as silent:
        port = silent.getsockname()[1]
        sources = f'[source.silent]\nurl = "http://127.0.0.1:{port}/"\n[source.web]\nurl = "{web.origin}"'
        pins = manifest(tmp_path, sources, '["silent", "web"]')
        assert gather(["thing"], cache=tmp_path / "c", manifest=pins)["thing/a.txt"].read_bytes() == RIGHT


def test_an_answer_without_end_is_cut_off(tmp_path: Path, web: Web) -> None:
    web.files["/a.txt"] = RIGHT + b"x" * 10_000_000
    pins = manifest(tmp_path, f'[source.web]\nurl = "{web.origin}"', '["web"]')
    with pytest.raises(OutsideError, match=f"got .* and {len(RIGHT) + 1} bytes"):
        gather(["thing"], cache=tmp_path / "c", manifest=pins)


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
    pins = manifest(tmp_path, '[source.pip]\npip = "thing==1.0"\nfolder = "thing/data"', '["pip"]')
    assert gather(["thing"], cache=tmp_path / "c", manifest=pins)["thing/a.txt"].read_bytes() == RIGHT
    pins = manifest(tmp_path, '[source.pip]\npip = "thing==2.0"\nfolder = "thing/data"', '["pip"]')
    with pytest.raises(OutsideError, match=r"pip \(thing==2\.0\): its client exited with code 1"):
        gather(["thing"], cache=tmp_path / "other", manifest=pins)


def test_a_file_out_of_a_package_through_npm(tmp_path: Path) -> None:
    package = tmp_path / "package"
    package.mkdir()
    (package / "package.json").write_text(json.dumps({"name": "thing", "version": "1.0.0"}), "utf-8")
    (package / "a.txt").write_bytes(RIGHT)
    pins = manifest(tmp_path, f'[source.npm]\nnpm = "{package.as_posix()}"\nfolder = "package"', '["npm"]')
    assert gather(["thing"], cache=tmp_path / "c", manifest=pins)["thing/a.txt"].read_bytes() == RIGHT
    pins = manifest(tmp_path, f'[source.npm]\nnpm = "{package.as_posix()}"\nfolder = "other"', '["npm"]')
    with pytest.raises(OutsideError, match=r"missing a\.txt"):
        gather(["thing"], cache=tmp_path / "other", manifest=pins)


def test_what_is_no_manifest_or_no_bundle_is_said(tmp_path: Path) -> None:
    (tmp_path / "a.toml").write_text("[source.x]\nurl = 1\n[bundle.y]\ntitle = 'no more'\n", "utf-8")
    with pytest.raises(OutsideError, match=r"a\.toml: KeyError: 'version'"):
        read_manifest(tmp_path / "a.toml")
    (tmp_path / "b.toml").write_text("[source.x]\nftp = 'x'\n[bundle]\n", "utf-8")
    with pytest.raises(OutsideError, match="source x: expected one of npm, pip or url"):
        read_manifest(tmp_path / "b.toml")
    with pytest.raises(OutsideError, match=r"unknown bundle nonsense in .*; known: numpy, pyodide"):
        gather(["nonsense"], cache=tmp_path)


def test_the_manifest_pins_every_file_and_every_licence_has_its_text() -> None:
    bundles = read_manifest()
    for bundle in bundles.values():
        assert bundle.sources
        for file in bundle.files:
            assert len(file.sha256) == 64
            assert file.size > 0
    by_title = {licence.title: licence for licence in licences(bundles)}
    assert "Mozilla Public License" in by_title["Pyodide, with CPython and its standard library"].text
    assert "PYTHON SOFTWARE FOUNDATION LICENSE" in by_title["Pyodide, with CPython and its standard library"].text
    assert "NumPy Developers" in by_title["NumPy"].text
    assert "lapack_lite/LICENSE.txt" in by_title["NumPy"].text
    for font in ("Source Serif 4", "Source Sans 3", "STIX Two Math"):
        assert "SIL OPEN FONT LICENSE" in by_title[font].text.upper()


def tarball(path: Path, members: dict[str, bytes], more: tarfile.TarInfo | None = None) -> None:
    """Write the archive that `npm pack` leaves in its folder."""
    with tarfile.open(path, "w:gz") as archive:
        for name, data in members.items():
            info = tarfile.TarInfo(name)
            info.size = len(data)
            archive.addfile(info, io.BytesIO(data))
        if more is not None:
            archive.addfile(more)


def wheel(path: Path, members: dict[str, bytes], more: tarfile.TarInfo | None = None) -> None:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in members.items():
            archive.writestr(name, data)


def pins_by(kind: str, folder: Path, monkeypatch: pytest.MonkeyPatch, **options: Any) -> Path:
    """A manifest whose source is a stand-in package client with an archive of these members."""
    fill, name = {"npm": (tarball, "thing-1.0.tgz"), "pip": (wheel, "thing-1.0-py3-none-any.whl")}[kind]
    monkeypatch.setattr(clients, "_download", lambda command, cwd, *rest: fill(cwd / "out" / name, **options))
    return manifest(folder, f'[source.it]\n{kind} = "thing"\nfolder = "in"', '["it"]')


@pytest.mark.parametrize("kind", ["npm", "pip"])
def test_a_member_is_read_no_further_than_its_pinned_size(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kind: str
) -> None:
    """A small archive that unpacks to 100 MB is refused with only a few bytes of it in memory."""
    pins = pins_by(kind, tmp_path, monkeypatch, members={"in/a.txt": bytes(100_000_000)})
    fill = clients._download

    def watch(*arguments: Any) -> None:
        fill(*arguments)
        tracemalloc.start()

    monkeypatch.setattr(clients, "_download", watch)
    with pytest.raises(OutsideError, match=f"a.txt: expected sha256 .*, got .* and {len(RIGHT) + 1} bytes"):
        gather(["thing"], cache=tmp_path / "c", manifest=pins)
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert most < 3_000_000


def test_a_package_that_unpacks_without_end_is_left(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """If the wanted file comes after more data than any of our packages holds."""
    monkeypatch.setattr(clients, "UNPACKED", 1_000_000)
    pins = pins_by("npm", tmp_path, monkeypatch, members={"big": bytes(2_000_000), "in/a.txt": RIGHT})
    with pytest.raises(OutsideError, match=r"it \(thing\): it unpacks to more than 1 MB"):
        gather(["thing"], cache=tmp_path / "c", manifest=pins)


@pytest.mark.parametrize("kind", ["npm", "pip"])
def test_names_in_an_archive_lead_nowhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kind: str) -> None:
    """Members are looked up by the names of the manifest, and nothing else is unpacked."""
    members = {"../evil.txt": WRONG, str(tmp_path / "evil.txt"): WRONG, "in/../../evil.txt": WRONG, "in/a.txt": RIGHT}
    pins = pins_by(kind, tmp_path, monkeypatch, members=members)
    assert gather(["thing"], cache=tmp_path / "c", manifest=pins)["thing/a.txt"].read_bytes() == RIGHT
    assert [path for path in tmp_path.rglob("*.txt") if path.read_bytes() != RIGHT] == []


def test_a_link_in_a_package_is_not_followed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    link = tarfile.TarInfo("in/a.txt")
    link.type, link.linkname = tarfile.SYMTYPE, "b.txt"
    pins = pins_by("npm", tmp_path, monkeypatch, members={"in/b.txt": RIGHT}, more=link)
    with pytest.raises(OutsideError, match=r"missing a\.txt"):
        gather(["thing"], cache=tmp_path / "c", manifest=pins)


@pytest.mark.parametrize("name", ["../a.txt", "/a.txt", "b/../../a.txt", "..\\\\a.txt"])
def test_a_manifest_names_files_of_its_own_folder_alone(tmp_path: Path, name: str) -> None:
    with pytest.raises(OutsideError, match="must not lead outside its bundle's folder"):
        read_manifest(manifest(tmp_path, '[source.web]\nurl = "http://127.0.0.1/"', '["web"]', name))


@pytest.mark.parametrize("length", [0, 10, 60])
@pytest.mark.parametrize("kind", ["npm", "pip"])
def test_an_archive_cut_short_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kind: str, length: int) -> None:
    """With the source that gave it, and without a traceback."""
    pins = pins_by(kind, tmp_path, monkeypatch, members={"in/a.txt": RIGHT})
    fill = clients._download

    def short(command: Any, cwd: Path, *rest: Any) -> None:
        fill(command, cwd, *rest)
        (archive,) = (cwd / "out").iterdir()
        archive.write_bytes(archive.read_bytes()[:length])

    monkeypatch.setattr(clients, "_download", short)
    with pytest.raises(OutsideError, match=r"a\.txt could not be obtained\n  it \(thing\): "):
        gather(["thing"], cache=tmp_path / "c", manifest=pins)


def test_a_folder_or_a_link_in_a_files_place_gives_way(tmp_path: Path, web: Web) -> None:
    web.files["/a.txt"] = RIGHT
    pins = manifest(tmp_path, f'[source.web]\nurl = "{web.origin}"', '["web"]')
    path = gather(["thing"], cache=tmp_path / "c", manifest=pins)["thing/a.txt"]
    for action in (lambda: (path / "in it").mkdir(parents=True), lambda: path.symlink_to(path)):
        path.unlink()
        action()
        assert gather(["thing"], cache=tmp_path / "c", manifest=pins)["thing/a.txt"].read_bytes() == RIGHT
    shutil.rmtree(tmp_path / "c")
    (tmp_path / "c").write_bytes(b"somebody's file")
    with pytest.raises(OutsideError, match=r"the cache: .*: (Not a directory|File exists)"):
        gather(["thing"], cache=tmp_path / "c", manifest=pins)


def test_the_licence_of_the_package_s_data_is_shown_as_well(tmp_path):
    """After those of the gathered files, with the text that accompanies the data."""
    from sitegen.external import served

    (last,) = served.licences([], cache=tmp_path)
    assert last.licence == "BSD-3-Clause"
    assert "Redistributions in binary form must reproduce" in last.text
