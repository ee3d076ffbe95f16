"""The grid of Gaussians: cells chosen by hover and by button, discarded cells with reasons, consistent numbers."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from widgets.engine.contract import preset
from widgets.engine.host import Host
from widgets.figures.ndt_map import STUCK, WIDGET

NEXT = ["press", "next"]
RANGES = {"noise": (0.0, 0.2), "size": (0.3, 2.5), "nudge_x": (-0.75, 0.75), "nudge_y": (-0.75, 0.75)}


def outcome(*log: Any, host: Host | None = None, **controls: Any) -> tuple[dict[str, str], dict[str, Any]]:
    """The readouts by name, and the frame, from a fresh host unless one is given."""
    plain = {**preset(WIDGET, "default", controls).plain(), "log": list(log)}
    frame = (host or Host()).render("f", plain)
    return {r["name"]: r["value"] for r in frame["readouts"]}, frame


def test_it_opens_on_a_corner_that_one_gaussian_blurs() -> None:
    """The first cell holds both arms of a corner: its small eigenvalue exceeds ten times the noise variance."""
    text, _ = outcome()
    assert text["cell"] == "kept"
    assert float(text["low"]) > 10 * 0.03**2
    assert 30 < abs(float(text["angle"].replace("−", "-"))) < 60


def test_pointing_chooses_the_cell_that_is_there() -> None:
    """Two places in one cell give one picture, a place in another cell another; only the last hover counts."""
    _, first = outcome(["hover", "main", -4.6, 1.2])
    _, twin = outcome(["hover", "main", -4.9, 1.9])
    _, second = outcome(["hover", "main", 0.5, 1.4])
    _, last = outcome(["hover", "main", -4.6, 1.2], ["hover", "main", 0.5, 1.4])
    assert first["panels"] == twin["panels"]
    assert first["panels"] != second["panels"]
    assert last["panels"] == second["panels"]


@pytest.mark.parametrize("controls", [{}, {"size": 0.4}, {"size": 2.0}, {"noise": 0.0}, {"nudge_x": 0.35}])
def test_next_goes_through_every_cell_that_holds_a_point(controls: dict[str, float]) -> None:
    """As many presses as there are such cells lead back to the first; together they hold every point once."""
    first, _ = outcome(**controls)
    cells = int(first["kept"]) + int(first["discarded"])
    host = Host()
    messages = [outcome(*[NEXT] * k, host=host, **controls)[0] for k in range(cells + 1)]
    assert messages[cells] == messages[0]
    assert len({m["mean"] for m in messages[:cells]}) > 0.9 * cells
    total = int(first["covered"].split(" of ")[1])
    assert sum(int(m["count"]) for m in messages[:cells]) == total
    full = [m for m in messages[:cells] if m["cell"].startswith("kept")]
    assert len(full) == int(first["kept"])
    assert sum(int(m["count"]) for m in full) == int(first["covered"].split(" of ")[0])


def test_discarded_cells_say_why() -> None:
    """The stuck beam's cell has enough points but no spread; another has too few; an empty one has none."""
    text, frame = outcome(["hover", "main", -2.5, 0.4])
    assert text["cell"] == "discarded"
    assert text["count"] == str(STUCK)
    assert "all points at one place" in frame["note"]
    notes = [outcome(*[NEXT] * k)[1]["note"] for k in range(34)]
    assert any("fewer than 3 points" in note for note in notes)
    text, frame = outcome(["hover", "main", 0.5, -0.5])
    assert (text["cell"], text["count"], text["angle"]) == ("empty", "0", "–")
    assert "This cell is empty" in frame["note"]


def test_the_stuck_beam_adds_its_returns_and_nothing_that_is_kept() -> None:
    """Switched off, its five points and one discarded cell disappear; the kept cells stay."""
    on, off = outcome()[0], outcome(stuck=False)[0]
    assert on["kept"] == off["kept"]
    assert int(on["discarded"]) == int(off["discarded"]) + 1
    assert int(on["covered"].split(" of ")[1]) == int(off["covered"].split(" of ")[1]) + STUCK


def test_without_noise_walls_are_floored_and_say_so() -> None:
    """The cell after the corner holds one exact wall."""
    text, frame = outcome(NEXT, noise=0.0)
    assert text["cell"] == "kept, floored"
    assert "raised" in frame["note"]


def test_smaller_cells_keep_less_of_the_scan() -> None:
    """Points in kept cells: all but a few at 1 u, fewer at 0.4 u, far fewer at 0.3 u."""
    counts = [int(outcome(size=h)[0]["covered"].split(" of ")[0]) for h in (1.0, 0.4, 0.3)]
    assert counts[0] > counts[1] > 1.5 * counts[2]


@settings(max_examples=25, deadline=None)
@given(
    st.fixed_dictionaries({name: st.floats(*span) for name, span in RANGES.items()}),
    st.lists(
        st.one_of(
            st.just(NEXT),
            st.tuples(st.just("hover"), st.just("main"), st.floats(-9e5, 9e5), st.floats(-9e5, 9e5)).map(list),
        ),
        max_size=4,
    ),
    st.integers(0, 2**31 - 1),
)
def test_whatever_a_reader_does_the_numbers_add_up(controls: dict[str, float], log: list[Any], seed: int) -> None:
    """For any grid, cell and draw, counts of cells and points are consistent, and nothing drawn is NaN."""
    plain = {**preset(WIDGET, "default", controls).plain(), "log": log, "seed": seed}
    frame = Host().render("f", plain)
    readouts = {r["name"]: r["value"] for r in frame["readouts"]}
    inside, total = (int(v) for v in readouts["covered"].split(" of "))
    assert 0 <= inside <= total
    assert 0 <= int(readouts["count"]) <= total
    assert "nan" not in frame["panels"][0]["svg"] + frame["panels"][1]["svg"]
    assert np.isfinite(int(readouts["kept"]) + int(readouts["discarded"]))


def test_one_point_is_a_point() -> None:
    """A cell with a single point says so in the singular."""
    text = Host().render("cells", {"widget": "ndt-map", "controls": {"nudge_x": 0.5, "nudge_y": 0.5}})["description"]
    assert "holds 1 point and is discarded" in text
