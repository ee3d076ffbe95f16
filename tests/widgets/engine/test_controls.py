"""Controls accept the values that their specification allows and explain why they refuse others."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any

import pytest

from widgets.engine.controls import choice, slider, specs, toggle, validated, values


@dataclass(frozen=True)
class Some:
    scene: str = choice(
        "clean", "Scene", {"clean": "Clean", "noisy": "Noisy"}, sets={"noisy": {"noise": 0.2}, "clean": {"noise": 0.0}}
    )
    noise: float = slider(0.1, "Noise", 0.0, 0.6, 0.02, "u")
    correct: bool = toggle(True, "Correct", keeps="pose")


def test_defaults_and_specs() -> None:
    assert values(Some()) == {"scene": "clean", "noise": 0.1, "correct": True}
    result = specs(Some)
    assert list(result) == ["scene", "noise", "correct"]
    assert (result["noise"].kind, result["noise"].unit, result["noise"].decimals) == ("slider", "u", 2)
    assert [spec.keeps for spec in result.values()] == ["nothing", "log", "pose"]


def test_a_slider_is_called_by_what_it_stands_for() -> None:
    """If the option has no name for it, or no option is known, the slider has its own label."""
    spec = slider(1, "Length", 0, 2, 1, named=("method", {"icp": "Gate", "cpd": "First σ"})).metadata["spec"]
    methods: tuple[dict[str, str], ...] = ({"method": "icp"}, {"method": "cpd"}, {"method": "ndt"}, {})
    assert [spec.called(controls) for controls in methods] == ["Gate", "First σ", "Length", "Length"]
    assert specs(Some)["noise"].called({"scene": "noisy"}) == "Noise"


@pytest.mark.parametrize(("step", "decimals"), [(1.0, 0), (0.5, 1), (0.02, 2), (0.125, 3), (10.0, 0)])
def test_a_slider_prints_the_decimals_of_its_step(step: float, decimals: int) -> None:
    spec = slider(0, "S", 0, 1, step).metadata["spec"]
    assert spec.decimals == decimals


def test_given_values_replace_defaults() -> None:
    assert validated(Some, {"noise": 0, "correct": False}) == Some("clean", 0.0, False)


def test_an_option_brings_values_that_given_ones_override() -> None:
    """Naming only the scene brings that scene's noise; naming both keeps both."""
    assert validated(Some, {"scene": "noisy"}).noise == 0.2
    assert validated(Some, {"scene": "noisy", "noise": 0.5}).noise == 0.5
    assert validated(Some, {}).noise == 0.1


def test_rounding_at_the_ends_is_clamped() -> None:
    assert validated(Some, {"noise": 0.6 + 1e-12}).noise == 0.6
    assert validated(Some, {"noise": -1e-12}).noise == 0.0


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"nois": 0.1}, "no control 'nois'; did you mean 'noise'?"),
        ({"zzz": 0.1}, "no control 'zzz'; there are scene, noise, correct"),
        ({"scene": "niosy"}, "scene: no option 'niosy'; did you mean 'noisy'?"),
        ({"scene": ["noisy"]}, "scene: no option"),
        ({"noise": 0.7}, "noise: 0.7 lies outside 0 … 0.6"),
        ({"noise": -1}, "noise: -1 lies outside 0 … 0.6"),
        ({"noise": "0.1"}, "noise: '0.1' is not a number"),
        ({"noise": True}, "noise: True is not a number"),
        ({"noise": float("nan")}, "noise: nan is not a number"),
        ({"noise": 10**400}, "is not a number"),
        ({"noise": None}, "noise: None is not a number"),
        ({"correct": 1}, "correct: 1 is neither true nor false"),
        ({"correct": "true"}, "correct: 'true' is neither true nor false"),
    ],
)
def test_refusals_name_the_control_and_the_nearest_right_name(values: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=re.escape(message)):
        validated(Some, values)
