"""The typefaces that a page preloads: those that its HTML uses, and no more."""

from __future__ import annotations

import pytest

from sitegen.assets.preload import Preload, preloads

FILES = [Preload(name, name) for name in ("serif", "title", "sans", "math", "serif-italic")] + [
    Preload("greek", "serif", "σθ"),
    Preload("greek-italic", "serif-italic", "σθ"),
]
PLAIN = ["serif", "title", "sans"]


@pytest.mark.parametrize(
    ("html", "more"),
    [
        ("<p>Words.</p>", []),
        ("<p>A formula: <math><mi>σ</mi></math>.</p>", ["math"]),
        ("<p>Some <em>stress</em>.</p>", ["serif-italic"]),
        ("<p>A width σ.</p>", ["greek"]),
        ("<p>A width <em>σ</em>.</p>", ["serif-italic", "greek", "greek-italic"]),
        ('<p title="σ">Words.</p>', []),
        ("<figure><figcaption>A width σ.</figcaption></figure>", []),
        ("<details><summary>More</summary><p>A <em>width</em> σ: <math></math></p></details>", []),
        ("<details><summary>Its <math></math></summary><p>A width σ.</p></details>", ["math"]),
        ("<details open><summary>Less</summary><p>A width σ: <math></math></p></details>", ["math", "greek"]),
        ('<p>Words.</p><div class="card" hidden><cite>On θ</cite> <math></math></div>', []),
    ],
)
def test_a_page_preloads_what_its_text_is_set_in(html: str, more: list[str]) -> None:
    assert preloads(FILES, html) == PLAIN + more
