"""Promises of captions and buttons: each is checked against what the figure shows, and a broken one is reported."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import pytest

from tests.sitegen.conftest import TOY, Project, State, cache_without_drawings
from widgets.drawing.picture import Picture, Readout

Fails = Callable[[str], list[str]]


def faults(desk: Project, body: str) -> list[tuple[str, str]]:
    """The problems of a body, each with the source text from its place to the end of the line."""
    desk.chapter(body)
    lines = (desk.root / "content/01-second.md").read_text("utf-8").split("\n")
    results = []
    for problem in desk.problems():
        _, line, column, words = problem.split(":", 3)
        results.append((lines[int(line) - 1][int(column) - 1 :], words.strip()))
    return results


@pytest.mark.parametrize(
    "expected",
    [
        *("presses < 3", "presses > 1.5", "presses is 2", "presses rises", "noise falls", "noise > -1; noise < 0.3"),
        *("noise is 0.25; presses rises", "  presses   rises ; noise < 1"),
        *("noise < .3", "noise > 1e-3", "noise > −1", "presses <= 2; presses >= 2", "presses < 3."),
    ],
)
def test_what_is_promised_and_holds(desk: Project, expected: str) -> None:
    """In a caption, in the chapter's text, on a button and on a slide."""
    own = f'{{noise=0.25 press=go*2 expect="{expected}; presses > 1"}}'
    with_id = own.replace("{", "{demo ")
    slide = f"slides:\n  - title: S\n    figure: demo\n    text: 'A :promise[slide]{own}.'\n"
    desk.chapter(
        f"\n::figure[A :promise[*caption* of $x$]{own}.]{{toy id=demo noise=0.5}}\n\nA :promise[text]{with_id}.\n\n"
        f"::try[B.]{with_id}\n",
        f'title: T\nrung: "1"\nslug: second\nsummary: S\n{slide}',
    )
    desk.build()
    page = desk.page("second.html")
    assert "A <em>caption</em> of <span class=\"held\"><math" in page
    assert "<p>A text.</p>" in page
    assert "expect" not in page


@pytest.mark.parametrize(
    ("expected", "message"),
    [
        ("¦presses < 2", "promised presses < 2, but it is 2"),
        ("¦presses > 2", "promised presses > 2, but it is 2"),
        ("¦noise is 0.3", "promised noise is 0.3, but it is 0.25"),
        ("¦presses falls", "promised presses falls, but it goes from 0 to 2"),
        ("¦noise rises", "promised noise rises, but it goes from 0.50 to 0.25"),
        ("¦noise stays", "promised noise stays, but it goes from 0.50 to 0.25"),
        ("presses > 1; ¦noise > 1", "promised noise > 1, but it is 0.25"),
        ("¦nose < 1", "unknown readout 'nose'; did you mean 'noise'?"),
        ("¦presses <= 1", "promised presses <= 1, but it is 2"),
        ("¦presses >= 2.5", "promised presses >= 2.5, but it is 2"),
        ("presses > 1; ¦noise =< 1", "'noise =< 1': expected NAME < 1.5 (or <=, >, >=), NAME is WORDS"),
        ("¦noise < 1/2", "'noise < 1/2': expected"),
        ("presses > 1;¦", "'': expected"),
    ],
)
def test_what_is_promised_and_does_not_hold(desk: Project, expected: str, message: str) -> None:
    """In a caption, in the text and on a button, each is reported once, at its own place, with the actual value."""
    set_by = f'noise=0.25 press=go*2 expect="{expected.replace("¦", "")}"'
    figure = f"\n::figure[:promise[This]{{{set_by}}}.]{{toy id=demo noise=0.5}}\n\n"
    results = faults(desk, f"{figure}:promise[A]{{demo {set_by}}}\n\n::try[A]{{demo {set_by}}}\n")
    assert len(results) == 3
    for at, words in results:
        assert at.startswith(expected.partition("¦")[2] or '"')
        assert words.startswith(message)


@pytest.mark.parametrize(
    ("text", "idle"),
    [
        (':promise[A]{demo press=go expect="¦presses < 2; noise is 0.50"}', True),
        ('::try[A]{demo then=go expect="¦noise < 1"}', True),
        (':promise[A]{demo press=go expect="presses > 0; noise < 1"}', False),
        (':promise[A]{demo press=go expect="noise < 1; noise stays"}', False),
        (':promise[A]{demo expect="noise < 1"}', False),  # about the figure as it opens
        ('::picture[A bird.]{toy press=go expect="noise < 1"}', False),  # about a state, which a reader only looks at
    ],
)
def test_what_holds_before_the_reader_does_anything_is_no_promise(desk: Project, text: str, idle: bool) -> None:
    body = f"\n::figure[C]{{toy id=demo noise=0.5}}\n\n{text.replace('¦', '')}\n"
    if not idle:
        desk.chapter(body)
        desk.build()
        return
    ((at, words),) = faults(desk, body)
    expected, quote, _ = (start := text.partition("¦")[2]).partition('"')
    assert (at, quote) == (start, '"')
    assert words == f"promised {expected}, but so the figure opens: expect what changes, or say NAME stays"


def test_what_the_text_asks_to_press_comes_after_the_button(desk: Project) -> None:
    """A button leaves the figure to the reader; its promise holds once the reader has pressed what it asks for."""
    desk.chapter('\n::figure[C]{toy id=demo}\n\n::try[Go on.]{demo press=go then=go*2 expect="presses is 3"}\n')
    desk.build()
    assert '"log":[["press","go"]]}' in desk.page("second.html")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (":promise[A]{demo ¦prss=go expect=x}", "no control 'prss'; did you mean 'press'?"),
        (":promise[A]{¦dmo expect=x}", "unknown figure 'dmo' in this chapter; did you mean 'demo'?"),
        (":promise[A]{¦expect=x}", "missing figure id, as in {"),
        ("¦:promise[A]{demo press=go}", "a promise needs expect="),
        ("::try[A]{demo ¦then=go}", "then= without expect="),
        ('::try[A]{demo then=¦goo expect="presses > 0"}', "no button 'goo' to press; did you mean 'go'?"),
        ('::try[A]{demo ¦then=go*2000 press=go expect="presses > 0"}', "too many actions: a log holds at most 2000"),
        ('::try[A]{demo ¦expct="presses > 0"}', "no control 'expct'; did you mean 'expect'?"),
    ],
)
def test_what_is_wrong_with_the_writing_of_a_promise(desk: Project, text: str, message: str) -> None:
    results = faults(desk, f"\n::figure[C]{{toy id=demo}}\n\n{text.replace('¦', '')}\n")
    assert [at for at, words in results if message in words] == [text.partition("¦")[2]]


def test_what_is_promised_of_a_figure_with_a_fault_is_one_problem(desk: Project) -> None:
    """In the caption, on the slide and in the text; a promise about another figure is still checked."""
    own = "{press=go expect=x}"
    figures = (
        f"::figure[A :promise[caption]{own}.]{{tyo id=lost}}\n\n"
        "::figure[B :promise[falls]{other expect=x}.]{toy id=demo}\n\n"
    )
    slide = f"slides:\n  - title: S\n    figure: lost\n    text: 'A :promise[slide]{own}.'\n"
    desk.chapter(
        f"\n{figures}:promise[Text]{{lost press=go expect=x}}\n",
        f'title: T\nrung: "1"\nslug: second\nsummary: S\n{slide}',
    )
    messages = [problem.split(": ", 1)[1] for problem in desk.problems()]
    assert messages == [
        "unknown widget 'tyo'; did you mean 'toy'?",
        "unknown figure 'other' in this chapter; known: demo",
    ]


@pytest.mark.parametrize(
    ("value", "expected", "holds"),
    [
        ("−7.25", "x < -7", True),
        ("22,500", "x > 22499", True),
        ("22 of 40", "x < 23", True),
        ("1\u202f840", "x > 1839", True),
        ("7", "x stays", True),
        ("3·10⁻⁵", "x < 0.00004", True),
        ("3·10⁻⁵", "x > 0.1", False),
        ("−1.25·10⁷", "x < -12000000", True),
        ("< 10⁻¹²", "x < 1e-12", True),
        ("< 10⁻¹²", "x > 0", False),
        ("–", "x < 5", False),
        ("–", "x > 5", False),
        ("converged, step 12", "x is converged", True),
        ("converged, step 12", "x is converge", False),
        ("not converged", "x is converged", False),
    ],
)
def test_what_a_readout_says(desk: Project, value: str, expected: str, holds: bool) -> None:
    """Numbers as the site prints them, and words. Before a press it says nothing, unless it is to stay."""

    def draw(state: State) -> Picture:
        text = value if state.presses or expected == "x stays" else "–"
        return replace(TOY.draw(state), readouts=(Readout("x", "X", text),))

    desk.widgets["toy"] = replace(TOY, draw=draw)  # type: ignore[arg-type]
    desk.cache = cache_without_drawings(desk.cache, desk.root / "cache")
    desk.chapter(f'\n::figure[C]{{toy id=demo}}\n\n:promise[A]{{demo press=go expect="{expected}"}}\n')
    if holds:
        desk.build()
    else:
        assert desk.problems() == [f"content/01-second.md:10:35: promised {expected}, but it is {value}"]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("It falls.", ["falls"]),
        ("To break it, press. It Arrives, and jumps.", ["break", "Arrives", "jumps"]),
        ("It broke, fell and rose again.", ["broke", "fell", "rose"]),
        ("It has Failed, arrived, recovered; is lost, broken.", ["Failed", "arrived", "recovered", "lost", "broken"]),
        ("It jumped, was refused, has risen, has fallen.", ["jumped", "refused", "risen", "fallen"]),
        ("A waterfall breaking; failure, arrival.", []),
        ("Notice :promise[that it falls]{press=go expect=\"presses > 0\"} and rises.", ["rises"]),
        (":claim[It falls.]{tests/test_claimed.py::test_it_holds}", []),
        ("A `:b` is :readout[demo presses]{press=go}: it recovers.", ["recovers"]),
        (":term[what fails]{pose}", ["fails"]),
    ],
)
def test_a_promising_word_is_held_by_something(desk: Project, text: str, words: list[str]) -> None:
    """In a caption and on a button, unless the button itself expects something; paragraphs are not checked."""
    desk.write("content/glossary.yaml", "pose:\n  term: pose\n  says: Where.\n  chapter: second\n")
    button = '::try[It falls.]{demo loud=true expect="noise stays"}'
    desk.chapter(f"\nIt falls and breaks.\n\n::figure[{text}]{{toy id=demo}}\n\n{button}\n")
    if not words:
        desk.build()
        return
    places = [f"content/01-second.md:10:{len('::figure[') + text.rindex(word) + 1}" for word in words]
    assert [problem.split(": ")[0] for problem in desk.problems()] == places


def test_a_button_that_promises_expects_something(desk: Project) -> None:
    ((at, words),) = faults(desk, "\n::figure[C]{toy id=demo}\n\n::try[And it rises.]{demo press=go}\n")
    assert at.startswith("rises.]")
    assert words == "untested promise 'rises': use :promise[…]{press=finish expect=\"rms < 0.1\"}"


def test_a_promising_word_on_a_slide_is_held_by_something(desk: Project) -> None:
    """In its text and its notes, each reported at its own place. A slide's title is not checked, and a button on it has
    its own check."""
    promise = ':promise[It falls]{press=go expect="presses > 0"}'
    slide = f"""slides:
  - title: It never rises
    figure: demo
    text: |
      {promise}, and ¦breaks.

      ::try[It rises.]{{demo loud=true expect="noise stays"}}
      ::try[It rises
      and fails.]{{demo loud=true
      expect="noise stays"}}
      Then it ¦falls.
    notes: It ¦recovers.
"""
    front = f'title: T\nrung: "1"\nslug: second\nsummary: S\n{slide}'
    desk.chapter("\n::figure[C]{toy id=demo}\n", front.replace("¦", ""))
    lines = (desk.root / "content/01-second.md").read_text("utf-8").split("\n")
    places = []
    for problem in desk.problems():
        _, line, column, words = problem.split(":", 3)
        places.append((lines[int(line) - 1][int(column) - 1 :].split(".")[0].split(";")[0], words.split(": use")[0]))
    assert places == [(word, f" untested promise '{word}'") for word in ("breaks", "falls", "recovers")]


def test_a_promising_word_of_a_plot_is_held_by_a_claim(desk: Project) -> None:
    """A plot has no readouts, so what its caption promises must be a claim, or a readout of some figure."""
    claim = ":claim[Notice that it rises]{tests/test_claimed.py::test_it_holds}"
    ((at, words),) = faults(desk, f"\n::plot[{claim}, and falls.]{{toy-plot id=dots}}\n")
    assert at.startswith("falls.]")
    assert words.startswith("untested promise 'falls': use :claim[")
    desk.chapter(f"\n::plot[{claim}.]{{toy-plot id=dots}}\n")
    desk.build()
    assert "it rises" in desk.page("second.html")


def test_readouts_that_are_known_are_not_drawn_again(desk: Project) -> None:
    """Readouts of a state on the figure's tape are reused from there; a second build draws nothing at all."""
    desk.cache = cache_without_drawings(desk.cache, desk.root / "cache")
    presses: list[int] = []

    def draw(state: State) -> Picture:
        presses.append(state.presses)
        return TOY.draw(state)

    desk.widgets["toy"] = replace(TOY, draw=draw)
    desk.chapter(
        '\n::figure[:promise[On the tape]{press=go expect="presses is 1"}, :promise[not on it]'
        '{press=go*7 expect="presses is 7"}.]{toy id=demo}\n'
    )
    desk.build()
    on_the_tape = presses.count(1)
    assert presses.count(7) == 1
    desk.chapter('\n::figure[C]{toy id=demo}\n')
    desk.cache = cache_without_drawings(desk.cache, desk.root / "other")
    presses.clear()
    desk.build()
    assert presses.count(1) == on_the_tape
    presses.clear()
    desk.build()
    assert presses == []
