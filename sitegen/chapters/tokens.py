"""Helpers of the rendering rules for tokens."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence

from markdown_it.token import Token
from markupsafe import Markup

from sitegen.markup.directives import Directive
from sitegen.markup.located import located
from sitegen.problems import Place

FOLDED = {"try-this": "Try this", "evidence": "Evidence", "answer": "Answer"}  # folding containers and their summaries
LINK = re.compile(r"</?a\b[^>]*>")


def directive_of(token: Token) -> tuple[Directive, Callable[[int], Place]]:
    """The directive that a token stands for, and a function from offsets in it to places."""
    line = located(token, Directive)
    return line.thing, line.at


def simple(rule: Callable[[Token], str]) -> Callable[..., str]:
    """Adapt a rule that needs only its token to markdown-it's signature."""
    return lambda tokens, idx, options, env: rule(tokens[idx])


def words(render: Callable[[Sequence[Token]], str], tokens: Sequence[Token]) -> Markup:
    """Render inline tokens for a second use: links and claims as plain text, without citations and note marks."""
    dropped = {"link_open", "link_close", "claim_open", "claim_close", "cite", "footnote_ref"}
    return Markup(LINK.sub("", render([token for token in tokens if token.type not in dropped])))


def opening(name: str) -> str:
    """The HTML that begins a container."""
    if name in FOLDED:
        return f'<details class="fold {name}">\n<summary>{FOLDED[name]}</summary>\n'
    title = '<p class="in-short-title">In short</p>\n' if name == "in-short" else ""
    return f'<div class="{name}">\n{title}'


def closing(name: str) -> str:
    """The HTML that ends a container."""
    return "</details>\n" if name in FOLDED else "</div>\n"
