"""Scripts and style sheets are bundled once per content; their mistakes are reported with file, line and column."""

from __future__ import annotations

import json
import re

import pytest

from sitegen.assets import bundle
from tests.sitegen.conftest import Project

JS, CSS = "templates/assets/js", "templates/assets/css"


def edit(project: Project, name: str, old: str, new: str) -> None:
    text = (project.root / name).read_text("utf-8")
    assert old in text
    project.write(name, text.replace(old, new, 1))


@pytest.fixture
def quiet(project: Project) -> Project:
    """The small site without anything in its text that has to be computed."""
    project.chapter("Only words.")
    project.write("content/00-start.md", '---\ntitle: Start\nrung: "0"\nsummary: S.\n---\n\nHello.\n')
    return project


@pytest.mark.parametrize(
    ("name", "old", "new", "message"),
    [
        (f"{JS}/base/emitter.js", "export function emitter() {", "export function emitter() { let 1;", "Expected"),
        (f"{JS}/main.js", '"./base/limits.js"', '"./base/limit.js"', f"there is no {JS}/base/limit.js"),
        (f"{JS}/main.js", "import { limits }", "import { limitss as limits }", 'No matching export in "'),
        (f"{JS}/theme.js", "(() => {", "(() = {", "Expected"),
        (f"{CSS}/base/type.css", "{", "}", 'Unexpected "}"'),
        (f"{CSS}/site.css", "./base/type.css", "./base/typo.css", f"there is no {CSS}/base/typo.css"),
        ("templates/assets/worker.mjs", "let python = null;", "let python = = null;", "Unexpected"),
    ],
    ids=["syntax", "import", "name", "theme", "style", "sheet", "worker"],
)
def test_a_mistake_is_told_where_it_stands(quiet: Project, name: str, old: str, new: str, message: str) -> None:
    """The file, line and column of esbuild's first error."""
    edit(quiet, name, old, new)
    text = (quiet.root / name).read_text("utf-8")
    (first, *_) = quiet.problems()
    match = re.match(r"(.*?):(\d+):(\d+): (.*)", first)
    assert match, first
    assert match[1] == name
    assert text.splitlines()[int(match[2]) - 1].count(new.splitlines()[0]) == 1
    assert int(match[3]) > 0
    assert message in match[4]


def test_a_column_counts_letters(quiet: Project) -> None:
    """Not bytes."""
    edit(quiet, f"{JS}/theme.js", "(() => {\n", "(() => {\n  /* äöü */ let 1;\n")
    (problem,) = [p for p in quiet.problems() if "theme.js" in p]
    text = (quiet.root / f"{JS}/theme.js").read_text("utf-8")
    line = next(i for i, row in enumerate(text.splitlines(), 1) if "äöü" in row)
    assert problem.startswith(f"{JS}/theme.js:{line}:17: ")


def test_a_picture_that_is_not_there_is_told_with_the_nearest_name(quiet: Project) -> None:
    """At its place in the sheet, even where esbuild would not complain."""
    (quiet.root / "templates/assets/arrow.svg").write_text('<svg xmlns="http://www.w3.org/2000/svg"/>', "utf-8")
    edit(quiet, f"{CSS}/print.css", "@media", "p { background: url('arow.svg'); }\n@media")
    (problem,) = quiet.problems()
    assert re.fullmatch(
        rf"{CSS}/print\.css:\d+:22: unknown picture 'arow\.svg', not in templates/assets; "
        r"did you mean 'arrow\.svg'\?",
        problem,
    )
    edit(quiet, f"{CSS}/print.css", "arow.svg", "arrow.svg")
    quiet.build()
    (sheet,) = quiet.site.glob("assets/site.*.css")
    (picture,) = quiet.site.glob("assets/arrow.*.svg")
    assert picture.name in sheet.read_text("utf-8")


def test_what_has_not_changed_is_not_bundled_again(quiet: Project, monkeypatch: pytest.MonkeyPatch) -> None:
    """No process is started if everything is cached; an edited sheet leaves the scripts alone."""
    quiet.build()
    runs: list[list[str]] = []
    run = bundle.run_node

    def count(script, request, **options):
        runs.append([b["entry"] for b in request["bundles"]])
        return run(script, request, **options)

    monkeypatch.setattr(bundle, "run_node", count)
    quiet.build()
    assert runs == []
    edit(quiet, f"{CSS}/print.css", "@media", ":root { --edited: 1; }\n@media")
    quiet.build()
    assert runs == [[f"{CSS}/site.css", f"{CSS}/deck.css"]]


def test_source_maps_lie_beside_and_are_not_kept_for_offline_use(quiet: Project) -> None:
    """Each bundle names its map, which leads to the sources; the service worker does not list maps."""
    quiet.build()
    worker = (quiet.site / "sw.js").read_text("utf-8")
    for pattern, source in (
        ("site.*.js", f"{JS}/figure/figure.js"),
        ("site.*.css", f"{CSS}/base/tokens.css"),
        ("deck.*.css", f"{CSS}/deck/slides.css"),
        ("theme.*.js", f"{JS}/theme.js"),
        ("worker.*.mjs", "templates/assets/worker.mjs"),
    ):
        (path,) = quiet.site.glob(f"assets/{pattern}")
        match = re.search(r"sourceMappingURL=(\S+)", path.read_text("utf-8"))
        assert match
        data = json.loads((quiet.site / "assets" / match[1]).read_text("utf-8"))
        assert source in data["sources"]
        assert data["sourcesContent"][data["sources"].index(source)] == (quiet.root / source).read_text("utf-8")
        assert f"assets/{path.name}" in worker
    assert '.map"' not in worker


def test_the_map_of_the_style_sheet_allows_for_what_stands_before_it(quiet: Project) -> None:
    """The rules of typefaces and formulas come first and have no source; the map begins after them."""
    quiet.build()
    (sheet,) = quiet.site.glob("assets/site.*.css")
    match = re.search(r"sourceMappingURL=(\S+)", text := sheet.read_text("utf-8"))
    assert match
    mappings = json.loads((sheet.parent / match[1]).read_text("utf-8"))["mappings"]
    lines = len(mappings) - len(mappings.lstrip(";"))
    assert "--paper" in text.splitlines()[lines]
    assert not any("--paper:" in line for line in text.splitlines()[:lines])
