"""Slips: text that looks like markup but is not, and would be printed verbatim or lost."""

from __future__ import annotations

import re
from collections.abc import Iterator

from sitegen.markup.inline import BLOCK, INLINE
from sitegen.problems import hint

CONTAINERS = ("example", "anatomy", "try-this", "opening", "evidence", "answer", "in-short")
CONTAINER = re.compile(r"^:::\s*([\w-]*)", re.MULTILINE)
CLOSING = re.compile(r":{3,}")
# Code and formulas, in which there are no slips.
LITERAL = re.compile(r"(?<!`)(`+)(?!`).*?(?<!`)\1(?!`)|(?<![\\$])\$[^$]+\$", re.DOTALL)
NAMES = "|".join((*BLOCK, *INLINE))
NEARLY = re.compile(rf"(?<![\w:\\])(:{{1,2}})( ?)({NAMES})(?=[\[{{(])", re.IGNORECASE)
TAGS = "a|abbr|audio|b|big|blockquote|br|button|center|cite|code|dd|del|details|div|dl|dt|em|figcaption|figure|font|"
TAGS += "h[1-6]|hr|i|iframe|img|input|ins|kbd|li|mark|ol|p|pre|q|s|script|section|small|span|strong|style|sub|summary|"
TAGS += "sup|svg|table|tbody|td|th|thead|tr|tt|u|ul|var|video|wbr"
SLIPS = (
    (r"^#{2,6}(?=\w)", "missing space after {0}"),
    (r"^#{2,6}(?=\u00a0)", "non-breaking space after {0}: use a plain one"),
    (rf"(?<!\\)<!--|(?<!\\)</?(?:{TAGS})(?:\s[^<>]*)?/?>", "{0}: HTML is not supported and would be printed as is"),
    (r"\]\((?=[^()\s\"'<>]+ [^()\"'<>]*\))", "space in a link address: write %20"),
    (r"\]\((?=(?:data:(?!image/)|file:|javascript:|vbscript:))", "links to data:, file: or scripts are not allowed"),
    (r"(?<!\\)\\\((?=.*?\\\))", "write formulas between dollars: $a$"),
    (r"(?<!\\)\\begin(?=\{)", "write equations between two lines of $$"),
    (r"(?<![\\\w])\^\[(?=[^\]]*\])", "write footnotes as a mark, [^name], and a line that starts with [^name]:"),
    (r"\]\([^()\n]*\)\{(?:\s*:?\s*[.#][\w-]|[^{}\n]*=)[^{}\n]*\}", "an image or link takes no {{…}}"),
    (r"\A\[[ xX]\](?= )", "{0}: boxes to tick are not supported"),
    (r"\A\[![A-Za-z]+\]", "{0}: write an ::aside, or the words in bold"),
    (r"(?<![^\s(])==(?=[^\s=][^=\n]*[^\s=]==(?![^\s.,;:!?)]))", "==: write *emphasis* or **strong**"),
)
UNPARTED = re.compile(r"\|.*\|\s*")
IN_HEADING = re.compile(rf"(?<![\w:\\]):(?:{'|'.join(INLINE)})\[.*?\]\{{[^}}]*\}}")
BRACES = re.compile(r"\{\s*#?[\w-]+\s*\}\.?\s*$")


def slips(text: str) -> Iterator[tuple[int, str]]:
    """Yield the slips in the text of a paragraph or a heading: offset and message."""
    depth = 0  # of failed blocks: their ends are not reported as well
    for match in CONTAINER.finditer(text):
        name = match[1]
        if name in CONTAINERS:
            yield match.start(), f"unexpected text after :::{name}"
        elif name:
            yield match.start(), f"unknown block :::{name}{hint(name, CONTAINERS)}"
        elif not depth:
            yield match.start(), "unmatched ':::': no block is open"
        depth += 1 if name else -1 if depth else 0
    words = plain(text)
    for pattern, message in SLIPS:
        for match in re.finditer(pattern, words, re.MULTILINE):
            yield match.start(), message.format(match[0])
    for match in NEARLY.finditer(words):
        name, opens = match[3].lower(), words[match.end()]
        if (match[2] or match[3] != name) if opens != "(" else not match[2]:
            colons = "::" if name in BLOCK else ":"
            yield match.start(), f"expected {colons}{name}[text]{{…}}"
    lines = words.split("\n")
    if UNPARTED.fullmatch(lines[0]):
        yield 0, "missing | --- | --- | after the table's first row, with as many cells"


def plain(text: str) -> str:
    """The text with blanks for what is printed as written."""
    return LITERAL.sub(lambda match: " " * len(match[0]), text)


def unread_anchor(heading: str) -> int | None:
    """The offset of a malformed anchor at the end of a heading; None if there is none."""
    match = BRACES.search(IN_HEADING.sub(lambda at: "." * len(at[0]), plain(heading)))
    return match.start() if match else None


def cells(line: str) -> int:
    """The number of cells in a line of a table."""
    inner = re.sub(r"^\s*\||(?<!\\)\|\s*$", "", line.strip(" >"))
    return len(re.findall(r"(?<!\\)\|", inner)) + 1
