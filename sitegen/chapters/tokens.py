"""What rules of rendering ask of tokens."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence

from markdown_it.token import Token
from markupsafe import Markup

from sitegen.markup.directives import Directive
from sitegen.markup.located import located
from sitegen.problems import Place

LINK = re.compile(r"</?a\b[^>]*>")


def directive_of(token: Token) -> tuple[Directive, Callable[[int], Place]]:
    """The directive that a token stands for, and what gives places in it."""
    line = located(token, Directive)
    return line.thing, line.at


def simple(rule: Callable[[Token], str]) -> Callable[..., str]:
    """The rule of markdown-it for one that looks at its token alone."""
    return lambda tokens, idx, options, env: rule(tokens[idx])


def words(render: Callable[[Sequence[Token]], str], tokens: Sequence[Token]) -> Markup:
    """Inline tokens for use a second time: without what is an anchor or a target of its own, and of links their words
    alone; citations and notes are left out."""
    dropped = {"link_open", "link_close", "claim_open", "claim_close", "cite", "footnote_ref"}
    return Markup(LINK.sub("", render([token for token in tokens if token.type not in dropped])))
