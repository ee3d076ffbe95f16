"""Markdown → tokens: markdown-it with formulas, footnotes and directives; tokens that can be wrong carry their place.

After parsing, directives and citations are single tokens ("figure", "picture", "plot", "predict", "try", "aside",
"value", "readout", "ref", "term", "cite") or pairs ("claim_open", "claim_close", and likewise for "promise"), and
footnote definitions are removed from the flow.
"""

from __future__ import annotations

import re
import unicodedata
from bisect import bisect_right
from collections.abc import Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass, field
from functools import lru_cache, partial
from typing import Any

from markdown_it import MarkdownIt
from markdown_it.rules_block import StateBlock
from markdown_it.rules_core import StateCore
from markdown_it.token import Token
from mdit_py_plugins.container import container_plugin
from mdit_py_plugins.dollarmath import dollarmath_plugin
from mdit_py_plugins.footnote import footnote_plugin

from sitegen.markup.directives import Directive, DirectiveError, read
from sitegen.markup.fences import open_fence
from sitegen.markup.inline import BLOCK, INLINE, citation, directive_in_line, misplaced, placed
from sitegen.markup.leftovers import leftovers
from sitegen.markup.located import (
    Anchor,
    EquationLabel,
    Fault,
    InLine,
    Located,
    TextStart,
    footnote_label,
    located,
    note,
    noted,
)
from sitegen.markup.slips import CLOSING, CONTAINERS, cells, slips, unread_anchor
from sitegen.markup.unclosed import dollar, label_first, lose
from sitegen.problems import Place, Problems, hint

PLACED = ("link", "image", "math_inline", "footnote_ref", "autolink")
HEADING_ID = re.compile(r"\s*\{#([^}]*)\}\s*$")
ANCHOR = re.compile(r"[a-z][a-z0-9-]*")
UNIT = re.compile(r"(?:(?<=\d)|^) (?=(?:%|u²?|rad|k?m|m?s|[kM]B)(?!\w))")  # at ^ after a computed number
EQUALS = re.compile(r"(?<=\w) = (?=[−\d])")


@dataclass
class Source:
    """A Markdown file to parse: its path as problems cite it, and its text with the front matter blanked out.

    shift: number of columns before each line of the text in its file.
    """

    path: str
    text: str
    problems: Problems
    shift: int = 0
    lines: list[str] = field(init=False)
    starts: list[int] = field(init=False)

    def __post_init__(self) -> None:
        self.lines = self.text.split("\n")
        self.starts = [0]
        for line in self.lines[:-1]:
            self.starts.append(self.starts[-1] + len(line) + 1)

    def at(self, offset: int) -> Place:
        """The place of an offset in the text."""
        line = bisect_right(self.starts, offset) - 1
        return Place(self.path, line + 1, self.shift + offset - self.starts[line] + 1)


@dataclass(frozen=True)
class Document:
    """A parsed file: the flow, and each footnote's tokens by label.

    lost: figures and equations ("fig:id", "eq:label") in text that could not be parsed; references to them are not
    reported.
    """

    tokens: Sequence[Token]
    footnotes: Mapping[str, Sequence[Token]]
    lost: AbstractSet[str]


def parse(source: Source) -> Document:
    """Parse a file; malformed parts go to source.problems."""
    text = source.text
    while True:
        env: dict[str, Any] = {"source": source, "footnote_tokens": {}, "lost": set()}
        tokens = parser().parse(text, env)
        fence = open_fence(tokens, source.lines)
        if fence is None:
            return Document(tokens, env["footnote_tokens"], env["lost"])
        # The fence swallowed what follows it: parse again without its line. Problems in lines that may be code wait.
        line = source.lines[fence.first]
        column = source.shift + len(line) - len(line.lstrip(" >")) + 1
        source.problems.add(Place(source.path, fence.first + 1, column), fence.says)
        source.problems.unclear |= {(source.path, n + 1) for n in range(fence.first, fence.unclear + 1)}
        lines = [" " * len(row) if fence.hides(n, row) else row for n, row in enumerate(text.split("\n"))]
        text = "\n".join(lines)


@lru_cache(maxsize=1)
def parser() -> MarkdownIt:
    """The shared parser, which keeps no state between files."""
    md = MarkdownIt("commonmark", {"typographer": True, "html": False})
    md.enable(["table", "smartquotes", "strikethrough"])
    dollarmath_plugin(md, allow_digits=False, allow_blank_lines=False)
    footnote_plugin(md, inline=False, move_to_end=False, always_match_refs=True)
    for name in CONTAINERS:
        container_plugin(md, name)
    md.inline.add_terminator_char(":")
    md.block.ruler.before(
        "paragraph", "directive", _block_directive, {"alt": ["paragraph", "reference", "blockquote", "list"]}
    )
    md.block.ruler.before("math_block", "label_first", label_first)
    md.inline.ruler.before("link", "directive", directive_in_line)
    md.inline.ruler.after("directive", "misplaced", misplaced)
    md.inline.ruler.before("link", "citation", citation)
    md.inline.ruler.after("math_inline", "dollar", dollar)
    rules = {rule.name: rule.fn for rule in md.inline.ruler.__rules__}  # no public API exposes a rule's function
    for name in PLACED:
        md.inline.ruler.at(name, partial(placed, rules[name]))
    md.core.ruler.before("inline", "heading_ids", _heading_ids)
    md.core.ruler.after("inline", "places", _add_places)
    md.core.ruler.push("fold", _fold)
    return md


def blocks(tokens: Sequence[Token]) -> list[list[Token]]:
    """The top-level blocks, each as the list of all its tokens."""
    result: list[list[Token]] = []
    depth = 0
    for token in tokens:
        if depth == 0:
            result.append([])
        result[-1].append(token)
        depth += token.nesting
    return result


def text_of(tokens: Sequence[Token]) -> str:
    """The plain text of inline tokens."""
    return "".join(" " if t.type in ("softbreak", "hardbreak") else t.content for t in tokens)


def unbroken(text: str) -> str:
    """The text with non-breaking spaces between number and unit and around an equals sign before a value."""
    return EQUALS.sub("\u00a0=\u00a0", UNIT.sub("\u00a0", text))


def ascii_slug(text: str) -> str:
    """An ASCII anchor for a heading's text."""
    plain = unicodedata.normalize("NFKD", text).encode("ascii", "ignore").decode().lower()
    return re.sub(r"[^a-z0-9]+", "-", plain).strip("-") or "section"


def _block_directive(state: StateBlock, start_line: int, end_line: int, silent: bool) -> bool:
    if state.is_code_block(start_line):
        return False
    start = state.bMarks[start_line] + state.tShift[start_line]
    source: Source = state.env["source"]
    if not state.src.startswith("::", start) or state.src.startswith(":::", start):
        return False
    stop_line = start_line + 1  # captions may be wrapped: the directive can extend to the next blank line
    while stop_line < end_line and not state.isEmpty(stop_line):
        stop_line += 1
    try:
        directive = read(state.src, start, state.eMarks[stop_line - 1], "::")
    except DirectiveError as error:
        if not silent:
            source.problems.add(source.at(error.offset), str(error))
            lose(state.env, state.src[start : state.eMarks[stop_line - 1]])
            state.line = stop_line
        return True
    if directive is None:
        if not re.match(r"::[a-z]+(\s|\{|$)", state.src[start : state.eMarks[start_line]]):
            return False
        if not silent:
            source.problems.add(source.at(start), "expected ::name[text]{attributes}")
            lose(state.env, state.src[start : state.eMarks[start_line]])
            state.line = start_line + 1
        return True
    if silent:
        return True
    last = source.at(directive.end).line - 1
    margins = (state.src[source.starts[n] : state.bMarks[n]] for n in range(start_line + 1, last + 1))
    if any(">" in margin for margin in margins):  # which would be part of its text
        source.problems.add(source.at(start), "in a quotation, a directive must fit on one line")
    remainder = state.src[directive.end : state.eMarks[last]]
    if remainder.strip():
        source.problems.add(
            source.at(directive.end), f"unexpected {remainder.strip()!r} after a directive: move it to another line"
        )
    if directive.name not in BLOCK:
        advice = "; inside a line, use one colon" if directive.name in INLINE else hint(directive.name, BLOCK)
        source.problems.add(source.at(start), f"unknown directive ::{directive.name}{advice}")
        lose(state.env, directive.attributes)
    state.line = last + 1
    token = state.push("directive_open", "", 1)
    token.map, token.info = [start_line, state.line], directive.name
    note(token, Located(directive, source.at(start), source.at, start))
    inline = state.push("inline", "", 0)
    inline.map, inline.content, inline.children = [start_line, state.line], directive.text, []
    note(inline, TextStart(directive.text_start))
    state.push("directive_close", "", -1)
    return True


def _heading_ids(state: StateCore) -> None:
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


def _add_places(state: StateCore) -> None:
    """Give every child with an offset its place in the file."""
    source: Source = state.env["source"]
    addresses = state.env.get("references", {})
    for duplicate in state.env.get("duplicate_refs", []):
        if duplicate["href"] != addresses[duplicate["label"]]["href"]:
            place = Place(source.path, duplicate["map"][0] + 1, 1)
            first = addresses[duplicate["label"]]["map"][0] + 1
            name = duplicate["label"].lower()
            source.problems.add(place, f"duplicate [{name}], with another address on line {first}")
    cell = columns = 0
    for i, token in enumerate(state.tokens):
        cell = 0 if token.type in ("tr_open", "table_close") else cell + (token.type in ("th_close", "td_close"))
        if token.type in ("math_block", "math_block_label") and token.map:
            first = source.starts[token.map[0]]
            dollars = source.text.index("$$", first)
            label = None
            if token.type == "math_block_label":
                bracket = source.text.rindex("(", 0, _line_end(source, token.map[1] - 1))
                label = EquationLabel(source.at(bracket + 1))
            note(token, Located(label, source.at(dollars), partial(_offset_in, source, dollars + 2), -2))
        elif token.type.startswith("container_") and token.map:
            _container(source, token)
            if token.nesting == 1 and state.tokens[i + 1].type.endswith("_close"):
                place = Place(source.path, token.map[0] + 1, 1)
                source.problems.add(place, f"empty {token.markup}{token.info.strip()}")
        elif token.type == "tr_open" and token.map:
            line = source.lines[token.map[0]]
            if state.tokens[i - 1].type == "thead_open":  # the header itself may follow a list's mark
                columns = cells(source.lines[token.map[0] + 1])
                continue
            if "|" not in line and "|" in source.lines[token.map[0] - 1]:  # text would be rows of one cell
                source.problems.add(Place(source.path, token.map[0] + 1, 1), "missing blank line after the table")
            if cells(line) > columns:
                place = Place(source.path, token.map[0] + 1, 1)
                source.problems.add(place, f"row of {cells(line)} cells in a table of {columns} columns")
        elif token.type == "fence" and token.map:
            place = Place(source.path, token.map[0] + 1, 1)
            note(token, Located(None, place, source.at, source.starts[token.map[0]]))
        elif token.type == "code_block" and token.map:  # claims, promises and all else in it would go unread
            line = source.lines[token.map[0]]
            place = source.at(source.starts[token.map[0]] + len(line) - len(line.lstrip(" >\t")))
            message = "indented by a tab or four spaces, this is code: unindent it, or put code between lines of ```"
            source.problems.add(place, message)
            lose(state.env, token.content)
        if token.type != "inline":
            continue
        at = partial(_inline_place, source, token, cell)
        for offset, message in slips(token.content):
            source.problems.add(at(offset), message)
            lose(state.env, token.content)
        for offset, message in leftovers(token.content, token.children or [], addresses):
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


def _container(source: Source, token: Token) -> None:
    """Report a container that is not closed, or has more than its name on its first line."""
    first, last = token.map or (0, 0)
    name = token.type.removeprefix("container_").removesuffix("_open")
    if token.nesting == 1 and token.info.strip() != name:
        source.problems.add(Place(source.path, first + 1, 1), f"unexpected text after {token.markup}{name}")
    if not CLOSING.fullmatch("".join(source.lines[last : last + 1]).strip(" \t>")):
        source.problems.add(Place(source.path, first + 1, 1), f"unclosed {token.markup}{name}: missing :::")


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


def _fold(state: StateCore) -> None:
    """Make each block directive one token with its text as children, and remove footnotes from the flow."""
    source: Source = state.env["source"]
    flow: list[Token] = []
    notes: dict[str, list[Token]] = state.env["footnote_tokens"]
    into = flow
    for token in state.tokens:
        match token.type:
            case "footnote_reference_open":
                label = footnote_label(token)
                if label in notes:
                    source.problems.add(
                        Place(source.path, (token.map or [0])[0] + 1, 1), f"duplicate footnote [^{label}]"
                    )
                into = notes[label] = []
            case "footnote_reference_close":
                into = flow
            case "directive_open":
                into.append(Token(token.info, "", 0, map=token.map, block=True, children=[]))
                note(into[-1], located(token, Directive))
            case "inline" if noted(token, TextStart) is not None:
                into[-1].children = token.children
            case "directive_close":
                pass
            case _:
                into.append(token)
    state.tokens[:] = flow
