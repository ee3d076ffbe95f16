"""The limits of a title slide: how much of the ladder it shows, and how long title and question may be."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from sitegen.chapters.content import Chapter
from sitegen.problems import Problems

RUNGS = 18  # each as tall as a finger in a low window
TITLE, QUESTION = 90, 160  # characters, in the narrower of the windows that slides are designed for


def in_part(rungs: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """The rungs of a title slide: all, or if too many, those around the current one and counts of the rest."""
    at = next((i for i, rung in enumerate(rungs) if rung["current"]), 0)
    start = max(min(at - RUNGS // 2, len(rungs) - RUNGS), 0)
    part = list(rungs[start : start + RUNGS])
    if start:
        part[0] = _ellipsis(start + 1, "below")
    if start + RUNGS < len(rungs):
        part[-1] = _ellipsis(len(rungs) - start - RUNGS + 1, "above")
    return part


def _ellipsis(count: int, side: str) -> dict[str, Any]:
    return {"rung": "…", "title": f"{count} more {side}", "page": "slides.html", "current": False, "emblem": ""}


def check_title(chapter: Chapter, problems: Problems) -> None:
    """Report a title or question that does not fit on the title slide."""
    for name, limit in (("title", TITLE), ("question", QUESTION)):
        count = len(getattr(chapter, name))
        if chapter.slides and count > limit:
            message = f"{name}: {count} characters, but the title slide fits {limit}"
            problems.add(chapter.at(name), message)
