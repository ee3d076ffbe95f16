"""A rung's emblem is its dial's ring: within its box, hollow in the middle, and a plain line without an objective."""

from __future__ import annotations

import re

import numpy as np
import pytest

from sitegen.assets import emblems
from widgets.parts import dial_marks as marks
from widgets.parts.dial import RUNGS


@pytest.mark.parametrize("name", emblems.NAMES)
def test_an_emblem_stays_in_its_box(name: str) -> None:
    outside = emblems.path(name).partition("z")[0]
    numbers = np.array([float(v) for v in re.findall(r"-?[\d.]+", outside)])
    if RUNGS[name].flat:
        assert emblems.path(name).count("z") == 2, "a circle within a circle"
    else:
        corners = numbers.reshape(-1, 2)
        assert len(corners) == 60
        assert corners.min() >= 0.0
        assert corners.max() <= emblems.BOX


@pytest.mark.parametrize("name", [name for name in emblems.NAMES if not RUNGS[name].flat])
def test_an_emblem_has_the_heights_of_the_ring(name: str) -> None:
    """Its lowest place is where the objective is lowest, and it uses the whole height."""
    radii = np.hypot(*emblems.profile(name).T)
    assert radii.min() == pytest.approx(marks.INNER)
    assert radii.max() == pytest.approx(marks.OUTER)
    assert radii.argmin() == emblems.dial(name).coarse.argmin()


def test_no_two_rungs_have_the_same_emblem() -> None:
    assert len({emblems.path(name) for name in emblems.NAMES}) == len(emblems.NAMES)
