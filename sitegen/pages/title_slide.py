"""What a title slide has room for: so much of the ladder, and a title and a question that are read from afar."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from sitegen.chapters.content import Chapter
from sitegen.problems import Problems

RUNGS = 18  # each is as high as a finger in a low window
TITLE, QUESTION = 90, 160  # characters, in the narrower of the windows that slides are made for


def in_part(rungs: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """The rungs of a title slide: all, or of very many those round the current one, and how many are left out."""
    at = next((i for i, rung in enumerate(rungs) if rung["current"]), 0)
    start = max(min(at - RUNGS // 2, len(rungs) - RUNGS), 0)
    part = list(rungs[start : start + RUNGS])
    if start:
        part[0] = _more(start + 1, "below")
    if start + RUNGS < len(rungs):
        part[-1] = _more(len(rungs) - start - RUNGS + 1, "above")
    return part


def _more(count: int, where: str) -> dict[str, Any]:
    return {"rung": "…", "title": f"{count} more {where}", "page": "slides.html", "current": False, "emblem": ""}


def check_title(chapter: Chapter, problems: Problems) -> None:
    """What would not fit is told where it is written."""
    for name, limit in (("title", TITLE), ("question", QUESTION)):
        count = len(getattr(chapter, name))
        if chapter.slides and count > limit:
            says = f"{name}: {count} characters, and the title slide has room for {limit}"
            problems.add(chapter.at(name), says)
