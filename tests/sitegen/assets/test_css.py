"""Style sheets as a parser reads them."""

from __future__ import annotations

import re
from pathlib import Path

from sitegen.assets.css import Rule, Url, functions, imports, rules, urls

SHEET = """\
/* a { } */
.a:is(.b, .c) > d, [x="e, f"] { color: red; --tone: light-dark(#ffffff, rgb(0, 0, 0)); }
@media print { .a { color: blue } }
.g{margin:0 auto!important;/* nothing */padding:/* less */1px}
"""

ROOT = Path(__file__).resolve().parents[3]


def test_rules_are_those_of_every_screen() -> None:
    """Commas within brackets and strings do not split selectors; comments and conditional rules are left out."""
    assert list(rules(SHEET)) == [
        Rule((".a:is(.b, .c) > d", '[x="e, f"]'), (("color", "red"), ("--tone", "light-dark(#ffffff, rgb(0, 0, 0))"))),
        Rule((".g",), (("margin", "0 auto !important"), ("padding", "1px"))),
    ]


def test_the_arguments_of_a_function() -> None:
    assert list(functions("light-dark(#ffffff, rgb(0, 0, 0)) light-dark(a,b) dark(c)", "light-dark")) == [
        ["#ffffff", "rgb(0, 0, 0)"],
        ["a", "b"],
    ]


def test_an_address_is_told_where_it_stands() -> None:
    """Quoted or not, inside a conditional rule or in a list; an address in a comment is ignored."""
    sheet = "/* url(no.png) */\n@media print {\n  a { background: none, url(one.svg) }\n}\nb { src: url( 'two.png' ) }"
    results = list(urls(sheet))
    assert results == [Url("one.svg", 3, 29), Url("two.png", 5, 16)]
    lines = sheet.splitlines()
    assert all(lines[url.line - 1][url.column - 1 :].startswith(url.address) for url in results)


def test_imports_are_told_where_their_addresses_stand() -> None:
    sheet = "/* @import 'no.css'; */\n@import \"base/a.css\" screen;\n@import url(b.css);\na { content: 'no.css' }"
    assert list(imports(sheet)) == [Url("base/a.css", 2, 10)]
    assert [url.address for url in urls(sheet)] == ["b.css"]


def test_no_element_of_any_kind_is_asked_how_many_children_it_has() -> None:
    """With `.many > :has(> .panel-half:nth-child(4))`, Chromium laid out the whole page again at every frame of a drag:
    11 ms instead of 2."""
    bare = re.compile(r"(?:[>+~}]\s*|[^\s,(]\s+):has\([^{})]*nth-")
    assert bare.search("a { b: c } .many > :has(> .panel-half:nth-child(4)) i { d: e }")
    sheets = sorted((ROOT / "templates/assets/css").rglob("*.css"))
    assert len(sheets) > 20
    for sheet in sheets:
        rules = re.sub(r"/\*.*?\*/", "", sheet.read_text("utf-8"), flags=re.DOTALL)
        assert not bare.search(rules), sheet.name
