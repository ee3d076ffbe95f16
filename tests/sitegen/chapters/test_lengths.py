"""Chapters do not grow: the word count of each main text stays within a budget.

The main text is what a reader sees without unfolding anything: running text, captions, tables, footnotes and *Try
this*. Evidence, answers, exercises, the opening and the five lines are not counted, nor are formulas and code.
"""

from __future__ import annotations

import re
from pathlib import Path

import pytest

CONTENT = Path(__file__).resolve().parents[3] / "content"
BUDGETS = {  # at most what each had before its counts were folded
    "00-start.md": 2474,
    "01-kabsch.md": 2310,
    "02-ransac.md": 2450,
    "03-icp.md": 2470,
    "04-surfaces.md": 2300,
    "05-ndt-map.md": 1220,
    "06-ndt-score.md": 1460,
    "07-ndt-climb.md": 1920,
    "08-soft.md": 1830,
    "09-mmd.md": 1740,
    "10-contestants.md": 1080,
    "11-race.md": 2060,
    "12-landscape.md": 1440,
    "13-reading.md": 2390,
    "14-four.md": 2140,
    "15-search.md": 1460,
    "16-uncertainty.md": 1450,
    "17-drive.md": 1520,
    "18-space.md": 1300,
    "19-clouds.md": 1174,
}
BEFORE = 34_224  # words in chapters 1 to 14 at that time
FOLDED = ("evidence", "answer", "in-short", "opening")
NOT_READ = (
    (r"```.*?```", " "),
    (r"\$\$.*?\$\$( \([\w-]+\))?", " "),
    (r":(readout|value)\[[^\]]*\](\{[^}]*\})?", " 0 "),
    (r"(::?(?:claim|promise|ref|term|figure|picture|plot|try|predict)\[.*?\])\{[^}]*\}", r"\1"),
    (r"\]\{[^}]*\}", " "),
    (r":{1,3}[\w-]+", " "),
    (r"\{#[^}]*\}", " "),
    (r"\$[^$]*\$", " x "),
    (r"[|\[\]*#_^]", " "),
)


def main_words(text: str) -> int:
    """The number of words in a chapter's main text."""
    body = text.split("\n---\n", 1)[1].partition("\n## Exercises {#exercises}\n")[0]
    for name in FOLDED:
        body = re.sub(rf"^:::{name}\b.*?^:::\s*?$", "", body, flags=re.MULTILINE | re.DOTALL)
    for pattern, instead in NOT_READ:
        body = re.sub(pattern, instead, body, flags=re.DOTALL if "`" in pattern or r"\$\$" in pattern else 0)
    return sum(bool(re.search(r"\w", word)) for word in body.split())


def test_what_is_counted() -> None:
    text = """---
title: Not counted
---

:::opening
**Assumes** not these words.
:::

Four words, one $x + y$.

:::evidence
:claim[Not these.]{tests/a.py::test_b}
:::

::figure[Press it. | :promise[It falls.]{press=go expect="a < 1; b > 2"}]{widget id=one press=go*12}

$$
E = 0
$$ (none)

Off by :readout[one rms]{press=go} u.

## Exercises {#exercises}

**1.** Not these.
"""
    assert main_words(text) == 4 + 4 + 4


@pytest.mark.parametrize("name", [path.name for path in sorted(CONTENT.glob("*.md"))])
def test_no_chapter_is_longer_than_its_budget(name: str) -> None:
    words = main_words((CONTENT / name).read_text("utf-8"))
    assert words <= BUDGETS[name], f"{name} has {words} words: fold counts under Evidence, or cut what is said twice"


def test_the_rungs_to_the_four_methods_are_more_than_a_fifth_shorter() -> None:
    assert sum(words for name, words in BUDGETS.items() if "01" <= name[:2] <= "14") < 0.79 * BEFORE
