"""Slides: mistakes in a front matter's list, the contents of a deck, and that every chapter of this site has one."""

from __future__ import annotations

import re
import zipfile
from pathlib import Path

import pytest

from sitegen.pages.title_slide import RUNGS, in_part
from tests.sitegen.check_site import check_site
from tests.sitegen.conftest import SECOND, Project

BODY = """\
::figure[C]{toy preset=default id=demo noise=0.5}

::figure[C]{toy preset=default id=other}

$$
E = m c^2 .
$$ (energy)

::plot[C]{toy-plot id=dots}
"""
# The slides of a chapter, from its line 7 on, and the build's messages.
BROKEN = {
    "no list": ("slides: one\n", ["6:1: slides: expected a list of slides, got 'one'"]),
    "no mapping": ("slides:\n  - one\n", ["7:5: expected a mapping of names to values"]),
    "unknown key": (
        "slides:\n  - title: T\n    txt: A\n",
        [
            "7:5: empty slide: add text, an equation, a figure or a plot",
            "8:5: unknown key 'txt'; did you mean 'text'?",
        ],
    ),
    "no title": ("slides:\n  - text: A\n", ["7:5: missing title: expected text"]),
    "title of another kind": (
        "slides:\n  - title: 3\n    text: A\n",
        ["7:5: title: expected text, got 3; quote it: title: \"3\""],
    ),
    "unknown figure": (
        "slides:\n  - title: T\n    figure: dmo\n",
        ["8:5: unknown figure 'dmo' in this chapter; did you mean 'demo'?"],
    ),
    "unknown plot": (
        "slides:\n  - title: T\n    plot: dot\n",
        ["8:5: unknown plot 'dot' in this chapter; did you mean 'dots'?"],
    ),
    "unknown equation": (
        "slides:\n  - title: T\n    equation: enrgy\n",
        ["8:5: unknown equation 'enrgy' in this chapter; did you mean 'energy'?"],
    ),
    "a figure and a plot": (
        "slides:\n  - title: T\n    figure: demo\n    plot: dots\n",
        ["9:5: a slide shows a figure or a plot, not both"],
    ),
    "set without a figure": (
        "slides:\n  - title: T\n    text: A\n    set: noise=0.2\n",
        ["9:5: set: the slide has no figure; add figure: id"],
    ),
    "set to nothing it has": (
        "slides:\n  - title: T\n    figure: demo\n    set: nose=0.2 press=go,goo\n",
        [
            "9:10: toy has no control 'nose'; did you mean 'noise'?",
            "9:28: toy has no button 'goo' to press; did you mean 'go'?",
        ],
    ),
    "set in quotes": (
        "slides:\n  - title: T\n    figure: demo\n    set: 'noise=2'\n",
        ["9:17: noise: 2 lies outside 0 … 1"],
    ),
    "unknown control": (
        "slides:\n  - title: T\n    figure: demo\n    controls: [noise, loudly]\n",
        ["9:23: toy has no control 'loudly'; did you mean 'loud'?"],
    ),
    "unknown readout and panel": (
        "slides:\n  - title: T\n    figure: demo\n    readouts: [press]\n    panels: [mains]\n",
        [
            "9:16: unknown readout 'press'; did you mean 'presses'?",
            "10:14: unknown panel 'mains'; did you mean 'main'?",
        ],
    ),
    "the same figure twice": (
        "slides:\n  - {title: T, figure: demo}\n  - {title: U, figure: demo}\n",
        ["8:16: figure 'demo' is already on an earlier slide: change it with a ::try line"],
    ),
    "another slide's button": (
        "slides:\n  - title: T\n    figure: demo\n    text: |\n      ::try[Go.]{other}\n",
        ["10:7: a slide's button can set only the slide's own figure"],
    ),
    "a figure in the text": (
        "slides:\n  - title: T\n    text: |\n      A.\n\n      ::figure[C]{toy}\n",
        ["11:7: a figure belongs in the chapter; a slide shows it with figure: id"],
    ),
    "a picture in the text": (
        "slides:\n  - title: T\n    text: |\n      A.\n\n      ::picture[C]{tou}\n",
        ["11:7: pictures belong in the chapter, beside the words that they show"],
    ),
    "a claim, a note, a heading": (
        "slides:\n  - title: T\n    text: |\n      ## B\n\n      :claim[A]{x::y} and[^n]\n",
        ["9:1: a slide's only heading is its title", "11:7: claims belong in the chapter, with their tests",
         "11:26: side notes belong in the chapter"],
    ),
    "a button among the notes": (
        "slides:\n  - title: T\n    figure: demo\n    notes: |\n      ::try[Go.]{demo}\n",
        ["10:7: buttons belong in the slide's text"],
    ),
    "an aside in the text and in the notes": (
        "slides:\n  - title: T\n    text: |\n      ::aside[A]\n    notes: |\n      ::aside[B]\n",
        [f"{at}: asides belong in the chapter; in a slide's notes, write plain text" for at in ("9:7", "11:7")],
    ),
    "titles that are no line of text": (
        "slides:\n  - {title: 1. Where it starts, text: A}\n  - {title: '***', text: A}\n"
        "  - {title: '> 90 degrees', text: A}\n  - {title: '::figre[A]', text: A}\n  - {title: '\\> 90', text: A}\n",
        [
            *[f"{at}: a slide's title is a line of text, not a list or a quotation: write 1\\. or \\> for the signs"
              for at in ("7:13", "8:14", "9:14")],
            "10:14: unknown directive ::figre; did you mean 'figure'?",
        ],
    ),
    "a bad formula, far inside": (
        "slides:\n  - title: T\n    text: |\n      One line,\n      and $\\frc{1}$ here.\n",
        ["10:"],
    ),
    "a reference that is none": (
        "slides:\n  - title: 'A :ref[fig:demi] T'\n    text: |\n      By :ref[eq:energi].\n",
        [
            "7:20: unknown figure 'demi'; did you mean 'demo'?",
            "9:15: unknown equation 'energi'; did you mean 'energy'?",
        ],
    ),
    "a readout that is none": (
        "slides:\n  - title: T\n    text: A :readout[demo pres] b\n",
        ["8:27: unknown readout 'pres'; did you mean 'presses'?"],
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", BROKEN)
def test_a_fault_in_a_slide_is_told_at_its_place(project: Project, name: str) -> None:
    slides, expected = BROKEN[name]
    project.chapter(BODY, f'title: T\nrung: "1"\nslug: second\nsummary: S\n{slides.rstrip()}')
    project.write("content/00-start.md", '---\ntitle: Start\nrung: "0"\nsummary: S\n---\n\nText.\n')
    messages = [problem.removeprefix("content/01-second.md:") for problem in project.problems()]
    assert len(messages) == len(expected), messages
    assert all(text == words or (words.endswith(":") and text.startswith(words))
               for text, words in zip(messages, expected, strict=True)), messages  # fmt: skip


def test_a_title_that_is_longer_than_its_slide_is_told(project: Project) -> None:
    """A chapter without slides may have such a title."""
    project.write("content/00-start.md", '---\ntitle: Start\nrung: "0"\nsummary: S\n---\n\nText.\n')
    front = f'title: {"a title " * 12}\nslug: second\nquestion: {"is it a question " * 10}\nsummary: S'
    project.chapter("Text.\n", f"{front}\nslides:\n  - title: A\n    text: B")
    assert project.problems() == [
        "content/01-second.md:2:1: title: 95 characters, but the title slide fits 90",
        "content/01-second.md:4:1: question: 169 characters, but the title slide fits 160",
    ]
    project.chapter("Text.\n", front)
    project.build()


def test_a_title_slide_shows_the_rungs_round_its_own() -> None:
    def labels(count: int, at: int) -> list[str]:
        rungs = [{"rung": str(i), "title": "T", "page": "", "current": i == at} for i in range(count)]
        return [step["title"] if step["rung"] == "…" else step["rung"] for step in in_part(rungs)]

    assert labels(RUNGS, 3) == [str(i) for i in range(RUNGS)]
    assert labels(30, 0) == [*(str(i) for i in range(17)), "13 more above"]
    assert labels(30, 15) == ["7 more below", *(str(i) for i in range(7, 23)), "7 more above"]
    assert labels(30, 29) == ["13 more below", *(str(i) for i in range(13, 30))]
    assert labels(19, 10) == ["2 more below", *(str(i) for i in range(2, 19))]


SLIDES = """\
slides:
  - title: The *first* & <best>
    text: |
      Press **New**. By :ref[eq:energy] and :ref[fig:demo], $x$ is :readout[demo presses]{press=go*2}. [@one2001]

      ::try[Go thrice.]{demo press=go,go,go}
    equation: energy
    figure: demo
    set: noise=0.25 press=go
    controls: [noise]
    readouts: [presses]
    notes: Say **this**, then :ref[index].
  - title: Last
    plot: dots
---
"""


def test_a_deck_holds_what_its_front_matter_asks_for(project: Project) -> None:
    """Texts, the chapter's equation without its full stop, its figure in the slide's state, from the chapter's tape."""
    project.write(
        "content/01-second.md",
        SECOND.replace("---\n\nA first", f"{SLIDES}\nA first") + "\n::plot[C]{toy-plot id=dots}\n",
    )
    report = project.build(strict=True)
    assert {"slides.html", "slides-second.html"} <= set(report.pages)
    assert "slides-index.html" not in report.pages
    deck, chapter = project.page("slides-second.html"), project.page("second.html")
    for part in (
        'The <em>first</em> &amp; &lt;best&gt;</h2>',
        '<a class="ref" href="second.html#eq-energy">(1.1)</a>',
        '<a class="ref" href="second.html#fig-demo">Figure 1.1</a>',
        '<span class="computed">2</span>',
        'id="card-one2001"',
        '<div class="slide-notes" role="note" aria-label="Notes">',
        '<a class="ref" href="index.html">Start here</a>',
        '<p class="slide-after">Next: Last</p>',
        'data-chosen="presses"',
        'data-button="new" class="primary">New<',
        '<input type="range" id="fig-demo-control-noise"',
        'id="fig-dots"',
    ):  # fmt: skip
        assert part in deck, part
    assert 'name="loud"' not in deck
    assert 'data-readout="noise"' not in deck
    assert 'class="job"' not in deck
    assert re.search(r'data-readout="presses".*?<span class="value">1</span>', deck, re.S), "the slide's own state"
    (tape,) = set(re.findall(r'data-tape="([^"]*)"', deck))
    assert tape in chapter, "one tape for both"
    assert '"noise":0.25,"loud":false},"seed":40,"log":[["press","go"]]' in (project.site / tape).read_text("utf-8")
    assert '<a href="slides-second.html">' in chapter
    assert "E=mc2" in re.sub(r"<[^>]*>|\s", "", deck.partition('class="formula"')[2])[:20]
    assert "." not in re.sub(r"<annotation.*?</annotation>|<[^>]*>|\s", "", deck.partition('class="formula"')[2])[:5]
    overview = project.page("slides.html")
    assert "3 slides" in overview
    assert 'class="still" aria-hidden="true"><svg class="panel"' in overview
    for page, sheets in ((deck, ["site", "deck"]), (overview, ["site", "deck"]), (chapter, ["site"])):
        assert re.findall(r'<link rel="stylesheet" href="assets/(\w+)\.\w+\.css">', page) == sheets
    problems = check_site(project.site, project.cache)
    assert [problem for problem in problems if problem.path.startswith("site/slides")] == []


def test_a_site_without_slides_has_no_page_for_them(project: Project) -> None:
    report = project.build(strict=True)
    assert not [page for page in report.pages if page.startswith("slides")]
    assert "slides" not in project.page("second.html")


def test_a_deck_takes_no_chapters_name(project: Project) -> None:
    slides = "slides:\n  - {title: T, text: A}"
    project.chapter("A.\n", f'title: T\nrung: "1"\nslug: second\nsummary: S\n{slides}')
    project.write("content/00-start.md", '---\ntitle: Start\nrung: "0"\nsummary: S\n---\n\nText.\n')
    project.write("content/02-taken.md", "---\ntitle: U\nslug: slides-second\nsummary: S\n---\n\nText.\n")
    message = "content/02-taken.md:3:1: page name 'slides-second' is taken by the slides of content/01-second.md"
    assert project.problems() == [message]


@pytest.fixture(scope="module")
def decks(site: Path) -> dict[str, str]:
    """Every deck of the built site, by chapter page."""
    chapters = [path for path in sorted(site.glob("*.html")) if 'class="chapter"' in path.read_text("utf-8")]
    assert len(chapters) >= 16, f"no built site in {site}: run `python3 build.py` first"
    links = {path.name: re.findall(r'href="(slides-[^"]*)"', path.read_text("utf-8")) for path in chapters}
    assert all(len(result) == 1 for result in links.values()), links
    return {page: (site / name).read_text("utf-8") for page, (name,) in links.items()}


def test_every_chapter_has_a_complete_deck(decks: dict[str, str]) -> None:
    """A title, four to eight slides, a live figure, notes on every slide, the way back and the way on."""
    for page, deck in decks.items():
        slides = re.split(r'<section class="slide', deck)[2:]
        assert 4 <= len(slides) <= 8, page
        assert 'data-tape="tapes/' in deck, f"{page}: no figure"
        for i, slide in enumerate(slides):
            notes = slide.partition('class="slide-notes"')[2]
            assert len(re.sub(r"<[^>]*>", "", notes.partition("slide-after")[0]).split()) > 8, f"{page}: {i + 2}"
        assert f'<a href="{page}">Read the chapter</a>' in slides[-1]
        assert re.search(r'<a href="slides[^"]*">(Next deck|All decks)', slides[-1]), page


def test_decks_are_kept_offline_and_in_the_zip_and_not_searched(site: Path, decks: dict[str, str]) -> None:
    names = {path.name for path in site.glob("slides*.html")}
    assert len(names) == len(decks) + 1
    worker = (site / "sw.js").read_text("utf-8")
    assert all(f'["{name}", ' in worker for name in names)
    (path,) = site.glob("*.zip")
    with zipfile.ZipFile(path) as archive:
        assert names <= {Path(name).name for name in archive.namelist()}
    (data,) = site.glob("assets/search.*.js")
    assert "slides-" not in data.read_text("utf-8")


UNSEEN = {
    ("clouds.html", 3): ["objective"],
    ("surfaces.html", 3): ["displaced source point"],
    ("surfaces.html", 4): ["displaced source point"],
    ("uncertainty.html", 3): ["target scan, and its robot", "walls"],
    ("uncertainty.html", 6): ["target scan, and its robot", "walls"],
    ("uncertainty.html", 7): ["expected by the Hessian, 95 %", "expected by Censi’s formula, 95 %"],
}


def test_a_slides_legend_names_only_what_its_panels_can_show(decks: dict[str, str]) -> None:
    """By the tape: other panels' marks, and those of controls that the slide leaves out, are not named."""
    for (page, number), unseen in UNSEEN.items():
        slide = re.split(r'<section class="slide', decks[page])[number]
        keys = re.findall(r'<li class="key[^>]*>(.*?)</li>', slide)
        assert keys
        assert not {*keys} & {*unseen}, (page, number, keys)
