"""The claims of the chapter 'The landscape', checked against the solvers."""

from itertools import pairwise

import numpy as np
import pytest

from solvers import Pose, Status, register
from solvers.methods.mmd.capped_landscape import capped_field
from solvers.methods.mmd.landscape import mmd_field
from solvers.numerics.fourier_features import unit_frequencies
from solvers.scenes.rooms import ROOM, room
from solvers.studies.seeds import seeds
from widgets.figures.landscape.terrain import minima

SIDE = 63
AT = (np.arange(SIDE) + 0.5) / SIDE * 5.0 - 2.5
LATTICE = np.stack(np.meshgrid(*[(np.arange(7) - 3) * 5.0 / 7] * 2), axis=-1).reshape(-1, 2)
DRAWS = range(40, 50)


@pytest.fixture(scope="module")
def scene():
    """The clean room."""
    return room("clean")


def mmd(scene, length, draw=40, count=32):
    """MMD² over translations for one draw of the frequencies."""
    return mmd_field(scene.source, scene.target, unit_frequencies(np.array([draw]), count, 2)[0] / length)


def deepest(field):
    """The lowest tile of the figure's map, and how many minima the map has."""
    values = field.grid(AT, AT)
    row, column = np.unravel_index(values.argmin(), values.shape)
    return np.array([AT[column], AT[row]]), minima(values)


def basin(field):
    """How many of the 49 sown starts descend to the same place as the deepest tile does."""
    ends = field.path(np.vstack([deepest(field)[0], LATTICE])).points[-1]
    return int((np.hypot(*(ends[1:] - ends[0]).T) < 0.2).sum())


def test_neither_is_convex(scene):
    """Both objectives are bounded over the whole plane, and each has a segment whose middle lies above both ends."""
    rng = np.random.default_rng(1)
    a, b = rng.uniform(-40.0, 40.0, (2, 2000, 2))
    for field, bound in ((mmd(scene, 0.6), 4.0), (capped_field(scene.source, scene.target, 1.0), 1.0)):
        ends = np.stack([field.values(a), field.values(b)])
        assert ends.max() <= bound
        values = field.values(a / 16), field.values(b / 16), field.values((a + b) / 32)
        assert (values[2] > np.maximum(values[0], values[1]) + 1e-3).any()


def test_false_minima_stay_when_the_rotation_is_free(scene):
    """From each of the first figure's two wrong ends, a descent in all three parameters at the same length scale goes
    down, converges, and moves by less than 0.1 u and 3°."""
    ends = mmd(scene, 0.6).path(LATTICE).points[-1]
    wrong = np.unique(np.round(ends[np.hypot(*ends.T) > 0.5], 2), axis=0)
    assert len(wrong) == 2
    for end in wrong:
        run = register(
            scene.source, scene.target, "mmd", start=Pose.from_angle(0.0, end), lengths=(0.6,), count=32, seed=40
        )
        assert run.status is Status.CONVERGED
        assert run.objective < run.history.objective[0]
        assert np.hypot(*(run.pose.t - end)) < 0.1
        assert abs(np.degrees(run.pose.angle)) < 3.0


def test_a_larger_length_scale_often_leaves_fewer_minima(scene, why):
    """Of ten draws of 32 frequencies, nine have more than one minimum at ℓ = 0.3 u, six at 0.6 u, none at 1.2 u."""
    several = [sum(deepest(mmd(scene, length, draw))[1] > 1 for draw in DRAWS) for length in (0.3, 0.6, 1.2)]
    at = ("0.3 u", "0.6 u", "1.2 u")
    why("the length scale", {at[k]: f"{several[k]} of ten draws have several minima" for k in (2, 1, 0)})
    assert several == [9, 6, 0]


def test_a_larger_length_scale_can_shrink_the_basin(scene):
    """In one draw, 38 of 49 starts reach the deepest place at ℓ = 0.5 u, but only 20 at ℓ = 0.6 u."""
    assert [basin(mmd(scene, length, draw=44)) for length in (0.5, 0.6)] == [38, 20]


def test_a_large_length_scale_moves_the_minimum(scene, why):
    """At ℓ = 2.4 u with 128 frequencies, the only minimum is 0.35 to 0.45 u off in each of ten draws; with the target
    cut to what the source has seen, it is within 0.03 u of the truth."""
    ends = np.array([mmd(scene, 2.4, draw, 128).path(np.zeros(2)).points[-1] for draw in DRAWS])
    target, errors = overlapping(scene), []
    for draw in DRAWS:
        frequencies = unit_frequencies(np.array([draw]), 128, 2)[0] / 2.4
        errors.append(np.hypot(*mmd_field(scene.source, target, frequencies).path(np.zeros(2)).points[-1]))
    why(
        "what the target has seen",
        {
            "the whole room": f"{np.hypot(*ends.T).mean():.2f} u off on average",
            "what the source has seen": f"{np.mean(errors):.2f} u off",
        },
    )
    assert ((np.hypot(*ends.T) > 0.35) & (np.hypot(*ends.T) < 0.45)).all()
    assert all(deepest(mmd(scene, 2.4, draw, 128))[1] == 1 for draw in DRAWS)
    assert max(errors) < 0.03


def test_resampling_moves_the_minima(scene):
    """Ten draws of 32 frequencies at ℓ = 0.6 u have one to four minima, and basins of 20 to 49 of 49 starts."""
    fields = [mmd(scene, 0.6, draw) for draw in DRAWS]
    counts, basins = [deepest(f)[1] for f in fields], [basin(f) for f in fields]
    assert (min(counts), max(counts)) == (1, 4)
    assert (min(basins), max(basins)) == (20, 49)


def test_more_frequencies_agree_on_the_deepest_place(scene, why):
    """Ten draws at ℓ = 0.6 u: with 128 frequencies they all share the deepest tile; with 8, some of their deepest tiles
    lie more than 0.4 u apart."""
    spread = {}
    for count in (128, 8):
        lowest = np.array([deepest(mmd(scene, 0.6, draw, count))[0] for draw in DRAWS])
        spread[count] = np.linalg.norm(lowest[:, None] - lowest, axis=-1).max()
    why("the frequencies", {str(n): f"ten draws lie up to {gap:.2f} u apart" for n, gap in spread.items()})
    assert spread[128] == 0.0
    assert spread[8] > 0.4


def test_a_mean_over_the_pairs_in_reach_rewards_losing_points():
    """In each of two draws of the noisy room with τ = 0.3 u, some shift keeps at most four pairs within reach and has a
    smaller mean over them than the truth has over its own; the capped mean over all points is more than four times
    larger there."""
    for seed in (40, 53):
        scene = room("noise", seed=seed)
        field = capped_field(scene.source, scene.target, 0.3)
        at = np.linspace(-6.0, 6.0, 49)
        shifts = np.stack(np.meshgrid(at, at), axis=-1).reshape(-1, 2)
        squares = np.square(np.linalg.norm(scene.source[:, None] - scene.target, axis=2).min(axis=1))
        truth = squares[squares <= 0.09].mean()
        result = 0
        for shift in shifts[np.hypot(*shifts.T) > 5.0]:
            moved = scene.source + shift
            nearest = np.square(np.linalg.norm(moved[:, None] - scene.target, axis=2).min(axis=1))
            used = nearest <= 0.09
            if 0 < used.sum() <= 4 and nearest[used].mean() < truth:
                result += 1
                assert field.values(shift) > 4.0 * field.values(np.zeros(2))
                break
        assert result == 1


def test_the_long_walls_make_the_valley_along_x(why):
    """The clean room, τ = 1 u, 25 draws: half a unit along x raises the capped objective less than half as much as half
    a unit along y; without the source's points on walls along x more than five times as much."""
    corner, along = ROOM[:-1], np.diff(ROOM, axis=0)
    length = np.linalg.norm(along, axis=1)
    unit = along / length[:, None]
    steps = 0.5 * np.array([[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]])
    ratios = {"they are there": [], "they are left out": []}
    for seed in seeds(25):
        scene = room("clean", seed=seed)
        place = np.clip(((scene.source[:, None] - corner) * unit).sum(axis=2), 0.0, length)
        wall = np.linalg.norm(scene.source[:, None] - corner - place[..., None] * unit, axis=2).argmin(axis=1)
        across = np.abs(unit[wall, 0]) < 0.5
        for name, points in zip(ratios, (scene.source, scene.source[across]), strict=True):
            field = capped_field(points, scene.target, 1.0)
            rise = field.values(steps) - field.values([0.0, 0.0])
            ratios[name].append(rise[:2].mean() / rise[2:].mean())
    why(
        "the source's points on walls along x",
        {name: f"along x it rises {np.median(r):.1f} times as much as along y" for name, r in ratios.items()},
    )
    assert max(ratios["they are there"]) < 0.5
    assert min(ratios["they are left out"]) > 5.0


def test_kinks_point_upwards(scene):
    """Along a line the capped objective is continuous, and its slope jumps only downwards: into ridges, not pits."""
    field = capped_field(scene.source, scene.target, 0.6)
    x = np.linspace(-1.0, 1.0, 10001)
    values = field.values(np.stack([x, np.full_like(x, 0.3)], axis=1))
    steps = np.diff(values) / (x[1] - x[0])
    assert np.abs(np.diff(values)).max() < 1e-3
    jumps = np.diff(steps)
    assert jumps.max() < 2.5 * (x[1] - x[0])  # a quadratic's slope changes by at most 2 a unit
    assert (jumps < -1e-3).sum() > 50


def test_the_capped_slope_is_the_mean_offset(scene):
    """Between switches the gradient is −(2/M) Σ of the offsets of the pairs within τ, as central differences confirm.
    It is nonzero everywhere on a lattice over the window, and zero far away, where no pair is within τ."""
    field, M = capped_field(scene.source, scene.target, 0.6), len(scene.source)
    for shift in LATTICE + 0.013:
        offsets = scene.target[None] - (scene.source + shift)[:, None]
        offset = np.take_along_axis(offsets, np.square(offsets).sum(axis=2).argmin(axis=1)[:, None, None], axis=1)[:, 0]
        used = np.hypot(*offset.T) < 0.6
        gradient = -2.0 / M * offset[used].sum(axis=0)
        h = 1e-7
        differences = [field.values(shift + h * e) - field.values(shift - h * e) for e in np.eye(2)]
        np.testing.assert_allclose(np.array(differences) / (2 * h), gradient, atol=1e-4)
        assert np.hypot(*gradient) > 1e-4
    assert field.values([30.0, 0.0]) == field.values([30.1, 0.2]) == pytest.approx(0.36)


def test_a_wider_cap_leaves_fewer_minima_but_not_at_every_step(scene, why):
    """Over the slider's 29 positions, 0.2 to 3 u, the map's minima fall from 197 to one, which is reached at 2.1 u.
    Three steps to a wider cap add one: 0.7 to 0.8 u, 1.1 to 1.2 u and 1.4 to 1.5 u."""
    tenths = range(2, 31)
    counts = {t: deepest(capped_field(scene.source, scene.target, t / 10))[1] for t in tenths}
    why("the cap", {f"{t / 10:g} u": f"{counts[t]} minima" for t in (20, 10, 3, 2)})
    assert counts[2] == 197
    assert [t for t in tenths if counts[t] == 1] == list(range(21, 31))
    rises = {(a, b): counts[b] - counts[a] for a, b in pairwise(tenths) if counts[b] > counts[a]}
    assert rises == {(7, 8): 1, (11, 12): 1, (14, 15): 1}


def overlapping(scene):
    """The target's points, in order along the outline, from the first to the last that has a source point nearby."""
    near = np.linalg.norm(scene.target[:, None] - scene.source, axis=2).min(axis=1) < 0.15
    first, last = np.flatnonzero(near)[[0, -1]]
    return scene.target[first : last + 1]


def test_missing_dense_parts_move_mmd_and_not_the_nearest_distances(why):
    """Six draws of a room sampled ever more thinly: the lowest MMD² tile (ℓ = 0.6 u) lies 0.3 u from the truth, the
    lowest tile of the capped distances (τ = 1 u) within 0.1 u. With the target cut where the source ends, which removes
    over a sixth of its points, the MMD² tile is within 0.1 u too. With fewer frequencies, the tile depends more on
    their draw."""
    frequencies = unit_frequencies(np.array([40]), 4096, 2)[0] / 0.6
    scenes = [room("gradient", seed=seed) for seed in seeds(6)]
    whole = [np.hypot(*deepest(mmd_field(scene.source, scene.target, frequencies))[0]) for scene in scenes]
    errors = [np.hypot(*deepest(mmd_field(scene.source, overlapping(scene), frequencies))[0]) for scene in scenes]
    why(
        "what the target has seen",
        {
            "the whole room": f"MMD's deepest tile is {min(whole):.2f} to {max(whole):.2f} u off",
            "what the source has seen": f"{min(errors):.2f} to {max(errors):.2f} u off",
        },
    )
    assert 0.25 < min(whole) <= max(whole) < 0.35
    assert max(errors) < 0.1
    for scene in scenes:
        assert len(overlapping(scene)) < 5 / 6 * len(scene.target)
        assert np.hypot(*deepest(capped_field(scene.source, scene.target, 1.0))[0]) < 0.1
