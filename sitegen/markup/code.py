"""Syntax highlighting: code with classes on its tokens, which the style sheet colours."""

from __future__ import annotations

from functools import cache
from html import escape
from itertools import groupby

from markupsafe import Markup
from pygments.lexers import find_lexer_class_by_name, get_all_lexers
from pygments.token import STANDARD_TYPES
from pygments.util import ClassNotFound

from sitegen.problems import hint

# Pygments' classes that the style sheet colours. All others are omitted: they would be half of the page of checks.
_FAMILIES = (("c", "ch", "cm", "c1", "cs", "sd"), ("k", "kc", "kd", "kn", "kp", "kr", "ow"), ("nf", "nc", "fm", "nd"))
_VALUES = (("s", "s1", "s2", "sa", "sb", "se", "sf", "si"), ("m", "mi", "mf", "mh", "il"), ("err", "gr"))
COLOURED = frozenset(name for family in (*_FAMILIES, *_VALUES) for name in family)
WAY = "coloured words alone"  # part of the cache key: changed when the highlighting changes


@cache
def highlighted(code: str, language: str) -> Markup:
    """Code with Pygments' classes. Raises ValueError for a language that Pygments does not know."""
    if not language:
        return Markup(escape(code, quote=False))
    try:
        lexer = find_lexer_class_by_name(language)(stripnl=False)
    except ClassNotFound:
        names = {alias for _, aliases, _, _ in get_all_lexers() for alias in aliases}
        raise ValueError(f"unknown language {language!r}{hint(language, names)}") from None
    pieces = ((STANDARD_TYPES.get(kind, ""), text) for kind, text in lexer.get_tokens(code))
    tokens = ((name if name in COLOURED else "", text) for name, text in pieces)
    groups = ((name, "".join(text for _, text in group)) for name, group in groupby(tokens, lambda piece: piece[0]))
    texts = ((name, escape(text, quote=False)) for name, text in groups)
    return Markup("".join(f'<span class="{name}">{text}</span>' if name else text for name, text in texts))
