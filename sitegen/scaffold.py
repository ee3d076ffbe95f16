"""`new chapter` and `new figure`: a working piece under a name, to be changed into one's own.

The pieces lie in sitegen/pieces as they are written, with $name, $module and more to be filled in.
"""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Mapping
from pathlib import Path
from string import Template

from .content import OWN_PAGES, SLUG
from .files import write

PIECES = Path(__file__).with_name("pieces")
NUMBERED = re.compile(r"(\d+)(?:\.\d+)?[a-z]?-(.+)\.md")


class NameTaken(ValueError):
    """The name is none, or stands for something already; the message says what to do."""


def new_command(root: Path, kind: str, name: str, title: str) -> int:
    """Write the piece and say what to do next. The exit code is 2 where the name will not do."""
    try:
        made = new_chapter(root, name, title) if kind == "chapter" else new_figure(root, name, title)
    except NameTaken as error:
        print(f"new {kind}: {error}", file=sys.stderr)
        return 2
    for path in made:
        print(f"made {path.relative_to(root).as_posix()}")
    if kind == "chapter":
        print("It is a draft: `python3 build.py serve` shows it; take `draft: true` away to publish it.")
    else:
        print(f"A chapter places it by ::figure[caption]{{{name}}}.")
        print(f"Its test: `python3 build.py test {made[1].relative_to(root).as_posix()}`")
    return 0


def new_chapter(root: Path, name: str, title: str = "") -> list[Path]:
    """A chapter after the last one. Raises NameTaken."""
    _sound(name)
    there = {match[2]: match for path in (root / "content").glob("*.md") if (match := NUMBERED.fullmatch(path.name))}
    if name in there:
        raise NameTaken(f"there is content/{there[name][0]}; choose another name")
    if name in OWN_PAGES or name == "index":
        raise NameTaken(f"{name}.html is a page of the site's own; choose another name")
    number = 1 + max((int(match[1]) for match in there.values()), default=-1)
    return _fill(root, name, title, {"chapter.md": f"content/{number:02d}-{name}.md"})


def new_figure(root: Path, name: str, title: str = "") -> list[Path]:
    """A figure's module and its test. Raises NameTaken."""
    _sound(name)
    module = name.replace("-", "_")
    pieces = {"figure.txt": f"widgets/figures/{module}.py", "test_figure.txt": f"tests/widgets/test_{module}.py"}
    for path in pieces.values():
        if (root / path).exists():
            raise NameTaken(f"there is {path}; choose another name")
    return _fill(root, name, title, pieces)


def _sound(name: str) -> None:
    if not SLUG.fullmatch(name) or name[0].isdigit():
        raise NameTaken(f"{name!r} is no name: small ASCII letters, digits and hyphens, a letter first")


def _fill(root: Path, name: str, title: str, pieces: Mapping[str, str]) -> list[Path]:
    plain = name.replace("-", " ").capitalize()
    quoted = json.dumps(title or plain, ensure_ascii=False)  # a string of Python and of YAML alike
    words = {"name": name, "module": name.replace("-", "_"), "words": plain, "quoted": quoted}
    made = []
    for piece, path in pieces.items():
        text = Template((PIECES / piece).read_text("utf-8")).safe_substitute(words)
        write(root / path, text.encode())
        made.append(root / path)
    return made
