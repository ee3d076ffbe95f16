"""Markdown → tokens: markdown-it with formulas, footnotes and directives; tokens that can be wrong carry their place.

After parsing, directives and citations are single tokens ("figure", "picture", "plot", "predict", "try", "aside",
"value", "readout", "ref", "term", "cite") or pairs ("claim_open", "claim_close", and likewise for "promise"), and
footnote definitions are removed from the flow.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass
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
from sitegen.markup.located import Located, TextStart, footnote_label, located, note, noted
from sitegen.markup.places import add_places, heading_ids
from sitegen.markup.slips import CONTAINERS
from sitegen.markup.source import Source
from sitegen.markup.unclosed import dollar, label_first, lose
from sitegen.problems import Place, hint

PLACED = ("link", "image", "math_inline", "footnote_ref", "autolink")
UNIT = re.compile(r"(?:(?<=\d)|^) (?=(?:%|u²?|rad|k?m|m?s|[kM]B)(?!\w))")  # at ^ after a computed number
EQUALS = re.compile(r"(?<=\w) = (?=[−\d])")


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
    md.core.ruler.before("inline", "heading_ids", heading_ids)
    md.core.ruler.after("inline", "places", add_places)
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
