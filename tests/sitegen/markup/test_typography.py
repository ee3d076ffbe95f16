"""Apostrophes are curved; quotes, code and primes are left alone. Names may wrap between their words."""

from __future__ import annotations

from pathlib import Path

import pytest
from markupsafe import escape

from sitegen.html_reader import Tag, read
from sitegen.markup.parser import parse
from sitegen.markup.source import Source
from sitegen.markup.typography import apostrophes, breakable, unbroken_formulas, untranslated, whole_options
from sitegen.problems import Problems

AS_WRITTEN = {"script", "style", "code", "pre", "math", "kbd"}


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("the cloud's edge, row i's partner", "the cloud’s edge, row i’s partner"),
        ("the points' noise", "the points’ noise"),
        ("all of the points'.", "all of the points’."),
        ("`fit`'s answer, GICP (2009)'s too", "`fit`’s answer, GICP (2009)’s too"),
        ("it isn't", "it isn’t"),
        ("the cloud's 'no partner' and the points' noise", "the cloud’s 'no partner' and the points’ noise"),
        ("stops: 'converged', 'stalled'", "stops: 'converged', 'stalled'"),
        ("'the cloud's edge'", "'the cloud’s edge'"),
        ("`options['k']` and x[`a's`]", "`options['k']` and x[`a's`]"),
        ("(E ψ')² and f'(x)", "(E ψ')² and f'(x)"),
        ("", ""),
    ],
)
def test_what_is_curved_and_what_is_left(text: str, expected: str) -> None:
    """The typed text is printed so, and printing it twice changes nothing more."""
    assert apostrophes(text) == apostrophes(expected) == expected


@pytest.mark.parametrize(
    ("html", "expected"),
    [
        ("a <math>x</math>, b", 'a <span class="held"><math>x</math>,</span> b'),
        ("(<math>x</math>) b", '<span class="held">(<math>x</math>)</span> b'),
        ("a (<math>x</math> b", 'a <span class="held">(<math>x</math></span> b'),
        ("a <math><mi>x</mi><mo>=</mo><mn>0.123456789</mn></math> b",
         'a <span class="held long"><math><mi>x</mi><mo>=</mo><mn>0.123456789</mn></math></span> b'),
        ('<div><math display="block"><mi>0.123456789012</mi></math></div>',
         '<div><math display="block"><mi>0.123456789012</mi></math></div>'),
        ("<math>x</math> and <math>y</math>’s", '<math>x</math> and <span class="held"><math>y</math>’</span>s'),
        ("<math>(x,</math> b, <math\nclass='a'>y</math> c", "<math>(x,</math> b, <math\nclass='a'>y</math> c"),
        ('<div class="formula"><math>x,</math></div>', '<div class="formula"><math>x,</math></div>'),
    ],
)
def test_signs_keep_to_their_formula(html: str, expected: str) -> None:
    assert unbroken_formulas(html) == expected


def test_formulas_and_code_are_not_for_translators() -> None:
    html = 'a <math display="block">x</math> <pre class="code"><code>y</code></pre> <b>codes</b> &lt;code&gt;'
    kept = 'a <math translate="no" display="block">x</math> <pre class="code"><code translate="no">y</code></pre>'
    assert untranslated(html) == f"{kept} <b>codes</b> &lt;code&gt;"


@pytest.mark.parametrize(
    ("code", "expected"),
    [
        ("test --changed main~3", 'test <span class="held">--changed</span> main~3'),
        ("--offline-check", '<span class="held">--offline-check</span>'),
        ("a --b <c>", 'a <span class="held">--b</span> &lt;c&gt;'),
        ("i--, --, -x, ---y, k--n", "i--, --, -x, ---y, k--n"),
    ],
)
def test_options_in_code_stay_whole(code: str, expected: str) -> None:
    assert whole_options(code) == expected


def test_options_stay_whole_on_the_page_of_commands(site: Path) -> None:
    """In its tables and in its text."""
    page = (site / "docs-commands.html").read_text("utf-8")
    assert 'test <span class="held">--changed</span></code></td>' in page
    assert '(<code translate="no"><span class="held">--out</span> FILE</code>)' in page


@pytest.mark.parametrize(
    "thing", [":term[ICP]{icp}", ":ref[icp]", ":ref[ eq:a ]", ":value[f(1)]{.1f}", ":readout[a b]", "[@one]"]
)
def test_quotes_beside_what_the_build_writes(thing: str) -> None:
    """They are those beside a word."""
    source = Source("content/01-a.md", f"""The robots' {thing}'s pose, the "{thing}" and 'a {thing}'.""", Problems())
    texts = [child.content for child in parse(source).tokens[1].children or [] if child.type == "text"]
    assert texts == ["The robots’ ", "’s pose, the “", "” and ‘a ", "’."]
    assert source.problems.found == []


class Straight:
    """Collects the straight apostrophes that a page shows or that screen readers speak, outside code and formulas."""

    def __init__(self) -> None:
        self.texts: list[str] = []
        self._around: list[str] = []

    def opened(self, tag: Tag) -> None:
        self._around.append(tag.name)
        for name in ("aria-label", "title", "alt", "placeholder"):
            self._look(tag.get(name))

    def closed(self, tag: Tag) -> None:
        self._around.remove(tag.name)

    def text(self, text: str) -> None:
        if not AS_WRITTEN & set(self._around):
            self._look(text)

    def _look(self, text: str) -> None:
        if apostrophes(text) != text:
            self.texts.append(" ".join(text.split()))


def test_no_page_shows_a_straight_apostrophe(site: Path) -> None:
    """In its text and in what is read aloud: prose, figures' words and labels, docstrings, the tests' own words."""
    results = {}
    for path in site.glob("*.html"):
        page = Straight()
        read(path.read_text("utf-8"), page)
        if page.texts:
            results[path.name] = page.texts
    assert results == {}


def test_a_test_s_name_wraps_between_its_words_only() -> None:
    name = "tests/claims/test_a.py::test_one[<b>-x_y]"
    result = breakable(name)
    assert result == "tests/<wbr>claims/<wbr>test_<wbr>a.py::<wbr>test_<wbr>one[&lt;b&gt;-x_<wbr>y]"
    assert result.replace("<wbr>", "") == escape(name)
