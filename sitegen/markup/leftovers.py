"""What the parser left over of Markdown: marks without their other half, links without words or an address."""

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
NOWHERE = re.compile(r"(?:https?:/*|mailto:)?")
MARKS = (
    (re.compile(r"\*\*"), "unmatched **: the other half is missing, or there are spaces just inside"),
    (re.compile(r"`+"), "unclosed {0} in this paragraph; write \\` for a literal backtick"),
)


def leftovers(text: str, children: Sequence[Token], defined: Mapping[str, Any]) -> Iterator[tuple[int, str]]:
    """Offsets in a paragraph's text, and what is wrong there. children: its tokens; defined: the addresses of links
    that stand on lines of their own, by their names."""
    for match in REFERENCE.finditer(plain(text)):
        name = match[2].strip() or match[1]
        if normalizeReference(name) not in defined:
            yield match.start(), f"missing '[{name}]: address' for this link; or write [words](address)"
    for i, token in enumerate(children):
        if token.type == "link_open":
            remark = noted(token, InLine)
            offset = remark.offset if remark else 0
            if NOWHERE.fullmatch(str(token.attrs.get("href", ""))):
                yield offset, "missing link address: [words](address)"
            elif children[i + 1].type == "link_close":
                yield offset, "missing link text: [words](address)"
        elif token.type == "text":  # what a \ stands before is of another type
            for mark, says in MARKS:
                if found := mark.search(token.content):
                    yield _found(text, token.content[found.start() :]), says.format(found[0])


def _found(text: str, piece: str) -> int:
    """The offset of what a token says, of which an escape or an entity may be written otherwise."""
    ends = [len(piece), *(match.start() for match in re.finditer(r"\W", piece))][:40]
    offsets = (text.find(piece[:end]) for end in [*sorted(ends, reverse=True), 1] if end)
    return next((offset for offset in offsets if offset >= 0), 0)
