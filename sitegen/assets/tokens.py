"""The site's colours, read from its style sheet."""

from __future__ import annotations

from pathlib import Path

from sitegen.assets.css import functions, rules

TOKENS = Path(__file__).resolve().parents[2] / "templates" / "assets" / "css" / "base" / "tokens.css"


def colours() -> dict[str, tuple[str, str]]:
    """The site's colours, name → (light, dark)."""
    values = {}
    for rule in rules(TOKENS.read_text("utf-8")):
        for name, value in rule.declarations:
            for light, dark in functions(value, "light-dark"):
                if name.startswith("--") and light.startswith("#"):
                    values[name.removeprefix("--")] = light, dark
    return values
