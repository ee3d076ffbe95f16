"""content/ → the site: read everything, collect every problem, write to a new folder, then swap it in."""

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
from sitegen.chapters.render_context import SiteContext
from sitegen.chapters.survey import survey
from sitegen.chapters.surveyed import Survey
from sitegen.chapters.values import Values
from sitegen.figures.bakery import Bakery, code_hash
from sitegen.figures.gallery import Gallery, version
from sitegen.figures.tape import Tape
from sitegen.figures.widget_faults import sound
from sitegen.markup.code import WAY, highlighted
from sitegen.markup.math import Mathematics
from sitegen.markup.math import render as render_formulas
from sitegen.pages import about
from sitegen.pages.bodies import Pen, outlines_of_drafts, write
from sitegen.pages.notebooks import NotebookInputs, notebooks
from sitegen.pages.views import environment
from sitegen.pipeline.ahead import missing
from sitegen.pipeline.context import STANDARD, BuildContext, Parts
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
    """A successful build: its pages, warnings (in a strict build also notes), and its number of files and bytes.

    Packed copies and the runtime are not counted. sources: the page of each chapter's source file.
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
    memory: Memory | None = None,
) -> Report:
    """Build the site of the checkout at `root` into `dest`, which changes only on success; see `BuildContext`.

    Raises BuildFailed with every problem in the content; OutsideError, NodeError or WheelError if the machinery fails.
    """
    clear(dest)
    cache, progress, memory = cache or cache_dir(), progress or quiet, memory or Memory()
    context = BuildContext(root, cache, progress, memory, parts, strict, drafts, pack)
    with pool.threads(spared=1) as beside:
        return _build(context, dest, beside)


def _build(context: BuildContext, dest: Path, beside: Executor) -> Report:
    """Build the site. Packing runs in the threads of `beside`, while the work on pages keeps one core busy."""
    problems = Problems()
    context.memory.begin((context.root, context.cache, context.parts, state(context.root)))
    manuscript = _read(context, problems)
    media = _draw(context, manuscript, problems, beside)
    content = _render(context, manuscript, media, problems)
    files = site_files(context, content, problems)
    if problems.found:
        raise BuildFailed(problems.found)
    publish(files, media.started, dest, context.pack, context.cache, context.progress)
    prune(context.cache)
    warnings = [*problems.warnings, *(problems.notes if context.strict else [])]
    if full := unwritable(context.cache):
        message = f"this cache cannot be written: {full}; every build starts from scratch"
        warnings.append(Problem(str(context.cache), 0, 0, message))
    return Report(
        tuple(sorted(name for name in files if name.endswith(".html"))),
        tuple(sorted(warnings)),
        len(files),
        sum(map(len, files.values())),
        {chapter.source.path: chapter.page for chapter in manuscript.written},
    )


@dataclass(frozen=True)
class _Manuscript:
    """Everything that authors have written. left_out: drafts that are not built; written: chapters and docs."""

    site: Site
    chapters: Sequence[Chapter]
    left_out: Sequence[Chapter]
    written: Sequence[Chapter]
    references: Mapping[str, Reference]
    terms: Mapping[str, Term]


def _read(context: BuildContext, problems: Problems) -> _Manuscript:
    root, memory = context.root, context.memory
    site = read_site(root, problems)
    chapters, left_out = read_chapters(root, site, problems, context.drafts, memory)
    references = read_references(root, problems, memory)
    terms = read_glossary(root, chapters, left_out, problems, memory)
    docs = read_docs(root, problems, memory)
    check_names([*docs, *chapters], problems)  # docs first: their files name them; a chapter can be renamed
    return _Manuscript(site, chapters, left_out, [*chapters, *docs], references, terms)


@dataclass(frozen=True)
class _Media:
    """Everything in the pages besides text, and the objects that produce it."""

    surveys: Sequence[Survey]
    mathematics: Mathematics
    templates: Environment
    started: RuntimeInfo | None
    tapes: Mapping[tuple[str, str], Tape]
    bakery: Bakery
    gallery: Gallery
    values: Values


def _draw(context: BuildContext, manuscript: _Manuscript, problems: Problems, beside: Executor) -> _Media:
    """Make formulas, figures, plots and the runtime that makes figures interactive."""
    cache, memory, parts, progress = context.cache, context.memory, context.parts, context.progress
    placeable = memory.told("widgets", (), problems, partial(sound, parts.widgets))

    def surveyed(chapter: Chapter) -> Survey:
        look = partial(survey, chapter, placeable, parts.plots)
        return memory.told(("survey", chapter.source.path), (chapter, placeable), problems, look)

    surveys = [surveyed(chapter) for chapter in manuscript.written]
    formulas = [formula for s in surveys for formula in s.formulas]
    unknown = Problems() if SETTINGS in problems.unread else problems  # the site's macros are defined there
    mathematics = render_formulas(formulas, manuscript.site.macros, cache, unknown, progress, memory)
    templates = environment(context.root, cache)
    broken = any(name.startswith("widgets/") for name in problems.unread)  # Python in the browser would not start
    runtime = None if broken else memory.answer("runtime", (), partial(_runtime, context))
    templates.globals["wheel"] = f"runtime/{runtime.wheel}" if runtime else ""
    bakery = Bakery(placeable, cache)
    gallery = Gallery(parts.plots, cache, progress)
    values = Values(cache, memory.answer("codes", (), _codes), gallery)
    unmade = [s for s in surveys if not memory.has_told(("tapes", s.chapter.source.path), s, problems)]
    ahead = [] if unwritable(cache) else missing(unmade, gallery, bakery, cache)  # nothing made ahead could be kept
    pool.make("computing plots, drawing figures", ahead, progress)
    tapes = record_tapes(surveys, bakery, problems, progress, memory)
    early = {**contents(runtime), **{tape.name: tape.script for tape in tapes.values()}}
    for name, data in early.items() if context.pack else ():
        beside.submit(packed, name, data, cache)  # publish and archive then find the copies in the cache
    if context.strict:
        try_presets(placeable, surveys, bakery, cache, problems, progress)
    return _Media(surveys, mathematics, templates, runtime, tapes, bakery, gallery, values)


def _render(context: BuildContext, manuscript: _Manuscript, media: _Media, problems: Problems) -> Content:
    """Render the chapters into what the pages are written from. Raises BuildFailed if anything is wrong."""
    root, cache, memory, parts = context.root, context.cache, context.memory, context.parts
    drafts = outlines_of_drafts(survey(c, parts.widgets, parts.plots, Problems()) for c in manuscript.left_out)
    site_context = SiteContext(
        root=root,
        chapters=(),
        drafts=drafts,
        pages={},
        references=manuscript.references,
        terms=manuscript.terms,
        tests=tests_for(root, manuscript.written, cache, memory),
        results=read_results(root, memory),
        mathematics=media.mathematics,
        values=media.values,
        problems=problems,
    )
    pen = Pen(media.templates, media.tapes, media.bakery, media.gallery)
    site_context, texts = write(media.surveys, site_context, pen, memory)
    media.values.keep()
    count = len(manuscript.chapters)
    surveys, pairs = media.surveys[:count], [(text.chapter, text.body) for text in texts]
    bodies, docs = pairs[:count], pairs[count:]
    cited = {key: [chapter for chapter, body in bodies if key in body.cited] for key in manuscript.references}
    for reference in unused(manuscript.references, (key for key, by in cited.items() if by)):
        problems.note(reference.place, f"unused reference {reference.key}")
    if problems.found or (context.strict and problems.warnings):
        raise BuildFailed([*problems.found, *(problems.warnings if context.strict else [])])

    wheel = str(media.templates.globals["wheel"])
    inputs = NotebookInputs(
        manuscript.site,
        manuscript.references,
        wheel,
        lambda chapter: pen.chapter_context(site_context, chapter, problems),
        lambda page, figure: media.tapes[page, figure.id].first,
        media.gallery.drawn,
    )
    tests = {claim.test_id: site_context.tests[claim.test_id].source for _, body in pairs for claim in body.claims}
    plain = [body for _, body in bodies]
    return Content(
        site=manuscript.site,
        templates=media.templates,
        started=media.started,
        tapes=media.tapes,
        chapters=manuscript.chapters,
        bodies=bodies,
        docs=docs,
        decks=[text.deck for text in texts if text.deck],
        references=manuscript.references,
        cited=cited,
        site_context=site_context,
        licences=memory.answer("licences", (), partial(parts.licences, SERVED, cache=cache)),
        notebooks=notebooks(surveys, plain, inputs, cache, memory),
        made=about.made(root, surveys, plain, media.started.size if media.started else 0),
        sources=memory.answer("tests as code", tests, partial(_sources, tests, cache)),
    )


def _codes() -> dict[str, str]:
    """The code hash of each package that chapters may call."""
    return {"solvers": code_hash((solvers,)), "widgets": code_hash((solvers, widgets))}


def _sources(claimed: Mapping[str, str], cache: Path) -> dict[str, Markup]:
    """The highlighted source of each test that backs a claim."""
    remembered = Remembered(cache, f"code-{version('pygments')}, {WAY}")
    sources = {name: remembered.answer(text, partial(highlighted, text, "python")) for name, text in claimed.items()}
    remembered.keep()
    return {name: Markup(code) for name, code in sources.items()}


def _runtime(context: BuildContext) -> RuntimeInfo | None:
    """The browser runtime, cached between builds; None if this build has none."""
    assemble = context.parts.assemble
    return None if assemble is None else assemble(cache=context.cache, progress=context.progress)
