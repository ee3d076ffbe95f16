"""The site's colours by their meaning, with their contrast, for the authors' style guide."""

from __future__ import annotations

from dataclasses import dataclass

from sitegen.assets.tokens import colours

# Role or text colour → its meaning. All other colours are tokens that only the style sheets use.
MEANING = {
    "source": "the cloud that moves, and what belongs to it",
    "target": "the cloud that stays, and what belongs to it",
    "truth": "what a solver is never told",
    "inlier": "a pair or a point that agrees with the pose",
    "outlier": "a pair or a point that does not",
    "ghost": "where something was before, or will not be",
    "pair": "a link between two points",
    "normal": "a surface’s direction",
    "weak": "a direction that the data do not hold",
    "guide": "what is drawn to help the eye",
    "ink": "text",
    "soft": "text that stands beside",
    "accent": "what can be pressed, and where the focus is",
    "wrong": "what has failed",
}


@dataclass(frozen=True)
class Swatch:
    """A colour: its token, its meaning, its values in the light and the dark theme, and its lowest contrast with its
    backgrounds in either theme, as a mark and as text."""

    name: str
    meaning: str
    light: str
    dark: str
    mark: float
    text: float


def luminance(colour: str) -> float:
    """The relative luminance of #rrggbb, from 0 to 1, by WCAG 2."""
    parts = [value / 255 for value in bytes.fromhex(colour[1:])]
    red, green, blue = (p / 12.92 if p <= 0.04045 else ((p + 0.055) / 1.055) ** 2.4 for p in parts)
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue


def contrast(first: str, second: str) -> float:
    """WCAG 2's contrast ratio of two colours, from 1 to 21."""
    low, high = sorted((luminance(first), luminance(second)))
    return (high + 0.05) / (low + 0.05)


def swatches() -> list[Swatch]:
    """All colours with a meaning, in order."""
    values = colours()

    def least(name: str, grounds: tuple[str, ...]) -> float:
        return min(contrast(values[name][theme], values[ground][theme]) for theme in (0, 1) for ground in grounds)

    return [
        Swatch(
            name,
            meaning,
            *values[name],
            least(name, ("paper", "panel")),
            least(f"{name}-text" if f"{name}-text" in values else name, ("paper", "panel", "raised")),
        )
        for name, meaning in MEANING.items()
    ]
