"""The emblem: all its pictures, drawn with the site's own colours and typefaces, the same bytes every time."""

from __future__ import annotations

import io
import subprocess
import sys
from xml.etree import ElementTree

import numpy as np
import pytest
from PIL import Image

from sitegen.assets import icons, typefaces
from sitegen.assets.tokens import colours

TITLE, LINE = "The Registration Ladder", "Point-cloud registration explained rung by rung."


@pytest.fixture(scope="module")
def faces() -> typefaces.FontSet:
    return typefaces.make()


@pytest.fixture(scope="module")
def files(faces, tmp_path_factory) -> dict[str, bytes]:
    return icons.make(TITLE, LINE, faces, cache=tmp_path_factory.mktemp("cache"))


def pixels(data: bytes) -> np.ndarray:
    return np.asarray(Image.open(io.BytesIO(data)).convert("RGB")).reshape(-1, 3)


def test_the_pictures_have_their_sizes(files) -> None:
    sizes = {name: Image.open(io.BytesIO(data)).size for name, data in files.items() if name.endswith(".png")}
    icons = {"icon-192.png": (192, 192), "icon-512.png": (512, 512), "icon-maskable.png": (512, 512)}
    assert sizes == {"favicon.png": (32, 32), "touch-icon.png": (180, 180), "share.png": (1200, 630), **icons}
    assert len(files["share.png"]) < 150_000


def test_the_share_picture_shows_the_scene_in_the_sites_colours(files) -> None:
    shades = {tuple(p) for p in np.unique(pixels(files["share.png"]), axis=0).tolist()}
    for name in ("paper", "ink", "source", "target", "accent"):
        value = colours()[name][0]
        assert tuple(bytes.fromhex(value[1:])) in shades, name


def test_the_title_changes_the_share_picture_alone(files, faces, tmp_path) -> None:
    new = icons.make("Another title", LINE, faces, cache=tmp_path)
    assert new["share.png"] != files["share.png"]
    assert {n: d for n, d in new.items() if n != "share.png"} == {n: d for n, d in files.items() if n != "share.png"}


def test_the_favicon_follows_the_theme(files) -> None:
    root = ElementTree.fromstring(files["favicon.svg"])
    style = "".join(root.itertext())
    (light, dark) = colours()["ink"]
    assert light in style.split("@media")[0]
    assert dark in style.split("@media")[1]


def test_another_process_draws_the_same_bytes(files, tmp_path) -> None:
    code = (
        "import sys, pathlib; from sitegen.assets import icons, typefaces; "
        f"files = icons.make({TITLE!r}, {LINE!r}, typefaces.make(), cache=pathlib.Path(sys.argv[1])); "
        "sys.stdout.buffer.write(b''.join(files[n] for n in sorted(files)))"
    )
    output = subprocess.run([sys.executable, "-c", code, str(tmp_path)], capture_output=True, check=True).stdout
    assert output == b"".join(files[name] for name in sorted(files))


def test_what_is_kept_is_not_drawn_again(faces, tmp_path, monkeypatch) -> None:
    first = icons.make(TITLE, LINE, faces, cache=tmp_path)
    monkeypatch.setattr(icons, "_canvas", lambda *a: pytest.fail("drawn again"))
    assert icons.make(TITLE, LINE, faces, cache=tmp_path) == first


def test_no_shape_of_an_icon_cuts_the_ladder(files) -> None:
    """The maskable icon's drawing stays within the circle of 80 %; the other icons are drawn larger."""
    paper = bytes.fromhex(colours()["paper"][0][1:])
    reach = {}
    for name in ("icon-512.png", "icon-maskable.png"):
        mask = (pixels(files[name]).reshape(512, 512, 3) != np.frombuffer(paper, np.uint8)).any(2)
        y, x = np.nonzero(mask)
        reach[name] = np.hypot(x - 255.5, y - 255.5).max()
    assert 180 < reach["icon-maskable.png"] <= 0.4 * 512 < reach["icon-512.png"]


def test_a_page_with_an_emblem_has_a_share_picture_of_its_own(files, faces, tmp_path) -> None:
    """In the site's colours, with its own words and its own dial; the other pictures stay the same."""
    pages = {"icp": ("nearest", "Unknown pairs", LINE), "kabsch": ("pairs", "Unknown pairs", LINE)}
    more = icons.make(TITLE, LINE, faces, pages, cache=tmp_path)
    assert set(more) - set(files) == {"share-icp.png", "share-kabsch.png"}
    assert {name: more[name] for name in files} == files
    assert more["share-icp.png"] != more["share-kabsch.png"]
    for name in ("share-icp.png", "share-kabsch.png"):
        assert Image.open(io.BytesIO(more[name])).size == (1200, 630)
        assert len(more[name]) < 150_000
        shades = {tuple(p) for p in np.unique(pixels(more[name]), axis=0).tolist()}
        for colour in ("paper", "ink", "source", "target"):
            assert tuple(bytes.fromhex(colours()[colour][0][1:])) in shades, colour
