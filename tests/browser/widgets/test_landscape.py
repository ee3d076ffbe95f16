"""The landscape as a reader walks on it: sown from the tape, clicked by mouse, redrawn and cleared."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from tests.browser.conftest import Reader
from tests.browser.figure import Figure
from tests.browser.server import SiteServer
from widgets.engine.contract import preset
from widgets.engine.host import Host
from widgets.figures.landscape.figure import BANDS, WIDGET


@pytest.fixture
def terrain(reader: Callable[..., Reader]) -> Figure:
    return Figure(reader(reduced_motion="reduce").open("landscape.html"), "fig-mmd").live()


def test_sowing_answers_before_python_is_up(reader: Callable[..., Reader], server: SiteServer) -> None:
    """With the runtime held back: sown, cleared by Reset, and sown again."""
    server.hold("/runtime/")
    terrain = Figure(reader(reduced_motion="reduce").open("landscape.html"), "fig-mmd").seen()
    terrain.button("sow").click()
    text = terrain.changes("reached", "–")
    terrain.button("reset").click()
    terrain.shows("reached", "–")
    terrain.button("sow").click()
    terrain.shows("reached", text)


@pytest.mark.parametrize("motion", ["no-preference", "reduce"])
@pytest.mark.parametrize("live", [False, True])
def test_descents_are_seen_to_descend(
    reader: Callable[..., Reader], server: SiteServer, live: bool, motion: str
) -> None:
    """Their lines grow from the starts, through finer maps as well, and the outcome's marks come last; with reduced
    motion everything appears at once."""
    if not live:
        server.hold("/runtime/")
    page = reader(reduced_motion=motion).open("landscape.html")
    terrain = Figure(page, "fig-mmd").live() if live else Figure(page, "fig-mmd").seen()
    page.evaluate("""name => {
      const group = () => document.getElementById(`${name}-map-descents`);
      const dash = e => parseFloat(e.style.strokeDasharray);
      const lines = () => [...(group()?.querySelectorAll('.line') ?? [])].map(dash); // none on a coarse map
      window.seen = [];
      new MutationObserver(() => {
        const drawn = lines();
        if (drawn.length < 49) return;
        const rest = [...group().querySelectorAll('path:not(.line)')];
        const marked = rest.some(e => getComputedStyle(e).visibility === 'visible');
        seen.push([Math.max(...drawn), document.getElementById(name).dataset.frame, marked]);
      }).observe(document.querySelector(`#${name} [data-panel=map]`), {
        subtree: true, attributes: true, childList: true,
      });
    }""", terrain.name)
    if live:  # at a length scale that is not on the tape, while its map is drawn coarsely
        page.evaluate("""name => new Promise(done => {
          const { root } = Ladder.figures.get(name), slider = root.querySelector('[name=length]');
          new MutationObserver((_, watch) => {
            watch.disconnect();
            done(root.querySelector('[data-button=sow]').click());
          }).observe(root, {attributeFilter: ['data-frame']});
          slider.value = '0.7';
          slider.dispatchEvent(new Event('input', {bubbles: true}));
        })""", terrain.name)
    else:
        terrain.button("sow").click()
    terrain.changes("reached", "–")
    terrain.settled()
    samples = page.evaluate("seen.filter(([length]) => length >= 0)")  # NaN once lines are whole
    if motion == "reduce":
        assert samples == []
    else:
        lengths, frames = [length for length, *_ in samples], {frame for _, frame, _ in samples}
        assert len(set(lengths)) > 3
        assert lengths == sorted(lengths)
        assert not any(is_marked for *_, is_marked in samples)
        assert len(frames) > 1 or not live
    group = page.locator(f"#{terrain.name}-map-descents")
    assert group.locator("path[style]").count() == 0
    assert group.locator("path:not(.line)").count() == 4


def test_picked_starts_stay_until_cleared(terrain: Figure) -> None:
    """A click adds a descent to the existing ones; *Resample* keeps them, *Clear* removes them."""
    box = terrain.settled().seen().root.locator('.figure-panel[data-panel="map"]').bounding_box()  # outlives swaps
    assert box
    for k, part in enumerate((0.3, 0.5), start=1):
        terrain.page.mouse.click(box["x"] + part * box["width"], box["y"] + 0.4 * box["height"])
        terrain.settled()
        assert terrain.readout("reached").endswith(f" of {k}")
    truth = terrain.readout("truth")
    terrain.button("resample").click()
    terrain.changes("truth", truth)
    assert terrain.settled().readout("reached").endswith(" of 2")
    terrain.button("clear").click()
    terrain.shows("reached", "–")


def test_levels_are_the_build_s_byte_for_byte(terrain: Figure) -> None:
    """Each preset, sown, at the coarsest and the finest level, is the native frame."""
    for name in WIDGET.presets:
        for level in (0, BANDS):
            record: dict[str, Any] = {**preset(WIDGET, name).plain(), "log": [["press", "sow"]]}
            live = terrain.page.evaluate(
                "request => Ladder.runtime.frame(request)", {"figure": "fig-x", "record": record, "detail": level}
            )
            assert live == Host().render("fig-x", record, level), (name, level)
