"""The leading parts of a figure: chosen by the widget, overridden by the placement, and the sentence before the bar."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Any

import pytest

from tests.sitegen.conftest import TOY, Project, cache_without_drawings
from widgets.drawing.picture import Panel, Picture, Points, View
from widgets.engine.contract import Key, Lead


def html_of(desk: Project, attributes: str, caption: str = "C") -> str:
    """The figure's HTML with these attributes."""
    desk.chapter(f"\n::figure[{caption}]{{toy id=demo {attributes}}}\n")
    desk.build()
    match = re.search(r'<figure class="figure".*?</figure>', desk.page("second.html"), re.DOTALL)
    assert match is not None
    return match[0]


def parts(html: str) -> tuple[str, str]:
    """The leading part, and the part behind More."""
    lead, _, rest = html.partition('<details class="figure-rest"')
    return lead, rest.partition("</details>")[0]


def test_without_a_choice_everything_leads(desk: Project) -> None:
    lead, rest = parts(html_of(desk, ""))
    assert 'name="noise"' in lead
    assert 'data-readout="presses"' in lead
    assert rest == ""


def test_a_placement_chooses_in_the_widgets_stead(desk: Project) -> None:
    desk.widgets["toy"] = replace(TOY, lead=Lead(readouts=("presses",), buttons=("go",)))
    desk.cache = cache_without_drawings(desk.cache, desk.root / "cache")
    lead, rest = parts(html_of(desk, "controls=none readouts=noise"))
    assert 'name="noise"' not in lead
    assert 'name="noise"' in rest
    assert 'data-readout="noise"' in lead
    assert 'data-readout="presses"' in rest
    assert 'data-button="go"' in lead
    assert 'data-button="back"' in rest


def test_the_sentence_before_the_bar_stands_above_the_picture(desk: Project) -> None:
    html = html_of(desk, "", "Press **Go**. | Notice *this*, a | b and `c | d`.")
    assert '<p class="figure-lead">Press <strong>Go</strong>.</p>' in html
    assert 'Notice <em>this</em>, a | b and <code translate="no">c | d</code>.' in html
    assert "figure-lead" not in html_of(desk, "", "No *bar | here* at all.")


@pytest.mark.parametrize("bar", [" |\n", "\n| ", " | \n  "])
@pytest.mark.parametrize(("sentence", "rest"), [("Press *it*.", "Notice\n**that**."), ("*Press*", "*notice*")])
def test_a_caption_is_wrapped_at_its_bar(desk: Project, bar: str, sentence: str, rest: str) -> None:
    html = html_of(desk, "", f"{sentence}{bar}{rest}")
    assert html == html_of(desk, "", f"{sentence} | {rest}")
    assert "figure-lead" in html


@pytest.mark.parametrize(
    ("sentence", "main"), [("Press **Go** | C", "go"), ("Press **New**, then **Go** | C", "new"), ("**Not** | C", "go")]
)
def test_the_filled_button_is_the_one_that_the_sentence_names(desk: Project, sentence: str, main: str) -> None:
    """The first button in bold; if the sentence names none, the widget's own."""
    html = html_of(desk, "", sentence)
    assert re.findall(r'data-button="(\w+)" class="primary"', html) == [main]


def test_a_main_button_leads(desk: Project) -> None:
    desk.chapter("\n::figure[Press **Go** | C]{toy id=demo buttons=new}\n")
    (problem,) = desk.problems()
    assert "main button 'Go' is hidden behind More" in problem
    assert 'class="primary"' not in html_of(desk, "buttons=new")


@pytest.mark.parametrize(
    ("attributes", "message"),
    [
        ("controls=noise,¦nois", "unknown control 'nois'; did you mean 'noise'?"),
        ("buttons=¦og", "unknown button 'og'; known: back, go, new"),
        ("readouts=¦pressed", "unknown readout 'pressed'; did you mean 'presses'?"),
        ("panels=main,¦man", "unknown panel 'man'; did you mean 'main'?"),
        ('panels="main,¦man"', "unknown panel 'man'; did you mean 'main'?"),
        ("panels=¦mian", "unknown panel 'mian'; did you mean 'main'?"),
        ("panels=¦none", "a figure must show at least one panel: name one, or omit panels="),
        ("after=¦og", "toy has no button 'og' to press; known: go"),
    ],
)
def test_what_leads_and_is_not_there(desk: Project, attributes: str, message: str) -> None:
    line = f"::figure[C]{{toy id=demo {attributes}}}"
    desk.chapter(f"\n{line.replace('¦', '')}\n")
    assert desk.problems() == [f"content/01-second.md:8:{1 + line.index('¦')}: {message}"]


@pytest.mark.parametrize(
    "caption",
    ["¦| A caption.", " ¦| A caption.", "\n¦| A caption.", "Press **Go**. ¦|", "Press **Go**.\n¦|\n", "¦|"],
)
def test_a_bar_has_words_on_both_sides(desk: Project, caption: str) -> None:
    before = f"::figure[{caption.partition('¦')[0]}"
    desk.chapter(f"\n::figure[{caption.replace('¦', '')}]{{toy id=demo}}\n")
    place = f"{8 + before.count(chr(10))}:{1 + len(before.rpartition(chr(10))[2])}"
    assert desk.problems() == [f"content/01-second.md:{place}: missing words beside the bar: lead | caption"]


@pytest.mark.parametrize("panels", ["mian", "none"])
def test_a_figure_without_a_panel_hides_no_other_problem(desk: Project, panels: str) -> None:
    """The rest of its page is still read, and its problems reported."""
    desk.chapter(f"\n::figure[C]{{toy id=demo panels={panels}}}\n\nSee :ref[fig:dmo].\n")
    assert [problem.split(": ", 1)[0] for problem in desk.problems()] == [
        "content/01-second.md:8:32",
        "content/01-second.md:10:10",
    ]


def test_a_figure_does_not_open_with_its_main_button_off(desk: Project) -> None:
    def draw(state: object) -> Picture:
        picture = TOY.draw(state)
        done = next(readout.value for readout in picture.readouts if readout.name == "presses") != "0"
        return replace(picture, disabled=frozenset({"go"} if done else ()))

    desk.widgets["toy"] = replace(TOY, draw=draw)
    desk.cache = cache_without_drawings(desk.cache, desk.root / "cache")
    desk.chapter("\n::figure[C]{toy id=demo press=go}\n")
    (problem,) = desk.problems()
    assert "main button 'Go' is disabled at first" in problem
    html = html_of(desk, "after=go")
    svgs = re.findall(r'<div class="figure-panel [^>]*>(<svg.*?</svg>)', html, re.DOTALL)
    as_it_opens, what_it_comes_to, _of_the_job = svgs
    assert as_it_opens != what_it_comes_to
    assert html.index('<div class="figure-after">') < html.index(what_it_comes_to)


def drawn_more(picture: Picture, *more: Panel, **main: Any) -> Picture:
    """The small site's picture with its panel's view changed, and with more panels."""
    (panel,) = picture.panels
    return replace(picture, panels=(replace(panel, view=replace(panel.view, **main)), *more))


@pytest.mark.parametrize(
    ("attributes", "first", "behind"),
    [
        ("", ["a point", "noise"], []),  # everything leads
        ("controls=scene,noise,loud readouts=noise", ["a point", "noise"], []),
        ("controls=scene readouts=noise", ["a point", "noise"], []),  # a leading option brings it
        ("controls=loud", ["a point"], ["noise"]),  # its option is behind More
    ],
)
def test_a_legend_names_first_what_may_be_seen_first(
    desk: Project, attributes: str, first: list[str], behind: list[str]
) -> None:
    """Marks of the leading parts come first; marks that only something behind More can bring are named there."""

    def draw(state: Any) -> Picture:
        picture = TOY.draw(state)
        (panel,) = picture.panels
        noisy = (Points([[0.5, 0.5]], "outlier"),) if state.controls.scene == "noisy" else ()
        return replace(picture, panels=(replace(panel, marks=(*panel.marks, *noisy)),))

    legend = (*TOY.legend, Key("outlier", "noise"))
    desk.widgets["toy"] = replace(TOY, draw=draw, legend=legend, tape=(({}, ("go",)), ({"scene": "noisy"}, ("go",))))
    desk.cache = cache_without_drawings(desk.cache, desk.root / "cache")
    matches = [re.findall(r'<li class="key[^>]*>(.*?)</li>', part) for part in parts(html_of(desk, attributes))]
    assert matches == [first, behind]


@pytest.mark.parametrize(
    ("tape", "first", "behind"),
    [
        (({}, ("new", "go")), ["a point"], ["noise"]),
        (({}, ("new",)), ["a point", "noise"], []),  # the tape does not show what Go brings
    ],
)
def test_a_legend_knows_what_buttons_bring_from_the_tape_alone(
    desk: Project, tape: Any, first: list[str], behind: list[str]
) -> None:
    legend = (*TOY.legend, Key("outlier", "noise"))
    buttons = (*TOY.buttons[:2], replace(TOY.buttons[2], does="press"))
    desk.widgets["toy"] = replace(TOY, legend=legend, tape=(tape,), buttons=buttons)
    desk.cache = cache_without_drawings(desk.cache, desk.root / "cache")
    html = html_of(desk, "controls=noise readouts=noise buttons=go")
    assert [re.findall(r'<li class="key[^>]*>(.*?)</li>', part) for part in parts(html)] == [first, behind]


@pytest.mark.parametrize(
    ("promised", "first", "behind"),
    [
        ("noise=0.3", ["a point", "noise"], []),
        ("scene=noisy noise=0.3", ["a point"], ["noise"]),  # this asks for something behind More as well
    ],
)
def test_a_legend_names_first_what_the_caption_asks_for(
    desk: Project, promised: str, first: list[str], behind: list[str]
) -> None:
    """A slider's value may be on no tape; the text's promises are drawn all the same."""

    def draw(state: Any) -> Picture:
        picture = TOY.draw(state)
        (panel,) = picture.panels
        noisy = (Points([[0.5, 0.5]], "outlier"),) if state.controls.noise == 0.3 else ()
        return replace(picture, panels=(replace(panel, marks=(*panel.marks, *noisy)),))

    desk.widgets["toy"] = replace(TOY, draw=draw, legend=(*TOY.legend, Key("outlier", "noise")))
    desk.cache = cache_without_drawings(desk.cache, desk.root / "cache")
    html = html_of(desk, "controls=noise", f':promise[Notice.]{{{promised} expect="noise is 0.30"}}')
    assert [re.findall(r'<li class="key[^>]*>(.*?)</li>', part) for part in parts(html)] == [first, behind]


@pytest.mark.parametrize(
    ("attributes", "first", "behind"),
    [
        ("", ["a point", "of the noisy scene"], []),
        ("controls=scene", ["a point", "of the noisy scene"], []),
        ("controls=noise scene=noisy", ["a point", "of the noisy scene"], []),
        ("controls=noise", ["a point"], ["of the noisy scene"]),
    ],
)
def test_a_legend_names_first_what_the_chosen_option_draws(
    desk: Project, attributes: str, first: list[str], behind: list[str]
) -> None:
    """This holds although another mark has the same role, unless the choice is itself among the leading controls."""
    legend = (*TOY.legend, Key("source", "of the noisy scene", "ring", under=("scene", "noisy")))
    desk.widgets["toy"] = replace(TOY, legend=legend)
    desk.cache = cache_without_drawings(desk.cache, desk.root / "cache")
    matches = [re.findall(r'<li class="key[^>]*>(.*?)</li>', part) for part in parts(html_of(desk, attributes))]
    assert matches == [first, behind]


def test_a_legend_names_first_the_marks_of_panels_that_lead(desk: Project) -> None:
    """Those of a panel behind More are named there."""
    more = Panel("more", "Another", View(0.0, 1.0, 0.0, 1.0), (Points([[0.5, 0.5]], "outlier"),))
    legend = (*TOY.legend, Key("outlier", "noise"))
    desk.widgets["toy"] = replace(TOY, draw=lambda state: drawn_more(TOY.draw(state), more), legend=legend)
    desk.cache = cache_without_drawings(desk.cache, desk.root / "cache")
    html = html_of(desk, "panels=main")
    assert [re.findall(r'<li class="key[^>]*>(.*?)</li>', part) for part in parts(html)] == [["a point"], ["noise"]]


def asking(desk: Project, *more: Panel, hovers: tuple[str, ...] = (), **main: Any) -> str:
    """The page of a figure with a prediction, its panel's view changed, with more panels."""
    desk.widgets["toy"] = replace(TOY, draw=lambda state: drawn_more(TOY.draw(state), *more, **main), hovers=hovers)
    desk.cache = cache_without_drawings(desk.cache, desk.root / "cache")
    ask = '::predict[How many? | One. | Two.]{demo press=go,go expect="presses < 2 | presses > 1"}'
    desk.chapter(f"\n::figure[C]{{toy id=demo}}\n\n{ask}\n")
    desk.build()
    return desk.page("second.html")


CHART = Panel("chart", "A chart of it", View(0.0, 1.0, 0.0, 1.0, width=320.0), ())


def test_a_chart_that_answers_to_pointing_comes_before_the_question(desk: Project) -> None:
    html = asking(desk, CHART, hovers=("main",))
    assert html.count('<div class="predict"') == 1
    assert html.index('<div class="predict"') > html.index('<div class="figure-charts">')


@pytest.mark.parametrize(
    ("height", "charts", "flat"), [(300.0, True, True), (330.0, True, False), (300.0, False, False)]
)
def test_a_flat_picture_has_the_question_beneath_it(desk: Project, height: float, charts: bool, flat: bool) -> None:
    """If charts fill the column at its right; otherwise the question is in that column, before any charts."""
    html = asking(desk, *([CHART] if charts else []), height=height)
    assert f'<div class="figure-body beside{" flat" * flat}">' in html
    assert ('<div class="figure-charts">' in html) is charts
    assert not charts or html.index('<div class="predict"') < html.index('<div class="figure-charts">')
