"""A slider's value is written the same by the build and by the page's script when the slider is moved."""

from __future__ import annotations

import json
import subprocess
from dataclasses import replace

import numpy as np

from sitegen.external.node import environment, node_command
from sitegen.pages.views import slider_text
from tests.scripts.test_node import HERE
from widgets.engine.controls import Spec, specs
from widgets.engine.registry import WIDGETS

SCRIPT = HERE.parents[1] / "templates/assets/js/figure/shown_value.js"
ASKED = """
import { readFileSync } from "node:fs";
import { shownValue } from %s;
const asked = JSON.parse(readFileSync(0, "utf8"));
console.log(JSON.stringify(asked.map(([spec, value]) => shownValue(spec, value))));
"""


def sliders() -> list[tuple[Spec, float]]:
    """All positions of every figure's sliders, and for each slider a negative value that rounds to zero."""
    ranges = [spec for widget in WIDGETS.values() for spec in specs(widget.controls).values() if spec.kind == "slider"]
    return [
        (spec, value)
        for spec in ranges
        for value in (*np.arange(spec.low, spec.high + spec.step / 2, spec.step).round(6).tolist(), -1e-9)
    ]


def test_a_value_reads_the_same_in_the_build_and_in_the_page() -> None:
    pairs = sliders()
    plain = [[{"kind": spec.kind, "decimals": spec.decimals, "unit": spec.unit}, value] for spec, value in pairs]
    command = node_command("--input-type=module", "--eval", ASKED % json.dumps(SCRIPT.as_uri()))
    process = subprocess.run(
        command, input=json.dumps(plain), capture_output=True, encoding="utf-8", env=environment(), check=True
    )
    assert json.loads(process.stdout) == [slider_text(spec, value) for spec, value in pairs]


def test_a_unit_stands_apart_but_a_degree_does_not() -> None:
    spec = sliders()[0][0]
    assert slider_text(replace(spec, step=5.0, unit="°"), -60.0) == "−60°"
    assert slider_text(replace(spec, step=0.1, unit="u"), 1.5) == "1.5\u00a0u"
    assert slider_text(replace(spec, step=1.0, unit=""), 3.0) == "3"
