"""What rules of rendering ask of tokens."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from markdown_it.token import Token

from sitegen.chapters.survey import LINKS
from sitegen.markup.directives import Directive
from sitegen.markup.located import located
from sitegen.problems import Place


def directive_of(token: Token) -> tuple[Directive, Callable[[int], Place]]:
    """The directive that a token stands for, and what gives places in it."""
    written = located(token, Directive)
    return written.thing, written.at


def simple(rule: Callable[[Token], str]) -> Callable[..., str]:
    """The rule of markdown-it for one that looks at its token alone."""
    return lambda tokens, idx, options, env: rule(tokens[idx])


def unlinked(tokens: Sequence[Token]) -> list[Token]:
    """Inline tokens without what becomes a link, an anchor or a target of its own, for use a second time."""
    dropped = {*LINKS, "link_close", "claim_close"}
    return [token for token in tokens if token.type not in dropped]
