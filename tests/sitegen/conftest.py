"""A small site to build: two chapters, references, a test to claim, and a widget with a control of each kind."""

from __future__ import annotations

import re
import shutil
import subprocess
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from html import unescape
from pathlib import Path
from time import perf_counter
from typing import Any, get_args

import pytest

from sitegen.cache.store import Kind
from sitegen.external import fetch
from sitegen.figures.gallery import Plot
from sitegen.figures.matplotlib_svg import COLOURS
from sitegen.pages.views import Bytecode
from sitegen.pipeline.build import Report, build
from sitegen.pipeline.context import Parts
from sitegen.problems import BuildFailed
from widgets.drawing.picture import Panel, Picture, Points, Readout, View, number
from widgets.engine.contract import Action, Button, Key, Widget
from widgets.engine.controls import choice, slider, toggle
from widgets.engine.jobs import Column, Job, Progress, Result, Row

ROOT = Path(__file__).resolve().parents[2]

SITE = """\
title: A <small> & "quoted" site
description: Two chapters to test with.
author: A. Tester
year: 2026
url: https://example.org/ladder
report: https://example.org/issues/new?title={title}&page={page}
licence:
  name: CC BY 4.0
  url: https://creativecommons.org/licenses/by/4.0/
ladder:
  - {rung: "0", title: Start}
  - {rung: "1", title: Known}
  - {rung: "2", title: Not yet written}
macros:
  '\\R': '\\mathbb{R}'
"""

START = """\
---
title: Start here
rung: "0"
summary: Where one starts.
---

Read :ref[second] next, or [its section](01-second.md#deep). Then the [references](references.html#ref-one2001).
"""

SECOND = """\
---
title: The </title><script>alert(1)</script> second
slug: second
rung: "1"
question: Is it "escaped"?
summary: It is <b>not</b> bold.
redirects: [old-second]
---

A first paragraph with $a^2 \\in \\R$ and a note.[^n] It cites [@one2001; @two2002, §3].

::figure[The *caption*: see :ref[eq:energy] and $x$.]{toy preset=default id=demo noise=0.5}

## A section {#deep}

$$
E = m c^2
$$ (energy)

By :ref[eq:energy], :ref[fig:demo] shows :readout[demo presses]{press=go*2} presses and
:value[solvers.core.validate.number(-7.25, "x")]{.3f}. :claim[It *holds*.]{tests/test_claimed.py::test_it_holds}

### Deeper

::try[Press **go** twice.]{demo noise=0.25 press=go,go}
::try[The other scene.]{demo scene=noisy loud=true seed=5}

| a | b |
| --- | --- |
| $y$ | `code` |

```python
print("<hello>")
```

::aside[Beside the *point*.]

[^n]: The note, with [@one2001] and $z$.
"""

REFERENCES = """\
one2001:
  authors: [Ada One]
  title: First things
  year: 2001
  doi: 10.1000/one
  note: It came first.

two2002:
  authors: [Ben Two, Cy van der Three, Di Four]
  title: "More & <more>?"
  year: 2002
  url: https://example.org/two
"""

CLAIMED = '''\
"""Tests to claim."""


def test_it_holds() -> None:
    """What holds & what <does not>."""
    assert 1 < 2


class TestGroup:
    def test_inside(self) -> None:
        """Inside a class."""
        assert True
'''


@dataclass(frozen=True)
class Controls:
    """One control of each kind; a scene brings its own noise."""

    scene: str = choice(
        "clean", "Scene", {"clean": "Clean", "noisy": "Noisy </script>"}, sets={"noisy": {"noise": 0.9}}
    )
    noise: float = slider(0.1, "Noise", 0.0, 1.0, 0.05, "u")
    loud: bool = toggle(False, "Loud")


@dataclass(frozen=True)
class State:
    controls: Controls
    seed: int
    presses: int = 0


def draw(state: State) -> Picture:
    view = View(0.0, 1.0, 0.0, 1.0)
    marks = (Points([[state.controls.noise, 0.1 * state.presses]], "source"),)
    readouts = (
        Readout("presses", "Presses", str(state.presses)),
        Readout("noise", "Noise", number(state.controls.noise), "u"),
    )
    words = f"</script> {state.presses} presses of {state.controls.scene} with seed {state.seed}."
    return Picture((Panel("main", "A point & more", view, marks),), readouts, words)


def count(controls: Controls, seed: int, part: str) -> Iterator[Progress]:
    """A job of one part in two pieces, whose times differ from run to run."""
    yield Progress(0.5, "half")
    yield Progress(1.0, "done", [seed, perf_counter()])


def counted(controls: Controls, outcomes: Mapping[str, Any]) -> Result:
    seed, time = outcomes["all"]
    columns = (Column("noise", "Noise & <more>", "u", 2), Column("time", "Time", "ms", timed=True))
    rows = (Row("one", "One </script>", (controls.noise, time), "truth", dashed=True),)
    panel = Panel("dots", "Dots", View(0.0, 1.0, 0.0, 1.0), (Points([[controls.noise, 0.5]], "truth"),))
    return Result(f"On seed {seed}.", "Row", columns, rows, (panel,), "print(1)")


TOY = Widget(
    name="toy",
    title="A toy",
    controls=Controls,
    presets={"default": {}, "noisy": {"scene": "noisy"}},
    start=State,
    act=lambda state, action: _act(state, action),
    draw=draw,
    buttons=(Button("go", "Go", primary=True), Button("back", "Back", "back"), Button("new", "New", "reseed")),
    legend=(Key("source", "a point"),),
    tape=(({}, ("go", "go", "go")), ({"scene": "noisy"}, ("go",))),
    jobs=(Job("count", "Count & tell", lambda controls: ("all",), count, counted),),
)


@dataclass(frozen=True)
class Counted:
    """The result of the small site's plot."""

    dots: tuple[tuple[float, float], ...]


def draw_count(result: Counted, figure: Any, narrow: bool) -> None:
    axes = figure.subplots()
    x, y = zip(*result.dots, strict=True)
    axes.plot(x, y, "o-", color=COLOURS["source"])
    axes.fill_between(x, y, color=COLOURS["truth"], alpha=0.2, linewidth=0)
    axes.set_title("narrow & <small>" if narrow else "wide & <large>")


TOY_PLOT = Plot(
    name="toy-plot",
    title="A toy's \"plot\"",
    result=Counted,
    compute=lambda: Counted(((0.0, 1.0), (1.0, 3.5), (2.0, 2.0))),
    draw=draw_count,
    words=lambda result: f"{len(result.dots)} dots & <words>.",
    table=lambda result: (["x", "y"], [[f"{x:g}", f"{y:g}"] for x, y in result.dots]),
    numbers={"highest": lambda result, times=1: times * max(y for _, y in result.dots)},
    sizes={"wide": (400, 200), "narrow": (200, 200)},
    code="code",
    look="look",
)


def _act(state: State, action: Action) -> State:
    return State(state.controls, state.seed, state.presses + (action.name == "go"))


def policy_of(page: str) -> str:
    """The policy stated by a page."""
    (content,) = re.findall(r'http-equiv="Content-Security-Policy" content="([^"]*)"', page)
    return unescape(content)


def fresh_cache(folder: Path) -> Path:
    """A cache that holds only the programs for formulas and scripts, copied from the user's cache."""
    programs = fetch.gather(["temml", "esbuild"])
    for path in (programs["temml/dist/temml.mjs"].parents[1], programs["esbuild/esbuild.wasm"].parent):
        shutil.copytree(path, folder / "outside" / path.name)
    return folder


def cache_without_drawings(cache: Path, folder: Path) -> Path:
    """A cache that shares everything but drawings with another: for a figure whose functions a test has replaced, which
    no hash of its code shows."""
    for kind in {*get_args(Kind), "outside"} - {"drawings", "frames", "plots"}:
        (cache / kind).mkdir(exist_ok=True)
        folder.mkdir(exist_ok=True)
        (folder / kind).symlink_to(cache / kind)
    return folder


@pytest.fixture(scope="session")
def cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """The cache that the tests share."""
    with pytest.MonkeyPatch.context() as patch:
        # All projects have the same templates, but in separate folders, by which Jinja would tell them apart.
        patch.setattr(Bytecode, "get_cache_key", lambda self, name, filename=None: name)
        yield fresh_cache(tmp_path_factory.mktemp("cache"))


def contents(folder: Path) -> dict[str, bytes]:
    """The files in a folder and those below, by path."""
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def git(root: Path, *words: str) -> None:
    author = ("-c", "user.name=A", "-c", "user.email=a@example.org")
    subprocess.run(["git", *author, *words], cwd=root, check=True, capture_output=True)


class Project:
    """A checkout of the small site in its own folder."""

    def __init__(self, root: Path, cache: Path) -> None:
        self.root, self.cache = root, cache
        self.widgets: dict[str, Widget] = {"toy": TOY}
        self.plots: dict[str, Plot] = {"toy-plot": TOY_PLOT}
        shutil.copytree(ROOT / "templates", root / "templates")
        for name in ("solvers", "widgets"):
            (root / name).mkdir()
            (root / name / "__init__.py").write_text(f'"""{name}."""\n')
        self.write("content/site.yaml", SITE)
        self.write("content/references.yaml", REFERENCES)
        self.write("content/00-start.md", START)
        self.write("content/01-second.md", SECOND)
        self.write("tests/test_claimed.py", CLAIMED)

    def write(self, name: str, text: str) -> None:
        path = self.root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, "utf-8")

    def chapter(self, body: str, front: str = 'title: T\nrung: "1"\nslug: second\nsummary: S') -> None:
        """Put a body in the second chapter's place; it begins in line 7."""
        self.write("content/01-second.md", f"---\n{front}\n---\n{body}")

    @property
    def site(self) -> Path:
        return self.root / "site"

    def build(self, **options: Any) -> Report:
        empty = {"assemble": None, "cut_fonts": None, "search": None}
        parts = Parts(self.widgets, self.plots, licences=lambda names, cache: [], **empty)
        return build(self.root, self.site, cache=self.cache, parts=parts, **{"pack": False, **options})

    def page(self, name: str) -> str:
        return (self.site / name).read_text("utf-8")

    def problems(self, **options: Any) -> list[str]:
        """The problems of a build that must fail."""
        with pytest.raises(BuildFailed) as error:
            self.build(**options)
        return [str(problem) for problem in error.value.problems]


@pytest.fixture
def project(tmp_path: Path, cache: Path) -> Project:
    return Project(tmp_path, cache)


@pytest.fixture
def second(project: Project) -> Callable[[str], list[str]]:
    """The problems of the second chapter with this body (whose first line is line 7)."""

    def fails(body: str) -> list[str]:
        project.chapter(body)
        project.write("content/00-start.md", START.partition("Read")[0])
        return [problem.removeprefix("content/01-second.md:") for problem in project.problems()]

    return fails
