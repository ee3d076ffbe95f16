"""Reads and checks what authors write: the site's settings, the chapters with their front matter, and the docs."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import pairwise, takewhile
from pathlib import Path
from typing import Any

from sitegen.assets import emblems
from sitegen.cache.memory import Memory
from sitegen.chapters import yaml_schema
from sitegen.chapters.onward import Onward, read_onward
from sitegen.chapters.slides import Slide, read_slides
from sitegen.markup.parser import Document, parse
from sitegen.markup.source import Source
from sitegen.problems import Place, Problems, hint, read_text

FILE_NAME = re.compile(r"(?P<number>\d+(?:\.\d+)?)(?P<letter>[a-z]?)-(?P<slug>[a-z0-9-]+)\.md")
SLUG = re.compile(r"[a-z0-9]+(-[a-z0-9]+)*")
PLAIN = re.compile(r"^\s*(title|slug|rung): *[\"']?([^\"'\n]+?)[\"']?$", re.MULTILINE)
DRAFT = re.compile(r"^draft: *true *(?:#.*)?$", re.MULTILINE)
FRONT_LINE = re.compile(r"[a-z]+:|\s+\S|- |#")
DOCS = "content/docs"  # for authors and maintainers: pages written like chapters, but not on the ladder
DOCS_INDEX = "index.md"  # the page that links to the others

SETTINGS = "content/site.yaml"
SITE = {
    "title": yaml_schema.plain(required=True),
    "description": yaml_schema.plain(required=True),
    "author": yaml_schema.plain(required=True),
    "year": yaml_schema.year(required=True),
    "language": yaml_schema.text(default="en"),
    "url": yaml_schema.text(),
    "report": yaml_schema.text(),
    "licence": yaml_schema.Field("a name and a url", lambda v: isinstance(v, dict), required=True, default={}),
    "ladder": yaml_schema.Field("a list of rungs", lambda v: isinstance(v, list), default=[]),
    "macros": yaml_schema.Field("a mapping of macros to LaTeX", lambda v: isinstance(v, dict), default={}),
}
DOC_FRONT = {
    "title": yaml_schema.plain(required=True),
    "question": yaml_schema.plain(required=True),
    "summary": yaml_schema.plain(),
    "redirects": yaml_schema.texts(),
    "hidden": yaml_schema.flag(),
}
LICENCE = {"name": yaml_schema.text(required=True), "url": yaml_schema.text(required=True)}
RUNG = {"rung": yaml_schema.text(required=True), "title": yaml_schema.plain(required=True)}
FRONT = {
    "title": yaml_schema.plain(required=True),
    "slug": yaml_schema.text(),
    "rung": yaml_schema.text(),
    "question": yaml_schema.plain(),
    "summary": yaml_schema.plain(),
    "emblem": yaml_schema.text(),
    "redirects": yaml_schema.texts(),
    "draft": yaml_schema.flag(),
    "slides": yaml_schema.Field("a list of slides", lambda v: isinstance(v, list), default=[]),
    "next": yaml_schema.Field("a list of entries with to and says", lambda v: isinstance(v, list), default=[]),
}


@dataclass(frozen=True)
class FixedPage:
    """A page that every site has, whatever its chapters. searched: by readers; public: in the site map."""

    name: str
    searched: bool = True
    public: bool = True

    @property
    def page(self) -> str:
        """Its file name on the site."""
        return f"{self.name}.html"


FIXED_PAGES = (
    FixedPage("about"),
    FixedPage("references"),
    FixedPage("glossary"),
    FixedPage("reference"),
    FixedPage("checks", searched=False),
    FixedPage("licences", searched=False, public=False),
    FixedPage("slides", searched=False, public=False),  # exists, and is then public, only if there are decks
    FixedPage("404", searched=False, public=False),
)
OWN_PAGES = tuple(fixed.name for fixed in FIXED_PAGES)


@dataclass(frozen=True)
class Rung:
    """One step of the ladder as the navigation shows it, published or not."""

    rung: str
    title: str


@dataclass(frozen=True)
class Site:
    """The settings of content/site.yaml. `url` is "" or ends with a slash; `report` may hold {title} and {page}."""

    title: str
    description: str
    author: str
    year: int
    language: str
    url: str
    report: str
    licence: str
    licence_url: str
    ladder: tuple[Rung, ...]
    macros: dict[str, str]


@dataclass(frozen=True)
class Chapter:
    """A parsed chapter or page of the docs. `name` is its page without .html; `front` its front matter, for places;
    `hidden` keeps a page of the docs out of searches and the site map; `emblem` names the rung's dial; `onward` lists
    where a reader may go next."""

    source: Source
    document: Document
    name: str
    slug: str
    title: str
    rung: str
    question: str
    summary: str
    redirects: tuple[str, ...]
    draft: bool
    front: yaml_schema.Yaml | None = None
    slides: tuple[Slide, ...] = ()
    hidden: bool = False
    emblem: str = ""
    onward: tuple[Onward, ...] = ()

    def at(self, *path: str | int) -> Place:
        """The place of an entry in the front matter."""
        return self.front.at(*path) if self.front else Place(self.source.path, 1, 1)

    @property
    def page(self) -> str:
        """The chapter's file name on the site."""
        return f"{self.name}.html"

    @property
    def is_doc(self) -> bool:
        """Whether it is a page of the docs."""
        return _is_doc(self.source.path)

    @property
    def deck(self) -> str:
        """The file name of its slides; "" if it has none."""
        return f"slides-{self.slug}.html" if self.slides else ""

    @property
    def checks(self) -> str:
        """The file name of its page of checks, which exists if it has claims."""
        return f"checks-{self.name}.html"

    def numbered(self, count: int) -> str:
        """The number of its `count`-th figure or equation: "1.2" on rung 1, "2" without a rung."""
        return f"{self.rung}.{count}" if self.rung else str(count)


def read_site(root: Path, problems: Problems) -> Site:
    """Read the settings; faulty ones get defaults."""
    path, name = root / SETTINGS, SETTINGS
    document, exists = None, path.is_file()
    if exists:
        document = yaml_schema.read(read_text(path, name, problems), name, problems)
    else:
        problems.add(Place(name), "missing site settings: create this file")
    document = document or yaml_schema.Yaml({}, {}, Place(name, 1, 1))
    had = len(problems.found)
    values = yaml_schema.validated(document, SITE, problems) if exists and document.data else _defaults(SITE)
    licence = yaml_schema.validated(document, LICENCE, problems, "licence") if values["licence"] else _defaults(LICENCE)
    rungs = []
    for i in range(len(values["ladder"])):
        rung = yaml_schema.validated(document, RUNG, problems, "ladder", i)
        rungs.append(Rung(rung["rung"], rung["title"]))
    macros = {}
    for macro, meaning in values["macros"].items():
        if re.fullmatch(r"\\[A-Za-z]+", str(macro)) and isinstance(meaning, str):
            macros[macro] = meaning
        else:  # which would make valid formulas fail
            problems.add(document.at("macros", macro), "expected '\\name': LaTeX for a macro")
    url = values["url"]
    if url and not re.fullmatch(r"https?://[^\s]+", url):
        problems.add(document.at("url"), f"url: expected an address starting with https://, got {url!r}")
    report = values["report"]
    if report and not re.fullmatch(r"(?:https?://|mailto:)\S+", report):
        message = f"report: expected an address starting with https:// or mailto:, got {report!r}"
        problems.add(document.at("report"), message)
    if exists and not document.data and len(problems.found) == had and name not in problems.unread:
        problems.add(Place(name, 1, 1), "empty site settings")
    return Site(
        values["title"],
        values["description"],
        values["author"],
        values["year"] or 0,
        values["language"],
        url.rstrip("/") + "/" if url else "",
        values["report"],
        licence["name"],
        licence["url"],
        tuple(rungs),
        macros,
    )


def _defaults(fields: dict[str, yaml_schema.Field]) -> dict[str, Any]:
    return {name: field.default for name, field in fields.items()}


def read_chapters(
    root: Path, site: Site, problems: Problems, drafts: bool = False, memory: Memory | None = None
) -> tuple[list[Chapter], list[Chapter]]:
    """Read the chapters, ordered by the numbers at the start of their file names, and the drafts that are left out,
    whose problems are ignored. With `memory`, only edited files are parsed."""
    memory = memory or Memory()
    files: list[tuple[tuple[float, str], Path]] = []
    for path in _markdown(root / "content", root, problems):
        match = FILE_NAME.fullmatch(path.name)
        if match is None:
            problems.add(
                Place(f"content/{path.name}"), "expected a file name like 01-kabsch.md: number, hyphen, name"
            )
        # Without a number it goes last, so that references to it are not reported as well.
        files.append(((float(match["number"]), match["letter"]) if match else (math.inf, path.name), path))
    files.sort()
    if not files and not problems.found:
        problems.add(Place("content"), "no chapters found")
    for (key, first), (next_key, second) in pairwise(files):
        if key == next_key and math.isfinite(key[0]):
            problems.add(Place(f"content/{second.name}"), f"duplicate chapter number, also in {first.name}")
    chapters: list[Chapter] = []
    left_out: list[Chapter] = []
    for _, path in files:
        faults = Problems()
        chapter = _chapter(root, path, faults, memory, first=not chapters)
        if chapter.draft and not drafts:
            left_out.append(chapter)
        else:
            chapters.append(chapter)
            problems.take(faults)
    _check_rungs(chapters, site, problems)
    return chapters, left_out


def _markdown(folder: Path, root: Path, problems: Problems) -> Iterator[Path]:
    """The Markdown files of a folder, by name, except editors' temporary files, whose names begin with a dot."""
    for path in sorted(folder.glob("*.md")):
        if path.name.startswith("."):
            continue
        if path.is_file():
            yield path
        else:
            problems.add(Place(path.relative_to(root).as_posix()), "expected a file, got a folder or a broken link")


def is_draft(subject: str, file: str) -> str:
    """The message for a reference to a draft that is left out. file: the draft's."""
    return f"{subject} is a draft: remove 'draft: true' from {file} to publish it"


def read_docs(root: Path, problems: Problems, memory: Memory | None = None) -> list[Chapter]:
    """Read the pages of the docs, by name. Any page requires an index, which must link to all the others."""
    docs, memory = [], memory or Memory()
    for path in _markdown(root / DOCS, root, problems):
        if not SLUG.fullmatch(path.stem):
            message = "expected a file name like authoring.md: lower-case ASCII letters, digits and hyphens"
            problems.add(Place(f"{DOCS}/{path.name}"), message)
        docs.append(_chapter(root, path, problems, memory, first=False))
    index = next((doc for doc in docs if doc.source.path == f"{DOCS}/{DOCS_INDEX}"), None)
    if docs and index is None:
        problems.add(Place(f"{DOCS}/{DOCS_INDEX}"), "missing docs index: it must link to every other page of the docs")
    elif index is not None:
        inline = [child for token in index.document.tokens for child in token.children or []]
        targets = {str(child.attrs["href"]).partition("#")[0] for child in inline if child.type == "link_open"}
        for doc in docs:
            if doc is not index and not targets & {doc.page, Path(doc.source.path).name}:
                problems.add(index.at(), f"missing link to {doc.source.path}")
    return docs


def _is_doc(name: str) -> bool:
    return name.startswith(f"{DOCS}/")


def _chapter(root: Path, path: Path, problems: Problems, memory: Memory, first: bool) -> Chapter:
    name = path.relative_to(root).as_posix()
    text = read_text(path, name, problems)
    return memory.told(("parsed", name), (text, first), problems, partial(_parse, name, text, first))


def _parse(name: str, text: str, first: bool, problems: Problems) -> Chapter:
    """Parse a text as a chapter; faults go to `problems`."""
    front, body = _split(text, name, problems)
    source = Source(name, body, problems)
    fields = DOC_FRONT if _is_doc(name) else FRONT
    values = _defaults({**FRONT, **DOC_FRONT})
    document = yaml_schema.read(front, name, problems, first_line=2) if front else None
    if front and document is None:
        # Others refer to the chapter by these; and a draft stays one.
        values |= {m[1]: m[2] for m in PLAIN.finditer(front)} | {"draft": DRAFT.search(front) is not None}
    elif document is not None:
        values |= yaml_schema.validated(document, fields, problems)
        for key, slug in [
            (("slug",), values["slug"]),
            *((("redirects", i), s) for i, s in enumerate(values["redirects"])),
        ]:
            if slug and not SLUG.fullmatch(slug):
                message = f"invalid page name {slug!r}: use lower-case letters, digits and hyphens"
                problems.add(document.at(*key), message)
        if values["emblem"] and values["emblem"] not in emblems.NAMES:
            message = f"unknown dial {values['emblem']!r}{hint(values['emblem'], emblems.NAMES)}"
            problems.add(document.at("emblem"), message)
        if not values["summary"]:
            problems.warn(document.at(), "missing summary: search results and link previews show it")
    file = Path(name)
    match = FILE_NAME.fullmatch(file.name)
    slug = values["slug"] or (match["slug"] if match else file.stem)
    if _is_doc(name):
        slug = "docs" if file.name == DOCS_INDEX else f"docs-{file.stem}"
    return Chapter(
        source,
        parse(source),
        "index" if first else slug,
        slug,
        values["title"] or slug,
        values["rung"],
        values["question"],
        values["summary"],
        tuple(values["redirects"]),
        values["draft"],
        document,
        read_slides(document, source, problems) if document is not None and fields is FRONT else (),
        values["hidden"],
        values["emblem"],
        read_onward(document, problems) if document is not None and fields is FRONT else (),
    )


def _split(text: str, name: str, problems: Problems) -> tuple[str, str]:
    """Split off the front matter; in the body, blank lines take its place, so that line numbers stay right."""
    start = re.match(r"---[ \t]*\n", text)
    if start is None:
        fault = "empty file" if not text.strip() else "missing front matter"
        problems.add(Place(name, 1, 1), f"{fault}: start with a title between two lines of ---")
        return "", text
    closing = re.compile(r"^---[ \t]*(?:\n|\Z)", re.MULTILINE).search(text, start.end())
    if closing is not None:
        front = text[start.end() : closing.start()]
        return front or "\n", "\n" * (front.count("\n") + 2) + text[closing.end() :]
    problems.add(Place(name, 1, 1), "unclosed front matter: end it with a line of ---")
    lines = list(takewhile(FRONT_LINE.match, text.split("\n")[1:]))
    return "\n".join([*lines, ""]), "\n" * (len(lines) + 1) + "\n".join(text.split("\n")[len(lines) + 1 :])


def check_names(chapters: Sequence[Chapter], problems: Problems) -> None:
    """Check that page names are unique, and that redirects do not start from an existing page."""
    owners = dict.fromkeys(OWN_PAGES, "a built-in page")
    for chapter in chapters:
        for name in sorted({chapter.name, chapter.slug}):
            if name in owners:
                problems.add(chapter.at("slug"), f"page name {name!r} is taken by {owners[name]}")
            owners[name] = chapter.source.path
    derived = {chapter.deck.removesuffix(".html"): f"the slides of {chapter.source.path}" for chapter in chapters}
    derived |= {chapter.checks.removesuffix(".html"): f"the checks of {chapter.source.path}" for chapter in chapters}
    for chapter in chapters:
        if chapter.name in derived:
            problems.add(chapter.at("slug"), f"page name {chapter.name!r} is taken by {derived[chapter.name]}")
    owners |= derived
    for chapter in chapters:
        for i, name in enumerate(chapter.redirects):
            if name in owners:
                message = f"redirect from {name!r}: page name is taken by {owners[name]}"
                problems.add(chapter.at("redirects", i), message)
            owners[name] = chapter.source.path


def _check_rungs(chapters: list[Chapter], site: Site, problems: Problems) -> None:
    """Check that every chapter's rung is on the ladder and is used only once."""
    rungs = [rung.rung for rung in site.ladder if rung.rung]
    owners: dict[str, str] = {}
    for chapter in chapters:
        if chapter.rung and rungs and chapter.rung not in rungs:
            message = f"unknown rung {chapter.rung!r}, not in content/site.yaml{hint(chapter.rung, rungs)}"
            problems.add(chapter.at("rung"), message)
        if chapter.rung in owners:
            problems.add(chapter.at("rung"), f"duplicate rung {chapter.rung!r}, also in {owners[chapter.rung]}")
        if chapter.rung:
            owners[chapter.rung] = chapter.source.path
