"""Finds phrases that sound translated, wherever someone reads them: text, templates, messages and docstrings.

`PHRASES` is the project's list: what not to write, and what to write instead. Add to it whatever an editor corrects
twice.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from pathlib import Path

READ = ("content", "templates", "solvers", "sitegen", "widgets", "README.md", "CHANGELOG.md")
KINDS = {".md", ".yaml", ".html", ".py", ".pyi", ".js"}
HERE = "sitegen/check/style.py"
# What may follow "is no": a comparison, and idioms.
AFTER_NO = "longer|more|less|fewer|farther|further|nearer|better|worse|larger|smaller|slower|faster|higher|lower|such"
PHRASES = {
    rf"(?<!there\s)(?<!There\s)\b(?:is|are|was|were) no (?!(?:{AFTER_NO})\b)[a-z]+": "is not a …",
    r"but for rounding": "up to rounding",
    r"find(?:s|ing)? no seeds? at all": "succeeds on no seed",
    r"half a turn less a little": "just under half a turn",
    r"[Dd]eep is high": "darker is higher",
    r"(?:what|that) is dear\b": "what is expensive",
    r"com(?:e|es|ing) home": "succeeds",
    r"leads? into a circle": "is circular",
    r"no currency": "not comparable",
    r"bring(?:s)? up what nobody": "reveals a surprise",
    r"hoped of (?:it|them)": "all we ask of …",
    r"every further nine": "each extra nine",
    r"helps? its point along": "say which draw is shown",
    r"has come less far": "gets less far",
    r"pairs hold fast": "the pairs constrain",
    r"of which an unknown part": "an unknown fraction of them",
    r"answers? differently to": "responds differently to",
    r"it takes the full Hessian": "this needs the full Hessian",
    r"vot(?:e|es|ed|ing) for staying": "vote to stay put",
    r"so many-th": "every `n`-th",
    r"tak(?:e|es|ing) \w+(?: own)? \w+ for exact": "treats … as exact",
    r"(?:same|equal|pose|sums) to rounding": "up to rounding",
    r"lies? (?:wrongly )?to (?:each other|the cloud)": "is aligned with …",
    r"by turns": "alternately",
    r"small letters": "lower-case letters",
    r"partners in effect": "effective partners",
    r"points? a cloud\b": "points per cloud",
    r"on a scale of decades": "on a logarithmic scale",
    r"comes? on top": "adds",
}
_ANY = re.compile("|".join(f"(?P<p{k}>{phrase})" for k, phrase in enumerate(PHRASES)).replace(" ", r"\s+(?:#\s)?"))


def style(root: Path) -> int:
    """Print every such phrase with its place. The exit code is 1 if there is one."""
    lines = [line for path in _files(root) for line in _findings(path, path.relative_to(root).as_posix())]
    sys.stdout.write("".join(f"{line}\n" for line in lines))
    sys.stdout.flush()
    return 1 if lines else 0


def _files(root: Path) -> Iterator[Path]:
    for name in READ:
        target = root / name
        for path in sorted(target.rglob("*")) if target.is_dir() else [target]:
            if path.suffix in KINDS and path.is_file() and path != root / HERE:
                yield path


def _findings(path: Path, name: str) -> Iterator[str]:
    text = path.read_text("utf-8")
    for match in _ANY.finditer(text):
        words = " ".join(match[0].split())
        instead = list(PHRASES.values())[int((match.lastgroup or "p0")[1:])]
        yield f"{name}:{text.count(chr(10), 0, match.start()) + 1}: {words} ==> {instead}"
