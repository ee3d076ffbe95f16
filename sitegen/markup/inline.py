"""Inline rules for Markdown: directives, failed attempts at one, and citations; their tokens carry offsets."""

from __future__ import annotations

import re
from collections.abc import Callable

from markdown_it.rules_inline import StateInline

from sitegen.markup.directives import Directive, DirectiveError, read
from sitegen.markup.located import Citation, InLine, NoteMark, Work, footnote_label, note
from sitegen.markup.unclosed import fault, lose
from sitegen.problems import hint

BLOCK = ("figure", "picture", "plot", "predict", "try", "aside")
INLINE = ("value", "readout", "promise", "claim", "ref", "term")
AROUND = ("promise", "claim")  # their text is Markdown, between an opening and a closing token
# The content of a token whose text is not yet known: to the quotes beside it a letter, though no slug has it.
UNSEEN = "\u2060"
CITATION = re.compile(r"\[(@[^\]]*)\]")
CITED = re.compile(r"\s*@(?P<key>[^\s,;\]]*)(?:,\s*(?P<locator>[^;\]]*?))?\s*(?:;|$)")
MISPLACED = re.compile(r"(:+)([a-z][a-z-]*) ?[\[{]")


def directive_in_line(state: StateInline, silent: bool) -> bool:
    start = state.pos
    if state.src[start] != ":" or (start and (state.src[start - 1].isalnum() or state.src[start - 1] == ":")):
        return False
    try:
        directive = read(state.src, start, state.posMax, ":")
    except DirectiveError as error:
        if not silent:
            fault(state, error.offset, str(error))
        state.pos += 1
        return True
    if directive is None:
        return False
    if not silent:
        if directive.name not in INLINE:
            advice = (
                "; on a line of its own, use two colons" if directive.name in BLOCK else hint(directive.name, INLINE)
            )
            fault(state, start, f"unknown directive :{directive.name}{advice}")
            lose(state.env, directive.attributes)
        elif directive.name in AROUND:
            _wrap(state, directive)
        else:
            token = state.push(directive.name, "", 0)
            token.content = directive.text if directive.name == "term" else UNSEEN
            note(token, InLine(directive, start))
    state.pos = directive.end
    return True


def misplaced(state: StateInline, silent: bool) -> bool:
    """Report a failed attempt at a directive: two colons within a line, no brackets, or a word right before it."""
    start = state.pos
    match = MISPLACED.match(state.src, start, state.posMax)
    if match is None or (start and state.src[start - 1] == ":"):
        return False
    colons, name = match.groups()
    if colons == ":::" and name not in (*BLOCK, *INLINE):
        return False  # a container's, reported with it
    word, bare = start > 0 and state.src[start - 1].isalnum(), not match[0].endswith(f"{name}[")
    if (word and bare) or (name not in (*BLOCK, *INLINE) and (word or bare or colons == ":")):
        return False  # C++, a time, an emoji
    if name in BLOCK:
        message = f"::{name} must start a line of its own"
    elif colons != ":":
        advice = "; inside a line, use one colon" if name in INLINE else hint(name, (*BLOCK, *INLINE))
        message = f"unknown directive {colons}{name}{advice}"
    else:
        message = f":{name} cannot directly follow a letter or digit"
    if bare and colons == ":" and name in INLINE:
        message = f"expected :{name}[text]{{…}}"
    try:
        directive = None if bare else read(state.src, start, state.posMax, colons)
    except DirectiveError:
        directive = None
    if not silent:
        fault(state, start, message)
        lose(state.env, directive.attributes if directive else state.src[start : state.posMax])
    state.pos = directive.end if directive else match.end()
    return True


def _wrap(state: StateInline, directive: Directive) -> None:
    note(state.push(f"{directive.name}_open", "", 1), InLine(directive, directive.start))
    stop = state.posMax
    state.pos, state.posMax = directive.text_start, directive.text_start + len(directive.text)
    state.md.inline.tokenize(state)
    state.posMax = stop
    state.push(f"{directive.name}_close", "", -1)


def citation(state: StateInline, silent: bool) -> bool:
    match = CITATION.match(state.src, state.pos, state.posMax)
    if match is None:
        if not state.src.startswith("[@", state.pos):
            return False
        if not silent:
            fault(state, state.pos, "unclosed citation: missing ']'")
        state.pos += 2
        return True
    if not silent:
        token = state.push("cite", "", 0)
        token.content = UNSEEN
        base = match.start(1)
        works = tuple(
            Work(m["key"], (m["locator"] or "").strip(), base + m.start("key"))
            for m in CITED.finditer(match[1])
            if m.group()
        )
        if "".join(m.group() for m in CITED.finditer(match[1])) != match[1] or not all(work.key for work in works):
            fault(state, state.pos, "expected [@key], [@key, p. 3] or [@one; @other]")
            works = ()
        note(token, InLine(Citation(works), state.pos))
    state.pos = match.end()
    return True


def placed(rule: Callable[[StateInline, bool], bool], state: StateInline, silent: bool) -> bool:
    """Run an inline rule and note the offset of its token; for links and images, that of their target."""
    start, count = state.pos, len(state.tokens)
    if not rule(state, silent):
        return False
    if not silent:
        token = next((t for t in state.tokens[count:] if t.type != "text"), None)
        if token is not None:
            target = state.src.rfind("](", start, state.pos) if token.type in ("link_open", "image") else -1
            thing = NoteMark(footnote_label(token)) if token.type == "footnote_ref" else None
            note(token, InLine(thing, target + 2 if target >= 0 else start))
    return True
