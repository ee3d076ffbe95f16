"""Images: their size, and files that a page cannot show."""

from __future__ import annotations

from pathlib import Path

import PIL.Image
import pytest

from sitegen.markup.images import read_image

SVG = "http://www.w3.org/2000/svg"


@pytest.mark.parametrize(
    ("text", "size"),
    [
        (f'<svg xmlns="{SVG}" viewBox="0 0 30 20"/>', (30, 20)),
        (f'<svg xmlns="{SVG}" viewBox="0, 0, 30.4, 20"/>', (30, 20)),
        (f'<svg xmlns="{SVG}" width="30px" height="20"/>', (30, 20)),
    ],
)
def test_a_drawing_has_the_size_of_its_view(tmp_path: Path, text: str, size: tuple[int, int]) -> None:
    (tmp_path / "a.svg").write_text(text, "utf-8")
    image = read_image(tmp_path / "a.svg")
    assert (image.width, image.height) == size


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("<svg", "not SVG: "),
        ('<html viewBox="0 0 3 2"/>', "not SVG: the root element is <html>"),
        (f'<svg xmlns="{SVG}"/>', "needs a viewBox"),
        (f'<svg xmlns="{SVG}" viewBox="0 0 1e999 3"/>', "needs a viewBox"),
        (f'<svg xmlns="{SVG}" viewBox="0 0 nan 3"/>', "needs a viewBox"),
        (f'<svg xmlns="{SVG}" viewBox="0 0 0 3"/>', "expected an SVG image with width and height, got 0 × 3"),
        (f'<svg xmlns="{SVG}" viewBox="0 0 -4 3"/>', "expected an SVG image with width and height, got -4 × 3"),
    ],
)
def test_a_drawing_of_no_size_is_refused(tmp_path: Path, text: str, message: str) -> None:
    (tmp_path / "a.svg").write_text(text, "utf-8")
    with pytest.raises(ValueError, match=message):
        read_image(tmp_path / "a.svg")


@pytest.mark.parametrize("kind", ["png", "jpg", "webp", "gif"])
def test_an_image_that_was_cut_short_is_refused(tmp_path: Path, kind: str) -> None:
    """Whole, it has its size; half of its bytes still begin with a valid header."""
    path = tmp_path / f"a.{kind}"
    PIL.Image.effect_noise((64, 48), 80.0).convert("RGB").save(path)
    assert (read_image(path).width, read_image(path).height) == (64, 48)
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    with pytest.raises(ValueError, match=f"a.{kind} cannot be read as an image"):
        read_image(path)
