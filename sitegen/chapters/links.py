"""Resolves references and links to figures, equations, chapters and anchors: checked, and relative to a page."""

from __future__ import annotations

from base64 import urlsafe_b64encode
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from markupsafe import Markup

from sitegen.chapters.content import is_draft
from sitegen.chapters.onward import Onward
from sitegen.chapters.rendered import Step
from sitegen.chapters.surveyed import Outline
from sitegen.figures.wire import dumps
from sitegen.problems import Place, Problems, hint
from widgets.engine.contract import Record, Widget


@dataclass(frozen=True)
class Links:
    """The links of one page. `pages`: page name → its anchors, None if they are not known here.

    chapter: the page of the chapter whose figures and equations take precedence: the page itself, or for a deck its
    chapter's. drafts: the chapters that are left out, so that a link to one is reported as such.
    """

    page: str
    chapter: str
    chapters: Sequence[Outline]
    drafts: Sequence[Outline]
    pages: Mapping[str, Collection[str] | None]
    problems: Problems

    def target(self, href: str, place: Place) -> str:
        """A link's address, checked if it is on the site."""
        if href.startswith(("https://", "http://", "mailto:")):
            return href
        page, _, fragment = href.partition("#")
        name = self._page_named(page) if page else self.page
        if name is None:
            draft = next((draft for draft in self.drafts if page == draft.deck or _is_named(page, draft)), None)
            self._lacks(place, repr(page), draft, f"unknown page {page!r}{hint(page, self.pages)}")
            return href
        return self._address(name, fragment, place)

    def placed(self, name: str) -> tuple[Widget, Record] | None:
        """The figure that `:ref[fig:name]` refers to: its widget, and its initial record."""
        having = [outline for outline in self.chapters if name in outline.placed]
        chapter = next((outline for outline in having if outline.page == self.chapter), next(iter(having), None))
        return chapter.placed[name] if chapter else None

    def reference(self, text: str, place: Place, state: str = "") -> Markup:
        """The link for `:ref[text]`; empty, and a problem, if it has no target. state: suffix for a figure's state."""
        kind, _, name = text.partition(":")
        if kind == "fig" and name:
            return self._number_link(kind, name, place, state)
        if kind == "eq" and name:
            return self._number_link(kind, name, place)
        slug, _, fragment = text.partition("#")
        for chapter in self.chapters:
            if slug in (chapter.slug, chapter.name):
                return self._chapter(chapter, fragment, place)
        kinds = [(f"fig:{slug}", outline.numbered) for outline in self.chapters]
        kinds += [(f"eq:{slug}", outline.equations) for outline in self.chapters]
        whole = next((kind for kind, numbers in kinds if slug in numbers), "")
        suggestion = hint(slug, [outline.slug for outline in self.chapters])
        advice = f"; did you mean {whole!r}?" if whole else f"{suggestion} (figures are fig:id, equations eq:label)"
        draft = next((outline for outline in self.drafts if slug == outline.slug), None)
        self._lacks(place, repr(slug), draft, f"unknown chapter {slug!r}{advice}")
        return Markup("")

    def onward(self, targets: Sequence[Onward]) -> tuple[Step, ...]:
        """The links at a chapter's end; missing targets are reported and left out."""
        steps = []
        for target in targets:
            link = self.reference(target.to, target.at)
            slug, _, part = target.to.partition("#")
            chapter = next((outline for outline in self.chapters if slug in (outline.slug, outline.name)), None)
            rung = f"Rung {chapter.rung}" if chapter and chapter.rung else ""
            over = [rung, chapter.title if chapter and part else ""]
            if link:
                steps.append(Step(link, " · ".join(words for words in over if words), target.says))
        return tuple(steps)

    def _lacks(self, place: Place, subject: str, draft: Outline | None, message: str) -> None:
        """Report a name that does not exist, or only in a draft."""
        self.problems.add(place, is_draft(subject, draft.file) if draft else message)

    def _chapter(self, chapter: Outline, fragment: str, place: Place) -> Markup:
        href = self._address(chapter.page, fragment, place)
        text = chapter.headings.get(fragment, chapter.title)
        return Markup('<a class="ref" href="{}">{}</a>').format(href, text)

    def _number_link(self, kind: str, name: str, place: Place, state: str = "") -> Markup:
        """A link to a figure ("fig") or an equation ("eq"): this chapter's own, or the only one elsewhere."""
        noun = "figure" if kind == "fig" else "equation"
        targets = {o.page: _numbers(o, kind)[name] for o in self.chapters if name in _numbers(o, kind)}
        page = self.chapter if self.chapter in targets else next(iter(targets), None)
        if page is None:
            if not any(f"{kind}:{name}" in outline.lost for outline in self.chapters):
                names = [known_name for outline in self.chapters for known_name in _numbers(outline, kind)]
                draft = next((outline for outline in self.drafts if name in _numbers(outline, kind)), None)
                message = f"unknown {noun} {name!r}{hint(name, names)}"
                self._lacks(place, f"the chapter of {noun} {name!r}", draft, message)
            return Markup("")
        if page != self.chapter and len(targets) > 1:
            files = " and ".join(sorted(outline.file for outline in self.chapters if outline.page in targets))
            plain = f"[words]({page}#{targets[page][0]})"
            self.problems.add(place, f"ambiguous {noun} {name!r}, in {files}: rename one, or link with {plain}")
        fragment, text = targets[page]
        href = f"{'' if page == self.page else page}#{fragment}{state}"
        return Markup('<a class="ref" href="{}">{}</a>').format(href, text)

    def _page_named(self, page: str) -> str | None:
        """The page that a link refers to, by its name, its chapter's slug or its chapter's file."""
        if page in self.pages:
            return page
        for chapter in self.chapters:
            if _is_named(page, chapter):
                return chapter.page
        return None

    def _address(self, page: str, fragment: str, place: Place) -> str:
        anchors = self.pages[page]
        name = fragment.partition("?")[0]  # a figure's state follows
        if fragment and anchors is not None and name not in anchors:
            self.problems.add(place, f"unknown anchor {name!r} on {page}{hint(name, anchors)}")
        path = "" if page == self.page else page
        return (path + (f"#{fragment}" if fragment else "")) or page


def _numbers(chapter: Outline, kind: str) -> Mapping[str, tuple[str, str]]:
    """A chapter's numbered items of a kind, figures ("fig") or equations: each with its element's id and its number."""
    return chapter.numbered if kind == "fig" else chapter.equations


def state_of(figure: Record, record: Record) -> str:
    """The suffix of a link that opens a figure in a state, as *Copy link* writes it: the differences in base64url."""
    first, plain = figure.plain(), record.plain()
    controls = {name: value for name, value in plain["controls"].items() if value != first["controls"][name]}
    state = {"widget": plain["widget"], "controls": controls, "seed": plain["seed"], "log": plain["log"]}
    return "?s=" + urlsafe_b64encode(dumps(state).encode()).decode().rstrip("=")


def _is_named(page: str, chapter: Outline) -> bool:
    """Whether a link to `page` refers to the chapter, by its slug or by its file."""
    return page in (f"{chapter.slug}.html", Path(chapter.file).name)
