"""Typography that Markdown lacks: curly apostrophes, punctuation that stays with its formula, symbols that are not
translated, whole options, names that may wrap."""

from __future__ import annotations

import re
from html import unescape

from markupsafe import Markup, escape

# Skips code in backticks and text in quotes.
_APOSTROPHE = re.compile(r"`[^`]*`|(?<!\w)'[^']*'(?!\w)|(?<=[A-Za-z`)])'(?=[a-z])|(?<=s)'(?![\w'])")
_OPTION = re.compile(r"(?<![\w-])--\w[\w-]*")
# A formula with the punctuation that touches it.
_BESIDE = re.compile(r"([(\[“‘]*)(<math\b.*?</math>)([,.;:!?)\]’”]*)", re.DOTALL)
_TAG = re.compile(r"<[^>]*>")
LONG = 12  # characters of an inline formula that may be wider than a phone's column with large text
_SYMBOLS = re.compile(r"<(?:math|code)\b")


def unbroken_formulas(html: str) -> str:
    """The HTML with no line breaks between a formula and the punctuation that touches it. Browsers may break there,
    since they treat a formula as an object rather than a letter. A long one is marked: it has no break either, and
    scrolls where it is wider than its column.
    """

    def hold(at: re.Match[str]) -> str:
        if ' display="block"' in at[2]:
            return at[0]
        if len(unescape(_TAG.sub("", at[2]))) >= LONG:
            return f'<span class="held long">{at[0]}</span>'
        return f'<span class="held">{at[0]}</span>' if at[1] or at[3] else at[0]

    return _BESIDE.sub(hold, html)


def untranslated(html: str) -> str:
    """The HTML in which browsers translate neither formulas nor code: they would take their letters for words."""
    return _SYMBOLS.sub(r'\g<0> translate="no"', html)


def whole_options(code: str) -> Markup:
    """Inline code as HTML in which no line ends after the hyphens of an option. A word joiner would be copied too."""
    return Markup(_OPTION.sub(r'<span class="held">\g<0></span>', str(escape(code))))


def apostrophes(text: str) -> str:
    """The text with curly apostrophes. Quotes stay straight, since in docstrings they belong to Python values."""
    return _APOSTROPHE.sub(lambda match: "’" if match[0] == "'" else match[0], text)


def breakable(name: str) -> Markup:
    """A long name as HTML with places to wrap: after a slash, an underscore and a double colon."""
    return Markup(re.sub(r"(::|[/_])(?=\w)", r"\1<wbr>", str(escape(name))))
