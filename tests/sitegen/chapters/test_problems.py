"""Broken content: every problem names the exact file, line and column, and the nearest right name."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from tests.sitegen.conftest import REFERENCES, SECOND, SITE, START, Project

Fails = Callable[[str], list[str]]

# The body of a chapter, from its line 7 on, and the build's messages.
BROKEN = {
    "unknown block directive": ("::figur[C]{toy}\n", ["7:1: unknown directive ::figur; did you mean 'figure'?"]),
    "unknown inline directive": ("A :vlue[x] b\n", ["7:3: unknown directive :vlue; did you mean 'value'?"]),
    "two colons in a line": ("::claim[x]{y}\n", ["7:1: unknown directive ::claim; inside a line, use one colon"]),
    "one colon on a line": (
        "A :try[x]{demo}\n",
        ["7:3: unknown directive :try; on a line of its own, use two colons"],
    ),
    "text never closed": ("::figure[C {toy}\n", ["7:9: unclosed '[': missing ']'"]),
    "attributes never closed": ("A :claim[C]{x\n", ["7:12: unclosed '{': missing '}'"]),
    "no text": ("::figure{toy}\n", ["7:1: expected ::name[text]{attributes}"]),
    "more on the line": (
        "::aside[C] and more\n",
        ["7:11: unexpected 'and more' after a directive: move it to another line"],
    ),
    "unknown widget": ("::figure[C]{tou}\n", ["7:13: unknown widget 'tou'; did you mean 'toy'?"]),
    "unknown preset": (
        "::figure[C]{toy preset=noise}\n",
        ["7:24: toy has no preset 'noise'; did you mean 'noisy'?"],
    ),
    "unknown control": (
        "::figure[C]{toy nose=0.5}\n",
        ["7:17: toy has no control 'nose'; did you mean 'noise'?"],
    ),
    "value out of range": ("::figure[C]{toy noise=1.5}\n", ["7:23: noise: 1.5 lies outside 0 … 1"]),
    "value of another kind": ("::figure[C]{toy loud=yes}\n", ["7:22: loud: 'yes' is neither true nor false"]),
    "unknown option": (
        "::figure[C]{toy scene=nosy}\n",
        ["7:23: scene: no option 'nosy'; did you mean 'noisy'?"],
    ),
    "twice the same": ("::figure[C]{toy noise=0.1 noise=0.2}\n", ["7:27: duplicate attribute 'noise'"]),
    "wrapped caption": (
        "::figure[A long\ncaption with :ref[fig:dem].]{toy id=demo}\n",
        ["8:19: unknown figure 'dem'; did you mean 'demo'?"],
    ),
    "twice the same figure": (
        "::figure[C]{toy id=a}\n\n::figure[C]{toy id=a}\n",
        ["9:1: duplicate figure 'a' in this chapter (first on line 7)"],
    ),
    "no caption": ("::figure[]{toy}\n", ["7:1: ::figure has no text"]),
    "button for no figure": (
        "::figure[C]{toy id=demo}\n\n::try[T]{demi}\n",
        ["9:10: unknown figure 'demi' in this chapter; did you mean 'demo'?"],
    ),
    "button presses nothing": (
        "::figure[C]{toy id=demo}\n\n::try[T]{demo press=go,goo}\n",
        ["9:24: toy has no button 'goo' to press; did you mean 'go'?"],
    ),
    "button presses no number of times": (
        "::figure[C]{toy id=demo}\n\n::try[T]{demo press=go,go*many}\n",
        ["9:24: 'go*many': expected a repeat count from 1 to 2000"],
    ),
    "button with a link": (
        "::figure[C]{toy id=demo}\n\n::try[T [x](https://x.org)]{demo}\n",
        ["9:13: a button cannot contain links"],
    ),
    "bad seed": (
        "::figure[C]{toy id=demo}\n\n::try[T]{demo seed=-3}\n",
        ["9:20: seed: expected a whole number, got '-3'"],
    ),
    "unknown module": (
        "A :value[solvers.metric.rms(1)]{.2f}\n",
        ["7:18: solvers has no 'metric'; did you mean 'metrics'?"],
    ),
    "unknown function": (
        'A :value[solvers.core.validate.nmber(1, "x")]{.2f}\n',
        ["7:32: solvers.core.validate has no 'nmber'; did you mean 'number'?"],
    ),
    "other package": (
        "A :value[os.getcwd()]\n",
        ["7:10: expected a call to solvers, widgets or plots, got 'os'; known: plots, solvers, widgets"],
    ),
    "no literal": (
        'A :value[solvers.core.validate.number(x, "x")]\n',
        ["7:39: arguments must be literals, not 'x'"],
    ),
    "a call that fails": (
        'A :value[solvers.core.validate.number("a", "x")]\n',
        ["7:10: ValueError: "],
    ),
    "no number": (
        'A :value[solvers.core.validate.one_of("a", ["a"], "x")]\n',
        ["7:10: expected a finite number, got str"],
    ),
    "no call, nor arithmetic that is allowed": (
        "A :value[solvers.core.validate] and :value[5 % 3]{.2f}\n",
        [
            f"7:{column}: expected a call, such as solvers.consensus.trials(0.5, 0.99, 2), or arithmetic with "
            "+ - * / **, pi, sqrt, exp, log, log2, sin, cos, asin, degrees, radians"
            for column in (10, 44)
        ],
    ),
    "a plot's name as ::plot writes it": (
        "A :value[plots.toy-plot.least(60)]\n",
        ["7:19: use underscores in names, not hyphens: plots.toy_plot.least(…)"],
    ),
    "no format": ('A :value[solvers.core.validate.number(1, "x")]{.2q}\n', ["7:48: invalid format '.2q': "]),
    "unknown readout": (
        "::figure[C]{toy id=demo}\n\nA :readout[demo press]{press=go}\n",
        ["9:17: unknown readout 'press'; did you mean 'presses'?"],
    ),
    "readout's control": (
        "::figure[C]{toy id=demo}\n\nA :readout[demo presses]{noise=7}\n",
        ["9:32: noise: 7 lies outside 0 … 1"],
    ),
    "unknown test": (
        "A :claim[C]{tests/test_claimed.py::test_it_hold}\n",
        [
            "7:13: unknown test 'tests/test_claimed.py::test_it_hold'; "
            "did you mean 'tests/test_claimed.py::test_it_holds'?",
        ],
    ),
    "unknown file of tests": (
        "A :claim[C]{tests/test_climed.py::test_it_holds}\n",
        ["7:13: no tests in 'tests/test_climed.py'; did you mean 'tests/test_claimed.py'?"],
    ),
    "unknown reference": ("A [@one2001; @tow2002]\n", ["7:15: unknown reference 'tow2002'; did you mean 'two2002'?"]),
    "no citation": ("A [@one2001 p. 3]\n", ["7:3: expected [@key], [@key, p. 3] or [@one; @other]"]),
    "unknown equation": (
        "A :ref[eq:energi]\n\n$$\nx\n$$ (energy)\n",
        ["7:8: unknown equation 'energi'; did you mean 'energy'?"],
    ),
    "unknown chapter": (
        "A :ref[secnd]\n",
        ["7:8: unknown chapter 'secnd'; did you mean 'second'? (figures are fig:id, equations eq:label)"],
    ),
    "unknown anchor": (
        "A [b](#ther)\n\n## There\n",
        ["7:7: unknown anchor 'ther' on second.html; did you mean 'there'?"],
    ),
    "anchor of another page": (
        "A [b](index.html#elsewhere)\n",
        ["7:7: unknown anchor 'elsewhere' on index.html; known: cite-this-page, main, notebook"],
    ),
    "unknown page": ("A *b* [b](indx.html)\n", ["7:11: unknown page 'indx.html'; did you mean 'index.html'?"]),
    "unknown command in a line": ("A $x + \\frb{y}$\n", ["7:8: formula: Unsupported function name: \\frb"]),
    "unknown command in a block": ("$$\na +\n  \\frb{y}\n$$\n", ["9:3: formula: Unsupported function name: \\frb"]),
    "a bar that is not drawn": (
        "A $\\overline{k}$\n",
        ["7:4: formula: browsers do not draw <menclose>: avoid \\overline, \\boxed, \\cancel …"],
    ),
    "in a list": ("- a\n- b $\\frb$\n", ["8:6: formula: Unsupported function name: \\frb"]),
    "in a quotation": ("> a\n> b [@no]\n", ["8:7: unknown reference 'no'"]),
    "in the second cell": (
        "| a | b |\n| - | - |\n| [@no] | [@no2] |\n",
        ["9:5: unknown reference 'no'", "9:13: unknown reference 'no2'"],
    ),
    "in a heading": ("## A :value[1 +]\n", ["7:13: not a call: invalid syntax"]),
    "equation twice": (
        "$$\nx\n$$ (e)\n\n$$\ny\n$$ (e)\n",
        ["13:5: duplicate equation 'e' in this chapter (first on line 9)"],
    ),
    "footnote not there": ("A [^x]\n", ["7:3: unknown footnote [^x]; none are defined"]),
    "footnote not used": ("A\n\n[^x]: B\n", ["9:1: unused footnote [^x]"]),
    "title in the text": ("# A\n", ["7:1: the chapter's title belongs in its front matter: headings start at ##"]),
    "level left out": ("## A\n\n#### B\n", ["9:1: skipped heading level: level 4 after level 2"]),
    "anchor twice": (
        "## A {#x}\n\n## B {#x}\n",
        ["9:1: duplicate anchor 'x' in this chapter (first on line 7)"],
    ),
    "no anchor": (
        "## A {#X y}\n",
        ["7:8: invalid anchor 'X y': use lower-case letters, digits and hyphens, starting with a letter"],
    ),
    "the page's own anchor": ("## A {#main}\n", ["7:1: reserved anchor 'main': choose another name"]),
    "another of them": ("## A {#works-cited}\n", ["7:1: reserved anchor 'works-cited': choose another name"]),
    "a figure's anchor before it": (
        "## A {#fig-a}\n\n::figure[C]{toy id=a}\n",
        ["7:1: reserved anchor 'fig-a': choose another name"],
    ),
    "an equation's anchor behind it": (
        "$$\nx\n$$ (e)\n\n## A {#eq-e}\n",
        ["11:1: reserved anchor 'eq-e': choose another name"],
    ),
    "image without words": (
        "A ![](x.png)\n",
        ["7:7: image not found: content/x.png", "7:7: missing alternative text: ![what it shows](x.png)"],
    ),
    "image outside": ("A ![b](../tests/test_claimed.py)\n", ["7:8: image not found: content/../tests/test_claimed.py"]),
    "unknown language": ("```pyhton\nx\n```\n", ["7:1: unknown language 'pyhton'; did you mean 'python'?"]),
}


@pytest.mark.parametrize("name", BROKEN)
def test_a_fault_in_a_text_is_told_at_its_place(second: Fails, name: str) -> None:
    body, expected = BROKEN[name]
    results = second(body)
    assert len(results) == len(expected), results
    for text, words in zip(results, expected, strict=True):
        assert text.startswith(words), results
        if not words.endswith(": ") and "reference 'no" not in words and "image not found" not in words:
            assert text == words


def test_all_problems_of_a_build_are_told_at_once(project: Project) -> None:
    project.write("content/00-start.md", START + "\n:ref[nowhere]\n")
    project.write("content/01-second.md", SECOND.replace("[@one2001;", "[@on2001;"))
    project.write("content/references.yaml", REFERENCES.replace("year: 2002", "yaer: 2002"))
    messages = project.problems()
    assert [problem.split(": ")[0] for problem in messages] == [
        "content/00-start.md:9:6",
        "content/01-second.md:10:64",
        "content/references.yaml:8:1",
        "content/references.yaml:11:3",
    ]
    assert messages[3].endswith("unknown key 'yaer'; did you mean 'year'?")


FRONT = {
    "unknown rung": (
        'title: T\nsummary: S\nrung: "3"',
        "",
        ["4:1: unknown rung '3', not in content/site.yaml; known: 0, 1, 2"],
    ),
    "rung twice": ('title: T\nsummary: S\nrung: "0"', "", ["4:1: duplicate rung '0', also in content/00-start.md"]),
    "no front matter": ("", "", ["1:1: missing front matter"]),
    "unknown key": ("title: T\nsumary: S", "", ["3:1: unknown key 'sumary'; did you mean 'summary'?"]),
    "no title": ("summary: S", "", ["2:1: missing title: expected text"]),
    "another type": ("title: T\nrung: 1\nsummary: S", "", ["3:1: rung: expected text, got 1"]),
    "no yaml": ("title: [T", "", ["2:8: invalid YAML: unclosed list: missing ]"]),
    "a list for a key": ("[title]: T", "", ["2:1: invalid YAML: "]),
    "a control character": ('title: "a\x07"', "", ["2:10: invisible character U+0007: delete it"]),
    "separators of lines": (
        'title: T\nsummary: "a\u2028b\u2029c"',
        "A\u2028b.",
        ["3:12: invisible character U+2028: delete it; 2 more below"],
    ),
    "markup where text is plain": (
        "title: T of $x$\nsummary: S **b**\nquestion: Do `a` and *b*?\nnext:\n- to: index\n  says: See :ref[index].",
        "",
        [
            f"{position}: plain text only; {text!r} would be printed as is"
            for text, position in {
                "$x$": "2:1: title",
                "**": "3:1: summary",
                "`": "4:1: question",
                ":ref[": "7:3: says",
            }.items()
        ],
    ),
    "a date that is none": ("title: T\nsummary: 2001-02-31", "", ["2:1: invalid YAML: day is out of range for month"]),
    "a list within itself": ("title: T\nredirects: &r [*r]", "", ["2:1: invalid YAML: "]),
    "twice": ("title: T\ntitle: U\nsummary: S", "", ["3:1: duplicate key 'title'"]),
    "no page name": ("title: T\nslug: Ätsch\nsummary: S", "", ["3:1: invalid page name 'Ätsch': "]),
    "redirect no name": (
        "title: T\nsummary: S\nredirects: [ok, 'no/name']", "",
        ["4:17: invalid page name 'no/name': "],
    ),
    "own page": (
        "title: T\nslug: checks\nsummary: S",
        "",
        ["3:1: page name 'checks' is taken by a built-in page"],
    ),
}


@pytest.mark.parametrize("name", FRONT)
def test_a_fault_in_front_matter_is_told_at_its_place(project: Project, name: str) -> None:
    front, body, expected = FRONT[name]
    project.write("content/00-start.md", START.partition("Read")[0])
    if front:
        project.chapter(body, front)
    else:
        project.write("content/01-second.md", "Text.\n")
    messages = [problem.removeprefix("content/01-second.md:") for problem in project.problems()]
    assert len(messages) == len(expected), messages
    assert all(text.startswith(words) for text, words in zip(messages, expected, strict=True)), messages


def test_plain_text_may_hold_signs_of_markup(project: Project) -> None:
    project.write("content/03-plain.md", "---\ntitle: 2 * 3 * 4 at $5 or $6\nsummary: A_b and [c] (d) e\n---\n")
    project.build()
    assert "2 * 3 * 4 at $5 or $6" in project.page("plain.html")


def test_two_chapters_of_one_name_or_number(project: Project) -> None:
    project.write("content/01-other.md", "---\ntitle: T\nslug: second\nsummary: S\n---\n")
    project.write("content/notes.md", "Text\n")
    messages = project.problems()
    assert "content/01-second.md:0:0: duplicate chapter number, also in 01-other.md" in messages
    assert "content/notes.md:0:0: expected a file name like 01-kabsch.md: number, hyphen, name" in messages
    assert any("page name 'second' is taken by content/01-other.md" in problem for problem in messages)


SETTINGS = {
    "unknown key": (
        SITE.replace("author:", "autor:"),
        ["1:1: missing author: ", "3:1: unknown key 'autor'; did you mean 'author'?"],
    ),
    "address": (
        SITE.replace("https://example.org/ladder", "example.org"),
        ["5:1: url: expected an address starting with https://"],
    ),
    "rung": (
        SITE.replace('{rung: "1", ', "{rang: 1, "),
        ["12:5: missing rung: expected text", "12:6: unknown key 'rang'; did you mean 'rung'?"],
    ),
    "licence": (
        SITE.replace("  name: CC", "  nam: CC"),
        ["7:1: missing name: expected text", "8:3: unknown key 'nam'; did you mean 'name'?"],
    ),
    "empty": ("", ["1:1: empty site settings"]),
}


@pytest.mark.parametrize("name", SETTINGS)
def test_a_fault_in_the_settings_is_told_at_its_place(project: Project, name: str) -> None:
    text, expected = SETTINGS[name]
    project.write("content/site.yaml", text)
    name = "content/site.yaml:"
    messages = [problem.removeprefix(name) for problem in project.problems() if problem.startswith(name)]
    assert len(messages) == len(expected), messages
    assert all(message.startswith(words) for message, words in zip(messages, expected, strict=True)), messages


def test_what_is_not_utf8_is_named_in_every_file(project: Project) -> None:
    for name in ("site.yaml", "references.yaml", "01-second.md"):
        path = project.root / "content" / name
        path.write_bytes(path.read_bytes().replace(b"title: ", b"title: \xff", 1))
    assert [problem.partition(" from")[0] for problem in project.problems() if "invalid UTF-8" in problem] == [
        "content/01-second.md:2:8: invalid UTF-8",
        "content/references.yaml:3:10: invalid UTF-8",
        "content/site.yaml:1:8: invalid UTF-8",
    ]


def test_a_fault_in_the_references_is_told_at_its_place(project: Project) -> None:
    text = REFERENCES.replace("authors: [Ada One]", "authors: Ada One").replace("10.1000/one", "doi.org/10.1000/one")
    text = text.replace("https://example.org/two", "www.example.org")
    project.write("content/references.yaml", text)
    assert project.problems() == [
        "content/references.yaml:2:3: authors: expected a list of names, got 'Ada One'",
        "content/references.yaml:5:3: doi: expected a DOI like 10.1109/34.88573, got 'doi.org/10.1000/one'",
        "content/references.yaml:12:3: url: expected an http or https URL, got 'www.example.org'",
    ]


def test_a_work_that_cannot_be_looked_up_is_warned_of(project: Project) -> None:
    project.write("content/references.yaml", REFERENCES.replace("  doi: 10.1000/one\n", ""))
    assert list(map(str, project.build().warnings)) == ["content/references.yaml:1:1: one2001: missing doi or url"]


def test_a_strict_build_minds_warnings_and_tells_notes(project: Project) -> None:
    extra = "\nspare:\n  authors: [No One]\n  title: Unused\n  year: 1999\n  url: https://example.org/\n"
    project.write("content/references.yaml", REFERENCES + extra)
    assert project.build().warnings == ()
    (note,) = project.build(strict=True).warnings
    assert str(note) == "content/references.yaml:14:1: unused reference spare"
    project.chapter("\nText, and a [link](index.html).\n", 'title: T\nrung: "1"\nslug: second')
    project.write("content/00-start.md", START.partition("Read")[0])
    warning = "missing summary: search results and link previews show it"
    assert [w.message for w in project.build().warnings] == [warning]
    assert project.problems(strict=True) == [f"content/01-second.md:2:1: {warning}"]


def test_a_figure_that_cannot_be_drawn_is_named(project: Project) -> None:
    from dataclasses import replace

    def fails(state: object) -> object:
        raise ZeroDivisionError("by nought")

    project.widgets["toy"] = replace(project.widgets["toy"], draw=fails)  # type: ignore[arg-type]
    project.chapter("::figure[C]{toy id=broken}\n")
    project.write("content/00-start.md", START.partition("Read")[0])
    message = "figure toy, draw: ZeroDivisionError: by nought (preset default; placed at content/01-second.md:7)"
    assert project.problems() == [f"content/01-second.md:7:1: {message}"]
