"""Markdown that the parser left as text: marks without their other half, links without words or an address."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from markdown_it.common.utils import normalizeReference
from markdown_it.token import Token

from sitegen.markup.located import InLine, noted
from sitegen.markup.slips import plain

# Two pairs of brackets, which are neither footnotes nor citations.
REFERENCE = re.compile(r"(?<![\\\]\w])\[([^\[\]^@][^\[\]]*)\]\[((?![\^@])[^\[\]]*)\]")
INNER = re.compile(r"[^\[]*?(\]\()")  # the end of a link that could not begin, since another was in its words
NOWHERE = re.compile(r"(?:https?:/*|mailto:)?")
MARKS = (
    (re.compile(r"\*\*"), "unmatched **: the other half is missing, or there are spaces just inside"),
    (re.compile(r"`+"), "unclosed {0} in this paragraph; write \\` for a literal backtick"),
)


def leftovers(text: str, children: Sequence[Token], addresses: Mapping[str, Any]) -> Iterator[tuple[int, str]]:
    """Yield the offset of each leftover in a paragraph's text, with a message. children: its tokens; addresses: the
    file's link definitions by label."""
    for match in REFERENCE.finditer(plain(text)):
        name = match[2].strip() or match[1]
        if normalizeReference(name) not in addresses:
            yield match.start(), f"missing '[{name}]: address' for this link; or write [words](address)"
    linked = False
    for i, token in enumerate(children):
        linked = linked or token.type in ("link_open", "footnote_ref")
        if token.type == "link_open":
            remark = noted(token, InLine)
            offset = remark.offset if remark else 0
            if NOWHERE.fullmatch(str(token.attrs.get("href", ""))):
                yield offset, "missing link address: [words](address)"
            elif children[i + 1].type == "link_close":
                yield offset, "missing link text: [words](address)"
        elif token.type == "text":  # escaped characters are tokens of another type
            for mark, message in MARKS:
                if half := mark.search(token.content):
                    yield _offset(text, token.content[half.start() :]), message.format(half[0])
            if linked and (end := INNER.match(token.content)):
                yield _offset(text, token.content[end.start(1) :]), "a link cannot contain another: move it out"


def _offset(text: str, piece: str) -> int:
    """The offset of a piece of a token in the source, where escapes and entities may spell it differently."""
    ends = [len(piece), *(match.start() for match in re.finditer(r"\W", piece))][:40]
    offsets = (text.find(piece[:end]) for end in [*sorted(ends, reverse=True), 1] if end)
    return next((offset for offset in offsets if offset >= 0), 0)
