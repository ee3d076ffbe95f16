"""The places of what is parsed: headings, blocks and the children of lines are noted with where they stand in the file,
and what only the finished tokens show to be wrong is reported.
"""

from __future__ import annotations

import re
from functools import partial

from markdown_it.rules_core import StateCore
from markdown_it.token import Token

from sitegen.markup.leftovers import leftovers
from sitegen.markup.located import Anchor, EquationLabel, Fault, InLine, Located, TextStart, note, noted
from sitegen.markup.slips import CLOSING, cells, slips, unread_anchor
from sitegen.markup.source import Source
from sitegen.markup.unclosed import lose
from sitegen.problems import Place

HEADING_ID = re.compile(r"\s*\{#([^}]*)\}\s*$")
ANCHOR = re.compile(r"[a-z][a-z0-9-]*")


def heading_ids(state: StateCore) -> None:
    """Strip `{#id}` from the end of headings and note it as their anchor."""
    source: Source = state.env["source"]
    for heading, inline in zip(state.tokens, state.tokens[1:], strict=False):
        if heading.type != "heading_open":
            continue
        name, start = "", source.starts[(heading.map or [0])[0]]
        if (match := HEADING_ID.search(inline.content)) is not None:
            line = (inline.map or [0])[0]
            place = source.at(source.starts[line] + source.lines[line].rfind("{#") + 2)
            if ANCHOR.fullmatch(match[1]):
                name = match[1]
            else:
                rule = "use lower-case letters, digits and hyphens, starting with a letter"
                source.problems.add(place, f"invalid anchor {match[1]!r}: {rule}")
            inline.content = inline.content[: match.start()]
        elif (offset := unread_anchor(inline.content)) is not None:
            line = (inline.map or [0])[0]
            place = source.at(source.starts[line] + source.lines[line].rfind(inline.content[offset:]))
            source.problems.add(place, "expected {#name} at the end of the heading")
        place = Place(source.path, (heading.map or [0])[0] + 1, 1)
        note(heading, Located(Anchor(name), place, source.at, start))


def add_places(state: StateCore) -> None:
    """Give every block and every child with an offset its place in the file; report the faults of both."""
    _addresses(state)
    source: Source = state.env["source"]
    cell = columns = 0  # the index of the cell that a line is in; the columns of the last header
    for i, token in enumerate(state.tokens):
        cell = 0 if token.type in ("tr_open", "table_close") else cell + (token.type in ("th_close", "td_close"))
        if token.type == "inline":
            _line(state, token, cell)
        elif not token.map:
            continue
        elif token.type in ("math_block", "math_block_label"):
            _equation(source, token)
        elif token.type.startswith("container_"):
            _container(source, token, is_empty=token.nesting == 1 and state.tokens[i + 1].type.endswith("_close"))
        elif token.type == "tr_open" and state.tokens[i - 1].type == "thead_open":
            columns = cells(source.lines[token.map[0] + 1])  # the header itself may follow a list's mark
        elif token.type == "tr_open":
            _row(source, token, columns)
        elif token.type == "fence":
            place = Place(source.path, token.map[0] + 1, 1)
            note(token, Located(None, place, source.at, source.starts[token.map[0]]))
        elif token.type == "code_block":
            _code(state, token)


def _addresses(state: StateCore) -> None:
    """Report the names of links that are given a second address."""
    source: Source = state.env["source"]
    addresses = state.env.get("references", {})
    for duplicate in state.env.get("duplicate_refs", []):
        if duplicate["href"] != addresses[duplicate["label"]]["href"]:
            place = Place(source.path, duplicate["map"][0] + 1, 1)
            first = addresses[duplicate["label"]]["map"][0] + 1
            name = duplicate["label"].lower()
            source.problems.add(place, f"duplicate [{name}], with another address on line {first}")


def _equation(source: Source, token: Token) -> None:
    """Note an equation's label and the place of each offset in its LaTeX."""
    first, last = token.map or (0, 0)
    dollars = source.text.index("$$", source.starts[first])
    label = None
    if token.type == "math_block_label":
        bracket = source.text.rindex("(", 0, _line_end(source, last - 1))
        label = EquationLabel(source.at(bracket + 1))
    note(token, Located(label, source.at(dollars), partial(_offset_in, source, dollars + 2), -2))


def _row(source: Source, token: Token, columns: int) -> None:
    """Report text directly below a table, and rows with more cells than the header has columns."""
    first, _ = token.map or (0, 0)
    line, place = source.lines[first], Place(source.path, first + 1, 1)
    if "|" not in line and "|" in source.lines[first - 1]:  # text would be rows of one cell
        source.problems.add(place, "missing blank line after the table")
    if cells(line) > columns:
        source.problems.add(place, f"row of {cells(line)} cells in a table of {columns} columns")


def _code(state: StateCore, token: Token) -> None:
    """Report text indented like code: claims, promises and all else in it would go unread."""
    source: Source = state.env["source"]
    first, _ = token.map or (0, 0)
    line = source.lines[first]
    place = source.at(source.starts[first] + len(line) - len(line.lstrip(" >\t")))
    message = "indented by a tab or four spaces, this is code: unindent it, or put code between lines of ```"
    source.problems.add(place, message)
    lose(state.env, token.content)


def _line(state: StateCore, token: Token, cell: int) -> None:
    """Note the places of an inline token's children, and report slips, leftovers and faults in its text."""
    source: Source = state.env["source"]
    at = partial(_inline_place, source, token, cell)
    for offset, message in slips(token.content):
        source.problems.add(at(offset), message)
        lose(state.env, token.content)
    for offset, message in leftovers(token.content, token.children or [], state.env.get("references", {})):
        source.problems.add(at(offset), message)
    for child in token.children or []:
        if (remark := noted(child, InLine)) is None:
            continue
        place = at(remark.offset)
        if isinstance(remark.thing, Fault):
            source.problems.add(place, remark.thing.message)
        else:
            note(child, Located(remark.thing, place, at, remark.offset))
    token.children = [child for child in token.children or [] if child.type != "fault"]


def _container(source: Source, token: Token, is_empty: bool) -> None:
    """Report a container that is not closed, is empty, or has more than its name on its first line."""
    first, last = token.map or (0, 0)
    name = token.type.removeprefix("container_").removesuffix("_open")
    if token.nesting == 1 and token.info.strip() != name:
        source.problems.add(Place(source.path, first + 1, 1), f"unexpected text after {token.markup}{name}")
    if not CLOSING.fullmatch("".join(source.lines[last : last + 1]).strip(" \t>")):
        source.problems.add(Place(source.path, first + 1, 1), f"unclosed {token.markup}{name}: missing :::")
    if is_empty:
        source.problems.add(Place(source.path, first + 1, 1), f"empty {token.markup}{token.info.strip()}")


def _line_end(source: Source, line: int) -> int:
    return source.starts[line] + len(source.lines[line])


def _offset_in(source: Source, base: int, offset: int) -> Place:
    return source.at(base + offset)


def _inline_place(source: Source, inline: Token, cell: int, offset: int) -> Place:
    """The place of an offset in an inline token's content, whose lines have lost indentation and container marks."""
    if (start := noted(inline, TextStart)) is not None:
        return source.at(start.offset + offset)
    head, lines = inline.content[:offset], inline.content.split("\n")
    top, end = inline.map or (0, 0)
    # Lines of characters such as U+2028, which Markdown does not count as blank, are stripped from a paragraph's start.
    top = next((row for row in range(top, end) if lines[0].rstrip() in source.lines[row]), top)
    row, content = top + head.count("\n"), lines[head.count("\n")]
    raw = source.lines[row]
    bars = [m.end() for m in re.finditer(r"(?<!\\)\|", raw)] if cell else []
    first = bars[cell - (not raw.lstrip().startswith("|"))] if cell < len(bars) + 1 and bars else 0
    column = raw.find(content.rstrip(), first)
    return Place(source.path, row + 1, source.shift + max(column, 0) + len(head.rpartition("\n")[2]) + 1)
