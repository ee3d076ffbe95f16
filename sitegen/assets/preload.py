"""The typefaces that a page preloads: those that it uses, as far as its HTML shows. Browsers warn about a preloaded
file that is not used, and it wastes bandwidth."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass

CARDS = '<div class="card"'  # at the end of a page; hidden at first
ALWAYS = {"serif", "title", "sans"}
ITALICS = "<em>", "<cite>", 'class="question"'
# A browser loads no font for what is folded, but for its summary.
FOLDED = re.compile(r"<details\b(?![^>]*\bopen\b)[^>]*>\s*(<summary\b.*?</summary>)?.*?</details>", re.DOTALL)
# Elements set in another face.
ELSEWHERE = re.compile(r"<(math|figure|svg|script|pre|code|table|button|label|summary)\b.*?</\1>", re.DOTALL)
TAG = re.compile(r"<[^>]*>")


@dataclass(frozen=True)
class Preload:
    """A file that may be preloaded: its URL, its face, and its letters if it holds only a few rare ones."""

    url: str
    face: str
    letters: str = ""


def preloads(files: Iterable[Preload], page: str) -> list[str]:
    """The URLs of the files that a page's HTML uses."""
    visible = FOLDED.sub(r"\1", page.split(CARDS)[0])
    faces = {*ALWAYS}
    if "<math" in visible:
        faces.add("math")
    if any(part in visible for part in ITALICS):
        faces.add("serif-italic")
    prose = set(TAG.sub("", ELSEWHERE.sub("", visible)))
    return [file.url for file in files if file.face in faces and (not file.letters or prose & set(file.letters))]
