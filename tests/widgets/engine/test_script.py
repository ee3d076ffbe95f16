"""Show me the Python: each figure's script runs in its own interpreter and prints the figure's numbers."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import pytest

from tests.widgets.chosen import figures
from widgets.engine.contract import preset
from widgets.engine.controls import Spec, specs
from widgets.engine.host import Host
from widgets.engine.registry import WIDGETS
from widgets.engine.script import WIDTH, called, headed, literal

pytestmark = pytest.mark.native  # starts interpreters

ROOT = Path(__file__).resolve().parents[3]
# Runs every script of a list where only the standard library, numpy and solvers can be imported.
RUNNER = """
import contextlib, io, json, pickle, sys

class Nothing_else:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] not in {*sys.stdlib_module_names, "numpy", "solvers"}:
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)

sys.meta_path.insert(0, Nothing_else())
sys.path.insert(0, sys.argv[1])
import solvers, solvers.odometry

def once(function):  # these take seconds, and draw by a seed that is given: the same arguments are computed once
    found = {}
    def called(*args, **options):
        key = pickle.dumps((args, options))
        if key not in found:
            found[key] = pickle.dumps(function(*args, **options))
        return pickle.loads(found[key])
    return called

for module, names in ((solvers, ["register"]), (solvers.odometry, ["scan_to_scan", "verified", "close"])):
    for name in names:
        setattr(module, name, once(getattr(module, name)))
printed = []
for script in json.load(sys.stdin):
    out = io.StringIO()
    with contextlib.redirect_stdout(out):
        exec(compile(script, "script", "exec"), {"__name__": "__main__"})
    printed.append(out.getvalue())
sys.stdout.write(json.dumps(printed))
"""


def any_value(spec: Spec, random: Random) -> Any:
    """Return a random value that a control accepts."""
    if spec.kind == "slider":
        return spec.low + spec.step * random.randint(0, int((spec.high - spec.low) / spec.step + 1e-9))
    return random.choice(list(spec.options)) if spec.kind == "choice" else random.random() < 0.5


def any_action(name: str, frame: Mapping[str, Any], random: Random) -> list[Any] | None:
    """An action that a reader could take on this frame: press a button, drag a handle, or click or hover at a place."""
    widget = WIDGETS[name]
    presses = [b.name for b in widget.buttons if b.does == "press" and b.name not in frame["disabled"]]
    doable: list[list[Any]] = [["press", name] for name in presses]
    views = {panel["name"]: panel["view"] for panel in frame["panels"]}
    spots = [("drag", handle["name"], handle["panel"]) for handle in frame["handles"] if "sets" not in handle]
    spots += [("click", panel, panel) for panel in widget.clicks]
    spots += [("hover", panel, panel) for panel in widget.hovers]
    for kind, target, panel in spots:
        x0, x1, y0, y1, *_ = views[panel]
        doable.append([kind, target, round(random.uniform(x0, x1), 4), round(random.uniform(y0, y1), 4)])
    return random.choice(doable) if doable else None


def states(name: str, host: Host) -> Iterator[dict[str, Any]]:
    """Frames of a figure, for each preset: untouched, after some actions, after some with other controls and seed, and
    at the end of its tape's longest run."""
    widget = WIDGETS[name]
    for start in widget.presets:
        random = Random(f"{name} {start}")
        names = list(specs(widget.controls))
        for count, actions in ((0, 0), (0, 3), (2, 4)):
            subset = random.sample(names, min(count, len(names)))
            changes = {key: any_value(specs(widget.controls)[key], random) for key in subset}
            plain = preset(widget, start, changes).plain()
            plain["seed"] += 13 * count
            for _ in range(actions):
                action = any_action(name, host.render("f", plain, 0), random)  # coarse: offers the same actions
                if action is not None:
                    plain["log"].append(action)
            yield {**host.render("f", plain), "record": plain}
        for changes, presses in sorted(widget.tape, key=lambda run: len(run[1]))[-1:]:
            plain = {**preset(widget, start, changes).plain(), "log": [["press", press] for press in presses]}
            yield {**host.render("f", plain), "record": plain}


@pytest.fixture(scope="module")
def runs(request: pytest.FixtureRequest) -> dict[str, list[tuple[dict[str, Any], str]]]:
    """For every figure of this run: its frames, and what their scripts print."""
    host, names = Host(), figures(request)
    frames = [(name, frame) for name in names for frame in states(name, host)]
    scripts = list({frame["python"]: None for _, frame in frames})  # some states share a script
    process = subprocess.run(
        [sys.executable, "-I", "-c", RUNNER, str(ROOT)],
        input=json.dumps(scripts),
        capture_output=True,
        text=True,
        encoding="utf-8",
    )
    message = f"a script of {', '.join(names)} fails in an interpreter of its own:\n{process.stderr}"
    assert process.returncode == 0, message
    result: dict[str, list[tuple[dict[str, Any], str]]] = {name: [] for name in names}
    outputs = dict(zip(scripts, json.loads(process.stdout), strict=True))
    for name, frame in frames:
        result[name].append((frame, outputs[frame["python"]]))
    return result


@pytest.mark.parametrize("name", WIDGETS)
def test_a_script_prints_the_figures_numbers(name: str, runs: dict[str, list[tuple[dict[str, Any], str]]]) -> None:
    """With numpy and solvers alone, in every preset, after presses, drags and picks, with other controls and seeds."""
    for frame, text in runs[name]:
        output = dict(line.split(" ", 1) for line in text.splitlines())
        texts = {r["name"]: r["value"].replace("−", "-").replace(",", "") for r in frame["readouts"]}
        few = f"{name}: a script prints three readouts or more, as print(\"name\", value); this one:\n{frame['python']}"
        assert len(output) >= 3, few
        assert set(output) <= set(texts), f"{name}: {sorted(set(output) - set(texts))} are printed and no readouts"
        for readout, value in output.items():
            decimals = len(texts[readout].partition(".")[2])
            close = pytest.approx(float(texts[readout]), abs=0.51 * 10**-decimals)
            assert float(value) == close, (
                f"{name}: the script prints {value} for {readout}, the figure shows {texts[readout]}, "
                f"at {frame['record']}:\n{frame['python']}"
            )


@pytest.mark.parametrize("name", WIDGETS)
def test_a_script_is_fit_to_be_read(name: str, runs: dict[str, list[tuple[dict[str, Any], str]]]) -> None:
    """It begins with what to install, has no lines over 120 columns, and ends with a newline."""
    for frame, _ in runs[name]:
        lines = frame["python"].split("\n")
        assert lines[0].startswith("# pip install registration_ladder-")
        assert lines[1] == f"# The Registration Ladder: {WIDGETS[name].title}"
        assert max(map(len, lines)) <= 120, max(lines, key=len)
        assert lines[-1] == ""
        assert lines[-2]


def test_calls_are_broken_where_they_are_long() -> None:
    """One line if it fits; otherwise every line is within the width, with the arguments whole and in order."""
    assert called("x = f", "1", 'a="b"') == ['x = f(1, a="b")']
    arguments = [f"name{k}=({k}, {k})" for k in range(20)]
    lines = called("    x = f", *arguments, after=".pose")
    assert lines[0] == "    x = f("
    assert lines[-1] == "    ).pose"
    assert all(line.startswith("        ") and line.endswith(",") and len(line) <= WIDTH for line in lines[1:-1])
    assert " ".join(line.strip() for line in lines[1:-1]) == ", ".join(arguments) + ","


def test_a_line_may_be_as_long_as_the_width() -> None:
    """Of a call in one line, and of two arguments in one; with a character more they are parted. No line is empty, even
    if the first argument alone is too long for one."""
    whole = called("f", "a" * (WIDTH - 3))
    assert [len(line) for line in whole] == [WIDTH]
    assert called("f", "a" * (WIDTH - 2)) == ["f(", f"    {'a' * (WIDTH - 2)},", ")"]
    first, room = "a" * 30, WIDTH - len("    ") - 30 - len(", ,")
    assert called("longer", first, "b" * room)[1:-1] == [f"    {first}, {'b' * room},"]
    assert len(called("longer", first, "b" * room)[1]) == WIDTH
    assert called("longer", first, "b" * (room + 1))[1:-1] == [f"    {first},", f"    {'b' * (room + 1)},"]


def test_values_are_written_as_python() -> None:
    """Infinity by numpy's name, text in double quotes; an empty script stays empty."""
    assert [literal(v) for v in (np.inf, "huber", 0.5, (1.0,), None)] == ["np.inf", '"huber"', "0.5", "(1.0,)", "None"]
    assert headed("", "Title") == ""
