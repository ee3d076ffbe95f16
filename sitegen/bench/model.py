"""A row of the bench, the site and browser that it is measured on, and how numbers are printed."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Row:
    """One measurement: what it is, its value, unit, upper target (None if it is only for information) and note."""

    what: str
    value: float
    unit: str
    aim: float | None = None
    note: str = ""

    @property
    def met(self) -> bool | None:
        """Whether the target is met; None without one."""
        return None if self.aim is None else self.value <= self.aim


@dataclass(frozen=True)
class Bench:
    """What the groups measure: the checkout, its freshly built site, a Chromium."""

    root: Path
    site: Path
    chromium: Path


def number(value: float) -> str:
    """Three significant digits; whole numbers and those from 100 without decimals."""
    return f"{value:.0f}" if value == round(value) or abs(value) >= 100 else f"{value:.3g}"
