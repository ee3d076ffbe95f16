"""Images of the content: measured, so that the page does not shift as they load, and named by a hash of their bytes."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass
from pathlib import Path

from sitegen.cache.files import hashed_name
from sitegen.markup.parser import ascii_slug

KINDS = (".png", ".jpg", ".jpeg", ".webp", ".gif", ".svg")


@dataclass(frozen=True)
class Image:
    """An image on the site: its path, its bytes, its size in px."""

    name: str
    data: bytes
    width: int
    height: int


def read_image(path: Path) -> Image:
    """Read an image file. Raises ValueError if it is not an image that pages can show."""
    if path.suffix.lower() not in KINDS:
        raise ValueError(f"{path.name}: expected an image in {', '.join(kind[1:] for kind in KINDS)}")
    data = path.read_bytes()
    width, height = _svg_size(data) if path.suffix.lower() == ".svg" else _raster_size(path)
    return Image(hashed_name(f"images/{ascii_slug(path.stem)}{path.suffix.lower()}", data), data, width, height)


def _raster_size(path: Path) -> tuple[int, int]:
    import PIL.Image  # takes a tenth of a second, which sites without images save

    try:
        with PIL.Image.open(path) as image:
            image.load()  # even a truncated file has a size
            return image.width, image.height
    except (OSError, SyntaxError) as error:  # raised for a damaged PNG
        raise ValueError(f"{path.name} cannot be read as an image") from error


def _svg_size(data: bytes) -> tuple[int, int]:
    try:
        root = ElementTree.fromstring(data)
    except ElementTree.ParseError as error:
        raise ValueError(f"not SVG: {error}") from error
    if root.tag.rpartition("}")[2] != "svg":
        raise ValueError(f"not SVG: the root element is <{root.tag.rpartition('}')[2]}>")
    box = re.split(r"[\s,]+", root.get("viewBox", "").strip())
    sides = [root.get("width", ""), root.get("height", "")] if len(box) != 4 else box[2:]
    try:
        width, height = (round(float(re.sub(r"px$", "", side))) for side in sides)
    except (ValueError, OverflowError) as error:
        raise ValueError("an SVG image needs a viewBox") from error
    if width < 1 or height < 1:
        raise ValueError(f"expected an SVG image with width and height, got {width} × {height}")
    return width, height
