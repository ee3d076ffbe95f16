"""Faults in inline text: each is a token until its place is known. Ids in text that could not be parsed are noted.

Also an equation that begins with its label, a fault in a block.
"""

from __future__ import annotations

import re
from typing import Any

from markdown_it.rules_block import StateBlock
from markdown_it.rules_inline import StateInline

from sitegen.markup.located import Fault, InLine, note

LOST = re.compile(r"\bid=(?P<figure>[\w-]+)|\${2}\s*[({[]#?(?P<equation>[\w-]+)[)}\]]")
LABEL = re.compile(r"[ \t]*(?:\{[^}\n]*\}|\[[^]\n]*\])[ \t]*$", re.MULTILINE)  # in the wrong brackets
LABEL_FIRST = re.compile(r"\${2}\s*\([^)$]+\)\s*")
LABELLED = "label an equation after its closing $$: $$ (label)"


def dollar(state: StateInline, silent: bool) -> bool:
    """Report a dollar that begins neither a formula nor an equation on lines of its own."""
    start = state.pos
    if state.src[start] != "$":
        return False
    double = state.src.startswith("$$", start)
    end = state.src.find("$$", start + 2, state.posMax) if double else -1
    if not silent:
        message = "unclosed formula: missing $; write \\$ for a literal dollar"
        if double:
            message = "unclosed equation: missing $$ before the next blank line"
        if end >= 0:
            message = "$$ inside a paragraph: put the equation on lines of its own, after a blank one"
            if not state.src[:start].strip() and LABEL.match(state.src, end + 2):
                message = LABELLED
        fault(state, start, message)
        lose(state.env, state.src[start : state.posMax])
    # Skip the contents of an equation: they are not text.
    state.pos = end + 2 if end >= 0 else state.posMax if double else start + 1
    return True


def label_first(state: StateBlock, start_line: int, end_line: int, silent: bool) -> bool:
    """Report a label behind the opening $$ of an equation, which would be read as the label of an empty one."""
    start, end = state.bMarks[start_line] + state.tShift[start_line], state.eMarks[start_line]
    if not LABEL_FIRST.fullmatch(state.src, start, end) or state.is_code_block(start_line):
        return False
    last = start_line + 1  # the line of the closing $$, before the next blank one
    while (
        last < end_line
        and not state.isEmpty(last)
        and state.src.find("$$", state.bMarks[last], state.eMarks[last]) < 0
    ):
        last += 1
    if last == end_line or state.isEmpty(last):
        return False
    if not silent:
        source = state.env["source"]
        source.problems.add(source.at(start), LABELLED)
        lose(state.env, state.src[start:end])
        state.line = last + 1
    return True


def fault(state: StateInline, offset: int, message: str) -> None:
    """Push a token that becomes a problem once its place in the file is known."""
    note(state.push("fault", "", 0), InLine(Fault(message), offset))


def lose(env: Any, text: str) -> None:
    """Note the ids of figures and equations in a text that could not be parsed."""
    for match in LOST.finditer(text):
        env["lost"].add(f"fig:{match['figure']}" if match["figure"] else f"eq:{match['equation']}")
