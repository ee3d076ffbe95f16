"""Built pages, parsed for the checks: every element with its attributes and its position in the file."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from urllib.parse import unquote, urlsplit

from sitegen.html_reader import Tag, read

# Attributes whose file the browser loads by itself.
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


class Element(Tag):
    """A start tag, with the addresses that it loads and links to."""

    __slots__ = ()

    @property
    def loads(self) -> list[str]:
        """The addresses that the browser loads for this element."""
        if self.name == "link":
            return [self.get("href")] if LOADED_LINKS & set(self.get("rel").lower().split()) else []
        addresses = []
        for name in LOADED.get(self.name, ()):
            if name in self.attributes:
                several = self.get(name).split(",") if name == "srcset" else [self.get(name)]
                addresses += [candidate.split()[0] if candidate.split() else "" for candidate in several]
        return addresses

    @property
    def links(self) -> list[str]:
        """The addresses that this element links or redirects to."""
        if self.name in ("a", "area"):
            return [self.attributes[name] for name in ("href", "xlink:href") if name in self.attributes]
        if self.name == "meta" and self.get("http-equiv").lower() == "refresh":
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
    inline: list[tuple[Element, str]] = field(default_factory=list)  # styles, and scripts without src

    @cached_property
    def ids(self) -> dict[str, list[Element]]:
        """The elements by id."""
        by_id: dict[str, list[Element]] = {}
        for element in self.elements:
            if "id" in element.attributes:
                by_id.setdefault(element.get("id"), []).append(element)
        return by_id


class _Collector:
    """Collects a page's elements, the texts of the TELLING ones, and inline styles and scripts."""

    def __init__(self, page: Page) -> None:
        self._page = page
        self._open_elements: list[tuple[Tag, Element, list[str]]] = []  # open elements with text, and that so far

    def opened(self, tag: Tag) -> None:
        element = Element(*tag)
        self._page.elements.append(element)
        for _, _, pieces in self._open_elements:
            pieces.append(element.get("alt") or element.get("aria-label"))
        if tag.name in TELLING or _is_inline(tag):
            self._open_elements.append((tag, element, []))

    def text(self, text: str) -> None:
        for _, _, pieces in self._open_elements:
            pieces.append(text)

    def closed(self, tag: Tag) -> None:
        if not self._open_elements or self._open_elements[-1][0] is not tag:
            return
        _, element, pieces = self._open_elements.pop()
        if _is_inline(tag):
            self._page.inline.append((element, "".join(pieces)))
        else:
            self._page.texts.append((element, "".join(pieces).strip()))


def _is_inline(tag: Tag) -> bool:
    """Whether it is an inline style or script."""
    return tag.name == "style" or (tag.name == "script" and "src" not in tag.attributes)


def read_pages(site: Path) -> dict[str, Page]:
    """Read every page of a built site; keyed by name."""
    pages = {}
    for path in sorted(site.rglob("*.html")):
        name = path.relative_to(site).as_posix()
        pages[name] = Page(site, name, path.read_text("utf-8"))
        read(pages[name].source, _Collector(pages[name]))
    return pages


def is_foreign(address: str) -> bool:
    """Whether an address names a host."""
    parts = urlsplit(address)
    return bool(parts.netloc) or parts.scheme in ("http", "https", "ws", "wss", "ftp")


def inside(address: str, base: str) -> tuple[str, str] | None:
    """The file and fragment that an address names, relative to the file `base`; None for data:, mailto: and foreign
    ones.

    The file may be outside the site ("../x") or absolute ("/x"); the checks report that.
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
