"""The figures of residuals, as a reader drives them: another residual with the same presses, a drag for all three."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from tests.browser.conftest import Reader
from tests.browser.figure import Figure
from tests.browser.server import SiteServer
from widgets.engine.contract import preset
from widgets.engine.host import Host
from widgets.engine.registry import WIDGETS


def test_another_residual_answers_before_python_is_up(reader: Callable[..., Reader], server: SiteServer) -> None:
    """With the runtime held back: one residual's run to its end, then another's by the same press."""
    server.hold("/runtime/")
    page = reader(reduced_motion="reduce").open("surfaces.html")
    look = Figure(page, "fig-look").seen()
    first = look.readout("stop")
    look.button("finish").click()
    plane = look.changes("stop", first)
    look.set("residual", "point")
    point = look.changes("stop", plane)
    assert plane.startswith("converged")
    assert point.startswith("converged")
    assert look.record()["log"] == [["press", "finish"]]


def test_the_wall_says_what_is_free_and_point_pairs_do_not(reader: Callable[..., Reader]) -> None:
    """Plane leaves the slide free and says so. Point, by one choice, leaves nothing free, at the same error."""
    page = reader(reduced_motion="reduce").open("surfaces.html")
    wall = Figure(page, "fig-wall").live()
    wall.button("finish").click()
    wall.shows("free", "slide").settled()
    assert "leave the slide along" in wall.root.locator(".figure-status").inner_text()
    wall.set("residual", "point")
    wall.settled()
    assert wall.readout("free") == "none"
    assert abs(float(wall.readout("along")) - 0.5) < 0.1


@pytest.mark.parametrize("name", ["plane", "gicp"])
def test_a_drag_in_one_panel_starts_all_three(reader: Callable[..., Reader], name: str) -> None:
    """Dragged in any panel, by pointer or key, all three have taken no step and have the same error."""
    page = reader(reduced_motion="reduce").open("surfaces.html")
    three = Figure(page, "fig-three").live()
    three.drag(f"{name}-source", 25, 15)
    three.settled()
    assert three.readout("point_rotation") == three.readout("plane_rotation") == three.readout("gicp_rotation")
    assert [three.readout(f"{key}_steps") for key in ("point", "plane", "gicp")] == ["0, not begun"] * 3
    before = three.readout("point_rotation")
    three.handle(f"{name}-turn").focus()
    page.keyboard.press("Shift+ArrowLeft")
    assert three.changes("point_rotation", before) == three.settled().readout("gicp_rotation")


def test_live_frames_are_the_build_s(reader: Callable[..., Reader]) -> None:
    """Each preset of both figures, at the end of its run, with and without weights: the same bytes as natively."""
    page = reader().open("surfaces.html")
    Figure(page, "fig-look").live()
    host = Host()
    for name in ("surfaces", "three-residuals"):
        for option in WIDGETS[name].presets:
            for weight in ("none", "tukey"):
                record = {**preset(WIDGETS[name], option, {"weight": weight}).plain(), "log": [["press", "finish"]]}
                live = page.evaluate("request => Ladder.runtime.frame(request)", {"figure": "f", "record": record})
                assert live == host.render("f", record), (name, option, weight)
