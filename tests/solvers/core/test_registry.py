"""The list of methods: names without imports, modules loaded on demand."""

from __future__ import annotations

import copy
import pickle
import re
import subprocess
import sys
from dataclasses import fields, is_dataclass, replace
from pathlib import Path
from typing import Any, get_args

import numpy as np
import pytest
from numpy.random import Generator

import solvers
from solvers import METHODS, Pose, options
from solvers.core.method import Problem
from solvers.core.registry import MethodName
from solvers.core.stepper import advance, begin
from solvers.studies.race import CONTESTANTS, EXTRAS
from solvers.uncertainty import closed_form


def test_each_method_stands_under_its_own_name() -> None:
    assert {name: METHODS[name].name for name in METHODS} == {name: name for name in METHODS}
    assert len(METHODS) == len(set(METHODS))


@pytest.mark.native
def test_a_method_is_named_wherever_methods_are() -> None:
    """Lists all that a new method still needs, beside its module and its line in the registry, in one failure."""
    from tests.solvers.stub import STUB, stub
    from widgets.figures.own_clouds.methods import OWN  # here: the page's Python has no figures
    from widgets.figures.race.field import ENTRIES

    page = "content/docs/package.md"
    text = (Path(__file__).resolve().parents[3] / page).read_text("utf-8")
    paragraph = re.search(r"^`solvers\.METHODS` names what there is:.*?\n\n", text, re.MULTILINE | re.DOTALL)
    assert paragraph, f"{page}: no paragraph begins with: `solvers.METHODS` names what there is:"
    names = set(re.findall(r"`([a-z0-9-]+)`", paragraph[0]))
    alone = {name for name, method in METHODS.items() if not method.paired and 2 in (method.dims or (2,))}
    words = r"[a-z][a-z0-9]*(-[a-z0-9]+)*"
    own = "widgets/figures/own_clouds/methods.py"
    classes = {method.options.__name__ for method in METHODS.values()}
    to_do = [
        *(f"solvers/core/registry.py: {name!r} is to be words of lower-case letters and digits, joined by hyphens:"
          " it stands in links and on command lines" for name in METHODS if not re.fullmatch(words, name)),
        *(f"solvers/core/registry.py: add {name!r} to MethodName, in the list's order" for name in METHODS
          if name not in get_args(MethodName)),
        *(f"solvers/options.py: import {one} and name it in __all__" for one in classes - set(options.__all__)),
        *(f"{page}: name `{name}` in the list of methods" for name in METHODS if name not in names),
        *(f"{page}: {name} is no method any more; take it off the list" for name in names - set(METHODS)),
        *(f"{own}: give {name!r} an Own(…): its button's label, what a length and a share are to it;"
          " readers run their own clouds through it" for name in METHODS if name in alone - set(OWN)),
        *(f"{own}: take {name!r} away; it is no method that works in the plane without pairs"
          for name in set(OWN) - alone),
        *(f"widgets/figures/race/field.py: {one.method!r} races, so give it a row: its name in the chart, its line, a"
          " note" for one in (*CONTESTANTS, *EXTRAS) if one.method not in ENTRIES),
        *([] if STUB.read_text("utf-8") == stub() else ["last, run .venv/bin/python -m tests.solvers.stub: it writes"
          f" the types in solvers/{STUB.name}"]),
    ]  # fmt: skip
    assert not to_do, "still to do:\n" + "\n".join(to_do)


@pytest.mark.native
def test_what_core_hands_over_to_rooms_above_it_by_name_is_two_things() -> None:
    """Import rules cannot see modules loaded by name. In core, these are just the methods and the closed-form
    covariance; both exist, and the rest of the package loads nothing by name except at its front door."""
    root = Path(solvers.__file__).parent
    loads = {
        path.relative_to(root).as_posix(): re.findall(r"import_module\(f?\"(solvers[\w.]*)", path.read_text("utf-8"))
        for path in root.rglob("*.py")
        if re.search(r"\b(import_module|__import__)\(", path.read_text("utf-8"))
    }
    assert loads == {
        "__init__.py": ["solvers.", "solvers.per_method"],
        "core/registry.py": ["solvers.methods."],
        "core/result.py": ["solvers.uncertainty.closed_form"],
    }
    assert [closed_form.__name__] == loads["core/result.py"]
    assert callable(closed_form.offered)


def test_an_unknown_name_is_a_key_error() -> None:
    assert "no such" not in METHODS
    with pytest.raises(KeyError):
        METHODS["no such"]


@pytest.mark.native
def test_a_method_is_imported_when_it_is_asked_for_and_not_by_its_name() -> None:
    code = """
import sys, solvers
assert "cpd-rigid" in solvers.METHODS and len(list(solvers.METHODS)) == len(solvers.METHODS)
before = "solvers.methods.soft.cpd" in sys.modules
solvers.METHODS["cpd-rigid"]
print(before, "solvers.methods.soft.cpd" in sys.modules)
"""
    process = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert process.stdout.split() == ["False", "True"]


def count_locked(value: Any) -> int:
    """Make all arrays of a state read-only; return how many there are."""
    if isinstance(value, np.ndarray):
        value.flags.writeable = False
        return 1
    if is_dataclass(value):
        return sum(count_locked(getattr(value, field.name)) for field in fields(value))
    return sum(map(count_locked, value)) if isinstance(value, tuple) else 0


@pytest.mark.parametrize("name", list(METHODS))
def test_a_step_writes_into_nothing_that_it_is_given(name: str, rng: Generator) -> None:
    """Callers may keep states, and the states before the first step are shared with them."""
    target = rng.standard_normal((2, 40, 2)) @ np.diag([3.0, 1.0])
    source = Pose.from_angle([0.2, -0.3], (0.1, 0.2)).inverse().apply(target)
    problem = Problem(source, target, np.ones((2, 40)), Pose.identity(2, (2,)), np.array([40, 53], dtype=np.int64))
    batch = begin(METHODS[name], problem, max_steps=4)
    while not batch.done:
        assert count_locked(batch.whole) + count_locked(batch.part) > 10
        batch = advance(batch)
    assert batch.steps.max() > 0


@pytest.mark.parametrize("name", METHODS)
def test_a_method_is_pickled_by_its_name(name: str) -> None:
    """So that a run can be set aside and a pool of processes handed a method, whatever its functions are."""
    assert pickle.loads(pickle.dumps(METHODS[name])) is METHODS[name]
    assert copy.deepcopy(METHODS[name]) is METHODS[name]


def test_a_run_set_aside_goes_on_as_before(rng: Generator) -> None:
    points = rng.standard_normal((1, 9, 2))
    problem = Problem(points, points + 0.1, np.ones((1, 9)), Pose.identity(batch=(1,)), np.array([40]))
    run = begin(METHODS["graduated-nonconvexity"], problem, METHODS["graduated-nonconvexity"].options(inlier=0.1), 50)
    later = advance(pickle.loads(pickle.dumps(run)))
    assert np.array_equal(later.state().pose.matrix, advance(run).state().pose.matrix)


def test_a_method_of_ones_own_is_pickled_as_it_is() -> None:
    own = replace(METHODS["icp"], name="own")
    twin = pickle.loads(pickle.dumps(own))
    assert (twin.name, twin.step) == ("own", METHODS["icp"].step)
    assert twin is not own
