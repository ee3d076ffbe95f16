"""What print has and Markdown does not: curved apostrophes, and signs that keep to their formula."""

from __future__ import annotations

import re

# Code in backticks and what stands in quotes are passed over.
_APOSTROPHE = re.compile(r"`[^`]*`|(?<!\w)'[^']*'(?!\w)|(?<=[A-Za-z`)])'(?=[a-z])|(?<=s)'(?![\w'])")
# A formula in a line, with the signs that touch it.
_BESIDE = re.compile(r"([(\[“‘]*)(<math\b.*?</math>)([,.;:!?)\]’”]*)", re.DOTALL)


def held(html: str) -> str:
    """HTML in which no line begins with a comma after a formula, nor ends with a bracket before one: browsers may break
    there, since to them a formula is a thing and not a letter.
    """
    return _BESIDE.sub(lambda at: f'<span class="held">{at[0]}</span>' if at[1] or at[3] else at[0], html)


def apostrophes(text: str) -> str:
    """Text whose apostrophes are curved. Quotes stay straight, since in docstrings they are those of Python values."""
    return _APOSTROPHE.sub(lambda match: "’" if match[0] == "'" else match[0], text)
