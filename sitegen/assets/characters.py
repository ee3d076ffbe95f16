"""The characters that a site uses, to which its typefaces are cut."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from pathlib import Path

from sitegen.assets import typefaces
from sitegen.cache.memo import Remembered
from sitegen.cache.memory import Memory

REMEMBERED = 500  # pages and tapes of earlier builds


def characters(pages: Mapping[str, str], scripts: Mapping[str, bytes], cache: Path, memory: Memory) -> tuple[str, str]:
    """The characters in the pages' text, including the tapes, and in their mathematics. A tape's name holds its
    content's hash."""
    memo = Remembered(cache, f"characters-{typefaces.FORMAT}", REMEMBERED)

    def of_page(page: str) -> tuple[str, str]:
        return memo.answer(page, partial(typefaces.characters, [page]))  # type: ignore[no-any-return]

    def of_tape(name: str) -> tuple[str, str]:
        return memo.answer(name, partial(_letters, scripts[name]))  # type: ignore[no-any-return]

    pairs = [memory.answer(("letters", name), page, partial(of_page, page)) for name, page in pages.items()]
    pairs += memory.answer("letters of tapes", list(scripts), lambda: list(map(of_tape, scripts)))
    memo.keep()
    text, signs = ("".join(sorted(set().union(*strings))) for strings in zip(*pairs, strict=True))
    return text, signs


def _letters(script: bytes) -> tuple[str, str]:
    return "".join(sorted(set(script.decode()))), ""
