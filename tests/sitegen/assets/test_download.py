"""The downloadable site: a zip that other readers can open, the same bytes every time."""

from __future__ import annotations

import io
import zipfile
from pathlib import Path

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from sitegen.assets.download import Download, archive, folder_name
from sitegen.cache.packing import packed
from tests.sitegen.conftest import Project

NAMES = st.from_regex(r"[a-z]{1,8}(/[a-z]{1,8})?\.(html|pack|js|png)", fullmatch=True)
CONTENTS = st.one_of(st.binary(max_size=40), st.binary(min_size=1, max_size=20).map(lambda data: data * 200))


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.dictionaries(NAMES, CONTENTS, max_size=6))
def test_what_was_put_in_comes_out(tmp_path: Path, files: dict[str, bytes]) -> None:
    """The standard library reads it back, checksums and all, in whatever order the files were given."""
    data = archive("a-site", files, tmp_path)
    with zipfile.ZipFile(io.BytesIO(data)) as file:
        assert file.testzip() is None
        assert {name: file.read(name) for name in file.namelist()} == {f"a-site/{n}": d for n, d in files.items()}
        assert {info.date_time for info in file.infolist()} <= {(1980, 1, 1, 0, 0, 0)}
    assert archive("a-site", dict(reversed(files.items())), tmp_path) == data


def test_what_hosts_get_packed_is_packed_here_too(tmp_path: Path) -> None:
    """It comes from the same cache: nothing is packed twice."""
    page = b"<p>text</p>" * 500
    copies = packed("a.html", page, tmp_path)
    data = archive("s", {"a.html": page, "b.woff2": page}, tmp_path)
    with zipfile.ZipFile(io.BytesIO(data)) as file:
        assert file.getinfo("s/a.html").compress_size == len(copies["a.html.gz"]) - 18
        assert file.getinfo("s/b.woff2").compress_size == len(page)


def test_the_site_carries_itself(project: Project) -> None:
    """All but the zip and source maps; its pages request nothing that a browser refuses from disk, and offer no zip."""
    project.build(pack=True)
    (path,) = project.site.glob("*.zip")
    assert path.name == "a-small-quoted-site.zip"
    with zipfile.ZipFile(path) as archive:
        inside = {name.removeprefix("a-small-quoted-site/"): archive.read(name) for name in archive.namelist()}
    outside = {p.relative_to(project.site).as_posix(): p for p in project.site.rglob("*") if p.is_file()}
    outside = {name: p for name, p in outside.items() if p.suffix not in (".gz", ".br", ".map")}
    assert set(inside) == set(outside) - {path.name, "sitemap.xml"}
    assert {name for name, data in inside.items() if data != outside[name].read_bytes()} <= {
        name for name in inside if name.endswith(".html") or name == "sw.js"
    }
    size = Download(path.name, path.read_bytes()).size
    assert f'href="{path.name}" download>Download this site</a> ({size})' in project.page("second.html")
    page = inside["second.html"].decode()
    for part in (path.name, 'rel="manifest"', 'rel="preload"'):
        assert part not in page


def test_a_folder_is_named_for_any_file_system() -> None:
    assert folder_name("The Registration Ladder") == "the-registration-ladder"
    assert folder_name("½ & ???") == "site"
