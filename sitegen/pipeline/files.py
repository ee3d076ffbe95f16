"""The site's files, made from the rendered content: pages, their assets, and the files that accompany them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from jinja2 import Environment
from markupsafe import Markup

from sitegen.assets import webmanifest
from sitegen.assets.assets import Assets, read_assets
from sitegen.assets.characters import characters
from sitegen.assets.download import Download, archive, folder_name
from sitegen.assets.hosting import MAP, headers, policy, service_worker
from sitegen.assets.tokens import colours
from sitegen.assets.typefaces import FontSet
from sitegen.chapters.citations import Reference
from sitegen.chapters.content import FIXED_PAGES, Chapter, Site
from sitegen.chapters.render_context import SiteContext
from sitegen.chapters.rendered import Body
from sitegen.external import fetch
from sitegen.figures.tape import Tape
from sitegen.pages import about, search_index
from sitegen.pages.decks import Deck
from sitegen.pages.lost import inline
from sitegen.pages.redirects import inline_script
from sitegen.pages.writer import Inside, Writer
from sitegen.pipeline.context import BuildContext
from sitegen.pipeline.output import contents
from sitegen.problems import Place, Problems
from sitegen.runtime.assemble import RuntimeInfo


@dataclass(frozen=True)
class Content:
    """Everything that the pages are written from. started: the browser runtime, None if there is none."""

    site: Site
    templates: Environment
    started: RuntimeInfo | None
    tapes: Mapping[tuple[str, str], Tape]
    chapters: Sequence[Chapter]
    bodies: Sequence[tuple[Chapter, Body]]
    docs: Sequence[tuple[Chapter, Body]]
    decks: Sequence[Deck]
    references: Mapping[str, Reference]
    cited: Mapping[str, Sequence[Chapter]]
    site_context: SiteContext
    licences: Sequence[fetch.Licence]
    notebooks: Mapping[str, bytes]
    made: about.Made
    sources: Mapping[str, Markup]


def site_files(context: BuildContext, content: Content, problems: Problems) -> dict[str, bytes]:
    """Every file of the site by name, without the runtime and the packed copies."""
    parts, memory, cache = context.parts, context.memory, context.cache
    templates, runtime = content.templates, content.started
    scripts = {tape.name: tape.script for tape in content.tapes.values()}
    # The text of the pages determines the fonts' glyphs and the search index, and the page frames link to both.
    zipped = folder_name(content.site.title) + ".zip" if context.pack else ""
    writer = Writer(
        templates, content.site, content.chapters, memory, bool(content.docs), parts.search is not None, zipped
    )
    insides = _insides(content, writer)
    assets = _assets(context, content, insides, scripts, problems)
    bodies = [*(body for _, body in [*content.bodies, *content.docs]), *(deck.found for deck in content.decks)]
    images = {image.name: image.data for body in bodies for image in body.images}
    media = {**scripts, **images, **assets.files}
    pages = partial(_pages, content, writer, insides)
    if context.pack:
        alone = _archive_files(context.root, content, {**pages(assets.from_disk()), **media})
        assets.download = Download(zipped, archive(zipped.removesuffix(".zip"), alone, cache))
    files = {**pages(assets), **media}
    if content.site.url:
        files["sitemap.xml"] = writer.sitemap(_public(content)).encode()
    files |= _for_hosts(context.root, templates, files, runtime)
    if assets.download:
        files[assets.download.name] = assets.download.data
    files |= content.notebooks  # they are for download, so not among the files kept for offline use
    return files


def _assets(
    context: BuildContext,
    content: Content,
    insides: Mapping[str, Inside],
    scripts: Mapping[str, bytes],
    problems: Problems,
) -> Assets:
    """Styles, scripts, typefaces, icons and the search index."""
    parts, memory, cache = context.parts, context.memory, context.cache
    fontset = _fonts(context, insides, scripts)
    if fontset and fontset.missing:
        problems.note(Place("content"), f"missing from all typefaces: {' '.join(fontset.missing)}")
    pictures = _pictures(context, content, fontset) if fontset else {}
    assets = read_assets(
        context.root, pictures, fontset, content.site_context.mathematics.css, problems, cache, context.progress
    )
    if runtime := content.started:
        assets.runtime = {"folder": "runtime/", "files": runtime.start_files(), "bytes": runtime.size}
    if parts.search is not None:
        library = memory.answer("search", (), partial(parts.search, cache))
        assets.search_library = assets.add("minisearch.js", library)
        hidden = {doc.page for doc, _ in content.docs if doc.hidden}
        visible = {name: str(inside.html) for name, inside in insides.items() if name not in hidden}
        assets.search_data = assets.add("search.js", search_index.search_data(visible, cache, memory))
    if webmanifest.ICONS.keys() <= assets.pictures.keys():
        site, assets.ground = content.site, colours()["paper"]
        texts = site.title, site.description, site.language
        manifest = webmanifest.web_manifest(*texts, assets.ground[0], assets.pictures)
        assets.manifest = assets.add("site.webmanifest", manifest)
    return assets


def _public(content: Content) -> list[str]:
    """The pages to list in the site map."""
    pages = [fixed.page for fixed in FIXED_PAGES if fixed.public]
    pages += [doc.page for doc, _ in content.docs if not doc.hidden]
    slides = [*(deck.chapter.deck for deck in content.decks), *(["slides.html"] if content.decks else [])]
    return [*(chapter.page for chapter in content.chapters), *pages, *slides]


def _fonts(context: BuildContext, insides: Mapping[str, Inside], scripts: Mapping[str, bytes]) -> FontSet | None:
    """The typefaces, subset to the letters that pages and figures need."""
    if context.parts.cut_fonts is None:
        return None
    pages = {name: inside.html for name, inside in insides.items()}
    letters = characters(pages, scripts, context.cache, context.memory)
    make = partial(context.parts.cut_fonts, *letters, url="fonts/", cache=context.cache, progress=context.progress)
    return context.memory.answer("fonts", letters, make)


def _pictures(context: BuildContext, content: Content, fontset: FontSet) -> Mapping[str, bytes]:
    """The site's icons, and the preview images of its links on other sites."""
    if context.parts.draw_emblem is None:
        return {}
    site = content.site
    emblems = {c.name: (c.emblem, c.title, c.question) for c in content.chapters if c.emblem and site.url}
    inputs = site.title, site.description, fontset, emblems
    return context.memory.answer("emblem", inputs, partial(context.parts.draw_emblem, *inputs, cache=context.cache))


def _for_hosts(
    root: Path, templates: Environment, files: Mapping[str, bytes], runtime: RuntimeInfo | None
) -> dict[str, bytes]:
    """The files for hosting: the service worker that caches the site, and `_headers` with the headers to send."""
    worker = service_worker(root, files, runtime.kept_files() if runtime else ())
    lost = inline(templates)
    text = headers(policy([lost.style], [lost.script, inline_script(templates)]))
    return {**({} if worker is None else {"sw.js": worker}), "_headers": text.encode()}


def _archive_files(root: Path, content: Content, files: Mapping[str, bytes]) -> dict[str, bytes]:
    """The whole site for the zip, with the Python runtime, so that its figures run once any small server serves it."""
    mine = {name: data for name, data in files.items() if not name.endswith(MAP)}
    mine |= {**_for_hosts(root, content.templates, mine, content.started), **content.notebooks}
    return mine | contents(content.started)


def _insides(content: Content, writer: Writer) -> dict[str, Inside]:
    """The contents of each page, by the page's name."""
    references, terms = content.references, content.site_context.terms
    insides = [writer.chapter(chapter, body, references, terms) for chapter, body in content.bodies]
    insides += [writer.doc(doc, body, references, terms) for doc, body in content.docs]
    insides += [writer.deck(deck, content.decks, references, terms) for deck in content.decks]
    if content.decks:
        insides.append(writer.slides(content.decks))
    bodies = [*content.bodies, *content.docs]
    insides += [
        writer.references(references, content.cited),
        writer.glossary(terms),
        writer.about(content.made),
        writer.reference(),
        *writer.checks(bodies, content.site_context.tests, content.site_context.results, content.sources),
        writer.licences(content.licences),
    ]
    return {inside.page.name: inside for inside in insides}


def _pages(content: Content, writer: Writer, insides: Mapping[str, Inside], assets: Assets) -> dict[str, bytes]:
    """Every page by name: the framed ones, and those that load nothing (redirects and 404)."""
    pages = {name: writer.framed(inside, assets) for name, inside in insides.items()}
    chapters = [*content.chapters, *(doc for doc, _ in content.docs)]
    pages |= {f"{name}.html": writer.redirect(chapter).encode() for chapter in chapters for name in _old_names(chapter)}
    return pages | {"404.html": writer.lost(assets).encode()}


def _old_names(chapter: Chapter) -> list[str]:
    """The chapter's former page names, and its slug if its page is named otherwise."""
    return [*chapter.redirects, *([chapter.slug] if chapter.slug != chapter.name else [])]
