"""The figure of residuals and weights: how strokes are drawn, what each control changes, what a wall leaves free."""

from __future__ import annotations

import re
from functools import partial
from typing import Any

import numpy as np
import pytest

from solvers import Pose
from solvers.numerics import gauss_newton, robust
from solvers.scenes.rooms import room_start
from tests.widgets.states import frame_after, readouts, state_after
from widgets.drawing.picture import Arrow, Ellipses, Label, Path, Points, Segments, Ticks
from widgets.engine.contract import SEED, Action, preset
from widgets.engine.host import Host
from widgets.figures.surfaces import WIDGET, act, motion
from widgets.parts.room import VIEW
from widgets.parts.surface_marks import (
    FAINTEST,
    carried,
    own_surfaces,
    pairs,
    surfaces,
    unused,
    weak_direction,
    weak_label,
    weight_chart,
)
from widgets.parts.surface_run import RESIDUALS, WEIGHTS, Ask, Run, along_across, begun, scene_of

STEP, FINISH = Action("press", "step"), Action("press", "finish")
RESIDUAL = pytest.mark.parametrize("residual", list(RESIDUALS))


run = partial(state_after, WIDGET)


def texts(log: list[Any], **controls: Any) -> dict[str, str]:
    return readouts(frame_after(WIDGET, *log, **controls))


@RESIDUAL
@pytest.mark.parametrize("weight", list(WEIGHTS))
def test_a_stroke_is_the_pairs_pull(residual: str, weight: str) -> None:
    """A pair's pull is the length of its term in the gradient of the step; the terms add up to that gradient."""
    fit = run(residual=residual, weight=weight, outliers=20.0, start="near").run
    forces = np.einsum("mij,mj->mi", fit.precision, fit.moved - fit.partners)
    w = fit.pairing.weights[0]
    np.testing.assert_allclose(fit.pull, np.linalg.norm(w[:, None] * forces, axis=1), atol=1e-12)
    np.testing.assert_allclose((w[:, None] * forces).sum(axis=0) / w.sum(), fit.system.gradient[0, :2], atol=1e-12)
    (strokes,) = pairs(fit)
    assert isinstance(strokes, Segments)
    share = fit.pull[fit.used] / fit.pull.max()
    np.testing.assert_allclose(strokes.weight, np.maximum(share, FAINTEST), atol=1e-12)  # type: ignore[arg-type]


def test_a_stroke_is_the_residual_itself() -> None:
    """Its length is the residual: to the partner in point and GICP mode, along the normal only in plane mode."""
    for residual in RESIDUALS:
        fit = run(residual=residual).run
        (strokes,) = pairs(fit)
        assert isinstance(strokes, Segments)
        length = np.linalg.norm(np.asarray(strokes.b) - np.asarray(strokes.a), axis=1)
        if residual == "plane":
            normals = fit.state.normals.vectors[0, fit.pairing.rows[0]]
            expected = np.abs(((fit.moved - fit.partners) * normals).sum(axis=1))[fit.used]
        else:
            expected = fit.pairing.distances[0, fit.used]
        np.testing.assert_allclose(length, expected, atol=1e-9)


@RESIDUAL
def test_a_drag_begins_as_a_start_there_would(residual: str) -> None:
    """Normals and covariances are reused after a drag; the run equals that of a fresh start at the dragged pose."""
    after_drag = run(STEP, Action("drag", "source", 1.0, -0.5), residual=residual).run
    fresh = begun(after_drag.ask, after_drag.scene, after_drag.began)
    for a, b in ((after_drag, fresh), (after_drag.finish(), fresh.finish())):
        np.testing.assert_array_equal(a.pose.matrix, b.pose.matrix)
        np.testing.assert_array_equal(a.pull, b.pull)


def test_each_residual_shows_its_own_model() -> None:
    """Ticks in plane mode, both clouds' ellipses in GICP mode, neither in point mode; the source's turn with it."""
    kinds = {name: [type(m) for m in surfaces(run(residual=name).run)] for name in RESIDUALS}
    assert kinds == {"point": [], "plane": [Ticks], "gicp": [Ellipses]}
    for turn in (0.0, 90.0):
        (own,) = own_surfaces(run(residual="gicp", scene="wall", noise=0.0, turn=turn).run)
        assert isinstance(own, Ellipses)
        wall = Pose.from_angle(np.radians(turn)).apply(np.array([[8.0, 2.8]]))[0]
        along = np.linalg.eigh(np.asarray(own.covariance)[3])[1][:, 1]
        assert abs(along @ wall) == pytest.approx(np.linalg.norm(wall))


@RESIDUAL
def test_every_button_and_control_changes_what_it_names(residual: str) -> None:
    """Each slider and choice changes the readouts after one step, in every mode."""
    base = {"residual": residual, "outliers": 10.0, "weight": "huber"}
    plain = texts([["press", "step"]], **base)
    second = next(name for name in RESIDUALS if name != residual)
    changes: list[dict[str, Any]] = [
        {"scene": "corridor"}, {"residual": second}, {"weight": "tukey"}, {"weight": "welsch"}, {"weight": "none"},
        {"start": "near"}, {"turn": 60.0}, {"offset": 0.5}, {"noise": 0.1}, {"outliers": 30.0}, {"trim": 20.0},
    ]  # fmt: skip
    for change in changes:
        assert texts([["press", "step"]], **{**base, **change}) != plain, change
    state = run(STEP, **base)
    assert motion(run(**base), state) is not None
    assert motion(state, act(state, FINISH)) is None


def test_a_wall_is_found_and_the_slide_left() -> None:
    """Point to plane finds the offset across the wall and the turn, leaves the offset along it, and reports the slide
    as free. Point and GICP report nothing free."""
    for scene in ("wall", "corridor"):
        begun_at = texts([], scene=scene, start="near")
        end = texts([["press", "finish"]], scene=scene, start="near")
        assert end["free"] == "slide"
        assert end["stop"].startswith("degenerate")
        assert float(end["across"]) < 0.05
        assert float(end["along"]) == pytest.approx(float(begun_at["along"]), abs=0.15)
        assert float(end["condition"].replace(",", "")) > 20
        for residual, most in (("point", 10.0), ("gicp", 150.0)):
            last = texts([["press", "finish"]], scene=scene, start="near", residual=residual)
            assert last["free"] == "none"
            assert float(last["condition"]) < most
            assert float(last["along"]) > 0.2
    assert texts([])["along"] == "–"


def test_the_weak_arrow_runs_along_the_wall() -> None:
    """On one wall and in a corridor the arrow is a slide along them, both ways, and longer as it is free."""
    for scene in ("wall", "corridor"):
        fit = run(FINISH, scene=scene, start="near").run
        path, *tips = weak_direction(fit)
        course = np.asarray(path.xy)  # type: ignore[union-attr]
        along = course[-1] - course[0]
        assert abs(along @ [8.0, 2.8]) > 0.99 * np.linalg.norm(along) * np.hypot(8.0, 2.8)
        assert np.linalg.norm(along) == pytest.approx(4.0)
        assert len(tips) == 2


def test_the_weak_arrow_of_a_turn_is_an_arc_of_it() -> None:
    """If the weak motion includes a turn, all points of the arrow are equally far from its fixed point."""
    fit = run(residual="gicp").run
    system = fit.system
    v, a = system.directions[0, :2, 0], system.directions[0, 2, 0]
    about = system.centre[0] + np.array([-v[1], v[0]]) * system.radius[0] / a
    course = np.asarray(weak_direction(fit)[0].xy)  # type: ignore[union-attr]
    radii = np.linalg.norm(course - about, axis=1)
    np.testing.assert_allclose(radii, radii[0], rtol=1e-9)


def test_where_all_motions_are_held_alike_no_arrow_is_drawn() -> None:
    """Unweighted point pairs constrain slides and turn equally: a direction would be rounding, so none is drawn."""
    fit = run(FINISH, residual="point").run
    np.testing.assert_allclose(fit.system.eigenvalues, 1.0, atol=1e-9)
    assert weak_direction(fit) == ()
    assert "no weakest direction" in weak_label(fit, VIEW).text


def test_the_point_system_is_that_of_identity_precisions() -> None:
    """In point mode the system equals the Gauss-Newton system in which every precision is the identity."""
    fit = run(residual="point").run
    J = gauss_newton.jacobian(fit.pairing.moved - fit.system.centre[:, None], fit.system.radius)[0]
    H = np.einsum("mij,mik->jk", J, J) / len(J)
    np.testing.assert_allclose(fit.system.information[0], H, atol=1e-12)


def test_the_scale_is_the_one_that_the_weights_are_made_with() -> None:
    """s is 1.4826 times the median distance of the pairs left after trimming."""
    for weight in WEIGHTS:
        fit = run(weight=weight, trim=30.0).run
        distances = np.sort(fit.pairing.distances[0])[: round(0.7 * len(fit.moved))]
        assert fit.scale == pytest.approx(1.4826 * np.median(distances), rel=0.02)


@pytest.mark.parametrize("weight", list(WEIGHTS))
def test_every_pair_is_in_the_rug_once(weight: str) -> None:
    """Strokes and the count beyond the edge add up to all pairs; trimmed and rejected ones are grey."""
    fit = run(weight=weight, outliers=30.0, trim=10.0, start="near").run
    panel = weight_chart(fit)
    rug = [m for m in panel.marks if isinstance(m, Segments) and m.role in ("source", "outlier", "ghost")]
    outside = [m.text for m in panel.marks if getattr(m, "text", "").endswith("beyond 8 s")]
    count = sum(len(np.asarray(m.a)) for m in rug) + (int(outside[0].split()[0]) if outside else 0)
    assert count == len(fit.moved)
    inside = fit.pairing.distances[0] <= 8.0 * fit.scale
    grey = sum(len(np.asarray(m.a)) for m in rug if m.role == "ghost")
    assert grey == (~fit.used & inside).sum() > 0


def test_outliers_are_crosses_and_unused_pairs_rings() -> None:
    fit = run(outliers=20.0, trim=20.0).run
    (_, (dots, crosses)), rings = carried(fit), unused(fit)
    assert isinstance(crosses, Points)
    assert isinstance(rings, Points)
    assert isinstance(dots, Points)
    assert len(np.asarray(crosses.xy)) == round(0.2 * len(fit.moved))
    assert len(np.asarray(rings.xy)) == (~fit.used).sum() == round(0.2 * len(fit.moved))
    assert len(np.asarray(dots.xy)) + len(np.asarray(crosses.xy)) == len(fit.moved)


def test_residual_and_weight_replay_the_same_presses() -> None:
    """Each residual runs to its end from the same start: the page keeps the log when these two controls change."""
    plain = preset(WIDGET).plain()
    host = Host()
    for residual in RESIDUALS:
        frame = host.render(
            "f", {**plain, "controls": {**plain["controls"], "residual": residual}, "log": [["press", "finish"]]}
        )
        assert frame["disabled"] == ["finish", "step"]


def test_without_noise_the_rms_is_a_number() -> None:
    """A wall without noise, with most residuals zero, under a weight that discards pairs: this RMS was once NaN."""
    log = [["drag", "turn", 0.0, 0.0], ["press", "finish"]]
    text = texts(log, scene="wall", weight="tukey", noise=0.0, outliers=3.0, trim=7.0)
    assert float(text["rms"]) >= 0.0


def test_a_run_of_a_scene_turned_half_round_ends_on_the_wall() -> None:
    """A wall looks the same from behind: from 170° the fit is as good, but the pose is half a turn off."""
    fit: Run = begun(Ask("plane", "none", 0.0), scene_of("wall", SEED, 0.02, 0.0), room_start(170.0, 0.3)).finish()
    assert fit.course[-1].rms < 0.05
    assert fit.course[-1].rotation > 170.0
    assert abs(along_across(fit)[1]) < 0.1


def test_a_condition_number_of_thousands_has_a_comma() -> None:
    """1,361, as the chapter writes it."""
    assert re.fullmatch(r"\d,\d{3}", texts([["press", "finish"]], scene="wall", start="near")["condition"])


@pytest.mark.parametrize("weight", list(WEIGHTS))
def test_the_chart_of_the_weights_is_the_function_with_its_two_places(weight: str) -> None:
    """w and w r over r in units of s; lines at s and at the function's own k, which no weight has."""
    marks = weight_chart(run(weight=weight).run).marks
    k = 1.0 if weight == "none" else robust.TUNING[weight]
    lines = {m.role: np.asarray(m.xy) for m in marks if isinstance(m, Path) and m.thick}
    r, w = lines["accent"].T
    np.testing.assert_allclose(w, robust.weights(weight, r, k))
    np.testing.assert_allclose(lines["ink"][:, 1], lines["ink"][:, 0] * robust.weights(weight, lines["ink"][:, 0], k))
    guides = [m for m in marks if isinstance(m, Segments) and m.role == "guide"]
    upright = [np.stack([m.a, m.b]) for m in guides if np.ndim(m.a) == 1]
    places = [line[0, 0] for line in upright if line[0, 0] == line[1, 0]]
    assert places == ([1.0] if weight == "none" else [1.0, k])
    labels = {m.text: float(np.reshape(m.xy, 2)[0]) for m in marks if isinstance(m, Label)}
    assert labels.get("k") == (None if weight == "none" else k)


def test_the_weak_arrows_point_outwards_at_both_ends() -> None:
    fit = run(FINISH, scene="wall", start="near").run
    path, *tips = weak_direction(fit)
    course = np.asarray(path.xy)  # type: ignore[union-attr]
    for tip, end, inside in zip(tips, course[[0, -1]], course[[1, -2]], strict=True):
        assert isinstance(tip, Arrow)
        np.testing.assert_allclose(tip.b, end)
        np.testing.assert_allclose(tip.a, inside)


@RESIDUAL
def test_the_description_is_of_the_scene_and_the_residual_shown(residual: str) -> None:
    """Off the wall along and across it, in the scenes of walls only; covariances are a model for GICP alone."""
    room, wall = (frame_after(WIDGET, ["press", "step"], scene=s, residual=residual) for s in ("room", "wall"))
    assert "along the wall" not in room["description"]
    text = readouts(wall)
    assert f"off by {text['along']} u along the wall and {text['across']} u across it." in wall["description"]
    for frame in (room, wall):
        assert ("The covariances are a model" in frame["description"]) == (residual == "gicp")
    fit = run(STEP, scene="wall", residual=residual).run
    off = fit.pose.apply(fit.scene.source).mean(axis=0) - fit.scene.truth.apply(fit.scene.source).mean(axis=0)
    along, across = np.array([[8.0, 2.8], [-2.8, 8.0]]) / np.hypot(8.0, 2.8) @ off
    assert (text["along"], text["across"]) == (f"{abs(along):.2f}", f"{abs(across):.2f}")
