"""A row of the bench, what a group of rows is measured on, and numbers as they are printed."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Row:
    """One number: what it is, its unit, the most it should be (None where only the size of it is of interest)."""

    what: str
    value: float
    unit: str
    aim: float | None = None
    note: str = ""

    @property
    def met(self) -> bool | None:
        """Whether the aim is reached; None without one."""
        return None if self.aim is None else self.value <= self.aim


@dataclass(frozen=True)
class Bench:
    """What groups measure on: the checkout, its freshly built site, a Chromium."""

    root: Path
    site: Path
    chromium: Path


def number(value: float) -> str:
    """Three significant digits, whole numbers whole."""
    return f"{value:.0f}" if value == round(value) or abs(value) >= 100 else f"{value:.3g}"
