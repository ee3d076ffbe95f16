"""The race and its benchmark: nine contestants run the same batched as one by one, and measured against the truth."""

import numpy as np
import pytest

from solvers import METHODS, Pose, Status
from solvers.core.stepper import advance
from solvers.metrics import rre, rte
from solvers.scenes.rooms import room, room_start
from solvers.studies.benchmark import benchmark, entry, line, table
from solvers.studies.race import CONTESTANTS, EXTRAS, SEEDS, Contestant, Controls, contestants, race_problem
from solvers.studies.seeds import seeds

pytestmark = pytest.mark.filterwarnings("error::RuntimeWarning")

NAMES = [c.method for c in CONTESTANTS]


def _run(contestant, problem):
    batch = contestant.begin(problem)
    while not batch.done:
        batch = advance(batch)
    return batch


def test_nine_race_and_all_are_methods():
    assert NAMES == [
        "icp", "point-to-plane", "gicp", "ransac-congruent", "ndt", "soft-annealed", "mmd", "association-bp",
        "hypothesis-mixture",
    ]  # fmt: skip
    assert set(NAMES) <= set(METHODS)
    assert SEEDS[:3] == (40, 53, 66)
    assert seeds(25) == SEEDS
    assert len({c.label for c in CONTESTANTS}) == 9


@pytest.mark.parametrize("contestant", CONTESTANTS, ids=NAMES)
@pytest.mark.parametrize("setting", ["clean", "combo"])
def test_batched_as_one_by_one(contestant, setting):
    """A seed's run is the same alone and in a batch: the pose to 1e-9, the number of steps, and how it stopped.

    Not to the last bit, since older numpy versions sum a batch in another order, and the steps amplify that.
    """
    controls, seeds = Controls(setting=setting), SEEDS[:4]
    problem, _ = race_problem(controls, seeds)
    batch = _run(contestant, problem)
    for i, seed in enumerate(seeds):
        alone = _run(contestant, race_problem(controls, [seed])[0])
        assert np.abs(alone.pose().matrix[0] - batch.pose().matrix[i]).max() < 1e-9
        assert alone.steps[0] == batch.steps[i]
        assert alone.state().status[0] == batch.state().status[i]


@pytest.mark.parametrize("contestant", CONTESTANTS, ids=NAMES)
def test_every_contestant_can_win(contestant):
    """From 10° and 0.3 u in the clean room, each ends within 5° and 0.2 u on all of five seeds."""
    controls = Controls(degrees=10.0, distance=0.3, setting="clean")
    (result,) = benchmark(controls, seeds=SEEDS[:5], contestants=[contestant])
    assert result.close == 5
    assert (result.steps <= 70).all()
    assert (result.status != Status.RUNNING).all()


def test_extras_are_other_methods_and_can_win():
    """Nine more may race, none of them one of the nine; from 10° and 0.3 u in the clean room, each ends close on all of
    three seeds."""
    names = [c.method for c in EXTRAS]
    assert len(set(names)) == 9
    assert not set(names) & set(NAMES)
    assert contestants(["gmmreg", "icp"]) == (CONTESTANTS[0], EXTRAS[5])
    lines = benchmark(Controls(degrees=10.0, distance=0.3, setting="clean"), seeds=SEEDS[:3], contestants=EXTRAS)
    assert {x.contestant.label for x in lines if x.close == 3} == {c.label for c in EXTRAS}


def test_ransac_and_the_grid_ignore_the_start():
    """From another start, RANSAC's and correlative matching's answers are the same to the bit; ICP's is not."""
    for name, same in (("ransac-congruent", True), ("correlative", True), ("icp", False)):
        poses = []
        for degrees in (15.0, 120.0):
            problem, _ = race_problem(Controls(degrees=degrees), SEEDS[:3])
            poses.append(_run(contestants([name])[0], problem).pose().matrix)
        assert np.array_equal(*poses) == same


def test_a_line_is_what_its_run_was():
    """Errors, counts and medians match those recomputed here from the poses."""
    controls = Controls(setting="noise")
    problem, truth = race_problem(controls, SEEDS[:6])
    contestant = contestants(["soft-annealed"])[0]
    batch = _run(contestant, problem)
    result = line(contestant, batch, truth, 0.5)
    pose = batch.pose()
    degrees, distance = np.degrees(rre(pose, Pose.identity())), rte(pose, Pose.identity())
    assert np.allclose(result.rre, degrees)
    assert np.allclose(result.rte, distance)
    assert result.turned == (degrees < 5.0).sum()
    assert result.close == ((degrees < 5.0) & (distance < 0.2)).sum()
    assert result.median_rre == np.median(degrees)
    assert result.median_rte == np.median(distance)
    assert result.median_steps == np.median(batch.steps)
    assert sum(result.stops.values()) == 6
    assert result.seconds == 0.5
    second = benchmark(controls, seeds=SEEDS[:6], contestants=[contestant])[0]
    assert np.array_equal(second.pose.matrix, pose.matrix)
    assert second.seconds > 0.0


def test_an_unfinished_run_has_a_line_too():
    """After two steps the line gives the state so far: runs that have not stopped count as running."""
    problem, truth = race_problem(Controls(), SEEDS[:3])
    contestant = contestants(["mmd"])[0]
    batch = advance(advance(contestant.begin(problem)))
    result = line(contestant, batch, truth, 0.0)
    assert result.stops == {"running": 3}
    assert (result.steps == 2).all()


def test_an_entry_is_the_table_s():
    """An entry looked up by name equals the whole benchmark's; a wrong name is reported."""
    (expected,) = benchmark(Controls(degrees=30.0, setting="noise"), contestants=contestants(["gicp"]))
    for name in ("median_rre", "median_rte", "turned", "close", "median_steps"):
        assert entry("gicp", name, degrees=30.0, setting="noise") == getattr(expected, name)
    stops = {name: entry("gicp", name, degrees=30.0, setting="noise") for name in ("converged", "stalled", "running")}
    assert {k: v for k, v in stops.items() if v} == expected.stops
    with pytest.raises(ValueError, match="did you mean 'close'"):
        entry("gicp", "closed")
    with pytest.raises(ValueError, match=r"^method: 'gcip' is unknown, did you mean 'gicp'"):
        entry("gcip", "close")
    with pytest.raises(ValueError, match=r"^method: \['icp'\] is unknown"):
        entry(["icp"], "close")
    with pytest.raises(ValueError, match=r"^degrees: expected a number, got \[1\]"):
        entry("icp", "close", degrees=[1])


def test_progress_can_end_the_benchmark():
    methods = []

    def stop_at_third(contestant):
        methods.append(contestant.method)
        return len(methods) == 3

    lines = benchmark(Controls(), seeds=[40], progress=stop_at_third, max_steps=2)
    assert methods == NAMES[:3]
    assert [x.contestant.method for x in lines] == NAMES[:2]
    assert max(x.steps.max() for x in lines) <= 2


def test_overlap_and_density_change_only_what_they_say():
    """A smaller overlap removes target points and leaves the others; a density changes only the source's count."""
    full, part = room("combo", seed=53), room("combo", seed=53, overlap=0.6)
    assert np.array_equal(full.source, part.source)
    assert np.array_equal(full.target[: len(part.target)], part.target)
    assert len(part.target) == pytest.approx(0.6 * len(full.target), abs=1.5)
    assert np.array_equal(full.target_outlier[: len(part.target)], part.target_outlier)
    for setting in ("clean", "gradient", "striped"):
        usual, dense = room(setting, seed=53), room(setting, seed=53, density=2.0)
        assert np.array_equal(usual.target, dense.target)
        assert len(dense.source) == pytest.approx(2.0 * len(usual.source), rel=0.08)
        assert dense.source.min(axis=0) == pytest.approx(usual.source.min(axis=0), abs=0.15)


def test_controls_make_the_problems():
    """Each problem's start, seed and scene follow from the controls."""
    controls = Controls(degrees=30.0, distance=0.7, setting="outliers", overlap=0.8, density=1.5)
    problem, truth = race_problem(controls, [53, 66])
    expected = room("outliers", seed=66, overlap=0.8, density=1.5)
    assert np.array_equal(problem.source[1], expected.source)
    assert np.array_equal(problem.target[1], expected.target)
    assert np.array_equal(problem.start.matrix[1], room_start(30.0, 0.7).matrix)
    assert problem.seed.tolist() == [53, 66]
    assert np.array_equal(truth.matrix[0], np.eye(3))


@pytest.mark.parametrize(
    ("wrong", "name"),
    [
        ({"setting": "cave"}, "setting"), ({"noise": -1.0}, "noise"), ({"outliers": 1.5}, "outliers"),
        ({"overlap": 0.0}, "overlap"), ({"density": 0.0}, "density"), ({"degrees": np.nan}, "degrees"),
        ({"distance": -1.0}, "distance"),
    ],
)  # fmt: skip
def test_wrong_controls_are_named(wrong, name):
    with pytest.raises(ValueError, match=f"^{name}"):
        Controls(**wrong)


def test_wrong_seeds_and_contestants_are_named():
    with pytest.raises(ValueError, match="seeds"):
        race_problem(Controls(), [])
    for wrong, text in (
        (["icpp"], "'icpp' is unknown, did you mean 'icp'"),
        ([["icp"]], r"\['icp'\] is unknown; known"),
        ("icp", "expected a sequence of names of methods, got 'icp'"),
        (5, "expected a sequence of names of methods, got 5"),
        (["kabsch"], "'kabsch' does not race, because it needs pairs"),
        (["gnc"], "'gnc' does not race, because it needs pairs"),
        (["flow"], "'flow' does not race, because no options are chosen for it; those that race: .*icp"),
    ):
        with pytest.raises(ValueError, match=f"^contestants: {text}"):
            contestants(wrong)


def test_contestants_are_named_as_methods_are():
    assert contestants(["generalized-icp", "point-to-point"]) == contestants(["icp", "gicp"])
    assert contestants(name for name in ("ndt", "icp")) == contestants(["icp", "ndt"])
    easy = Controls(degrees=10.0, distance=0.2, setting="clean")
    (own,) = contestants(["ndt"])
    lines = benchmark(easy, seeds=SEEDS[:1], contestants=["generalized-icp", own, "icp"], max_steps=1)
    assert [x.contestant.method for x in lines] == ["gicp", "ndt", "icp"]


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"controls": 5}, "controls: expected Controls, got int"),
        ({"seeds": 5}, "seeds: expected a sequence of integers, got 5"),
        ({"seeds": np.array(5)}, r"seeds: expected a sequence of integers, got array\(5\)"),
        ({"seeds": "abc"}, "seeds: expected a sequence of integers, got 'abc'"),
        ({"seeds": [[40, 53]]}, "seeds: expected a sequence of integers, got"),
        ({"contestants": "icp"}, "contestants: expected a sequence of contestants or of names of methods, got 'icp'"),
        ({"contestants": CONTESTANTS[0]}, "contestants: expected a sequence of contestants"),
        ({"contestants": [5]}, "contestants: expected a Contestant, got int"),
        ({"contestants": ["umeyama"]}, "contestants: 'umeyama' does not race"),
        ({"contestants": [Contestant("gnc", "GNC")]}, "contestants: 'gnc' does not race, because it needs pairs"),
        ({"max_steps": "x"}, "max_steps: expected an integer, got 'x'"),
        ({"progress": 3}, "progress: expected a function, got 3"),
    ],
)
def test_what_is_no_benchmark_is_refused_before_anything_runs(wrong, message):
    with pytest.raises(ValueError, match=f"^{message}"):
        benchmark(**{"seeds": SEEDS[:1], **wrong})


def test_what_is_no_line_is_refused():
    (icp,) = contestants(["icp"])
    for wrong, text in (
        (("icp", None), "contestant: expected a Contestant, got str"),
        ((icp, None), "batch: expected a Batch, got NoneType"),
    ):
        with pytest.raises(ValueError, match=f"^{text}"):
            line(*wrong, Pose.identity(batch=(1,)), 0.0)
    with pytest.raises(ValueError, match=r"^lines: expected a sequence of Line, got 5"):
        table(5)
    with pytest.raises(ValueError, match=r"^lines: expected a Line, got Contestant"):
        table([icp])


@pytest.mark.native
def test_the_command_prints_the_table(capsys):
    from solvers.cli.command import main

    assert main(["benchmark", "--setting", "clean", "--seeds", "2", "--only", "icp", "mmd", "--max-steps", "3"]) == 0
    output = capsys.readouterr().out
    assert "clean, start 45° and 1.43 u, 2 seeds" in output
    assert "MMD-Reg" in output
    assert "2 capped" in output
    assert main(["benchmark", "--overlap", "7"]) == 2
    assert "overlap" in capsys.readouterr().err
    assert table(()).startswith("method")
