"""A page's figures as readers see them who do not tell red from green: pictures to look at, in artefacts/sight. That
the marks of a legend differ to them, tests/sitegen/assets/test_legends.py computes."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Literal

from playwright.sync_api import Page

from tests.browser.figure import Figure, figures

SIGHT = "Emulation.setEmulatedVisionDeficiency"
CENTRE = "body => body.scrollIntoView({ block: 'center', behavior: 'instant' })"
DRAWN = "([id, frames]) => +document.getElementById(id).dataset.frame > frames"
Theme = Literal["light", "dark"]
SIGHTS: dict[Theme, str] = {"dark": "deuteranopia", "light": "protanopia"}  # either theme in one of the two
ARTEFACTS = Path(__file__).resolve().parents[3] / "artefacts" / "sight"


def unchanged(page: Page, path: str) -> Iterator[str]:
    """The figures, each after its main button, that nobody sees otherwise than all others; the light theme stays."""
    emulated = page.context.new_cdp_session(page)
    ARTEFACTS.mkdir(parents=True, exist_ok=True)
    placed = figures(page)
    for figure in placed:
        button = figure.seen().root.locator(".buttons .primary")
        if button.count():
            before = figure.frames()
            button.first.click()
            page.wait_for_function(DRAWN, arg=[figure.name, before])
            figure.settled()
    for theme, sight in SIGHTS.items():
        page.emulate_media(color_scheme=theme)
        usual = [_picture(figure) for figure in placed]
        emulated.send(SIGHT, {"type": sight})  # paints the whole page anew, so once for all figures
        for figure, seen_by_others in zip(placed, usual, strict=True):
            name = f"{path.removesuffix('.html')}-{figure.name}-{sight}-{theme}.png"
            if _picture(figure, ARTEFACTS / name) == seen_by_others:
                yield name
        emulated.send(SIGHT, {"type": "none"})


def _picture(figure: Figure, path: Path | None = None) -> bytes:
    """A figure's picture, kept at `path`; always at one place in the window, where the same is under the pointer."""
    body = figure.root.locator(".figure-body")
    body.evaluate(CENTRE)
    return body.screenshot(path=path, caret="initial")
