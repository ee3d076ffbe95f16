"""Built pages as the checks see them: every element with its attributes and its place in the file."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

# Attributes whose file the browser loads by itself when it meets the element.
LOADED = {
    "audio": ("src",),
    "embed": ("src",),
    "iframe": ("src",),
    "image": ("href", "xlink:href"),
    "img": ("src", "srcset"),
    "input": ("src",),
    "object": ("data",),
    "script": ("src",),
    "source": ("src", "srcset"),
    "track": ("src",),
    "use": ("href", "xlink:href"),
    "video": ("src", "poster"),
}
TELLING = {"a", "button", "label", "legend", "summary", "h1", "h2", "h3", "h4", "h5", "h6"}
LOADED_LINKS = {"stylesheet", "icon", "apple-touch-icon", "preload", "modulepreload", "prefetch", "manifest"}


@dataclass(frozen=True)
class Element:
    """A start tag: its attributes (no value is ""), line and column from 1."""

    tag: str
    attributes: dict[str, str]
    line: int
    column: int

    def get(self, name: str) -> str:
        """An attribute's value, "" where there is none."""
        return self.attributes.get(name, "")

    @property
    def loads(self) -> list[str]:
        """The addresses that the browser loads for this element."""
        if self.tag == "link":
            return [self.get("href")] if LOADED_LINKS & set(self.get("rel").lower().split()) else []
        found = []
        for name in LOADED.get(self.tag, ()):
            if name in self.attributes:
                several = self.get(name).split(",") if name == "srcset" else [self.get(name)]
                found += [one.split()[0] if one.split() else "" for one in several]
        return found

    @property
    def links(self) -> list[str]:
        """The addresses that a reader may go to from this element, or is sent to."""
        if self.tag in ("a", "area"):
            return [self.attributes[name] for name in ("href", "xlink:href") if name in self.attributes]
        if self.tag == "meta" and self.get("http-equiv").lower() == "refresh":
            _, _, address = self.get("content").partition("=")
            return [address.strip(" '\"")]
        return []


@dataclass
class Page:
    """One HTML file of the site. `name` is its path below the site, with slashes."""

    site: Path
    name: str
    source: str
    elements: list[Element] = field(default_factory=list)
    texts: list[tuple[Element, str]] = field(default_factory=list)  # of links, buttons, labels and headings
    inline: list[tuple[Element, str]] = field(default_factory=list)  # styles, and scripts without an address

    @cached_property
    def ids(self) -> dict[str, list[Element]]:
        """The elements by id."""
        found: dict[str, list[Element]] = {}
        for element in self.elements:
            if "id" in element.attributes:
                found.setdefault(element.get("id"), []).append(element)
        return found


class _Collector(HTMLParser):
    def __init__(self, page: Page) -> None:
        super().__init__(convert_charrefs=True)
        self.page = page
        self.open: list[tuple[Element, list[str]]] = []
        self.inline: tuple[Element, list[str]] | None = None

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        line, column = self.getpos()
        element = Element(tag, {name: value or "" for name, value in attrs}, line, column + 1)
        self.page.elements.append(element)
        for _, said in self.open:
            said.append(element.get("alt") or element.get("aria-label"))
        if tag in TELLING:
            self.open.append((element, []))
        if tag == "style" or (tag == "script" and "src" not in element.attributes):
            self.inline = (element, [])

    def handle_data(self, data: str) -> None:
        if self.inline:
            self.inline[1].append(data)
        for _, said in self.open:
            said.append(data)

    def handle_endtag(self, tag: str) -> None:
        if self.inline and self.inline[0].tag == tag:
            self.page.inline.append((self.inline[0], "".join(self.inline[1])))
            self.inline = None
        if self.open and self.open[-1][0].tag == tag:
            element, said = self.open.pop()
            self.page.texts.append((element, "".join(said).strip()))


def read_pages(site: Path) -> dict[str, Page]:
    """Every page of a built site by its name."""
    pages = {}
    for path in sorted(site.rglob("*.html")):
        page = Page(site, path.relative_to(site).as_posix(), path.read_text("utf-8"))
        collector = _Collector(page)
        collector.feed(page.source)
        collector.close()
        pages[page.name] = page
    return pages


def is_foreign(address: str) -> bool:
    """Whether an address names its own host."""
    parts = urlsplit(address)
    return bool(parts.netloc) or parts.scheme in ("http", "https", "ws", "wss", "ftp")


def inside(address: str, base: str) -> tuple[str, str] | None:
    """File and fragment that an address names, seen from the file `base`; None for data:, mailto: and foreign ones.

    The file may lie outside of the site ("../x") or be absolute ("/x"); that is for the checks to say.
    """
    parts = urlsplit(address)
    if parts.scheme or parts.netloc:
        return None
    path = unquote(parts.path)
    if path and not path.startswith("/"):
        steps: list[str] = base.split("/")[:-1]
        for step in path.split("/"):
            if step == ".." and steps and steps[-1] != "..":
                steps.pop()
            elif step != ".":
                steps.append(step)
        path = "/".join(steps)
    file = path or base
    return (file + "index.html" if file.endswith("/") else file), unquote(parts.fragment)
