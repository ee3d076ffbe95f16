"""The recorded drive as in its file, and simulated drives with their true poses."""

from __future__ import annotations

import hashlib

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from solvers import Pose
from solvers.odometry import straightened
from solvers.scenes.drive import Drive, chained, interlaced, telecom_loop
from solvers.scenes.drive_packing import packed, unpacked
from solvers.scenes.simulated_drive import simulated_drive


def test_the_recorded_drive_is_the_one_that_was_published() -> None:
    """225 × 361 whole centimetres, checked by a hash of the table in the data set's file; 11.5 % have no echo."""
    drive = telecom_loop()
    assert drive.ranges.shape == (225, 361)
    centimetres = np.where(np.isinf(drive.ranges), 0.0, 100.0 * drive.ranges)
    whole = np.rint(centimetres)
    assert np.abs(centimetres - whole).max() < 1e-9
    digest = hashlib.sha256(whole.astype("<u2").tobytes()).hexdigest()
    assert digest == "b91bdd532f212aa88d893866d53ff7bf616b708b09daf42036d18518a0898c11"
    assert np.isinf(drive.ranges).mean() == pytest.approx(0.1146, abs=1e-4)
    assert drive.seconds[-1] == pytest.approx(59.075)
    assert np.allclose(drive.motion.t[-1], (0.52931, 0.00808))
    assert float(drive.motion.angle[-1]) == pytest.approx(0.02823)


@given(
    st.integers(1, 5).flatmap(
        lambda k: st.lists(st.lists(st.integers(0, 30_000), min_size=k, max_size=k), min_size=1, max_size=5)
    )
)
def test_what_is_packed_is_unpacked(rows: list[list[int]]) -> None:
    table = np.array(rows)
    n, k = table.shape
    data = packed(np.zeros(n), np.zeros((n, 3)), table)
    assert (unpacked(data[4 + 16 * n :], n, k) == table).all()


def test_times_are_packed_in_milliseconds_and_motions_in_millionths() -> None:
    """After the numbers of scans and beams, rounded; so the recorded drive's come back."""
    data = packed(np.array([0.0, 1.2344]), np.array([[0.0] * 3, [0.5, -2e-6, 3.1415926]]), np.full((2, 3), 70))
    assert np.frombuffer(data[:4], "<u2").tolist() == [2, 3]
    assert np.frombuffer(data[4:36], "<i4").tolist() == [0, 0, 0, 0, 1234, 500_000, -2, 3_141_593]


def test_a_file_of_another_length_is_refused() -> None:
    data = packed(np.zeros(2), np.zeros((2, 3)), np.full((2, 3), 70))
    with pytest.raises(ValueError, match="5 beams, and 2 scans of 3 need 6"):
        unpacked(data[4 + 32 : -1], 2, 3)


@pytest.mark.parametrize("left", [1, 2])
def test_a_file_cut_within_a_long_difference_is_refused(left: int) -> None:
    """The number of beams alone is right: the last one's mark is there, but not both of its bytes."""
    data = packed(np.zeros(1), np.zeros((1, 3)), np.array([[70, 80, 900]]))[4 + 16 :]
    assert unpacked(data, 1, 3).tolist() == [[70.0, 80.0, 900.0]]
    with pytest.raises(ValueError, match="the data end within a difference of two bytes"):
        unpacked(data[: left - 3], 1, 3)


def test_ranges_are_packed_up_to_their_limits() -> None:
    table = np.array([[32767, 65534, 65535, 32768]])
    assert (unpacked(packed(np.zeros(1), np.zeros((1, 3)), table)[4 + 16 :], 1, 4) == table).all()


def test_a_scan_s_points_lie_at_their_ranges_from_the_laser() -> None:
    drive = telecom_loop()
    points = drive.points(10)
    echoes = drive.ranges[10][np.isfinite(drive.ranges[10])]
    assert np.allclose(np.linalg.norm(points - drive.mount.t, axis=1), echoes)
    assert len(drive.points(10, 5.0)) == (echoes <= 5.0).sum()


@pytest.mark.parametrize("missing", [0.0, np.inf, np.nan, -np.inf])
def test_a_beam_without_an_echo_is_no_point_at_the_laser(missing: float) -> None:
    """Many lasers report 0 if nothing came back, and so do the files that are read; ROS's −inf is too near."""
    ranges = [[2.0, missing, 1.0], [2.0, missing, 1.0]]
    drive = Drive([0.0, 1.0], Pose.identity(batch=(2,)), ranges, [-0.1, 0.0, 0.1], Pose.identity(), [0.0, 0.01, 0.02])
    assert drive.heard(0).tolist() == [True, False, True]
    assert np.linalg.norm(drive.points(0), axis=1) == pytest.approx([2.0, 1.0])
    assert [len(cloud) for cloud in straightened(drive)] == [2, 2]


def test_chained_motions_lead_where_composed_poses_do() -> None:
    motion = Pose.from_angle([0.0, 0.3, -0.2], [[0.0, 0.0], [1.0, 0.1], [0.5, 0.0]])
    last = motion[1].compose(motion[2])
    assert np.allclose(chained(motion).t[2], last.t)
    assert np.allclose(chained(motion).R[2], last.R)


def test_a_simulated_scan_at_the_truth_lies_on_the_walls_of_all_others() -> None:
    """Without noise, a scan at its true pose lies on the echoes of the next one, to 0.1 m in the median; without slip
    the odometry is the truth."""
    drive, truth = simulated_drive(scans=40, noise=0.0, slip=0.0)
    assert np.allclose(chained(drive.motion).t, truth.t)
    assert np.allclose(truth.t[0], 0.0)
    a, b = truth[10].apply(drive.points(10)), truth[11].apply(drive.points(11))
    gap = np.linalg.norm(a[:, None] - b[None], axis=2).min(axis=1)
    assert np.median(gap) < 0.1


@pytest.mark.parametrize(("name", "value"), [("scans", 1), ("beams", 2), ("noise", -1.0), ("slip", -0.1), ("seed", -1)])
def test_a_drive_that_cannot_be_is_refused(name: str, value: float) -> None:
    with pytest.raises(ValueError, match=name):
        simulated_drive(**{name: value})  # type: ignore[arg-type]


def test_noise_as_large_as_the_ranges_leaves_fewer_echoes() -> None:
    """A range that noise makes negative is not an echo, and does not raise an error about arguments that nobody
    gave."""
    quiet, loud = (simulated_drive(scans=4, noise=noise)[0] for noise in (0.0, 3.0))
    assert (loud.ranges > 0.0).all()
    assert 0.5 < np.isfinite(loud.ranges).sum() / np.isfinite(quiet.ranges).sum() < 1.0


def test_without_other_errors_the_odometry_turns_by_a_tenth_of_the_slip_for_each_metre() -> None:
    """On average over seeds, as documented."""
    _, truth = simulated_drive(seed=0)
    step = truth[:-1].inverse().compose(truth[1:])
    errors = [simulated_drive(seed=seed, slip=0.1, beams=3)[0].motion.angle[1:] - step.angle for seed in range(100)]
    assert np.mean(errors) / np.linalg.norm(step.t, axis=1).mean() == pytest.approx(0.1 * 0.1, rel=0.1)


def test_a_scan_that_is_not_there_is_refused() -> None:
    drive, _ = simulated_drive(scans=3)
    for tell in (drive.points, drive.heard):
        with pytest.raises(ValueError, match=r"^k: expected a scan from 0 to 2, got 99"):
            tell(99)
        for wrong in (-1, 1.5, None):
            with pytest.raises(ValueError, match=r"^k: "):
                tell(wrong)  # type: ignore[arg-type]
        for distance in (float("nan"), "a", None):
            with pytest.raises(ValueError, match=r"^farthest: expected a"):
                tell(0, distance)  # type: ignore[arg-type]
        assert len(tell(np.int64(2)))


@pytest.mark.parametrize(
    ("motion", "message"),
    [
        (None, "expected a Pose, got NoneType"),
        (simulated_drive(scans=3)[0], r"expected a Pose, got Drive; pass drive\.motion"),
        (Pose.identity(), r"expected motions of shape \(n,\), got \(\)"),
        (Pose.identity(2, (2, 3)), r"expected motions of shape \(n,\), got \(2, 3\)"),
    ],
)
def test_what_is_no_chain_of_motions_is_refused(motion: Pose, message: str) -> None:
    with pytest.raises(ValueError, match=f"^motion: {message}"):
        chained(motion)


def test_a_motion_has_no_scale() -> None:
    """A scale would silently be lost, so it is refused."""
    with pytest.raises(ValueError, match=r"^motion\.scale: a robot's motion has scale 1, not 2"):
        chained(Pose.from_angle(np.zeros(2), np.zeros((2, 2)), [1.0, 2.0]))


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(
    ("name", "value"),
    [("beams", -1), ("beams", 0), ("beams", 5.0), ("turns", 0), ("turns", 1.5), ("step", float("nan")), ("step", "a"),
     ("period", -1.0), ("period", None)],
)  # fmt: skip
def test_beams_that_cannot_be_sent_are_refused(name: str, value: object) -> None:
    with pytest.raises(ValueError, match=f"^{name}: "):
        interlaced(**{"beams": 5, "step": 0.1, name: value})  # type: ignore[arg-type]


PARTS = {
    "seconds": [0.0, 0.5],
    "motion": Pose.identity(batch=(2,)),
    "ranges": [[1.0, 2.0, 3.0], [1.0, np.inf, np.nan]],
    "bearings": [-0.5, 0.0, 0.5],
    "mount": Pose.identity(),
}


def test_a_drive_is_made_of_lists_and_of_matrices() -> None:
    """They are copied, and any finite range is an echo."""
    ranges = np.array(PARTS["ranges"])
    parts = {**PARTS, "motion": np.stack([np.eye(3)] * 2), "mount": np.eye(3), "ranges": ranges, "delays": [0, 1, 2]}
    drive = Drive(**parts)  # type: ignore[arg-type]
    ranges[0] = -1.0
    assert drive.points(0).shape == (3, 2)
    assert drive.heard(1).tolist() == [True, False, False]
    for name in ("seconds", "ranges", "bearings", "delays"):
        assert getattr(drive, name).dtype == np.float64
        assert not getattr(drive, name).flags.writeable
    assert (drive.motion.batch, drive.mount.batch) == ((2,), ())


def test_a_drive_begins_at_the_identity() -> None:
    """Whatever the first motion given, it becomes the identity; the others are kept."""
    motion = Pose.from_angle([0.3, 0.2], [(1.0, 2.0), (0.5, 0.1)])
    result = Drive(**{**PARTS, "motion": motion}).motion  # type: ignore[arg-type]
    assert np.array_equal(result[0].matrix, np.eye(3))
    assert np.array_equal(result[1].matrix, motion[1].matrix)


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("seconds", [0.0, 0.5, 1.0], r": expected shape \(2,\), one per scan, got \(3,\)"),
        ("seconds", [0.0, np.nan], ": 1 of 2 numbers is not finite"),
        ("seconds", [0.0, -0.5], ": scan 1 is at -0.5, before the scan before it, at 0"),
        ("seconds", "x", ": expected real numbers, got str"),
        ("motion", Pose.identity(), r": expected motions of shape \(2,\), one per scan, got \(\)"),
        ("motion", Pose.identity(3, (2,)), ": moves points in 3 dimensions"),
        ("motion", Pose(np.eye(2), np.zeros((2, 2)), 2.0), r"\.scale: expected rigid motions, of scale 1"),
        ("motion", None, ": expected a Pose, got NoneType"),
        ("motion", [[0.0, 0.0, 0.0]] * 2, r": is neither .* got \(2, 3\); Pose\.from_angle\(radians, \(x, y\)\)"),
        ("ranges", [1.0, 2.0, 3.0], r": expected shape \(n, k\), one row per scan, got \(3,\)"),
        ("ranges", np.zeros((0, 3)), r": expected shape \(n, k\), one row per scan, got \(0, 3\)"),
        ("ranges", [[1.0, 2.0, -3.0]] * 2, ": must not be negative, but the smallest is -3; 0, inf or nan stands"),
        ("ranges", [[-np.inf, np.nan, -2.0]] * 2, ": must not be negative, but the smallest is -2; "),
        ("ranges", [[1.0, 2.0, 1e200]] * 2, ": beyond 1e.150 squares overflow"),
        ("ranges", [[1.0, 2.0], [1.0]], ": rows of unequal length"),
        ("bearings", [-0.5, 0.5], r": expected shape \(3,\), one per beam, got \(2,\)"),
        ("bearings", [-90.0, 0.0, 90.0], ": expected radians from −2π to 2π, but there is one of 90; numpy.radians"),
        ("bearings", [-0.5, 0.0, np.inf], ": 1 of 3 numbers is not finite"),
        ("mount", Pose.identity(batch=(2,)), r": expected a single pose, got \(2,\)"),
        ("mount", Pose.identity(3), ": moves points in 3 dimensions"),
        ("mount", None, ": expected a Pose, got NoneType"),
        ("delays", [0.0, 0.1], r": expected shape \(3,\), one per beam, got \(2,\)"),
        ("delays", [0.0, 0.1, np.nan], ": 1 of 3 numbers is not finite"),
    ],
)  # fmt: skip
@pytest.mark.filterwarnings("error")
def test_what_is_no_drive_is_refused_by_name(name: str, value: object, message: str) -> None:
    with pytest.raises(ValueError, match=f"^{name}{message}"):
        Drive(**{**PARTS, name: value})  # type: ignore[arg-type]
