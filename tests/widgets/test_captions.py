"""What captions promise when a reader changes a figure: each change is replayed, and the readouts do as promised."""

from __future__ import annotations

from typing import Any

from widgets.engine.contract import preset
from widgets.engine.host import Host
from widgets.engine.registry import WIDGETS


def readouts(name: str, start: str, *presses: str, **controls: Any) -> dict[str, str]:
    """A figure's readouts after some presses, with these controls."""
    plain = preset(WIDGETS[name], start, controls).plain()
    frame = Host().render("f", {**plain, "log": [["press", press] for press in presses]})
    return {readout["name"]: readout["value"] for readout in frame["readouts"]}


def test_a_wide_threshold_breaks_ransac_where_the_pattern_repeats() -> None:
    """2.1 and 2.2: beyond 1.2 u every pair of the repeated pattern counts, even the wrong ones; with partners hidden by
    occlusion, no threshold of the slider admits a wrong one."""
    for start, outliers in (("default", 18), ("tight", 18)):
        for epsilon in (1.25, 1.4, 1.6):
            repeated = readouts("ransac", start, "finish", scene="repeated", epsilon=epsilon)
            assert (repeated["count"], repeated["admitted"]) == ("40", str(outliers))
            assert float(repeated["translation_error"]) > 0.4
            occluded = readouts("ransac", start, "finish", scene="occluded", epsilon=epsilon)
            assert occluded["admitted"] == "0"


def test_eight_steps_of_points_come_less_far_than_of_planes() -> None:
    """3½.1: plane is within half a degree, point still about 17° off."""
    plane = readouts("surfaces", "default", *["step"] * 8, residual="plane")
    point = readouts("surfaces", "default", *["step"] * 8, residual="point")
    assert float(plane["rotation_error"]) <= 0.5
    assert 16.5 < float(point["rotation_error"]) < 17.5
    assert float(plane["translation_error"]) < float(point["translation_error"])


def test_a_short_length_scale_breaks_the_landscape() -> None:
    """7.1: at 0.3 u fewer of the 49 starts reach the truth, and there are more minima and more ends."""
    usual, short = readouts("landscape", "default", "sow"), readouts("landscape", "default", "sow", length=0.3)
    counts = [int(result["reached"].split(" ")[0]) for result in (usual, short)]
    assert counts[1] < counts[0]
    assert int(short["minima"]) > int(usual["minima"])
    assert int(short["places"]) > int(usual["places"])


def test_refining_need_not_sharpen_the_run_that_is_shown() -> None:
    """8.1: refining leaves the rotation error of the figure's run unchanged; with the race's gate it is larger."""
    proposal, refinement = (readouts("pipeline", "default", *["next"] * k)["rotation_error"] for k in (1, 2))
    wide = readouts("pipeline", "default", "next", "next", gate=2.6)["rotation_error"]
    assert proposal == refinement
    assert float(refinement) < float(wide) < 5.0
