"""`new chapter` and `new figure`: create a working chapter or figure to start from.

The skeletons are in sitegen/cli/skeletons, with $name, $module and other placeholders to fill in.
"""

from __future__ import annotations

import json
import keyword
import re
import sys
import unicodedata
from collections.abc import Mapping
from pathlib import Path
from string import Template

import yaml

from sitegen.cache.files import write
from sitegen.chapters.content import OWN_PAGES, SLUG, read_chapters, read_docs, read_site
from sitegen.chapters.yaml_schema import MARKUP
from sitegen.problems import Problems

SKELETONS = Path(__file__).with_name("skeletons")
NUMBERED = re.compile(r"(\d+)(?:\.\d+)?[a-z]?-(.+)\.md")
DEVICES = re.compile(r"aux|con|nul|prn|(?:com|lpt)\d")  # Windows forbids these as file names, with any ending
LONGER = "choose another name, such as one of two words: known-pairs"
EVERY_TEST = ("test_.py", "tests", "widgets", "figures")  # parts of the path of every figure's tests


class NameTaken(ValueError):
    """The name or title is unsuitable, or the name is taken; the message says what to do."""


def new_command(root: Path, kind: str, name: str, title: str) -> int:
    """Write the files and print what to do next. The exit code is 2 for an unsuitable name, 1 if a file cannot be
    written."""
    try:
        paths = new_chapter(root, name, title) if kind == "chapter" else new_figure(root, name, title)
    except NameTaken as error:
        print(f"new {kind}: {error}", file=sys.stderr)
        return 2
    except OSError as error:
        print(f"new {kind}: {error.filename}: {error.strerror}; nothing was created", file=sys.stderr)
        return 1
    for path in paths:
        print(f"created {path.relative_to(root).as_posix()}")
    if kind == "chapter":
        print("It is a draft: `python3 build.py serve` shows it; remove `draft: true` to publish it.")
    else:
        print(f"To include it in a chapter: ::figure[caption]{{{name}}}")
        print(f"Its own tests and the tests for every figure: `python3 build.py test -k {chosen(name)}`")
    return 0


def chosen(name: str) -> str:
    """The argument of pytest's -k that selects a figure's own tests and other tests' cases named after it."""
    module = name.replace("-", "_")
    return name if name == module else f'"{name} or {module}"'


def new_chapter(root: Path, name: str, title: str = "") -> list[Path]:
    """Write a chapter that comes after the last one. Raises NameTaken."""
    _sound(name)
    _check_title(title)
    if markup := MARKUP.search(title):
        raise NameTaken(f"plain text only in a title; {markup[0]!r} would be printed as is")
    existing = {match[2]: match for path in (root / "content").glob("*.md") if (match := NUMBERED.fullmatch(path.name))}
    if name in existing:
        raise NameTaken(f"content/{existing[name][0]} already exists; choose another name")
    if name in OWN_PAGES or name == "index":
        raise NameTaken(f"{name}.html is a built-in page; choose another name")
    if owner := _pages(root).get(name):
        raise NameTaken(f"{name}.html is a page of {owner}; choose another name")
    number = 1 + max((int(match[1]) for match in existing.values()), default=-1)
    return _fill(root, name, title, {"chapter.md": f"content/{number:02d}-{name}.md"})


def _pages(root: Path) -> dict[str, str]:
    """The file behind each page that chapters and docs have, or once had, by the page's name."""
    ignored = Problems()  # a build reports the mistakes of other chapters
    chapters, _ = read_chapters(root, read_site(root, ignored), ignored, drafts=True)
    pages = [*chapters, *read_docs(root, ignored)]
    return {
        name.removesuffix(".html"): chapter.source.path
        for chapter in pages
        for name in (chapter.name, chapter.slug, chapter.deck, chapter.checks, *chapter.redirects)
    }


def new_figure(root: Path, name: str, title: str = "") -> list[Path]:
    """Write a figure's module and its test. Raises NameTaken."""
    _sound(name)
    _check_title(title)
    module = name.replace("-", "_")
    if keyword.iskeyword(module):
        raise NameTaken(f"{name!r} is a Python keyword, so no module can have this name; {LONGER}")
    if any(module in part for part in EVERY_TEST):
        raise NameTaken(f"{name!r} occurs in every test's name, so `test -k {name}` would run them all; {LONGER}")
    pieces = {
        "figure.py.txt": f"widgets/figures/{module}.py",
        "test_figure.py.txt": f"tests/widgets/figures/test_{module}.py",
    }
    for path in (*pieces.values(), f"widgets/figures/{module}"):
        if (root / path).exists():
            raise NameTaken(f"{path} already exists; choose another name")
    return _fill(root, name, title, pieces)


def _sound(name: str) -> None:
    if not SLUG.fullmatch(name) or name[0].isdigit():
        rule = "use lower-case ASCII letters, digits and hyphens, starting with a letter"
        raise NameTaken(f"invalid name {name!r}: {rule}")
    if yaml.safe_load(name) != name:
        raise NameTaken(f"{name!r} is read as {yaml.safe_load(name)} in a chapter's front matter; {LONGER}")
    if DEVICES.fullmatch(name):
        raise NameTaken(f"{name!r} is a reserved device name on Windows; {LONGER}")


def _check_title(title: str) -> None:
    if title and (title.isspace() or any(unicodedata.category(character) in ("Cc", "Cs") for character in title)):
        raise NameTaken(f"invalid --title {title!r}: expected a line of UTF-8 text without control characters")


def _fill(root: Path, name: str, title: str, pieces: Mapping[str, str]) -> list[Path]:
    """Write the files, all or none. Raises OSError that names the one that cannot be written."""
    plain = name.replace("-", " ").capitalize()
    literal = json.dumps(title or plain, ensure_ascii=False)  # a valid string in both Python and YAML
    words = {"name": name, "module": name.replace("-", "_"), "words": plain, "quoted": literal}
    texts = {root / path: Template((SKELETONS / piece).read_text("utf-8")) for piece, path in pieces.items()}
    paths: list[Path] = []
    for path, text in texts.items():
        try:
            write(path, text.safe_substitute(words).encode())
        except OSError as error:
            for written_path in paths:
                written_path.unlink()
            raise OSError(error.errno, error.strerror, path.relative_to(root).as_posix()) from error
        paths.append(path)
    return paths
