"""The colours of the style sheet: legible in both themes, with roles that colour-blind readers can tell apart too."""

from __future__ import annotations

import re
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest

from sitegen.assets.swatches import contrast
from sitegen.assets.tokens import colours

CSS = Path(__file__).resolve().parents[3] / "templates" / "assets" / "css"
THEMES = pytest.mark.parametrize("theme", [0, 1], ids=["light", "dark"])

# The roles of clouds: dots and squares of a few px that may lie side by side in one picture.
CLOUDS = ("source", "target", "truth", "inlier", "outlier", "ghost")
ROLES = (*CLOUDS, "pair", "normal", "weak", "guide")
# Lines of one chart, which also differ in their dashes and carry their names.
RACE = tuple(f"by-{name}" for name in ("nearest", "samples", "cells", "weights", "means", "marginals"))

# Dichromacy, linear RGB to linear RGB: Machado, Oliveira & Fernandes 2009, A physiologically-based model for simulation
# of color vision deficiency, severity 1.0.
SIMULATED = {
    "normal": np.eye(3),
    "protanopia": np.array(
        [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]]
    ),
    "deuteranopia": np.array(
        [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]]
    ),
    "tritanopia": np.array(
        [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.303900]]
    ),
}
# Distances in CIELAB. A just noticeable difference is about 2.3 between large fields and several times that between
# marks of a few px; 20 keeps neighbours apart at a glance. Tritanopia is far rarer than the other two: 15.
APART = {"normal": 30.0, "protanopia": 20.0, "deuteranopia": 20.0, "tritanopia": 15.0}


def linear(value: str) -> np.ndarray:
    rgb = np.array(list(bytes.fromhex(value[1:]))) / 255
    return np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)


def lab(rgb: np.ndarray) -> np.ndarray:
    """CIELAB (D65) of linear RGB."""
    to_xyz = np.array(
        [[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.0721750], [0.0193339, 0.1191920, 0.9503041]]
    )
    part = to_xyz @ np.clip(rgb, 0, 1) / (0.95047, 1.0, 1.08883)
    f = np.where(part > 216 / 24389, np.cbrt(part), (24389 / 27 * part + 16) / 116)
    return np.array([116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])])


def test_contrast_is_what_wcag_says() -> None:
    assert contrast("#000000", "#ffffff") == pytest.approx(21.0)
    assert contrast("#777777", "#ffffff") == pytest.approx(4.48, abs=0.01)


@THEMES
@pytest.mark.parametrize("ground", ["paper", "panel", "raised"])
def test_text_is_legible(theme, ground) -> None:
    hues = {name: pair[theme] for name, pair in colours().items()}
    texts = ["ink", "soft", "accent", "wrong", *(f"{r}-text" if f"{r}-text" in hues else r for r in (*ROLES, *RACE))]
    low = {name: contrast(hues[name], hues[ground]) for name in texts if contrast(hues[name], hues[ground]) < 4.5}
    assert not low


@THEMES
def test_text_on_fills_and_tints_is_legible(theme) -> None:
    hues = {name: pair[theme] for name, pair in colours().items()}
    assert contrast(hues["paper"], hues["ink"]) >= 4.5
    for name in ("ink", "truth", "soft"):
        assert contrast(hues[name], hues["tint"]) >= 4.5, name


@THEMES
def test_marks_and_edges_of_controls_stand_out(theme) -> None:
    hues = {name: pair[theme] for name, pair in colours().items()}
    for name in (*ROLES, "edge"):
        for ground in ("paper", "panel"):
            assert contrast(hues[name], hues[ground]) >= 3.0, (name, ground)


@THEMES
@pytest.mark.parametrize("sight", SIMULATED)
def test_roles_stay_apart(theme, sight) -> None:
    points = {name: lab(SIMULATED[sight] @ linear(colours()[name][theme])) for name in CLOUDS}
    distances = {(a, b): float(np.linalg.norm(points[a] - points[b])) for a, b in combinations(CLOUDS, 2)}
    assert not {pair: d for pair, d in distances.items() if d < APART[sight]}


@THEMES
@pytest.mark.parametrize("sight", SIMULATED)
def test_the_race_s_families_stay_apart(theme, sight) -> None:
    points = {name: lab(SIMULATED[sight] @ linear(colours()[name][theme])) for name in RACE}
    distances = {(a, b): float(np.linalg.norm(points[a] - points[b])) for a, b in combinations(RACE, 2)}
    assert not {pair: d for pair, d in distances.items() if d < 0.85 * APART[sight]}


@THEMES
def test_heat_gets_stronger_in_even_steps(theme) -> None:
    """The first step is close to the panel's ground; each stands out more than the one before, in both themes."""
    ramp = np.array([lab(linear(colours()[f"h{i}"][theme])) for i in range(24)])
    steps = np.linalg.norm(np.diff(ramp, axis=0), axis=1)
    ground = lab(linear(colours()["panel"][theme]))[0]
    assert (np.diff(np.abs(ramp[:, 0] - ground)) > 0).all()
    assert abs(ramp[0, 0] - ground) < 10
    assert abs(ramp[-1, 0] - ground) > 55
    assert steps.min() > 0.4 * steps.mean()
    assert steps.max() < 1.6 * steps.mean()


@THEMES
@pytest.mark.parametrize("sight", SIMULATED)
def test_the_ends_of_runs_get_stronger_and_the_truth_stands_out(theme, sight) -> None:
    """The more an end is turned, the more its lightness differs from the ground's; the truth's colour is distinct."""
    text = (CSS / "figure" / "legend.css").read_text("utf-8")
    used = dict(re.findall(r"\.end-(\w+) \{\s*--colour: var\(--(\w+)\)", text))
    names = [used[kind] for kind in ("none", "shifted", "turned", "quarter", "half")]
    *ends, truth = (lab(SIMULATED[sight] @ linear(colours()[name][theme])) for name in (*names, "truth"))
    assert min(np.diff([abs(end[0] - ends[0][0]) for end in ends])) > 4
    assert min(float(np.linalg.norm(end - truth)) for end in ends) > APART[sight]


def test_every_colour_used_is_a_token() -> None:
    """Outside the tokens no colour is written out, unless a rule itself gives the values for both themes."""
    tokens = set(re.findall(r"(--[a-z0-9-]+):", "".join(p.read_text("utf-8") for p in CSS.rglob("*.css"))))
    for path in sorted(CSS.rglob("*.css")):
        text = re.sub(r"url\([^)]*\)|/\*.*?\*/", "", path.read_text("utf-8"), flags=re.S)
        assert set(re.findall(r"var\((--[a-z0-9-]+)", text)) <= tokens, path.name
        if path.name not in ("tokens.css", "print.css"):
            bare = re.findall(r"#[0-9a-fA-F]{3,8}\b", re.sub(r"light-dark\([^;]*\)", "", text))
            assert not bare, path.name
