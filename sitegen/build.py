"""content/ → the site: read everything, collect every problem, write beside, then take the old site's place."""

from __future__ import annotations

import json
import os
import shutil
import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from jinja2 import Environment
from markupsafe import Markup

from widgets.contract import Widget
from widgets.registry import WIDGETS

from . import fonts, outside, runtime
from .assets import HEADERS, Assets, read_assets, service_worker
from .cite import Reference, read_references, unused
from .claims import read_results, read_tests, test_files
from .computed import Values
from .content import OWN_PAGES, Chapter, Site, read_chapters, read_site
from .figures import Bakery, Figure, code_hash, tape_script
from .files import fingerprint, hashed_name, packed
from .maths import Mathematics
from .maths import render as render_formulas
from .outside import Progress, quiet
from .pages import Writer, environment, figure_html, figure_view
from .problems import BuildFailed, Place, Problem, Problems
from .render import Body, Known, render
from .survey import OWN_IDS, Survey, survey

SERVED = ("temml", "pyodide", "numpy", *fonts.BUNDLES)


@dataclass(frozen=True)
class Report:
    """A build that went well: its pages, its warnings (of a strict build: notes that are no fault), files and bytes.

    Packed copies and the runtime are not counted.
    """

    pages: tuple[str, ...]
    warnings: tuple[Problem, ...]
    files: int
    size: int


@dataclass(frozen=True)
class Parts:
    """What a build is made of beside content and templates; tests put others in their place."""

    widgets: Mapping[str, Widget]
    assemble: Callable[..., runtime.RuntimeInfo] | None = runtime.assemble
    cut_fonts: Callable[..., fonts.FontSet] | None = fonts.make
    licences: Callable[..., Sequence[outside.Licence]] = outside.licences


STANDARD = Parts(WIDGETS)


def build(
    root: Path,
    dest: Path,
    *,
    strict: bool = False,
    drafts: bool = False,
    pack: bool = True,
    progress: Progress | None = None,
    cache: Path | None = None,
    parts: Parts = STANDARD,
) -> Report:
    """Build the site of the checkout at `root` into `dest`, which changes only when all went well.

    strict: warnings are problems. drafts: chapters that are drafts are built too. pack: .gz and .br beside the files.
    Raises BuildFailed with every problem of the content; OutsideError, NodeError, WheelError where the machinery fails.
    """
    progress, cache, problems = progress or quiet, cache or outside.cache_dir(), Problems()
    site = read_site(root, problems)
    chapters = read_chapters(root, problems, drafts)
    references = read_references(root, problems)
    surveys = [survey(chapter, parts.widgets, problems) for chapter in chapters]
    formulas = [asked for one in surveys for asked in one.formulas]
    mathematics = render_formulas(formulas, site.macros, cache, problems, progress)
    templates = environment(root)
    started = _runtime(root, parts, cache, progress)
    templates.globals["wheel"] = f"runtime/{started.wheel}" if started else ""
    code = code_hash()
    bakery = Bakery(parts.widgets, cache, code)
    values = Values(cache, code)
    tapes = _tapes(surveys, bakery, problems, progress)
    known = Known(
        root,
        surveys,
        _pages(surveys, references),
        references,
        read_tests(root, test_files(root)),
        read_results(root),
        mathematics,
        values,
        bakery.frames,
        lambda figure, caption: Markup(""),
        problems,
    )
    draw = figure_html(templates)
    bodies: list[tuple[Chapter, Body]] = []
    for one in surveys:
        known.figure_html = _figure_drawer(one, tapes, draw)
        bodies.append((one.chapter, render(one, known)))
    values.keep()
    cited = {key: [chapter for chapter, body in bodies if key in body.cited] for key in references}
    for reference in unused(references, (key for key, by in cited.items() if by)):
        problems.note(reference.place, f"{reference.key} is cited by no chapter")
    if problems.found or (strict and problems.warnings):
        raise BuildFailed([*problems.found, *(problems.warnings if strict else [])])

    licences = parts.licences(SERVED, cache=cache)
    content = _Content(root, site, chapters, bodies, references, cited, known, licences)
    files = _files(content, templates, mathematics, tapes, started, parts, cache, progress, problems)
    if problems.found:
        raise BuildFailed(problems.found)
    _publish(files, started, dest, pack, cache, progress)
    pages = tuple(sorted(name for name in files if name.endswith(".html")))
    return Report(
        pages,
        tuple(sorted([*problems.warnings, *(problems.notes if strict else [])])),
        len(files),
        sum(map(len, files.values())),
    )


@dataclass(frozen=True)
class Tape:
    """A figure's tape: its file on the site, its script, and the first frame, which the page itself shows."""

    name: str
    script: bytes
    first: dict[str, Any]


@dataclass(frozen=True)
class _Content:
    """What the pages are written from."""

    root: Path
    site: Site
    chapters: Sequence[Chapter]
    bodies: Sequence[tuple[Chapter, Body]]
    references: Mapping[str, Reference]
    cited: Mapping[str, Sequence[Chapter]]
    known: Known
    licences: Sequence[outside.Licence]


def _tapes(
    surveys: Sequence[Survey], bakery: Bakery, problems: Problems, progress: Progress
) -> dict[tuple[str, str], Tape]:
    """The tape of every figure, by page and figure."""
    figures = [(one.chapter, figure) for one in surveys for figure in one.figures.values()]
    tapes = {}
    for i, (chapter, figure) in enumerate(figures):
        progress("drawing figures", i, len(figures))
        try:
            frames = bakery.frames(figure.dom_id, figure.records)
        except Exception as error:  # a widget's own mistake: the author sees which figure and why
            problems.add(figure.place, f"the figure cannot be drawn: {type(error).__name__}: {error}")
            continue
        script = tape_script(figure.dom_id, figure.records, frames).encode()
        name = hashed_name(f"tapes/{chapter.name}-{figure.id}.js", script)
        tapes[chapter.name, figure.id] = Tape(name, script, frames[0])
    progress("drawing figures", len(figures), len(figures))
    return tapes


def _figure_drawer(
    one: Survey, tapes: Mapping[tuple[str, str], Tape], draw: Callable[[Any], Markup]
) -> Callable[[Figure, Markup], Markup]:
    def drawn(figure: Figure, caption: Markup) -> Markup:
        tape = tapes.get((one.chapter.name, figure.id))
        return draw(figure_view(figure, tape.first, tape.name, caption)) if tape else Markup("")

    return drawn


def _pages(surveys: Sequence[Survey], references: Mapping[str, Reference]) -> dict[str, Mapping[str, Place] | None]:
    """Every page that a link may lead to, with its anchors."""
    pages: dict[str, Mapping[str, Place] | None] = {f"{name}.html": None for name in OWN_PAGES if name != "404"}
    pages["references.html"] = {f"ref-{key}": reference.place for key, reference in references.items()}
    fixed = {name: Place("templates/chapter.html") for name in OWN_IDS}
    return pages | {one.chapter.page: {**fixed, **one.anchors} for one in surveys}


def _runtime(root: Path, parts: Parts, cache: Path, progress: Progress) -> runtime.RuntimeInfo | None:
    """The browser runtime, kept in the cache from build to build, one for each checkout."""
    if parts.assemble is None:
        return None
    home = cache / "runtime" / fingerprint([("root", str(root.resolve()).encode())])[:12]
    return parts.assemble(home, cache=cache, progress=progress)


def _files(
    content: _Content,
    templates: Environment,
    mathematics: Mathematics,
    tapes: Mapping[tuple[str, str], Tape],
    started: runtime.RuntimeInfo | None,
    parts: Parts,
    cache: Path,
    progress: Progress,
    problems: Problems,
) -> dict[str, bytes]:
    """Every file of the site by name, without the runtime and what is packed."""
    scripts = {tape.name: tape.script for tape in tapes.values()}
    fontset = None
    if parts.cut_fonts is not None:
        # The fonts are cut to what the pages say, and the pages name the style sheet that names the fonts: so, twice.
        text, signs = fonts.characters(_html(content, templates, Assets()).values())
        text = "".join(sorted(set(text).union(*(script.decode() for script in scripts.values()))))
        fontset = parts.cut_fonts(text, signs, url="fonts/", cache=cache, progress=progress)
    assets = read_assets(
        content.root,
        [fontset.css if fontset else "", mathematics.css],
        fontset.files if fontset else {},
        fontset.preload if fontset else (),
        problems,
    )
    if started:
        assets.runtime = {"folder": "runtime/", "files": json.dumps(started.start_files()), "bytes": started.size}
    images = {image.name: image.data for _, body in content.bodies for image in body.images}
    pages = {name: html.encode() for name, html in _html(content, templates, assets).items()}
    files = {**pages, **scripts, **images, **assets.files}
    writer = Writer(templates, content.site, content.chapters, assets)
    if content.site.url:
        public = [*(chapter.page for chapter in content.chapters), "references.html", "checks.html"]
        files["sitemap.xml"] = writer.sitemap(public).encode()
    worker = service_worker(content.root, files, fingerprint(files.items())[:16])
    if worker is not None:
        files["sw.js"] = worker
    files["_headers"] = HEADERS.encode()
    return files


def _html(content: _Content, templates: Environment, assets: Assets) -> dict[str, str]:
    """Every page by name."""
    writer = Writer(templates, content.site, content.chapters, assets)
    pages = {chapter.page: writer.chapter(chapter, body, content.references) for chapter, body in content.bodies}
    pages |= {f"{name}.html": writer.redirect(chapter) for chapter in content.chapters for name in _old_names(chapter)}
    pages["references.html"] = writer.references(content.references, content.cited)
    pages["checks.html"] = writer.checks(content.bodies, content.known.tests, content.known.results)
    pages["licences.html"] = writer.licences(content.licences)
    pages["404.html"] = writer.lost()
    return pages


def _old_names(chapter: Chapter) -> list[str]:
    """Where a chapter was, or would be looked for."""
    return [*chapter.redirects, *([chapter.slug] if chapter.slug != chapter.name else [])]


def _publish(
    files: Mapping[str, bytes],
    started: runtime.RuntimeInfo | None,
    dest: Path,
    pack: bool,
    cache: Path,
    progress: Progress,
) -> None:
    """Write all files into a folder beside `dest`, then put that in its place."""
    dest.parent.mkdir(parents=True, exist_ok=True)
    beside = Path(tempfile.mkdtemp(prefix=f".{dest.name}-", dir=dest.parent))
    beside.chmod(0o755)
    try:
        for i, (name, data) in enumerate(files.items()):
            progress("writing pages", i, len(files))
            for each, bytes_ in {name: data, **(packed(name, data, cache) if pack else {})}.items():
                (beside / each).parent.mkdir(parents=True, exist_ok=True)
                (beside / each).write_bytes(bytes_)
        progress("writing pages", len(files), len(files))
        if started:
            _copy_runtime(started, beside / "runtime", pack, cache)
        if (dest / ".gitignore").is_file():  # the folder's own, which is in git and not of the build
            shutil.copyfile(dest / ".gitignore", beside / ".gitignore")
        _exchange(beside, dest)
    finally:
        shutil.rmtree(beside, ignore_errors=True)


def _copy_runtime(started: runtime.RuntimeInfo, folder: Path, pack: bool, cache: Path) -> None:
    for name in [*(file.name for file in started.files), started.wheel]:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(started.folder / name, folder / name)
        if pack:
            for each, data in packed(name, (folder / name).read_bytes(), cache).items():
                (folder / each).write_bytes(data)


def _exchange(beside: Path, dest: Path) -> None:
    """Put the new folder in the old one's place; were the second step to fail, the old one comes back."""
    old = beside.with_name(beside.name + "-old")
    if dest.exists():
        os.replace(dest, old)
    try:
        os.replace(beside, dest)
    except OSError:
        if old.exists():
            os.replace(old, dest)
        raise
    shutil.rmtree(old, ignore_errors=True)
