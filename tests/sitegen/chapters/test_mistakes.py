"""Authors' mistakes: each is reported once, at its exact place, in helpful words; and all of them in one build.

A mark ¦ comes before each place that must be named.
"""

from __future__ import annotations

import re

import pytest

from tests.sitegen.conftest import START, Project

FRONT = "---\ntitle: T\nslug: second\nsummary: S\n---\n"
GLOSSARY = "gate:\n  term: Gate\n  says: How far a partner may lie.\n  chapter: second\n"

# A piece of a chapter, and the message for each mark. Mere consequences of a mistake are not reported.
TEXT = {
    "a widget": ("::figure[C]{¦tou id=a1}\n\n::try[T]{a1 noise=2}\n\n:ref[fig:a1] :readout[a1 x]", ["mean 'toy'?"]),
    "a preset": ("::figure[C]{toy preset=¦noise id=a2}\n\n:ref[fig:a2]", ["no preset 'noise'; did you mean 'noisy'?"]),
    "a control": ("::figure[C]{toy ¦nose=0.5 id=a3}", ["toy has no control 'nose'; did you mean 'noise'?"]),
    "presets": ("::figure[C]{toy ¦presets=noisy id=a4}", ["no control 'presets'; did you mean 'preset'?"]),
    "attributes of a remark": ("::aside[R]{¦b1 noise=3}", ["::aside takes no attributes"]),
    "attributes of a remark in a list": ("- one\n\n  ::aside[R]{¦b1}", ["::aside takes no attributes"]),
    "a value out of range": ("::figure[C]{toy noise=¦1.5 id=a5}", ["noise: 1.5 lies outside 0 … 1"]),
    "a decimal comma": ("::figure[C]{toy noise=¦0,5 id=a6}", ["noise: '0,5' is not a number"]),
    "blanks around =": (
        "::figure[C]{toy ¦preset = noisy id=a7}\n\n:ref[fig:a7]",
        ["expected name=value, without spaces around the ="],
    ),
    "two faults of one line": (
        "::figure[C]{toy nose=1 ¦loud=7 id=a8}".replace("nose", "¦nose").replace("¦loud=", "loud=¦"),
        ["no control 'nose'", "loud: 7 is neither true nor false"],
    ),
    "a button": (
        "::figure[C]{toy id=a9}\n\n::try[T]{a9 press=go,¦goo}",
        ["no button 'goo' to press; did you mean 'go'?"],
    ),
    "a preset of a button": ("::figure[C]{toy id=b0}\n\n::try[T]{b0 ¦preset=noisy}", ["set it on the ::figure"]),
    "a figure of no id": (
        "::figure[C]{toy id=b1}\n\n::try[T]{¦b11}",
        ["unknown figure 'b11' in this chapter; did you mean"],
    ),
    "a caption never closed": ("::figure¦[C {toy id=b2}\n\n:ref[fig:b2]", ["unclosed '[': missing ']'"]),
    "a claim never closed": ("So :claim¦[it holds{x}.", ["unclosed '[': missing ']'"]),
    "no brackets": ("¦::figure{toy id=b3}\n\n:ref[fig:b3]", ["expected ::name[text]{attributes}"]),
    "a directive's name": (
        "¦::figre[C]{toy id=b4}\n\n:ref[fig:b4]",
        ["unknown directive ::figre; did you mean 'figure'?"],
    ),
    "one colon": ("¦:figure[C]{toy id=b5}\n\n:ref[fig:b5]", ["on a line of its own, use two colons"]),
    "a figure in a line": (
        "Text ¦::figure[C]{toy id=d0} more\n\n:ref[fig:d0] :readout[d0 x]\n\n::try[T]{d0 noise=2}",
        ["::figure must start a line of its own"],
    ),
    "a plot in a list's words": ("- one\n- two ¦::plot[C]{toy-plot id=d1}\n", ["::plot must start a line of its own"]),
    "a figure deep in a paragraph": ("Text\n      ¦::figure[C]{toy}", ["::figure must start a line of its own"]),
    "two colons in a line": ("A ¦::term[gate]{gate}.", ["unknown directive ::term; inside a line, use one colon"]),
    "two colons in a cell": (
        "| a |\n| - |\n| ¦::ref[second] |",
        ["unknown directive ::ref; inside a line, use one colon"],
    ),
    "two colons in a caption": (
        "::figure[C ¦::term[gate]{gate}]{toy id=d2}",
        ["unknown directive ::term; inside a line, use one colon"],
    ),
    "three colons in a line": ("A ¦:::term[gate]{gate}.", ["unknown directive :::term; inside a line, use one colon"]),
    "two colons and a slip": ("A ¦::tern[gate]{gate}.", ["unknown directive ::tern; did you mean 'term'?"]),
    "a word before": ("See¦:term[gate]{gate}.", [":term cannot directly follow a letter or digit"]),
    "no brackets in a line": ("A ¦:term{gate}.", ["expected :term[text]{…}"]),
    "no brackets where a line starts": ("¦:term{gate} and no full stop", ["expected :term[text]{…}"]),
    "never closed in a line": ("A ¦::term[gate{gate}.", ["unknown directive ::term; inside a line, use one colon"]),
    "the end of no block": ("Text.\n\n¦:::", ["unmatched ':::': no block is open"]),
    "an indented directive": ("- a\n\nText\n\n\t¦::figure[C]{toy id=b6}\n\n:ref[fig:b6]", ["indented by a tab"]),
    "an equation never closed": (
        "¦$$\nE = m c^2\n\nText.",
        ["unclosed equation: missing $$ before the next blank line"],
    ),
    "an equation in a paragraph": (
        "As we saw\n¦$$\nE = m\n$$ (b7)\nand :ref[eq:b7].",
        ["put the equation on lines of its own, after a blank one"],
    ),
    "a label in braces": ("¦$$\nE = m\n$$ {#e5}\n\nBy :ref[eq:e5].", ["label an equation after its closing $$"]),
    "a label in brackets": ("- So\n\n  ¦$$ E $$ [e6]\n\nBy :ref[eq:e6].", ["label an equation after its closing $$"]),
    "a label first": ("¦$$ (e4)\nE = m\n$$\n\nBy :ref[eq:e4].", ["label an equation after its closing $$: $$ (label)"]),
    "a label first in a list": ("- So\n\n  ¦$$ (e7)\n  E = m $$\n  and :ref[eq:e7].", ["label an equation after its"]),
    "a formula never closed": (
        "The sum ¦$a_i + b holds.",
        ["unclosed formula: missing $; write \\$ for a literal dollar"],
    ),
    "LaTeX": ("The sum $x + ¦\\frb{y}$ holds.", ["formula: Unsupported function name: \\frb"]),
    "LaTeX in lines": ("$$\na +\n  ¦\\frb{y}\n$$ (b8)\n\n:ref[eq:b8]", ["formula: Unsupported function name: \\frb"]),
    "a label twice": ("$$\nx\n$$ (b9)\n\n$$\ny\n$$ (¦b9)", ["duplicate equation 'b9'"]),
    "a reference": (
        "$$\nx\n$$ (energy)\n\nBy :ref[¦eq:energi].",
        ["unknown equation 'energi'; did you mean 'energy'?"],
    ),
    "a reference without its kind": ("$$\nx\n$$ (inertia)\n\nBy :ref[¦inertia].", ["did you mean 'eq:inertia'?"]),
    "a figure that is none": ("::figure[C]{toy id=c0}\n\nBy :ref[¦fig:c00].", ["unknown figure 'c00'; did you mean"]),
    "a kind of target": ("See :ref[¦figure:plain].", ["unknown chapter 'figure:plain'"]),
    "a chapter": ("See :ref[¦secnd].", ["unknown chapter 'secnd'; did you mean 'second'?"]),
    "a citation": ("As [@one2001; @¦tow2002] say.", ["unknown reference 'tow2002'; did you mean 'two2002'?"]),
    "a citation never closed": ("As ¦[@one2001 says.", ["unclosed citation: missing ']'"]),
    "a test": (
        ":claim[It holds.]{¦tests/test_claimed.py::test_it_hold}",
        ["did you mean 'tests/test_claimed.py::test_it_holds'?"],
    ),
    "a claim without a test": (":claim[It holds.]¦", ["missing test, as in {tests/file.py::test_name}"]),
    "a plot": ("::plot[C]{¦toyplot id=c1}\n\n:ref[fig:c1]", ["unknown plot 'toyplot'; did you mean 'toy-plot'?"]),
    "a value's name": ("It is :value[solvers.metrics.¦rsm(1)].", ["solvers.metrics has no 'rsm'; did you mean 'rms'?"]),
    "a value that fails": ('It is :value[¦solvers.core.validate.number("a", "x")].', ["ValueError: "]),
    "a readout": (
        "::figure[C]{toy id=c2}\n\nIt is :readout[c2 ¦press].",
        ["unknown readout 'press'; did you mean 'presses'?"],
    ),
    "a term": ("A :term[gate]{¦gat}.", ["unknown glossary term 'gat'; did you mean 'gate'?"]),
    "a level left out": ("## One\n\n¦#### Two", ["skipped heading level: level 4 after level 2"]),
    "a heading without a blank": ("¦##Three", ["missing space after ##"]),
    "an image that is not there": (
        "![A line](¦lin.svg)",
        ["image not found: content/lin.svg; did you mean 'line.svg'?"],
    ),
    "an image without words": ("![](¦line.svg)", ["missing alternative text"]),
    "a page": ("[that](¦secnd.html)", ["unknown page 'secnd.html'; did you mean 'second.html'?"]),
    "an anchor": ("## There\n\n[that](¦#ther)", ["unknown anchor 'ther' on second.html; did you mean 'there'?"]),
    "a footnote": ("A note.¦[^c3]", ["unknown footnote [^c3]"]),
    "a language": ("¦```pyhton\nx\n```", ["unknown language 'pyhton'; did you mean 'python'?"]),
    "code never closed": (
        "¦```python\nx = 1\n\n::figure[C]{toy id=c4}\n\n:ref[fig:c4]",
        ["unclosed code block"],
    ),
    "code whose end is left out": (
        "¦```python\nx = a[$1]\n# d :ref[no]\n\n::figure[C]{toy id=d4}\n\n```python\ny\n```\n\n:ref[fig:d4] [@¦no]",
        ["unclosed code block '```python': end it with a line of ``` alone; line ", "unknown reference 'no'"],
    ),
    "code whose end has words": (
        "¦```python\nx\n``` python\n\n::figure[C]{toy id=d5}\n\n```python\ny\n```\n\n:ref[fig:d5]",
        ["'``` python', does not end it"],
    ),
    "code in a list never closed": (
        "- a\n\n  ¦```python\n  x\n\n::figure[C]{toy id=d6}\n\n:ref[fig:d6]",
        ["unclosed code block '```python'"],
    ),
    "a merge": (
        "¦<<<<<<< HEAD\nOurs [@one2001].\n=======\nTheirs [@no].\n>>>>>>> branch\n",
        ["unresolved merge conflict, up to line"],
    ),
}

# Code blocks that leave a fence without its pair, each in a chapter of its own.
FENCES = {
    "of two without a language the first": "¦```\nx\n\n::figure[C]{toy id=d7}\n\n```\ny\n```\n\n:ref[fig:d7]",
    "more backticks": "¦````python\nx\n```\n\n::figure[C]{toy id=d8}\n\n:ref[fig:d8]",
    "tildes": "¦~~~\nx\n```\n\n::figure[C]{toy id=d9}\n\n:ref[fig:d9]",
    "an end too far in": "¦```\nx\n    ```\n\n::figure[C]{toy id=e0}\n\n:ref[fig:e0]",
    "an end behind code": "¦```\nx = 3 ```\n\n::figure[C]{toy id=e1}\n\n:ref[fig:e1]",
}

# A chapter's file, and the message for each mark; the rest of the file is still read.
FILES = {
    "20-colon.md": ("---\ntitle: Pairs¦: known\nslug: colon\n---\n", ["quote text that contains it"]),
    "21-quote.md": (
        '---\ntitle: ¦"Pairs\nslug: quote\nsummary: S\n---\n',
        ["unclosed quote"],
    ),
    "22-tab.md": ("---\ntitle: T\n¦\tslug: tab\nsummary: S\n---\n", ["tab character: indent with spaces"]),
    "23-indent.md": ("---\ntitle: T\n slug¦: indent\nsummary: S\n---\n", ["align names with their neighbours"]),
    "24-key.md": ("---\ntitle: T\nslug: key\n¦sumary: S\n---\n", ["unknown key 'sumary'; did you mean 'summary'?"]),
    "25-number.md": ("---\ntitle: T\nslug: number\nsummary: S\n¦rung: 1\n---\n", ['quote it: rung: "1"']),
    "26-rung.md": (
        '---\ntitle: T\nslug: rung\nsummary: S\n¦rung: "7"\n---\n',
        ["unknown rung '7', not in content/site.yaml"],
    ),
    "27-open.md": (
        "¦---\ntitle: T\nslug: open\nsummary: S\n\nSee :ref[start].\n",
        ["unclosed front matter: end it with a line of ---"],
    ),
    "28-bare.md": ("¦Text.\n", ["missing front matter"]),
    "29-empty.md": ("¦", ["empty file"]),
    "30-slug.md": ("---\ntitle: T\n¦slug: second\nsummary: S\n---\n", ["is taken by content/01-second.md"]),
    "30b-emblem.md": (
        "---\ntitle: T\nslug: emblem\nsummary: S\n¦emblem: neares\n---\n",
        ["unknown dial 'neares'; did you mean 'nearest'?"],
    ),
    "31-latin.md": ("---\ntitle: T\nslug: latin\nsummary: S\n---\n\nA caf¦é.\n", ["invalid UTF-8 from here on"]),
    "32-utf16.md": ("¦---\ntitle: T\nslug: utf16\nsummary: S\n---\n", ["expected UTF-8, got UTF-16"]),
    "33-windows.md": ("---\ntitle: T\nslug: windows\nsummary: S\n---\n\n[@¦no]\n", ["unknown reference 'no'"]),
    "34-tab-list.md": ("---\ntitle: T\nredirects:\n¦\t- old-list\nsummary: S\n---\n", ["tab character: indent with"]),
    "35-tab-dash.md": ("---\ntitle: T\nslides:\n  -¦\ttitle: A\n---\n", ["tab character: indent with spaces"]),
    "36-quote-later.md": (
        '---\ntitle: ¦"Pairs\nslug: later\nsummary: "S"\n---\n',
        ["unclosed quote"],
    ),
    "37-quote-slides.md": (
        "---\ntitle: T\nslides:\n  - title: A\n    text: ¦'B\n    notes: C\n  - title: 'D'\n    text: E\n---\n",
        ["unclosed quote"],
    ),
    "38-apostrophe.md": (
        "---\ntitle: 'It¦'s T'\nslug: its\nsummary: S\n---\n",
        ["use double quotes for text with a '"],
    ),
    "39-escape.md": ('---\ntitle: "The ¦\\R"\nslug: escape\nsummary: S\n---\n', ["unknown escape: use single quotes"]),
    "unnumbered.md": ("---\ntitle: T\nsummary: S\n---\n", ["expected a file name like 01-kabsch.md"]),
}
SAVED = {
    "31-latin.md": lambda text: text.encode("latin-1"),
    "32-utf16.md": lambda text: text.encode("utf-16"),
    "33-windows.md": lambda text: b"\xef\xbb\xbf" + text.replace("\n", "\r\n").encode(),
}
LINE = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 30 20"><path d="M0 0h9"/></svg>'


def places(text: str, first: int) -> list[str]:
    """The marks' places as line:column, if the text begins in line `first`."""
    result, plain = [], ""
    for piece in text.split("¦")[:-1]:
        plain += piece
        result.append(f"{first + plain.count(chr(10))}:{len(plain) - plain.rfind(chr(10))}")
    return result


@pytest.fixture
def desk(project: Project) -> Project:
    """The small site with a glossary, an image, and a first chapter that refers to nothing."""
    project.write("content/00-start.md", START.partition("Read")[0].replace("---\n", "---\nslug: start\n", 1))
    project.write("content/glossary.yaml", GLOSSARY)
    project.write("content/line.svg", LINE)
    project.write("content/01-second.md", FRONT)
    return project


def agree(problems: list[str], expected: list[tuple[str, str]]) -> None:
    """Check that each problem has its place and contains its words, in order, and that there are no others."""
    pairs = [re.fullmatch(r"(?s)content/(\S+?:\d+:\d+): (.*)", problem) for problem in problems]
    messages = [(match[1], match[2]) for match in pairs if match]
    assert [position for position, _ in messages] == [position for position, _ in expected], "\n".join(problems)
    for (position, message), (_, words) in zip(messages, expected, strict=True):
        assert words in message, f"{position}: {message}"


@pytest.mark.parametrize("name", TEXT)
def test_a_mistake_in_the_text(desk: Project, name: str) -> None:
    text, words = TEXT[name]
    desk.write("content/01-second.md", FRONT + text.replace("¦", "") + "\n")
    agree(desk.problems(), [(f"01-second.md:{at}", word) for at, word in zip(places(text, 6), words, strict=True)])


@pytest.mark.parametrize("name", FENCES)
def test_a_fence_that_is_left_over_is_told_once(desk: Project, name: str) -> None:
    desk.write("content/01-second.md", FRONT + FENCES[name].replace("¦", "") + "\n")
    agree(desk.problems(), [("01-second.md:6:1", "unclosed code block")])


def test_code_may_hold_shorter_and_other_fences(desk: Project) -> None:
    text = "````text\n```python\nx\n```\n````\n\n~~~text\n```python\n~~~\n\n> ```\n> ::figure[C]{toy}\n> ```\n"
    desk.write("content/01-second.md", FRONT + text)
    desk.build()
    assert desk.page("second.html").count('<pre class="code"') == 3


def test_colons_in_words_and_in_code_are_no_directives(desk: Project) -> None:
    text = "C++ has std::vector[0], at 12:30 [sic] a note: figure [2], `A ::term[x]{y}`; \\::figure[C]{toy} is text.\n"
    desk.write("content/01-second.md", FRONT + text)
    desk.build()
    assert "std::vector[0]" in desk.page("second.html")


def save(desk: Project, name: str) -> list[tuple[str, str]]:
    """Write one of the faulty files; return the expected problems."""
    text, words = FILES[name]
    data = SAVED.get(name, str.encode)(text.replace("¦", ""))
    (desk.root / "content" / name).write_bytes(data)
    return [(f"{name}:{at}", message) for at, message in zip(places(text, 1) or ["0:0"], words, strict=True)]


@pytest.mark.parametrize("name", FILES)
def test_a_mistake_of_a_file(desk: Project, name: str) -> None:
    expected = save(desk, name)
    agree(desk.problems(), expected)


def test_all_mistakes_are_told_in_one_build(desk: Project) -> None:
    """The mistakes of one text and of all files together: each is reported once, and none of their consequences."""
    slugs = re.findall(r"slug: (\w+)", "".join(text for text, _ in FILES.values()))
    start = (desk.root / "content/00-start.md").read_text("utf-8") + "".join(f":ref[{slug}]\n" for slug in slugs)
    desk.write("content/00-start.md", start)
    last = "code never closed"  # the text after it is still read, except what looks like its end
    texts = {name: TEXT[name][0] for name in sorted(TEXT, key=lambda name: name == last)}
    body, expected = "", []
    for name, text in texts.items():
        first = 6 + body.count("\n")
        expected += [(f"01-second.md:{at}", word) for at, word in zip(places(text, first), TEXT[name][1], strict=True)]
        body += text.replace("¦", "") + "\n\n"
    desk.write("content/01-second.md", FRONT + body)
    for name in FILES:
        expected += save(desk, name)
    agree(desk.problems(), expected)


@pytest.mark.parametrize("name", ["references.yaml", "glossary.yaml", "site.yaml"])
def test_what_a_faulty_list_would_have_named_is_no_mistake(desk: Project, name: str) -> None:
    """With one unclosed quote in a list, its citations, terms, rungs and macros are not reported as unknown."""
    desk.write("content/01-second.md", FRONT + "[@one2001] :term[gate] $\\R$\n")
    path = desk.root / "content" / name
    text = path.read_text("utf-8")
    desk.write(f"content/{name}", text.replace(": ", ': "', 1) if '"' not in text.split("\n")[0] else "a: [")
    assert [problem.split(": ")[1] for problem in desk.problems()] == ["invalid YAML"]


@pytest.mark.parametrize("name", ["references.yaml", "glossary.yaml", "site.yaml"])
@pytest.mark.parametrize("text", ["- one2001\n- gate\n", "one2001 and gate\n"], ids=["list", "text"])
def test_a_file_of_entries_that_is_none_is_told_once(desk: Project, name: str, text: str) -> None:
    """A list or a sentence instead of keys: the file is there, and what it would have named is not missed."""
    desk.write("content/01-second.md", FRONT + "[@one2001] :term[gate] $\\R$\n")
    desk.write(f"content/{name}", text)
    (message,) = desk.problems()
    assert message.startswith(f"content/{name}:1:1: expected a mapping of ")


LISTS = {
    "references.yaml": (
        "one2001:\n  authors: [¦\"Ada One]\n  title: First\n  year: 2001\n  url: https://a.org\ntwo2002:\n"
        "  authors: [Ben Two]\n  title: \"Second\"\n",
        "two2002:\n  authors: [Ben Two]\n¦\ttitle: Second\n",
    ),
    "glossary.yaml": (
        "gate:\n  term: ¦\"Gate\n  says: How far.\nother:\n  term: Other\n  says: \"It is\"\n",
        "gate:\n¦\tterm: Gate\n\tsays: How far.\n",
    ),
    "site.yaml": (
        "title: T\nladder:\n  - {rung: ¦\"0, title: Start}\n  - {rung: \"1\", title: Known}\n",
        "title: T\nladder:\n¦\t- {rung: \"0\", title: Start}\n",
    ),
}


@pytest.mark.parametrize("name", LISTS)
def test_quotes_and_tabs_of_the_lists_are_told_where_they_are(desk: Project, name: str) -> None:
    for text, message in zip(LISTS[name], ("unclosed quote", "tab character: indent with"), strict=True):
        desk.write(f"content/{name}", text.replace("¦", ""))
        agree(desk.problems(), [(f"{name}:{places(text, 1)[0]}", message)])
