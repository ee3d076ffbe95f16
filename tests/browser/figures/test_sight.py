"""Every figure after its main button, as readers see it who do not tell red from green: pictures to look at, in
artefacts/sight. That the marks of a legend differ to them, tests/sitegen/assets/test_legends.py computes."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Literal

from tests.browser.conftest import Reader
from tests.browser.figure import figures
from tests.browser.layout import placed

DRAWN = "([id, frames]) => +document.getElementById(id).dataset.frame > frames"
THEMES: tuple[Literal["light", "dark"], ...] = ("light", "dark")
SIGHTS = ("protanopia", "deuteranopia")
ARTEFACTS = Path(__file__).resolve().parents[3] / "artefacts" / "sight"


def test_what_a_reader_sees(reader: Callable[..., Reader], site: Path, pages: list[str]) -> None:
    """In both themes: with either sight a figure is seen, and otherwise than without."""
    one = reader(reduced_motion="reduce")
    page = one.open()
    emulated = page.context.new_cdp_session(page)
    ARTEFACTS.mkdir(parents=True, exist_ok=True)
    placing = {path: placed(site, path) for path in pages if placed(site, path) and not path.startswith("docs-")}
    taken = 0
    for path in placing:
        page.goto(f"{one.origin}/{path}")
        for figure in figures(page):
            button = figure.seen().root.locator(".buttons .primary")
            if button.count():
                before = figure.frames()
                button.first.click()
                page.wait_for_function(DRAWN, arg=[figure.name, before])
                figure.settled()
            body = figure.root.locator(".figure-body")
            for theme in THEMES:
                page.emulate_media(color_scheme=theme)
                plain = body.screenshot(caret="initial")
                for sight in SIGHTS:
                    emulated.send("Emulation.setEmulatedVisionDeficiency", {"type": sight})
                    name = f"{path.removesuffix('.html')}-{figure.name}-{sight}-{theme}.png"
                    assert body.screenshot(path=ARTEFACTS / name, caret="initial") != plain, f"{figure.name}, {theme}"
                    emulated.send("Emulation.setEmulatedVisionDeficiency", {"type": "none"})
            taken += 1
    assert taken == sum(placing.values())
