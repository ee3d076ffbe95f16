"""Text that looks like markup but is not is reported with its place, instead of being printed or lost."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from tests.sitegen.conftest import START, Project

# The body of a chapter, from its line 7 on, and the build's messages.
SLIPS = {
    "words after a block's name": (":::evidence more\nA\n:::\n", ["7:1: unexpected text after :::evidence"]),
    "a title for a block": (":::answer[Yes]\nA\n:::\n", ["7:1: unexpected text after :::answer"]),
    "a heading with a blank that does not break": (
        "##\u00a0Head\n",
        ["7:1: non-breaking space after ##: use a plain one"],
    ),
    "a comment": ("A <!-- todo --> b\n", ["7:3: <!--: HTML is not supported and would be printed as is"]),
    "what a PDF leaves": (
        "A\nb c\x02d\x1b \ufeffe\n",
        ["8:4: invisible character U+0002: delete it; 2 more below"],
    ),
    "a tag": (
        "A <b>c</b>\n",
        [f"7:{n}: {tag}: HTML is not supported and would be printed as is" for n, tag in ((3, "<b>"), (7, "</b>"))],
    ),
    "tags of every kind": (
        "A <code>b, <svg width='3'>, <wbr/> and\n<input> </figcaption>\n",
        [
            f"{at}: {tag}: HTML is not supported and would be printed as is"
            for at, tag in {
                "7:3": "<code>", "7:12": "<svg width='3'>", "7:29": "<wbr/>", "8:1": "<input>", "8:9": "</figcaption>",
            }.items()
        ],
    ),
    "a blank in an address": ("A [b](c d.html) e\n", ["7:5: space in a link address: write %20"]),
    "LaTeX's parentheses": ("A \\(a\\) b\n", ["7:3: write formulas between dollars: $a$"]),
    "LaTeX's environment": ("\\begin{equation}\nx\n", ["7:1: write equations between two lines of $$"]),
    "a note in its place": (
        "A^[b] ^[c]\n",
        ["7:7: write footnotes as a mark, [^name], and a line that starts with [^name]:"],
    ),
    "an indented paragraph": (
        "A\n\n    B :claim[c]{tests/no.py::test_no} and\n    d\n\n>     e\n",
        [
            f"{at}: indented by a tab or four spaces, this is code: unindent it, or put code between lines of ```"
            for at in ("9:5", "12:7")
        ],
    ),
    "a width": ("A [b](second.html){width=50%} and (c){d=e}\n", ["7:5: an image or link takes no {…}"]),
    "a class": ("A [b](second.html){.wide} and (c){d}\n", ["7:5: an image or link takes no {…}"]),
    "a box to tick": (
        "- [ ] A [b] == c\n- [x] B\n",
        ["7:3: [ ]: boxes to tick are not supported", "8:3: [x]: boxes to tick are not supported"],
    ),
    "a coloured box": ("> [!NOTE]\n> A\n", ["7:3: [!NOTE]: write an ::aside, or the words in bold"]),
    "a highlight": ("A ==b c==, d `e ==f==` and g == h == i\n", ["7:3: ==: write *emphasis* or **strong**"]),
    "a table of one line": (
        "| a | b |\n| 1 | 2 |\n",
        ["7:1: missing | --- | --- | after the table's first row, with as many cells"],
    ),
    "text directly below a table": (
        "| a | b |\n| - | - |\n| 1 | 2 |\nText\nand more\n",
        ["10:1: missing blank line after the table"],
    ),
    "a cell too many": (
        "| a | b |\n| - | - |\n| 1 | 2 | 3 |\n",
        ["9:1: row of 3 cells in a table of 2 columns"],
    ),
    "a cell too many in a list": (
        "- | a | b |\n  | - | - |\n  | 1 | 2 | 3 |\n",
        ["9:1: row of 3 cells in a table of 2 columns"],
    ),
    "a directive of two lines in a quotation": (
        "> A\n>\n> ::aside[a long\n> remark]\n\n- ::aside[a long\n  remark > 1]\n",
        ["9:3: in a quotation, a directive must fit on one line"],
    ),
    "a capital": ("::Aside[C]\n", ["7:1: expected ::aside[text]{…}"]),
    "a blank after the colons": (":: aside[C]\n", ["7:1: expected ::aside[text]{…}"]),
    "parentheses": ("A :ref(second)\n", ["7:3: expected :ref[text]{…}"]),
    "an anchor without its sign": ("## Head {part}\n", ["7:9: expected {#name} at the end of the heading"]),
    "an anchor and a full stop": ("## Head {#part}.\n", ["7:9: expected {#name} at the end of the heading"]),
    "an anchor without its sign after a number": (
        "## Of :value[1]{.1f} {part}\n",
        ["7:22: expected {#name} at the end of the heading"],
    ),
    "a reference in a heading": (
        "## See :ref[second] {#a}\n",
        ["7:8: a heading cannot contain references, citations or footnotes"],
    ),
    "a heading of nothing": ("## {#a}\n", ["7:1: empty heading"]),
    "a link to nothing": (
        "A [b]() c [d](https://)\n",
        [f"7:{n}: missing link address: [words](address)" for n in (7, 15)],
    ),
    "a link of nothing": ("A [](second.html)\n", ["7:6: missing link text: [words](address)"]),
    "a file of the author's own": (
        "A [b](file:///C:/b.csv)\n",
        ["7:5: links to data:, file: or scripts are not allowed"],
    ),
    "a link's address that stands nowhere": (
        "A [b][c] and [d][e] and [f][]\n\n[e]: second.html\n",
        [
            f"7:{n}: missing '[{name}]: address' for this link; or write [words](address)"
            for n, name in ((3, "c"), (25, "f"))
        ],
    ),
    "a link's address that stands twice": (
        "A [b][c]\n\n[c]: second.html\n[c]: #a\n\n## Head {#a}\n",
        ["10:1: duplicate [c], with another address on line 9"],
    ),
    "bold text that never ends": (
        "Some **bold** text, **then *more*\nand &amp; **so on\n",
        [
            f"{position}: unmatched **: the other half is missing, or there are spaces just inside"
            for position in ("7:21", "8:11")
        ],
    ),
    "code that never ends": (
        "Call `a` and ``b`\n",
        ["7:14: unclosed `` in this paragraph; write \\` for a literal backtick"],
    ),
    "an address with a space, of words that are marked up": (
        "[`x`](c d.html)\n\n[*x*](c d.html)\n",
        [f"{position}: space in a link address: write %20" for position in ("7:5", "9:5")],
    ),
    "a block of nothing": ("A\n\n:::answer\n\n:::\n", ["9:1: empty :::answer"]),
    "a link in a link": (
        "[a :ref[second]](second.html)\n\nA [a [b](second.html)](second.html) x.\n\n[see[^1] x](second.html)\n\n"
        "[^1]: y\n",
        [f"{position}: a link cannot contain another: move it out" for position in ("7:4", "9:22", "11:11")],
    ),
}  # fmt: skip

FINE = (
    "`<b>` and `| a |` and `:Ref[x]` and `\\(a\\)`.\n",
    "$a < b > c$ and `<b>` alone: no.\n",
    "Two columns: value (in u), 5 < 6, \\<b> and x^2.\n",
    "| a \\| b | c |\n| - | - |\n| 1 | `2` |\n",
    "A [link](second.html \"with a title\") and <https://example.org/>.\n",
    "- In a list:\n\n  :::evidence\n  A\n  :::\n",
    ":::evidence\nA\n::: \n",
    "> :::answer\n> A\n> :::\n",
    ":value[ 1 + 1 ] is two.\n",
    "1. | a | b |\n   | - | - |\n   | 1 | 2 |\n\n> a | b\n> --|--\n> 1 | 2\n",
    "[Its sources](#works-cited) are one.[^n]\n\n[^n]: [@one2001]\n",
    "\\*\\*a \\` 2 * 3 * 4, ***b*** and ``a ` b``, :value[2**3] and `2**3`.\n",
    "[a] (b) and f[0] (x), `[a](b c)`. The interval ]($a$, 2).\n",
    "[a][B], [b][], [b]\\[c], `x[a][0]`, x[a][0] and [[d]].\n\n[b]: second.html\n[b]: second.html\n"
    "[//]: # (one)\n[//]: # (two)\n",
)


@pytest.fixture(name="problems_of")
def _problems_of(project: Project) -> Callable[[str], list[str]]:
    """The problems of a small site whose first chapter has this body."""

    def problems_of(body: str) -> list[str]:
        project.write("content/00-start.md", START.partition("Read")[0] + body)
        return [line.partition("content/00-start.md:")[2] for line in project.problems()]

    return problems_of


@pytest.mark.parametrize(("body", "expected"), SLIPS.values(), ids=SLIPS)
def test_a_slip_is_told_with_its_place(problems_of: Callable[[str], list[str]], body: str, expected: list[str]) -> None:
    assert problems_of(body) == expected


@pytest.mark.parametrize("body", FINE)
def test_what_is_meant_as_it_stands_is_no_slip(project: Project, body: str) -> None:
    project.write("content/00-start.md", START.partition("Read")[0] + body)
    assert project.build().warnings == ()


@pytest.mark.parametrize("body", ["1. A\n\n   :::answer\n   Because.\n   :::\n", "> :::answer\n> Because.\n> :::\n"])
def test_a_block_folds_in_a_list_and_a_quotation_too(project: Project, body: str) -> None:
    project.write("content/00-start.md", START.partition("Read")[0] + body)
    project.build()
    fold = '<details class="fold answer">\n<summary>Answer</summary>\n<p>Because.</p>\n</details>'
    assert fold in project.page("index.html")


def test_a_claim_in_a_claim_and_directives_in_alternative_text_are_told(project: Project) -> None:
    """Either would be lost silently: the inner claim's test, and the directive's result. A claim in a link would put
    one link into another."""
    body = ":claim[A :claim[B]{x} c]{y}\n\n![A :value[1]](a.png)\n\n[A :claim[B]{x}](second.html)\n"
    project.write("content/00-start.md", START.partition("Read")[0] + body)
    messages = [line.partition("content/00-start.md:")[2] for line in project.problems()]
    assert "7:10: a claim cannot contain another: move it out" in messages
    assert "11:4: a link cannot contain another: move it out" in messages
    assert any("alternative text must be plain: no directives or citations" in line for line in messages)


def test_an_editor_s_own_files_are_passed_over(project: Project) -> None:
    """A lock file, which is a dangling link, is not a chapter; a dangling link with a chapter's name is reported."""
    (project.root / "content/.#00-start.md").symlink_to("someone@host.1")
    project.build()
    (project.root / "content/30-gone.md").symlink_to("nowhere")
    assert project.problems() == ["content/30-gone.md:0:0: expected a file, got a folder or a broken link"]


@pytest.mark.parametrize("name", ["glossary", "references"])
def test_a_file_that_is_gone_is_named_once(project: Project, name: str) -> None:
    (project.root / f"content/{name}.yaml").unlink(missing_ok=True)
    uses = ":term[a] and :term[b]" if name == "glossary" else "[@one2000] and [@two2001]"
    project.write("content/00-start.md", START.partition("Read")[0] + uses + ".\n")
    project.write("content/01-second.md", "---\ntitle: T\nslug: second\nsummary: S\n---\n\nText.\n")
    assert project.problems() == [f"content/{name}.yaml:0:0: required file is missing or empty"]
