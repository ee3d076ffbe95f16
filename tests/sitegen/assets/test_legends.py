"""Readers who cannot tell red from green can tell a legend's marks apart: by shape, by hatching or by colour."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest

from sitegen.assets.tokens import colours
from tests.sitegen.assets.test_contrast import APART, SIMULATED, THEMES, lab, linear
from widgets.drawing.hatching import LINES
from widgets.engine.contract import Key
from widgets.engine.registry import WIDGETS

BANDS = ("truth", "line")  # drawn and shown twice as wide as any other line


def coexist(a: Key, b: Key) -> bool:
    """Whether one picture may have both: not if they belong to different options of the same choice."""
    (first, *of_a), (second, *of_b) = a.under or ("",), b.under or ("",)
    return first != second or not first or not set(of_a).isdisjoint(of_b)


@THEMES
@pytest.mark.parametrize("sight", ["normal", "protanopia", "deuteranopia"])
@pytest.mark.parametrize("name", sorted(WIDGETS))
def test_marks_of_one_shape_differ_in_colour(name: str, sight: str, theme: int) -> None:
    points = {role: lab(SIMULATED[sight] @ linear(pair[theme])) for role, pair in colours().items()}
    keys = [key for key in WIDGETS[name].legend if (key.role, key.shape) != BANDS]
    shapes = [(key.shape, LINES.get(key.role)) for key in keys]
    pairs = combinations(zip(keys, shapes, strict=True), 2)
    alike = [(a, b) for (a, shape), (b, form) in pairs if shape == form and a.role != b.role and coexist(a, b)]
    distances = {(a.label, b.label): float(np.linalg.norm(points[a.role] - points[b.role])) for a, b in alike}
    assert not {pair: distance for pair, distance in distances.items() if distance < APART["deuteranopia"]}


def test_the_simulation_finds_what_is_alike() -> None:
    """Red and green of equal lightness are far apart, except to readers who cannot tell them apart."""
    red, green = (linear(value) for value in ("#b0523c", "#757c36"))

    def distance(sight: str) -> float:
        return float(np.linalg.norm(lab(SIMULATED[sight] @ red) - lab(SIMULATED[sight] @ green)))

    assert distance("normal") > 40
    assert distance("deuteranopia") < 20
