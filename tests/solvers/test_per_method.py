"""Methods as functions: their parameters, their docstrings, and the types that editors see."""

from __future__ import annotations

import ast
import inspect
from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any, get_args

import numpy as np
import pytest

import solvers
from solvers import METHODS, Pose, per_method, register
from solvers.core.registry import ALIASES, MethodName
from solvers.options import IcpOptions


@pytest.fixture
def clouds() -> tuple[np.ndarray, np.ndarray]:
    source = np.random.default_rng(40).normal(size=(40, 2))
    return source, Pose.from_angle(0.1, (0.1, -0.05)).apply(source)


@pytest.mark.native
def test_the_types_are_those_of_the_functions() -> None:
    from tests.solvers.stub import STUB, stub

    assert STUB.read_text("utf-8") == stub()


@pytest.mark.native
def test_what_editors_see_is_exported() -> None:
    """To Pyright, a typed package exports what is in `__all__`: of `solvers` that is the stub's too, which has all."""
    from tests.solvers.stub import STUB

    values = [node for node in ast.parse(STUB.read_text("utf-8")).body if isinstance(node, ast.AnnAssign)]
    (names,) = (node.value for node in values if ast.unparse(node.target) == "__all__")
    assert names is not None
    exported = {*solvers.__all__, *ast.literal_eval(names)}
    assert {*solvers._MODULES, *per_method.NAMES, *per_method.ALSO, "METHODS", "register"} <= exported
    front = ast.parse(Path(solvers.__file__).read_text("utf-8"))
    (types,) = (node for node in front.body if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING")
    assert [ast.unparse(node) for node in types.body] == [
        "import solvers._functions as _typed", "from solvers._functions import *", "__all__ += _typed.__all__",
    ]  # fmt: skip


def test_every_method_is_named_for_editors() -> None:
    assert get_args(MethodName) == tuple(METHODS)


@pytest.mark.parametrize("name", per_method.NAMES)
def test_a_function_takes_its_method_s_options_and_tells_them(name: str) -> None:
    """Its signature and docstring list the method's options, and nothing that the method refuses."""
    method, function = METHODS[per_method.NAMES[name]], getattr(solvers, name)
    parameters = list(inspect.signature(function).parameters)
    own = [option.name for option in fields(method.options)]
    assert parameters[:2] == ["source", "target"]
    assert parameters[2 : 2 + len(own)] == own
    assert ("pairs" in parameters, "weights" in parameters) == (method.paired, method.weighted)
    assert function.__name__ == name
    doc = inspect.getdoc(function)
    assert doc is not None  # the suite runs with docstrings kept
    assert all(f"\n{option} : " in doc for option in parameters)
    assert doc.index("Parameters\n---") < doc.index("Returns\n---")


def test_a_function_answers_as_register_does(clouds: tuple[np.ndarray, np.ndarray]) -> None:
    direct, by_name = solvers.icp(*clouds, gate=0.8, max_steps=5), register(*clouds, "icp", gate=0.8, max_steps=5)
    assert np.array_equal(direct.matrix, by_name.matrix)
    assert direct.method == "icp"
    with pytest.raises(ValueError, match="gat: no option of method 'icp', did you mean 'gate'"):
        solvers.icp(*clouds, gat=0.8)


def test_a_function_runs_its_own_method_alone(clouds: tuple[np.ndarray, np.ndarray]) -> None:
    message = r"^icp\(\) takes no method: it runs 'icp'; another is run by register\(source, target, 'ndt'\)$"
    with pytest.raises(TypeError, match=message):
        solvers.icp(*clouds, method="ndt")


def test_options_come_as_an_object_too(clouds: tuple[np.ndarray, np.ndarray]) -> None:
    whole = register(*clouds, options=IcpOptions(gate=0.8))
    assert np.array_equal(whole.matrix, register(*clouds, gate=0.8).matrix)
    with pytest.raises(ValueError, match="options: method 'gicp' takes GicpOptions, got IcpOptions"):
        register(*clouds, "gicp", options=IcpOptions())
    with pytest.raises(ValueError, match="trim: give the options as one object or one by one, not both"):
        register(*clouds, options=IcpOptions(), trim=0.1)


def test_the_field_s_names_are_understood(clouds: tuple[np.ndarray, np.ndarray]) -> None:
    """Common names for methods and for the gate work, but are not listed, so that each method is listed once."""
    assert {METHODS[name].name for name in ALIASES} == set(ALIASES.values())
    assert not set(ALIASES) & set(METHODS)
    assert all(name in METHODS for name in ALIASES)
    assert register(*clouds, "umeyama").method == "similarity"
    by_alias, report = register(*clouds, max_distance=0.8), register(*clouds, gate=0.8)
    assert np.array_equal(by_alias.matrix, report.matrix)
    with pytest.raises(ValueError, match="max_distance: is another name of gate; give one of them"):
        register(*clouds, gate=0.8, max_distance=0.8)
    capped = solvers.capped_icp(*clouds, max_distance=0.8)
    assert np.array_equal(capped.matrix, solvers.capped_icp(*clouds, cap=0.8).matrix)
    with pytest.raises(ValueError, match="max_distance: no option of method 'trimmed-icp'; it takes: keep"):
        register(*clouds, "trimmed-icp", max_distance=0.8)


@pytest.mark.parametrize(
    ("method", "wrong", "meant"),
    [
        ("icp", "init", "start"),
        ("icp", "initial", "start"),
        ("icp", "strat", "start"),
        ("gicp", "max_iterations", "max_steps"),
        ("gicp", "max_correspondence_distance", "gate"),
        ("capped-icp", "max_correspondence_distance", "cap"),
        ("ransac", "max_distance", "inlier"),
        ("ransac", "pair", "pairs"),
        ("icp", "wieght", "weight"),
        ("trimmed-icp", "overlap", "keep"),
        ("icp", "trim_ratio", "trim"),
        ("icp", "max_range", "gate"),
        ("capped-icp", "max_range", "cap"),
        ("ndt", "resolution", "cells"),
        ("ndt", "voxel_size", "cells"),
        ("correlative", "resolution", "cell"),
        ("ransac", "threshold", "inlier"),
        ("icp", "threshold", "gate"),
        ("cpd-rigid", "w", "clutter"),
        ("filterreg", "w", "clutter"),
    ],
)
def test_a_wrong_option_leads_to_the_right_one(
    method: str, wrong: str, meant: str, clouds: tuple[np.ndarray, np.ndarray]
) -> None:
    with pytest.raises(ValueError, match=f"^{wrong}: no option of method '{method}', did you mean '{meant}'[?];"):
        register(*clouds, method, **{wrong: 1.0})


@pytest.mark.parametrize("name", METHODS)
def test_of_a_wrong_option_it_is_told_what_the_method_itself_takes(
    name: str, clouds: tuple[np.ndarray, np.ndarray]
) -> None:
    """The message lists the method's options, adds pairs and weights only if it takes them, and suggests no options or
    callback for other words."""
    method = METHODS[name]
    names = [option.name for option in fields(method.options)]
    names += [word for word, flag in (("pairs", method.paired), ("weights", method.weighted)) if flag]
    for wrong in ("option", "callbak", "xyzzy"):
        with pytest.raises(ValueError, match=f"; it takes: {', '.join(names)}$") as error:
            register(*clouds, name, **{wrong: 1.0})
        assert not any(f"'{word}'" in str(error.value) for word in ("options", "callback"))


def test_functions_have_the_field_s_names_too() -> None:
    assert solvers.umeyama is solvers.similarity
    assert solvers.ransac_unpaired is solvers.ransac_congruent
    assert all(callable(getattr(solvers, name)) for name in per_method.ALSO)
    assert not set(per_method.ALSO) & {*per_method.NAMES, *dir(solvers)}


@pytest.mark.parametrize(
    ("wrong", "meant"),
    [
        ("cpd", "'cpd-rigid' or 'cpd-similarity'"),
        ("CPD", "'cpd-rigid' or 'cpd-similarity'"),
        ("ICP", "'icp'"),
        ("point_to_plane", "'point-to-plane'"),
        ("trimed-icp", "'trimmed-icp'"),
        ("umeyma", "'umeyama'"),
        ("generalised-icp", "'generalized-icp'"),
        ("Go-ICP", "'branch-and-bound'"),
        ("plicp", "'point-to-plane'"),
        ("svd", "'kabsch'"),
        ("coherent_point_drift", "'cpd-rigid' or 'cpd-similarity'"),
    ],
)
def test_a_wrong_name_leads_to_the_right_one(wrong: str, meant: str, clouds: tuple[np.ndarray, np.ndarray]) -> None:
    """A part, a typo or another author's name leads to the right one, also in `METHODS`; Go-ICP is no gicp."""
    message = f"'{wrong}' is unknown, did you mean {meant}[?]; known: association-bp, branch-and-bound"
    with pytest.raises(ValueError, match=f"method: {message}"):
        register(*clouds, wrong)
    with pytest.raises(KeyError, match=message):
        METHODS[wrong]


def test_methods_show_what_they_are() -> None:
    lines = repr(METHODS).splitlines()
    assert [line.split()[0] for line in lines] == list(METHODS)
    assert repr(METHODS["icp"]).startswith("<method 'icp': pairs of nearest points")
    doc = inspect.getdoc(METHODS["icp"])
    assert doc is not None
    assert "gate : float, default inf\n    Pairs farther apart" in doc


def test_modules_come_when_they_are_asked_for() -> None:
    assert solvers.metrics.rre(Pose.identity(), Pose.from_angle(0.5)) == pytest.approx(0.5)
    assert solvers.downsample.spacing(np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 2.0]])) > 0.0
    assert callable(solvers.verify.evidence)
    assert "icp" in dir(solvers)
    assert "verify" in dir(solvers)
    with pytest.raises(AttributeError, match="has no attribute 'nothing'"):
        _ = solvers.nothing


@pytest.mark.native
def test_debug_messages_tell_the_course(
    clouds: tuple[np.ndarray, np.ndarray], caplog: pytest.LogCaptureFixture
) -> None:
    """They report what is run, each step, and how it ended; without a listener nothing is logged."""
    with caplog.at_level("DEBUG", "solvers"):
        result = solvers.icp(*clouds)
    messages = [record.getMessage() for record in caplog.records]
    assert messages[0].startswith("icp: 40 points on to 40, a batch of 1, IcpOptions(gate=inf")
    assert len(messages) == 2 + result.steps
    assert messages[-1] == repr(result)
    caplog.clear()
    solvers.icp(*clouds)
    assert not caplog.records


def arrays(value: Any) -> Iterator[np.ndarray]:
    """All arrays in a result or a state, at any depth."""
    if isinstance(value, np.ndarray):
        yield value
    elif is_dataclass(value):
        yield from arrays(tuple(getattr(value, field.name) for field in fields(value)))
    elif isinstance(value, tuple):
        for item in value:
            yield from arrays(item)


@pytest.mark.parametrize("name", METHODS)
def test_a_result_stays_when_the_clouds_are_written_to(name: str, clouds: tuple[np.ndarray, np.ndarray]) -> None:
    """A result shares no memory with its inputs: its RMSE stays that of the data that were registered."""
    inputs = [*clouds, np.ones(len(clouds[0]))]
    weights = {"weights": inputs[2]} if METHODS[name].weighted else {}
    result = register(*clouds, name, max_steps=3, **weights)
    outputs = [array for array in arrays(result) if array.dtype != object]
    assert len(outputs) > 10
    assert not any(np.shares_memory(array, entry) for array in outputs for entry in inputs)
    before = result.rmse
    for entry in inputs:
        entry[:] = 7.0
    assert result.rmse == before


@pytest.mark.parametrize("name", METHODS)
def test_a_rigid_method_starts_at_scale_one(name: str, clouds: tuple[np.ndarray, np.ndarray]) -> None:
    """Rigid methods refuse a start with another scale, which some of them would keep and others drop."""
    start = Pose.from_angle(0.0, (0.0, 0.0), scale=1.25)
    if METHODS[name].scaled:
        assert register(*clouds, name, start=start).pose.scale == pytest.approx(1.0, abs=1e-6)
    else:
        message = rf"start.scale: scale the source first: method '{name}' finds rigid motions.* not 1.25"
        with pytest.raises(ValueError, match=message):
            register(*clouds, name, start=start)
    assert [method for method in METHODS if METHODS[method].scaled] == ["similarity", "cpd-similarity"]


@pytest.mark.parametrize("name", METHODS)
def test_a_width_does_not_end_above_its_beginning(name: str) -> None:
    """If a method has both, `last` above `first` is refused by name; equal values give a constant width."""
    options = METHODS[name].options
    if not {"first", "last"} <= {field.name for field in fields(options)}:
        return
    with pytest.raises(ValueError, match=r"^last: expected at most first"):
        options(first=0.1, last=0.5)
    assert options(first=0.5, last=0.5).last == 0.5
