"""content/ → the site: read everything, collect every problem, write beside, then take the old site's place."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from jinja2 import Environment
from markupsafe import Markup

import solvers
import widgets
from sitegen.assets import typefaces
from sitegen.cache import pool
from sitegen.cache.files import cache_dir
from sitegen.cache.memo import Remembered
from sitegen.cache.memory import Memory, state
from sitegen.cache.packing import packed
from sitegen.cache.prune import prune
from sitegen.cache.store import unwritable
from sitegen.chapters.citations import Reference, read_references, unused
from sitegen.chapters.claims import read_results, tests_for
from sitegen.chapters.content import (
    SETTINGS,
    Chapter,
    Site,
    check_names,
    read_chapters,
    read_docs,
    read_site,
)
from sitegen.chapters.glossary import Term, read_glossary
from sitegen.chapters.known import Known
from sitegen.chapters.survey import survey
from sitegen.chapters.surveyed import Survey
from sitegen.chapters.values import Values
from sitegen.figures.bakery import Bakery, code_hash, frames_of, readouts_of
from sitegen.figures.gallery import Gallery, version
from sitegen.figures.tape import Tape
from sitegen.figures.widget_faults import sound
from sitegen.markup.code import WAY, highlighted
from sitegen.markup.math import Mathematics
from sitegen.markup.math import render as render_formulas
from sitegen.pages import about
from sitegen.pages.bodies import Pen, outlines_of_drafts, write
from sitegen.pages.notebooks import Shown, notebooks
from sitegen.pages.views import environment
from sitegen.pipeline.ahead import missing
from sitegen.pipeline.asked import STANDARD, Asked, Parts
from sitegen.pipeline.files import Content, site_files
from sitegen.pipeline.output import clear, contents, publish
from sitegen.pipeline.presets import try_presets
from sitegen.pipeline.tapes import record_tapes
from sitegen.problems import BuildFailed, Problem, Problems
from sitegen.progress import Progress, quiet
from sitegen.runtime.assemble import RuntimeInfo

SERVED = ("temml", "pyodide", "numpy", "minisearch", *typefaces.BUNDLES)


@dataclass(frozen=True)
class Report:
    """A build that went well: its pages, its warnings (of a strict build: notes that are not faults), files and bytes.

    Packed copies and the runtime are not counted. sources: the page of each chapter's file.
    """

    pages: tuple[str, ...]
    warnings: tuple[Problem, ...]
    files: int
    size: int
    sources: Mapping[str, str]


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
    kept: Memory | None = None,
) -> Report:
    """Build the site of the checkout at `root` into `dest`, which changes only when all went well; see `Asked`.

    Raises BuildFailed with every problem of the content; OutsideError, NodeError, WheelError where the machinery fails.
    """
    clear(dest)
    asked = Asked(root, cache or cache_dir(), progress or quiet, kept or Memory(), parts, strict, drafts, pack)
    with pool.threads(spared=1) as beside:
        return _build(asked, dest, beside)


def _build(asked: Asked, dest: Path, beside: Executor) -> Report:
    """The build; what can wait is done `beside` it, while the work on pages keeps one core busy."""
    problems = Problems()
    asked.kept.begin((asked.root, asked.cache, asked.parts, state(asked.root)))
    read = _read(asked, problems)
    drawn = _drawn(asked, read, problems, beside)
    content = _content(asked, read, drawn, problems)
    files = site_files(asked, content, problems)
    if problems.found:
        raise BuildFailed(problems.found)
    publish(files, drawn.started, dest, asked.pack, asked.cache, asked.progress)
    prune(asked.cache)
    told = [*problems.warnings, *(problems.notes if asked.strict else [])]
    if full := unwritable(asked.cache):
        says = f"nothing can be kept in this cache: {full}; every build makes it all anew"
        told.append(Problem(str(asked.cache), 0, 0, says))
    return Report(
        tuple(sorted(name for name in files if name.endswith(".html"))),
        tuple(sorted(told)),
        len(files),
        sum(map(len, files.values())),
        {chapter.source.path: chapter.page for chapter in read.written},
    )


@dataclass(frozen=True)
class _Read:
    """What authors have written. left_out: drafts that are not built; written: chapters and docs."""

    site: Site
    chapters: Sequence[Chapter]
    left_out: Sequence[Chapter]
    written: Sequence[Chapter]
    references: Mapping[str, Reference]
    terms: Mapping[str, Term]


def _read(asked: Asked, problems: Problems) -> _Read:
    root, kept = asked.root, asked.kept
    site = read_site(root, problems)
    chapters, left_out = read_chapters(root, site, problems, asked.drafts, kept)
    references = read_references(root, problems, kept)
    terms = read_glossary(root, chapters, left_out, problems, kept)
    written = [*chapters, *read_docs(root, problems, kept)]
    check_names(written, problems)
    return _Read(site, chapters, left_out, written, references, terms)


@dataclass(frozen=True)
class _Drawn:
    """What stands in the pages beside words, and what makes it."""

    surveys: Sequence[Survey]
    mathematics: Mathematics
    templates: Environment
    started: RuntimeInfo | None
    tapes: Mapping[tuple[str, str], Tape]
    bakery: Bakery
    gallery: Gallery
    values: Values


def _drawn(asked: Asked, read: _Read, problems: Problems, beside: Executor) -> _Drawn:
    """Formulas, figures and plots, and the runtime that brings figures alive."""
    cache, kept, parts, progress = asked.cache, asked.kept, asked.parts, asked.progress
    placeable = kept.told("widgets", (), problems, partial(sound, parts.widgets))
    surveys = [
        kept.told(("survey", one.source.path), (one, placeable), problems, partial(survey, one, placeable, parts.plots))
        for one in read.written
    ]
    formulas = [formula for one in surveys for formula in one.formulas]
    unknown = Problems() if SETTINGS in problems.unread else problems  # the site's macros stand there
    mathematics = render_formulas(formulas, read.site.macros, cache, unknown, progress, kept)
    templates = environment(asked.root, cache)
    broken = any(name.startswith("widgets/") for name in problems.unread)  # Python in the browser would not start
    started = None if broken else kept.answer("runtime", (), partial(_runtime, asked))
    templates.globals["wheel"] = f"runtime/{started.wheel}" if started else ""
    bakery = Bakery(placeable, cache)
    gallery = Gallery(parts.plots, cache, progress)
    values = Values(cache, kept.answer("codes", (), _codes), gallery)
    unmade = [one for one in surveys if not kept.has_told(("tapes", one.chapter.source.path), one, problems)]
    pool.make("computing plots, drawing figures", missing(unmade, gallery, bakery, cache), progress)
    tapes = record_tapes(surveys, bakery, problems, progress, kept)
    early = {**contents(started), **{tape.name: tape.script for tape in tapes.values()}}
    for name, data in early.items() if asked.pack else ():
        beside.submit(packed, name, data, cache)  # for publish and archive, which find the copies in the cache
    if asked.strict:
        try_presets(placeable, surveys, bakery, cache, problems, progress)
    return _Drawn(surveys, mathematics, templates, started, tapes, bakery, gallery, values)


def _content(asked: Asked, read: _Read, drawn: _Drawn, problems: Problems) -> Content:
    """What the pages are written from; BuildFailed where anything is wrong with it."""
    root, cache, kept, parts = asked.root, asked.cache, asked.kept, asked.parts
    drafts = outlines_of_drafts(survey(one, parts.widgets, parts.plots, Problems()) for one in read.left_out)
    known = Known(
        root=root,
        chapters=(),
        drafts=drafts,
        pages={},
        references=read.references,
        terms=read.terms,
        tests=tests_for(root, read.written, cache, kept),
        results=read_results(root, kept),
        mathematics=drawn.mathematics,
        values=drawn.values,
        frames=partial(frames_of, drawn.bakery, problems, {}),
        readouts=partial(readouts_of, drawn.bakery, problems, {}),
        figure_html=lambda figure, says, caption, question: Markup(""),  # these three are the pen's to give
        plot_html=lambda placed, caption: Markup(""),
        picture_html=lambda panels, words, caption: Markup(""),
        problems=problems,
    )
    known, texts = write(drawn.surveys, known, Pen(drawn.templates, drawn.tapes, drawn.bakery, drawn.gallery), kept)
    drawn.values.keep()
    count = len(read.chapters)
    surveys, written = drawn.surveys[:count], [(text.chapter, text.body) for text in texts]
    bodies, docs = written[:count], written[count:]
    cited = {key: [chapter for chapter, body in bodies if key in body.cited] for key in read.references}
    for reference in unused(read.references, (key for key, by in cited.items() if by)):
        problems.note(reference.place, f"{reference.key} is cited by no chapter")
    if problems.found or (asked.strict and problems.warnings):
        raise BuildFailed([*problems.found, *(problems.warnings if asked.strict else [])])

    wheel = str(drawn.templates.globals["wheel"])
    shown = Shown(read.site, known, wheel, lambda page, figure: drawn.tapes[page, figure.id].first, drawn.gallery.drawn)
    tests = {claim.test_id: known.tests[claim.test_id].source for _, body in written for claim in body.claims}
    plain = [body for _, body in bodies]
    return Content(
        site=read.site,
        templates=drawn.templates,
        started=drawn.started,
        tapes=drawn.tapes,
        chapters=read.chapters,
        bodies=bodies,
        docs=docs,
        decks=[text.deck for text in texts if text.deck],
        references=read.references,
        cited=cited,
        known=known,
        licences=kept.answer("licences", (), partial(parts.licences, SERVED, cache=cache)),
        notebooks=notebooks(surveys, plain, shown, cache, kept),
        made=about.made(root, surveys, plain, drawn.started.size if drawn.started else 0),
        sources=kept.answer("tests as code", tests, partial(_sources, tests, cache)),
    )


def _codes() -> dict[str, str]:
    """The hash of each package that chapters may call."""
    return {"solvers": code_hash((solvers,)), "widgets": code_hash((solvers, widgets))}


def _sources(claimed: Mapping[str, str], cache: Path) -> dict[str, Markup]:
    """The claimed tests' sources as code."""
    shown = Remembered(cache, f"code-{version('pygments')}, {WAY}")
    made = {name: shown.answer(text, partial(highlighted, text, "python")) for name, text in claimed.items()}
    shown.keep()
    return {name: Markup(code) for name, code in made.items()}


def _runtime(asked: Asked) -> RuntimeInfo | None:
    """The browser runtime, kept in the cache from build to build."""
    assemble = asked.parts.assemble
    return None if assemble is None else assemble(cache=asked.cache, progress=asked.progress)
