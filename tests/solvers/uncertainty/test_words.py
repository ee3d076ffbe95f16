"""A direction of motion in words: which way a slide goes, and about which point a turn is."""

import re

import numpy as np
import pytest

from solvers.uncertainty import exp
from solvers.uncertainty.words import SLIDE, named


@pytest.mark.parametrize("direction", [(0.6, 0.8, 0.0), (-0.6, 0.0, 0.8), (0.28, -0.576, 0.768)])
def test_a_turn_is_about_the_point_that_stays(direction):
    """The point that it names is moved by less than a thousandth of what the centre is, by 0.001 of the direction."""
    centre, radius = np.array([7.0, -3.0]), 2.0
    text = named(np.array(direction), centre, radius)
    point = np.array(re.fullmatch(r"the turn about \((.+), (.+)\)", text).groups(), dtype=float)
    step = exp(1e-3 * np.array(direction) / [radius, 1.0, 1.0])  # about the centre
    far, near = (np.linalg.norm(step.apply((x - centre)[None]) - (x - centre)) for x in (centre, point))
    assert far == pytest.approx(1e-3 * np.hypot(*direction[1:]), rel=1e-2)
    assert near < 0.02 * far


def test_a_slide_is_along_a_unit_vector():
    """A direction that hardly turns is a slide; its turning part counts for nothing in the words."""
    assert named(np.array([0.0, 0.0, -1.0]), np.zeros(2), 1.0) == "the slide along (0.00, -1.00)"
    turn = 0.99 * SLIDE
    slide = np.sqrt(1.0 - turn**2) * np.array([0.6, 0.8])
    assert named(np.array([turn, *slide]), np.array([5.0, 5.0]), 3.0) == "the slide along (0.60, 0.80)"
    assert named(0.5 * np.array([0.0, 0.6, 0.8]), np.zeros(2), 1.0) == "the slide along (0.60, 0.80)"
    assert named(np.array([1.01 * SLIDE, *slide]), np.zeros(2), 1.0).startswith("the turn about")


def test_a_place_is_told_to_a_hundredth_of_the_cloud():
    """In kilometres as in metres: two decimals alone would call any small cloud's centre the origin."""
    turn = np.array([1.0, 0.0, 0.0])
    assert named(turn, np.array([3.2, 1.5]), 2.0) == "the turn about (3.20, 1.50)"
    assert named(turn, 1e-3 * np.array([3.2, 1.5]), 2e-3) == "the turn about (0.00320, 0.00150)"
