"""The sizes of what a reader loads, in bytes by gzip -9."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from sitegen.assets.css import imports, urls
from sitegen.cache.files import cache_dir
from sitegen.cache.packing import gzipped
from sitegen.check.html import Page, inside, is_foreign

PAGE_LIMIT = 250_000  # for a page with its fonts; without tapes and the runtime
RUNTIME_LIMIT = 6_200_000


@dataclass(frozen=True)
class Weight:
    """A page's files, including the page itself, and their compressed sizes in bytes."""

    page: str
    parts: Mapping[str, int]

    @property
    def total(self) -> int:
        """The total size."""
        return sum(self.parts.values())


def heaviest(weights: Iterable[Weight]) -> Weight:
    """The weight with the largest total."""
    return max(weights, key=lambda weight: weight.total)


@lru_cache(maxsize=4096)
def _gzip_size(path: Path, mtime: int) -> int:
    return len(gzipped(path.read_bytes(), cache_dir()))


def gzip_size(path: Path) -> int:
    """A file's size by gzip -9; a file that is gzip already counts as it is."""
    return _gzip_size(path, path.stat().st_mtime_ns)


def page_weight(page: Page) -> Weight:
    """The page and everything that its elements and their style sheets load."""
    queue = [page.name]
    for element in page.elements:
        queue += [target[0] for address in element.loads if (target := inside(address, page.name))]
    parts: dict[str, int] = {}
    while queue:
        name = queue.pop()
        path = page.site / name
        if name in parts or not path.is_file():
            continue
        parts[name] = gzip_size(path)
        if path.suffix == ".css":
            addresses = _of_sheet(path.read_text("utf-8"))
            queue += [target[0] for a in addresses if not is_foreign(a) and (target := inside(a, name))]
    return Weight(page.name, parts)


@lru_cache(maxsize=8)
def _of_sheet(text: str) -> list[str]:
    """The addresses in a sheet, remembered because all pages share one."""
    return [url.address for url in [*urls(text), *imports(text)]]


def runtime_weight(page: Page) -> Weight:
    """The files that the page's worker loads to start Python, as listed on its body; empty if it lists none."""
    parts: dict[str, int] = {}
    for element in page.elements:
        if element.name == "body" and element.get("data-runtime"):
            folder = element.get("data-runtime")
            for file in json.loads(element.get("data-runtime-files") or "[]"):
                target = inside(folder + file["name"], page.name)
                if target and (page.site / target[0]).is_file():
                    parts[target[0]] = gzip_size(page.site / target[0])
    return Weight(page.name, parts)
