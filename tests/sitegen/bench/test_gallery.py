"""The gallery of the docs: the printed snippets are those that ran, and the text agrees with their results."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import solvers
from sitegen.bench import gallery, gallery_run
from solvers import Pose
from solvers.walk_scenes import fish

ROOT = Path(__file__).resolve().parents[3]
DATA: dict[str, Any] = json.loads((ROOT / gallery.DATA).read_text("utf-8"))
FOUND: dict[str, dict[str, Any]] = DATA["tasks"]
TASKS = gallery.tasks()
PAGE = (ROOT / gallery.PAGE).read_text("utf-8")


def answer(task: str, module: str) -> Any:
    return np.array(FOUND[task][module]["matrix"])


def planar(matrix: Any) -> Any:
    """A spatial pose that keeps z, as a planar one."""
    rows = np.array([0, 1, 3])
    return matrix[np.ix_(rows, rows)]


def test_the_page_is_what_the_data_make_it() -> None:
    """Generating every table and snippet again changes nothing."""
    assert gallery.written(PAGE, DATA) == PAGE


def test_every_snippet_was_run_and_is_shown_as_it_is() -> None:
    """Each file belongs to a task, has an answer, and is on the page word for word."""
    run = {gallery.snippet(task, module) for task, modules in FOUND.items() for module in modules}
    assert run == set(gallery.CODE.iterdir())
    assert DATA["absent"] == {}
    for path in run:
        assert f"\n```py\n{path.read_text('utf-8')}```\n" in PAGE
        assert max(map(len, path.read_text("utf-8").splitlines())) <= 88


@pytest.mark.native
@pytest.mark.parametrize("name", TASKS)
def test_our_snippets_give_what_is_kept(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Today's solvers give the kept errors, to the printed digits."""
    monkeypatch.setattr(gallery_run, "FEWEST", 1)
    monkeypatch.setattr(gallery_run, "ENOUGH", 0.0)
    task = TASKS[name]
    report = gallery_run.run(gallery.snippet(name, "solvers"), list(task.given("solvers").values()))
    entry = FOUND[name]["solvers"]
    errors = gallery.errors(report["matrix"], task.truth)
    np.testing.assert_allclose(errors, [entry[key] for key in ("rotation", "translation", "scale")], atol=5e-6)
    assert len(report["seconds"]) == 1


def test_known_pairs_have_one_answer() -> None:
    """The three libraries' matrices agree to 1e-12, and so do the errors of a thousand fits."""
    ours = answer("pairs", "solvers")
    for theirs in (answer("pairs", "skimage"), planar(answer("pairs", "open3d"))):
        np.testing.assert_allclose(theirs, ours, rtol=0.0, atol=1e-12)
    for key in ("rotation", "translation"):
        assert FOUND["thousand"]["skimage"][key] == pytest.approx(FOUND["thousand"]["solvers"][key], abs=1e-12)


def test_ransac_ends_with_the_fit_of_the_right_pairs() -> None:
    """Ours and scikit-image's answers are the least-squares fit of the 24 right pairs; Open3D's is not."""
    clouds = TASKS["wrong"].clouds
    ours = answer("wrong", "solvers")
    residuals = clouds["source"] @ ours[:2, :2].T + ours[:2, 2] - clouds["target"]
    right = np.linalg.norm(residuals, axis=1) <= 0.2
    assert right.sum() == 24
    fit = solvers.fit_rigid(clouds["source"][right], clouds["target"][right]).pose.matrix
    np.testing.assert_allclose(ours, fit, atol=1e-12)
    np.testing.assert_allclose(answer("wrong", "skimage"), fit, atol=1e-12)
    assert np.abs(planar(answer("wrong", "open3d")) - fit).max() > 1e-3


def test_icp_ends_where_open3d_does() -> None:
    """Ours converges in fewer than 20 steps at tolerance zero; the two kept answers agree to 1e-9."""
    task = TASKS["scans"]
    zero = {"gate": 2.6, "max_steps": 20, "tolerance": 0.0, "rms_tolerance": 0.0}
    ours = solvers.register(task.clouds["source"], task.clouds["target"], "icp", start=task.start, **zero)
    assert ours.status.label == "converged"
    assert ours.steps < 20
    np.testing.assert_allclose(planar(answer("scans", "open3d")), answer("scans", "solvers"), atol=1e-9)
    assert np.abs(planar(answer("scans", "small_gicp")) - answer("scans", "solvers")).max() > 1e-4


def test_coherent_point_drift_has_one_answer() -> None:
    """Ours and pycpd's matrices, scale included, agree to 1e-9 after 50 iterations."""
    np.testing.assert_allclose(answer("soft", "pycpd"), answer("soft", "solvers"), atol=1e-9)


def test_the_text_on_who_is_quicker_is_what_was_measured() -> None:
    """For one small fit ours is slowest; Open3D is fastest with wrong pairs; in ICP both others are ten times
    faster."""
    seconds = {task: {module: line["seconds"] for module, line in lines.items()} for task, lines in FOUND.items()}
    assert max(seconds["pairs"], key=lambda module: seconds["pairs"][module]) == "solvers"
    assert min(seconds["wrong"], key=lambda module: seconds["wrong"][module]) == "open3d"
    assert all(10.0 * seconds["scans"][m] < seconds["scans"]["solvers"] for m in ("open3d", "small_gicp"))


def test_sizes_are_those_that_the_page_names() -> None:
    sizes = [len(task.clouds["source"]) for task in TASKS.values()]
    sizes += [len(task.clouds["target"]) for task in TASKS.values() if "target" in task.clouds]
    assert min(sizes) == 13
    assert max(sizes) == 160
    assert len(fish("noisy").source) == 150


@pytest.mark.parametrize("lifts", [False, True])
def test_errors_are_those_that_were_put_in(lifts: bool) -> None:
    """A pose off by 2°, 5 u and 10 % of scale; in space as in the plane."""
    truth = Pose.from_angle(np.radians(170.0), (1.0, 2.0), scale=2.0)
    result = Pose.from_angle(np.radians(-188.0), (4.0, 6.0), scale=2.2).matrix
    rotation, translation, scale = gallery.errors(result, truth)
    assert (rotation, translation, scale) == pytest.approx((2.0, 5.0, 0.1))
    if lifts:
        rigid = Pose.from_angle(np.radians(172.0), (4.0, 6.0)).matrix
        errors = gallery.errors(gallery.lifted(rigid), Pose.from_angle(np.radians(170.0), (1.0, 2.0)))
        assert errors == pytest.approx((2.0, 5.0, 0.0))


def test_a_tilt_out_of_the_plane_is_an_error_of_rotation() -> None:
    """The angle between the two rotations in space."""
    c, s = np.cos(0.3), np.sin(0.3)
    matrix = np.eye(4)
    matrix[1:3, 1:3] = [[c, -s], [s, c]]
    rotation, translation, scale = gallery.errors(matrix, Pose.identity())
    assert (rotation, translation, scale) == pytest.approx((np.degrees(0.3), 0.0, 0.0))


def test_a_library_that_is_absent_is_left_out_and_named(tmp_path: Path) -> None:
    """A snippet whose import fails is distinguished from one that is wrong."""
    lone = tmp_path / "lone.py"
    lone.write_text("import no_such_library\n", "utf-8")
    assert gallery_run.run(lone, []) == {"absent": "No module named 'no_such_library'"}
    without = {name: {m: line for m, line in lines.items() if m != "open3d"} for name, lines in FOUND.items()}
    importing = {module: s for module, s in DATA["importing"].items() if module != "open3d"}
    data = {**DATA, "tasks": without, "importing": importing, "absent": {"open3d": "No module named 'open3d'"}}
    page = gallery.written(PAGE, data)
    assert "import open3d" not in page
    assert "Open3D was not available: No module named 'open3d'." in page


def test_a_page_without_marks_is_an_error() -> None:
    with pytest.raises(ValueError, match="missing marks for pairs"):
        gallery.written("text", DATA)


@pytest.mark.native
def test_a_snippet_that_fails_leaves_page_and_data_alone(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The exit code is 1, here because a folder that is not a checkout has no runner."""
    assert gallery.gallery_command(tmp_path, Path(sys.executable)) == 1
    assert "the gallery could not be measured" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_a_python_that_is_not_there_is_a_mistyped_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert gallery.gallery_command(tmp_path, tmp_path / "python") == 2
    assert f"--gallery: no program at {tmp_path / 'python'}" in capsys.readouterr().err
