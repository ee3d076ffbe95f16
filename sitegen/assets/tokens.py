"""The site's colours, as its style sheet has them."""

from __future__ import annotations

import re
from pathlib import Path

TOKENS = Path(__file__).resolve().parents[2] / "templates" / "assets" / "css" / "base" / "tokens.css"


def colours() -> dict[str, tuple[str, str]]:
    """The site's colours, name → (light, dark), as its style sheet has them."""
    found = re.findall(r"--([a-z0-9-]+):\s*light-dark\((#[0-9a-f]{6}),\s*(#[0-9a-f]{6})\)", TOKENS.read_text("utf-8"))
    return {name: (light, dark) for name, light, dark in found}
