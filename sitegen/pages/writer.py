"""Everything known about the site → its HTML pages, through the templates."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any
from urllib.parse import quote
from xml.sax.saxutils import escape as xml_escape

from jinja2 import Environment
from markupsafe import Markup

from sitegen.assets import emblems, swatches
from sitegen.assets.assets import Assets
from sitegen.assets.hosting import POLICY
from sitegen.cache.memory import Memory
from sitegen.chapters.citations import Reference
from sitegen.chapters.claims import Result, Test, anchor, standing
from sitegen.chapters.content import Chapter, Site
from sitegen.chapters.glossary import Term
from sitegen.chapters.rendered import Body
from sitegen.external.fetch import Licence
from sitegen.markup.typography import unbroken_formulas, untranslated
from sitegen.pages import api_reference
from sitegen.pages.about import Made, bibtex
from sitegen.pages.decks import Deck
from sitegen.pages.lost import lost
from sitegen.pages.notebooks import name_of
from sitegen.pages.redirects import redirect
from sitegen.pages.title_slide import in_part

STYLE_GUIDE = "docs-style"
HOSTED = re.compile(r"<!--hosted-->(.*?)<!--/hosted-->", re.DOTALL)  # omitted from pages on a disk
SAID = {
    "passed": "Passed on this code.",
    "failed": "Failed on this code.",
    "unknown": "Not yet run on this code.",
}


@dataclass(frozen=True)
class Page:
    """What the templates need to know about a page. hidden: keep it from search engines; share: the preview image of
    links to it, if it has its own."""

    name: str
    title: str
    description: str
    kind: str
    canonical: str = ""
    report: str = ""
    home: bool = False
    hidden: bool = False
    share: str = ""
    previous: Chapter | None = None
    next: Chapter | None = None


@dataclass(frozen=True)
class Inside:
    """The contents of a page's body, independent of the files that the page loads: only its frame names those."""

    page: Page
    html: Markup


@dataclass(frozen=True)
class Writer:
    """Fills the templates of one build. memory: page contents from earlier builds, for reuse. has_search: whether
    pages can be searched. download: the name of the zip of the whole site; "" if there is none."""

    templates: Environment
    site: Site
    chapters: Sequence[Chapter]
    memory: Memory
    has_docs: bool = False
    has_search: bool = False
    download: str = ""

    def _page(self, name: str, title: str, description: str, kind: str, **extra: Any) -> Page:
        url = self.site.url
        canonical = (url if name == "index.html" else url + name) if url else ""
        report = self.site.report.replace("{title}", quote(title)).replace("{page}", quote(name))
        return Page(name, title, description, kind, canonical, report, **extra)

    def _fill(self, template: str, page: Page, **values: Any) -> Inside:
        context = values | {
            "site": self.site,
            "page": page,
            "ladder": self._ladder(page.name),
            "has_slides": any(chapter.slides for chapter in self.chapters),
            "has_docs": self.has_docs,
            "has_search": self.has_search,
            "download": self.download,
        }
        made_of = template, context, self.templates.globals["wheel"]

        def fill() -> str:
            html = self.templates.get_template(template).render(context)
            return untranslated(unbroken_formulas(html))

        return Inside(page, Markup(self.memory.answer(("inside", page.name), made_of, fill)))

    def framed(self, inside: Inside, assets: Assets) -> bytes:
        """The complete page, with links to the files that it loads."""
        size = assets.download.size if assets.download else ""
        bare = replace(assets, files={})
        frame = self.templates.get_template("frame.html")

        def whole() -> bytes:
            html = hosted(inside.html, size)
            return frame.render(site=self.site, page=inside.page, policy=POLICY, assets=bare, inside=html).encode()

        return self.memory.answer(("page", inside.page.name, bool(size)), (inside, bare, self.site), whole)

    def _ladder(self, current: str) -> list[dict[str, Any]]:
        """Every rung in order: published ones with their page, the rest without; chapters without a rung come last."""
        by_rung = {c.rung: c for c in self.chapters if c.rung}
        planned = [(r.rung, r.title, by_rung.get(r.rung)) for r in self.site.ladder]
        names = {c.name for _, _, c in planned if c}
        unplanned = [(c.rung, c.title, c) for c in self.chapters if c.name not in names]
        return [
            {
                "rung": rung,
                "title": chapter.title if chapter else title,
                "page": chapter.page if chapter else "",
                "current": chapter is not None and chapter.page == current,
                "emblem": emblems.path(chapter.emblem) if chapter and chapter.emblem else "",
            }
            for rung, title, chapter in [*planned, *unplanned]
        ]

    def chapter(
        self, chapter: Chapter, body: Body, references: Mapping[str, Reference], terms: Mapping[str, Term]
    ) -> Inside:
        """A chapter's page."""
        i = self.chapters.index(chapter)
        page = self._page(
            chapter.page,
            chapter.title,
            chapter.summary or self.site.description,
            "chapter-page",
            home=i == 0,
            share=f"share-{chapter.name}.png" if chapter.emblem else "",
            previous=self.chapters[i - 1] if i else None,
            next=self.chapters[i + 1] if i + 1 < len(self.chapters) else None,
        )
        if page.home:
            page = replace(page, title=self.site.title)
        return self._fill(
            "chapter.html",
            page,
            notebook=name_of(chapter),
            slides=len(chapter.slides) + 1 if chapter.slides else 0,
            **_text_context(chapter, body, references, terms),
        )

    def deck(
        self, deck: Deck, decks: Sequence[Deck], references: Mapping[str, Reference], terms: Mapping[str, Term]
    ) -> Inside:
        """The slides of a chapter. decks: all of them, in reading order."""
        chapter, i = deck.chapter, decks.index(deck)
        description = f"{chapter.title}, as {deck.count} slides with the chapter's live figures."
        page = self._page(chapter.deck, f"{chapter.title}: slides", description, "deck-page")
        of = {d.chapter.page: d.chapter.deck for d in decks}
        rungs = [{**rung, "page": of.get(rung["page"], "")} for rung in self._ladder(chapter.page)]
        return self._fill(
            "deck.html",
            page,
            deck=deck,
            chapter=chapter,
            rungs=in_part(rungs),
            after=decks[i + 1].chapter if i + 1 < len(decks) else None,
            cards=[references[key] for key in deck.found.cited],
            words=[terms[key] for key in deck.found.terms],
        )

    def slides(self, decks: Sequence[Deck]) -> Inside:
        """The page of all decks, each with its question and a still."""
        description = f"{self.site.title} as slides: a deck for each chapter, with its live figures."
        return self._fill("slides.html", self._page("slides.html", "Slides", description, "slides-page"), decks=decks)

    def doc(self, doc: Chapter, body: Body, references: Mapping[str, Reference], terms: Mapping[str, Term]) -> Inside:
        """A page of the docs; the style guide's template adds the style sheet's colours and the type."""
        page = self._page(doc.page, doc.title, doc.summary or self.site.description, "docs-page", hidden=doc.hidden)
        canonical = "" if doc.hidden else page.canonical
        page = replace(page, canonical=canonical)
        context = _text_context(doc, body, references, terms)
        if doc.name != STYLE_GUIDE:
            return self._fill("docs.html", page, **context)
        headings = [(2, name.lower(), Markup(name)) for name in ("Colours", "Type")]
        context["contents"] = _tree([*body.contents, *headings])
        return self._fill("style.html", page, swatches=swatches.swatches(), **context)

    def glossary(self, terms: Mapping[str, Term]) -> Inside:
        """The glossary: every term, with the chapter that explains it."""
        page = self._page("glossary.html", "Glossary", f"The words that {self.site.title} uses.", "glossary-page")
        return self._fill("glossary.html", page, terms=list(terms.values()))

    def reference(self) -> Inside:
        """The API reference of the solvers package: functions, types and methods, from their docstrings."""
        description = (
            "What is in solvers, the numpy package behind the figures: functions, types, methods and their options."
        )
        page = self._page("reference.html", "solvers: reference", description, "reference-page")
        return self._fill("reference.html", page, groups=api_reference.groups(), methods=api_reference.methods())

    def references(self, references: Mapping[str, Reference], cited: Mapping[str, Sequence[Chapter]]) -> Inside:
        """The bibliography, each work with the chapters that cite it."""
        entries = [{"reference": r, "chapters": cited.get(r.key, [])} for r in references.values()]
        page = self._page("references.html", "References", f"Works cited in {self.site.title}.", "references-page")
        return self._fill("references.html", page, references=entries)

    def checks(
        self,
        bodies: Sequence[tuple[Chapter, Body]],
        tests: Mapping[str, Test],
        results: Mapping[str, Result],
        sources: Mapping[str, Markup],
    ) -> list[Inside]:
        """The overview of checks by chapter, and for each chapter a page of its claims with their tests, the tests'
        source code and their last outcome."""
        by_test: dict[str, list[dict[str, Any]]] = {}
        for chapter, body in bodies:
            for claim in body.claims:
                entry = {"page": chapter.page, "chapter": chapter.title, "id": claim.anchor}
                entry |= {"html": claim.html, "kind": claim.kind}
                by_test.setdefault(claim.test_id, []).append(entry)
        checks: dict[str, dict[str, Any]] = {}
        for test_id, claims in by_test.items():
            result = results.get(test_id)
            state = standing(result)
            checks[test_id] = {
                "anchor": anchor(test_id),
                "claims": claims,
                "test": tests[test_id],
                "source": sources[test_id],
                "state": state,
                "said": SAID[state],
                "change": result.change if result is not None and result.current else None,
            }
        insides, rows = [], []
        for chapter, body in bodies:
            if body.claims:
                entries = [checks[test_id] for test_id in dict.fromkeys(claim.test_id for claim in body.claims)]
                description = f"The tests behind the statements in the chapter {chapter.title}."
                page = self._page(chapter.checks, f"Checks: {chapter.title}", description, "checks-page")
                insides.append(self._fill("checks.html", page, chapter=chapter, checks=entries))
                states = Counter(checks[claim.test_id]["state"] for claim in body.claims)
                causes = sum(claim.kind == "why" for claim in body.claims)
                rows.append({"chapter": chapter, "all": len(body.claims), "causes": causes, "states": states})
        page = self._page(
            "checks.html", "About the checks", "The tests behind the statements in the text.", "checks-page"
        )
        return [self._fill("checks_about.html", page, rows=rows), *insides]

    def about(self, numbers: Made) -> Inside:
        """The page about the site and this build of it."""
        site = self.site
        page = self._page("about.html", "About this site", f"How {site.title} is made, kept and cited.", "about-page")
        citation = bibtex(site.title, site.author, site.year, site.url)
        return self._fill("about.html", page, made=numbers, bibtex=citation)

    def licences(self, licences: Sequence[Licence]) -> Inside:
        """The licences of everything that the site serves."""
        page = self._page("licences.html", "Licences", f"Licences of what {self.site.title} serves.", "licences-page")
        return self._fill("licences.html", page, licences=licences)

    def lost(self, assets: Assets) -> str:
        """The 404 page."""
        return lost(self.templates, self.site, assets.css)

    def redirect(self, chapter: Chapter) -> str:
        """The page at a chapter's old name."""
        return redirect(self.templates, self.site, chapter)

    def sitemap(self, pages: Sequence[str]) -> str:
        """sitemap.xml, which needs the site's URL."""
        entries = (
            f"<url><loc>{xml_escape(self.site.url + ('' if p == 'index.html' else p))}</loc></url>\n" for p in pages
        )
        head = '<?xml version="1.0" encoding="UTF-8"?>\n<urlset xmlns="http://www.sitemaps.org/schemas/sitemap/0.9">\n'
        return head + "".join(entries) + "</urlset>\n"


def hosted(html: str, size: str) -> Markup:
    """Page contents for a host, with the zip's size, which is known only after packing; if `size` is "", for a disk."""
    return Markup(HOSTED.sub(lambda match: match[1].replace("<!--size-->", size) if size else "", html))


def _text_context(
    chapter: Chapter, body: Body, references: Mapping[str, Reference], terms: Mapping[str, Term]
) -> dict[str, Any]:
    """The template context for a chapter's text."""
    return {
        "chapter": chapter,
        "body": body.html,
        "contents": _tree(body.contents),
        "onward": body.onward,
        "cards": [references[key] for key in body.cited],
        "words": [terms[key] for key in body.terms],
    }


def _tree(contents: Sequence[tuple[int, str, Markup]]) -> list[dict[str, Any]]:
    """Second- and third-level headings as entries with children."""
    entries: list[dict[str, Any]] = []
    for level, name, html in contents:
        entry: dict[str, Any] = {"id": name, "html": html, "children": []}
        (entries[-1]["children"] if level == 3 and entries else entries).append(entry)
    return entries
