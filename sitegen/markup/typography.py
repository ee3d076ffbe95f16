"""Text that is not Markdown (docstrings, names) as print has it."""

from __future__ import annotations

import re

# Code in backticks and what stands in quotes are passed over.
_APOSTROPHE = re.compile(r"`[^`]*`|(?<!\w)'[^']*'(?!\w)|(?<=[A-Za-z`)])'(?=[a-z])|(?<=s)'(?![\w'])")


def apostrophes(text: str) -> str:
    """Text whose apostrophes are curved. Quotes stay straight, since in docstrings they are those of Python values."""
    return _APOSTROPHE.sub(lambda found: "’" if found[0] == "'" else found[0], text)
