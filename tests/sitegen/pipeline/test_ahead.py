"""Drawing ahead in several processes: afterwards a build has no figure left to draw."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import pytest

from sitegen.cache import pool
from sitegen.figures.bakery import Bakery
from tests.sitegen.conftest import Project, fresh_cache
from widgets.engine.registry import WIDGETS

SHOWN = """
## Deep {#deep}

::figure[One.]{kabsch id=demo}

::picture[Two.]{kabsch noise=0.1}

::picture[Three.]{kabsch expect="rms > 0"}

::picture[Ours alone.]{toy}
"""
SLIDES = """\
title: Second
rung: "1"
slug: second
summary: S
slides:
  - {title: One, figure: demo, set: press=solve, text: Solved.}"""


def test_pictures_slides_and_tapes_are_drawn_before_all_else(
    project: Project, tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Except for widgets that other processes cannot find by name; with everything cached, a build draws none."""
    project.cache = fresh_cache(tmp_path_factory.mktemp("cold"))
    project.widgets["kabsch"] = WIDGETS["kabsch"]
    project.chapter(SHOWN, SLIDES)
    by_pool: list[str] = []
    by_build: list[str] = []
    drawing = Bakery._frame

    def make(_title: str, pieces: Sequence[pool.Piece], _progress: Any) -> None:
        for function, arguments in pieces:
            by_pool.append(str(arguments[0]))
            function(*arguments)
        by_build.clear()

    def frame(bakery: Bakery, dom_id: str, record: Any) -> Any:
        by_build.append(f"{record['widget']} {dom_id}")
        return drawing(bakery, dom_id, record)

    monkeypatch.setattr(pool, "make", make)
    monkeypatch.setattr(Bakery, "_frame", frame)
    project.build()
    assert by_pool == ["fig-demo", "fig-picture-1", "fig-picture-2"]
    assert set(by_build) == {"toy fig-picture-3"}
