"""The figure of the wrong loop: it opens on the closed map, bends it on the press, and a kernel lets go."""

from __future__ import annotations

import numpy as np
import pytest

from tests.widgets.states import readouts
from widgets.drawing.picture import Label, Path, Ring, Segments
from widgets.engine.contract import Action, preset
from widgets.figures.wrong_loop import WIDGET, State, act, draw, start
from widgets.parts.drive_table import KERNELS, WRONG, table


def opened(kernel: str = "none") -> State:
    return start(preset(WIDGET, "default", {"kernel": kernel}).controls, 40)


def added(kernel: str = "none") -> State:
    return act(opened(kernel), Action("press", "add"))


def test_the_wrong_loop_bends_what_no_kernel_holds() -> None:
    bent = [float(readouts(draw(added(kernel)))["bent"]) for kernel in KERNELS]
    assert bent[0] > 5.0
    assert 0.1 < bent[1] < 1.0
    assert bent[2] < 0.05
    assert [readouts(draw(opened(kernel)))["bent"] for kernel in KERNELS] == ["0.00"] * 3


@pytest.mark.parametrize("kernel", KERNELS)
def test_the_shift_is_that_of_the_pose_that_moves_farthest(kernel: str) -> None:
    """Readout, note and description say the same."""
    picture = draw(added(kernel))
    moved = table().way("closed", kernel, True).t - table().way("closed", kernel).t
    shift = f"{max(float(np.hypot(x, y)) for x, y in moved):.2f}"
    assert readouts(picture)["bent"] == shift
    assert picture.note == f"The wrong loop moves poses by up to {shift} m."
    assert f"It moves poses by up to {shift} m." in picture.description


@pytest.mark.parametrize("kernel", KERNELS)
@pytest.mark.parametrize("state_of", [opened, added])
def test_the_errors_are_those_of_the_correct_loops(kernel: str, state_of) -> None:
    """Between the two scans of each by the poses and by the measurement."""
    state = state_of(kernel)
    data, shifts, turns = table(), [], []
    for k, (later, earlier) in enumerate(zip(data.later, data.earlier, strict=True)):
        off = data.loops[k].inverse().compose(state.way[int(earlier)].inverse().compose(state.way[int(later)]))
        shifts.append(float(np.hypot(*off.t)))
        turns.append(abs(float(np.degrees(off.angle))))
    text = readouts(draw(state))
    assert text["apart"] == f"{np.median(shifts):.3f}"
    assert text["worst"] == f"{max(shifts):.3f}"
    assert text["turn"] == f"{np.median(turns):.2f}"
    assert f"and {len(shifts)} correct loops" in draw(state).description


@pytest.mark.parametrize("kernel", KERNELS)
def test_the_two_scans_are_ringed_and_named_until_the_loop_is_there(kernel: str) -> None:
    """In two sizes, so that both show where the loop pulls them together; then the loop is drawn and named, and the
    path without it is dotted."""
    for state, words in ((opened(kernel), {"scan 150", "scan 20", "10 m"}), (added(kernel), {"wrong loop", "10 m"})):
        marks = draw(state).panels[0].marks
        rings = {mark.radius: np.asarray(mark.xy) for mark in marks if isinstance(mark, Ring)}
        assert len(rings) == 2
        for (_, xy), scan in zip(sorted(rings.items()), sorted(WRONG), strict=True):
            np.testing.assert_array_equal(xy, state.way.t[scan])
        labels = {mark.text: np.asarray(mark.xy) for mark in marks if isinstance(mark, Label)}
        assert labels.keys() == words
        for scan in WRONG:
            if f"scan {scan}" in labels:
                np.testing.assert_array_equal(labels[f"scan {scan}"], state.way.t[scan])
        lines = [mark for mark in marks if isinstance(mark, Segments) and mark.role == "outlier"]
        ghosts = [np.asarray(mark.xy) for mark in marks if isinstance(mark, Path) and mark.role == "ghost"]
        assert len(lines) == len(ghosts) == int(state.has_wrong_loop)
        if state.has_wrong_loop:
            assert np.asarray(lines[0].a).tolist() == state.way.t[WRONG[0]].tolist()
            assert np.asarray(lines[0].b).tolist() == state.way.t[WRONG[1]].tolist()
            np.testing.assert_array_equal(ghosts[0], table().way("closed", kernel).t)


def test_the_weight_is_what_the_kernel_leaves_the_loop() -> None:
    """There is none to show before the loop is added, which can be done once."""
    for kernel in KERNELS:
        assert readouts(draw(opened(kernel)))["weight"] == "–"
        assert readouts(draw(added(kernel)))["weight"] == f"{table().kept[kernel]:.3f}"
        assert not draw(opened(kernel)).disabled
        assert draw(added(kernel)).disabled == {"add"}
