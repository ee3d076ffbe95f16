"""Code with its words in classes, which the style sheet colours."""

from __future__ import annotations

from functools import cache

from markupsafe import Markup, escape
from pygments import highlight
from pygments.formatters import HtmlFormatter
from pygments.lexers import find_lexer_class_by_name, get_all_lexers
from pygments.util import ClassNotFound

from sitegen.problems import hint


@cache
def highlighted(code: str, language: str) -> Markup:
    """Code with Pygments' classes. Raises ValueError for a language that it does not know."""
    if not language:
        return Markup(escape(code))
    try:
        lexer = find_lexer_class_by_name(language)(stripnl=False)
    except ClassNotFound:
        names = {alias for _, aliases, _, _ in get_all_lexers() for alias in aliases}
        raise ValueError(f"no language {language!r}{hint(language, names)}") from None
    return Markup(highlight(code, lexer, HtmlFormatter(nowrap=True)))
