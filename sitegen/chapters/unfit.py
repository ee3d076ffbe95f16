"""Finds misplaced or empty elements: references in headings, links in links, claims in claims, markup in terms,
attributes on asides, bars with nothing beside them."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from itertools import pairwise

from markdown_it.token import Token

from sitegen.chapters.yaml_schema import MARKUP
from sitegen.markup.directives import Directive
from sitegen.markup.located import located, place_of
from sitegen.markup.parser import text_of
from sitegen.problems import Place, Problems

REFERENCES = ("cite", "ref", "footnote_ref")
MADE = (*REFERENCES, "term", "value", "readout", "claim_open", "promise_open")
"""Tokens that the build replaces with generated text or markup."""
HALF = re.compile(r"(?<!\S)\|(?=\s*\Z)|\A\s*\|(?=\s)")


def tell_unfit(tokens: Sequence[Token], problems: Problems) -> None:
    """Report the misplaced or empty elements in some text."""
    for heading, content in pairwise(tokens):
        if heading.type == "heading_open":
            _heading(located(heading, object).place, content.children or [], problems)
    for token in tokens:
        _check_nesting(token.children or [], problems)
        if token.type == "aside" and (line := located(token, Directive)).thing.attributes.strip():
            problems.add(line.at(line.thing.attributes_start), "::aside takes no attributes")
        if token.type == "figure" and (half := HALF.search((line := located(token, Directive)).thing.text)):
            bar = line.thing.text_start + half.end() - 1
            problems.add(line.at(bar), "missing words beside the bar: lead | caption")


def _heading(place: Place, children: Sequence[Token], problems: Problems) -> None:
    if not text_of(children).strip():
        problems.add(place, "empty heading")
    for child in children:
        if child.type in REFERENCES:
            problems.add(place_of(child) or place, "a heading cannot contain references, citations or footnotes")


def _check_nesting(children: Iterable[Token], problems: Problems) -> None:
    """Check the elements inside a link, a claim or an image's alternative text."""
    link = claim = False
    for child in children:
        place = place_of(child)
        if place is None:
            link = link and child.type != "link_close"
            claim = claim and child.type != "claim_close"
            continue
        if child.type in (*REFERENCES, "term", "claim_open") and link:
            problems.add(place, "a link cannot contain another: move it out")
        if child.type == "claim_open" and claim:
            problems.add(place, "a claim cannot contain another: move it out")
        if child.type == "image" and any(inner.type in MADE for inner in child.children or []):
            problems.add(place, "alternative text must be plain: no directives or citations")
        if child.type in ("term", "claim_open") and not located(child, Directive).thing.text.strip():
            problems.add(place, f":{child.type.removesuffix('_open')} has no text")
        if child.type == "term" and (markup := MARKUP.search(located(child, Directive).thing.text)):
            problems.add(place, f"a term's words are plain text; {markup[0]!r} would be printed as is")
        link = link or child.type == "link_open"
        claim = claim or child.type == "claim_open"
