"""content/ → the site: read everything, collect every problem, write beside, then take the old site's place."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

from jinja2 import Environment
from markupsafe import Markup

import solvers
import widgets
from sitegen.assets import icons, typefaces, webmanifest
from sitegen.assets.assets import Assets, read_assets
from sitegen.assets.characters import characters
from sitegen.assets.download import Download, archive, folder_name
from sitegen.assets.hosting import MAP, headers, policy, service_worker
from sitegen.assets.tokens import colours
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
    FIXED_PAGES,
    SETTINGS,
    Chapter,
    Site,
    check_names,
    read_chapters,
    read_docs,
    read_site,
)
from sitegen.chapters.glossary import read_glossary
from sitegen.chapters.known import Known
from sitegen.chapters.rendered import Body
from sitegen.chapters.survey import survey
from sitegen.chapters.values import Values
from sitegen.external import fetch, served
from sitegen.figures.bakery import Bakery, code_hash, frames_of, readouts_of
from sitegen.figures.gallery import Gallery, Plot, version
from sitegen.figures.tape import Tape
from sitegen.figures.widget_faults import sound
from sitegen.markup.code import WAY, highlighted
from sitegen.markup.math import Mathematics
from sitegen.markup.math import render as render_formulas
from sitegen.pages import about, search_index
from sitegen.pages.bodies import Pen, outlines_of_drafts, write
from sitegen.pages.decks import Deck
from sitegen.pages.lost import inline
from sitegen.pages.notebooks import Shown, notebooks
from sitegen.pages.views import environment
from sitegen.pages.writer import Inside, Writer
from sitegen.pipeline.ahead import missing
from sitegen.pipeline.output import clear, contents, publish
from sitegen.pipeline.presets import try_presets
from sitegen.pipeline.tapes import record_tapes
from sitegen.plots import registry
from sitegen.problems import BuildFailed, Place, Problem, Problems
from sitegen.progress import Progress, quiet
from sitegen.runtime.assemble import RuntimeInfo
from sitegen.runtime.reuse import assembled
from widgets.engine.contract import Widget
from widgets.engine.registry import WIDGETS

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


@dataclass(frozen=True)
class Parts:
    """What a build is made of beside content and templates; tests put others in their place."""

    widgets: Mapping[str, Widget]
    plots: Mapping[str, Plot] = field(default_factory=registry.known)
    assemble: Callable[..., RuntimeInfo] | None = assembled
    cut_fonts: Callable[..., typefaces.FontSet] | None = typefaces.make
    draw_emblem: Callable[..., Mapping[str, bytes]] | None = icons.make
    licences: Callable[..., Sequence[fetch.Licence]] = served.licences
    search: Callable[[Path], bytes] | None = search_index.library


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
    kept: Memory | None = None,
) -> Report:
    """Build the site of the checkout at `root` into `dest`, which changes only when all went well.

    strict: warnings are problems. drafts: chapters that are drafts are built too. pack: .gz and .br beside the files,
    and the whole site in a zip to take away; who only looks at pages needs neither. kept: what an earlier build in this
    process left there is not made again; the site is the same without.
    Raises BuildFailed with every problem of the content; OutsideError, NodeError, WheelError where the machinery fails.
    """
    clear(dest)
    progress, cache, kept = progress or quiet, cache or cache_dir(), kept or Memory()
    with pool.threads(spared=1) as beside:
        return _build(root, dest, strict, drafts, pack, progress, cache, parts, kept, beside)


def _build(
    root: Path,
    dest: Path,
    strict: bool,
    drafts: bool,
    pack: bool,
    progress: Progress,
    cache: Path,
    parts: Parts,
    kept: Memory,
    beside: Executor,
) -> Report:
    """The build; what can wait is done `beside` it, while the work on pages keeps one core busy."""
    problems = Problems()
    kept.begin((root, cache, parts, state(root)))
    site = read_site(root, problems)
    chapters, left_out = read_chapters(root, site, problems, drafts, kept)
    references = read_references(root, problems, kept)
    terms = read_glossary(root, chapters, left_out, problems, kept)
    written = [*chapters, *read_docs(root, problems, kept)]
    check_names(written, problems)
    placeable = kept.told("widgets", (), problems, partial(sound, parts.widgets))
    surveys = [
        kept.told(("survey", one.source.path), (one, placeable), problems, partial(survey, one, placeable, parts.plots))
        for one in written
    ]
    formulas = [asked for one in surveys for asked in one.formulas]
    unknown = Problems() if SETTINGS in problems.unread else problems  # the site's macros stand there
    mathematics = render_formulas(formulas, site.macros, cache, unknown, progress, kept)
    templates = environment(root, cache)
    broken = any(name.startswith("widgets/") for name in problems.unread)  # Python in the browser would not start
    started = None if broken else kept.answer("runtime", (), partial(_runtime, parts, cache, progress))
    templates.globals["wheel"] = f"runtime/{started.wheel}" if started else ""
    bakery = Bakery(placeable, cache)
    gallery = Gallery(parts.plots, cache, progress)
    values = Values(cache, kept.answer("codes", (), _codes), gallery)
    unmade = [one for one in surveys if not kept.has_told(("tapes", one.chapter.source.path), one, problems)]
    pool.make("computing plots, drawing figures", missing(unmade, gallery, bakery, cache), progress)
    tapes = record_tapes(surveys, bakery, problems, progress, kept)
    early = {**contents(started), **{tape.name: tape.script for tape in tapes.values()}}
    for name, data in early.items() if pack else ():
        beside.submit(packed, name, data, cache)  # for publish and archive, which find the copies in the cache
    if strict:
        try_presets(placeable, surveys, bakery, cache, problems, progress)
    known = Known(
        root,
        (),
        outlines_of_drafts(survey(one, parts.widgets, parts.plots, Problems()) for one in left_out),
        {},
        references,
        terms,
        tests_for(root, written, cache, kept),
        read_results(root, kept),
        mathematics,
        values,
        partial(frames_of, bakery, problems, {}),
        partial(readouts_of, bakery, problems, {}),
        lambda figure, says, caption, question: Markup(""),
        lambda placed, caption: Markup(""),
        lambda panels, words, caption: Markup(""),
        problems,
    )
    known, texts = write(surveys, known, Pen(templates, tapes, bakery, gallery), kept)
    bodies = [(text.chapter, text.body) for text in texts]
    decks = [text.deck for text in texts if text.deck]
    values.keep()
    bodies, docs = bodies[: len(chapters)], bodies[len(chapters) :]
    surveys = surveys[: len(chapters)]
    cited = {key: [chapter for chapter, body in bodies if key in body.cited] for key in references}
    for reference in unused(references, (key for key, by in cited.items() if by)):
        problems.note(reference.place, f"{reference.key} is cited by no chapter")
    if problems.found or (strict and problems.warnings):
        raise BuildFailed([*problems.found, *(problems.warnings if strict else [])])

    licences = kept.answer("licences", (), partial(parts.licences, SERVED, cache=cache))
    wheel = str(templates.globals["wheel"])
    shown = Shown(site, known, wheel, lambda page, figure: tapes[page, figure.id].first, gallery.drawn)
    books = notebooks(surveys, [body for _, body in bodies], shown, cache, kept)
    made = about.made(root, surveys, [body for _, body in bodies], started.size if started else 0)
    claims = [claim for _, body in [*bodies, *docs] for claim in body.claims]
    tests = {claim.test_id: known.tests[claim.test_id].source for claim in claims}
    code = kept.answer("tests as code", tests, partial(_sources, tests, cache))
    content = _Content(
        root, site, chapters, bodies, decks, references, cited, known, licences, books, made, code, docs, kept
    )
    files = _files(content, templates, mathematics, tapes, started, parts, pack, cache, progress, problems)
    if problems.found:
        raise BuildFailed(problems.found)
    publish(files, started, dest, pack, cache, progress)
    prune(cache)
    full = unwritable(cache)
    told = [Problem(str(cache), 0, 0, f"nothing can be kept in this cache: {full}; every build makes it all anew")]
    pages = tuple(sorted(name for name in files if name.endswith(".html")))
    return Report(
        pages,
        tuple(sorted([*problems.warnings, *(problems.notes if strict else []), *(told if full else [])])),
        len(files),
        sum(map(len, files.values())),
        {chapter.source.path: chapter.page for chapter in written},
    )


@dataclass(frozen=True)
class _Content:
    """What the pages are written from."""

    root: Path
    site: Site
    chapters: Sequence[Chapter]
    bodies: Sequence[tuple[Chapter, Body]]
    decks: Sequence[Deck]
    references: Mapping[str, Reference]
    cited: Mapping[str, Sequence[Chapter]]
    known: Known
    licences: Sequence[fetch.Licence]
    notebooks: Mapping[str, bytes]
    made: about.Made
    sources: Mapping[str, Markup]
    docs: Sequence[tuple[Chapter, Body]]
    kept: Memory


def _codes() -> dict[str, str]:
    """The hash of each package that chapters may call."""
    return {"solvers": code_hash((solvers,)), "widgets": code_hash((solvers, widgets))}


def _sources(claimed: Mapping[str, str], cache: Path) -> dict[str, Markup]:
    """The claimed tests' sources as code."""
    shown = Remembered(cache, f"code-{version('pygments')}, {WAY}")
    made = {name: shown.answer(text, partial(highlighted, text, "python")) for name, text in claimed.items()}
    shown.keep()
    return {name: Markup(code) for name, code in made.items()}


def _runtime(parts: Parts, cache: Path, progress: Progress) -> RuntimeInfo | None:
    """The browser runtime, kept in the cache from build to build."""
    return None if parts.assemble is None else parts.assemble(cache=cache, progress=progress)


def _files(
    content: _Content,
    templates: Environment,
    mathematics: Mathematics,
    tapes: Mapping[tuple[str, str], Tape],
    started: RuntimeInfo | None,
    parts: Parts,
    pack: bool,
    cache: Path,
    progress: Progress,
    problems: Problems,
) -> dict[str, bytes]:
    """Every file of the site by name, without the runtime and what is packed."""
    scripts = {tape.name: tape.script for tape in tapes.values()}
    # What the pages say decides which letters the fonts have and what is searched, and their frames name both.
    zipped = folder_name(content.site.title) + ".zip" if pack else ""
    writer = Writer(
        templates, content.site, content.chapters, content.kept, bool(content.docs), parts.search is not None, zipped
    )
    insides = _insides(content, writer)
    fontset = None
    if parts.cut_fonts is not None:
        letters = characters({name: one.html for name, one in insides.items()}, scripts, cache, content.kept)
        cut = partial(parts.cut_fonts, *letters, url="fonts/", cache=cache, progress=progress)
        fontset = content.kept.answer("fonts", letters, cut)
    if fontset and fontset.missing:
        problems.note(Place("content"), f"no typeface of the site has {' '.join(fontset.missing)}")
    pictures: Mapping[str, bytes] = {}
    if fontset is not None and parts.draw_emblem is not None:
        emblems = {c.name: (c.emblem, c.title, c.question) for c in content.chapters if c.emblem and content.site.url}
        says = content.site.title, content.site.description, fontset, emblems
        pictures = content.kept.answer("emblem", says, partial(parts.draw_emblem, *says, cache=cache))
    assets = read_assets(
        content.root,
        pictures,
        [fontset.css if fontset else "", mathematics.css],
        fontset.files if fontset else {},
        fontset.preload if fontset else (),
        problems,
        cache,
        progress,
    )
    if started:
        assets.runtime = {"folder": "runtime/", "files": json.dumps(started.start_files()), "bytes": started.size}
    if parts.search is not None:
        library = content.kept.answer("search", (), partial(parts.search, cache))
        assets.search_library = assets.add("minisearch.js", library)
        hidden = {doc.page for doc, _ in content.docs if doc.hidden}
        seen = {name: str(one.html) for name, one in insides.items() if name not in hidden}
        assets.search_data = assets.add("search.js", search_index.search_data(seen, cache, content.kept))
    found = [*(body for _, body in [*content.bodies, *content.docs]), *(each.found for each in content.decks)]
    images = {image.name: image.data for body in found for image in body.images}
    if webmanifest.ICONS.keys() <= assets.pictures.keys():
        site, assets.ground = content.site, colours()["paper"]
        made = webmanifest.web_manifest(site.title, site.description, site.language, assets.ground[0], assets.pictures)
        assets.manifest = assets.add("site.webmanifest", made)
    rest = {**scripts, **images, **assets.files}
    pages = partial(_pages, content, writer, insides)
    if pack:
        alone = _unpacked(content, templates, {**pages(assets.from_disk()), **rest}, started)
        assets.download = Download(zipped, archive(zipped.removesuffix(".zip"), alone, cache))
    files = {**pages(assets), **rest}
    if content.site.url:
        own = [fixed.page for fixed in FIXED_PAGES if fixed.public]
        own += [doc.page for doc, _ in content.docs if not doc.hidden]
        slides = [*(each.chapter.deck for each in content.decks), *(["slides.html"] if content.decks else [])]
        public = [*(chapter.page for chapter in content.chapters), *own, *slides]
        files["sitemap.xml"] = writer.sitemap(public).encode()
    files |= _for_hosts(content.root, templates, files, started)
    if assets.download:
        files[assets.download.name] = assets.download.data
    files |= content.notebooks  # to be taken away, so not among what is kept for offline use
    return files


def _for_hosts(
    root: Path, templates: Environment, files: Mapping[str, bytes], started: RuntimeInfo | None
) -> dict[str, bytes]:
    """What lies beside the files of a site: the service worker that keeps them, the headers that hosts shall send."""
    worker = service_worker(root, files, started.kept_files() if started else ())
    sent = headers(policy(**inline(templates).hashes))
    return {**({} if worker is None else {"sw.js": worker}), "_headers": sent.encode()}


def _unpacked(
    content: _Content, templates: Environment, files: Mapping[str, bytes], started: RuntimeInfo | None
) -> dict[str, bytes]:
    """The whole site as it lies on a disk, with Python, so that a small server brings the unpacked folder alive."""
    mine = {name: data for name, data in files.items() if not name.endswith(MAP)}
    mine |= {**_for_hosts(content.root, templates, mine, started), **content.notebooks}
    return mine | contents(started)


def _insides(content: _Content, writer: Writer) -> dict[str, Inside]:
    """What stands in each page, by the page's name."""
    references, terms = content.references, content.known.terms
    insides = [writer.chapter(chapter, body, references, terms) for chapter, body in content.bodies]
    insides += [writer.doc(doc, body, references, terms) for doc, body in content.docs]
    insides += [writer.deck(each, content.decks, references, terms) for each in content.decks]
    if content.decks:
        insides.append(writer.slides(content.decks))
    bodies = [*content.bodies, *content.docs]
    insides += [
        writer.references(references, content.cited),
        writer.glossary(terms),
        writer.about(content.made),
        writer.reference(),
        *writer.checks(bodies, content.known.tests, content.known.results, content.sources),
        writer.licences(content.licences),
    ]
    return {inside.page.name: inside for inside in insides}


def _pages(content: _Content, writer: Writer, insides: Mapping[str, Inside], assets: Assets) -> dict[str, bytes]:
    """Every page by name: framed, and those that load nothing."""
    pages = {name: writer.framed(inside, assets) for name, inside in insides.items()}
    written = [*content.chapters, *(doc for doc, _ in content.docs)]
    pages |= {f"{name}.html": writer.redirect(one).encode() for one in written for name in _old_names(one)}
    return pages | {"404.html": writer.lost(assets).encode()}


def _old_names(chapter: Chapter) -> list[str]:
    """Where a chapter was, or would be looked for."""
    return [*chapter.redirects, *([chapter.slug] if chapter.slug != chapter.name else [])]
