"""The site's typefaces: subset at build time to the characters that its pages use, with the CSS that loads them.

Five faces: a serif for text, its italic, a display cut of it for titles, a sans for controls and labels, and a
mathematical font. Each is instanced at the optical size and weights that it is used at, subset, and named by its
content.

The licence of the originals reserves their names, so the modified fonts have names of their own.
"""

from __future__ import annotations

import hashlib
import io
import json
import re
import unicodedata
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from functools import partial
from html import unescape
from pathlib import Path
from typing import Any

import fontTools

from sitegen.assets.preload import Preload
from sitegen.cache import pool
from sitegen.cache.files import cache_dir, content, short_hash
from sitegen.cache.memo import Remembered
from sitegen.cache.store import Store
from sitegen.external import fetch
from sitegen.progress import Progress, quiet

BUNDLES = ("serif", "sans", "math-font")
FORMAT = "6"  # of cached fonts; to be raised when their making changes in a way that the key does not cover

# Characters that any page may need at run time, for a live figure's numbers and for messages. Rarer ones are added for
# the pages that have them.
ASCII = "".join(map(chr, range(0x20, 0x7F)))
BASICS = ASCII + "\u00a0°±²³×¼½¾–—‘’“”…′−"
TITLES = "".join(c for c in BASICS if c not in "#$*<>@[\\]^_`{|}~¼¾×′")  # without signs that occur in no title
SYMBOLS = "←→↑↓⁰⁴⁵⁶⁷⁸⁹⁻αβγδεθκλμνπρστφχψωΔΣ≤≥≈√"
# Browsers draw a single letter in mathematics with the italic letters of this block, not with the letter itself.
ITALIC = {
    **{chr(0x41 + i): chr(0x1D434 + i) for i in range(26)},
    **{chr(0x61 + i): chr(0x1D44E + i) for i in range(26)},
    "h": "ℎ",
    **{chr(0x391 + i): chr(0x1D6E2 + i) for i in range(17)},
    **{chr(0x3A3 + i): chr(0x1D6F4 + i) for i in range(7)},
    **{chr(0x3B1 + i): chr(0x1D6FC + i) for i in range(25)},
    **dict(zip("ϵϑϰϕϱϖ", "𝜖𝜗𝜘𝜙𝜚𝜛", strict=True)),
}
MATHEMATICS = ASCII + "·×±−≤≥≠≈→′… ,"
FORMULA = re.compile(r"<math\b.*?</math>", re.DOTALL)
TAG = re.compile(r"<[^>]*>")
ROOT = re.compile(r"<m(?:sqr|roo)t\b")  # browsers draw a sign for it that is not in the text


@dataclass(frozen=True)
class Face:
    """One face of the site: `family` in the CSS, cut from the first of `files` (bundle/name) that has a character.

    limits: the value at which each axis of a variable original is pinned, or the range that it keeps. features: the
    layout features to keep. wanted: which characters it needs: "text", "controls", "title" or "mathematics". preload:
    whether pages may preload it.
    """

    name: str
    family: str
    files: tuple[str, ...]
    wanted: str
    limits: Mapping[str, float | tuple[float, float]] = field(default_factory=dict)
    features: tuple[str, ...] = ("kern", "mark", "ccmp", "liga")
    style: str = "normal"
    weight: str = "400"
    preload: bool = False


def _serif(style: str) -> tuple[str, ...]:
    scripts = ("latin", "latin-ext", "greek")
    return tuple(f"serif/files/source-serif-4-{script}-opsz-{style}.woff2" for script in scripts)


TEXT_SIZE, TITLE_SIZE = 18.0, 40.0  # optical sizes
FACES = (
    Face("serif", "Ladder Serif", _serif("normal"), "text", {"opsz": TEXT_SIZE, "wght": (400, 600)},
         ("kern", "mark", "ccmp", "liga", "pnum"), weight="400 600", preload=True),
    Face("serif-italic", "Ladder Serif", _serif("italic"), "text", {"opsz": TEXT_SIZE, "wght": 400},
         ("kern", "mark", "ccmp", "liga", "pnum"), style="italic", preload=True),
    Face("title", "Ladder Title", _serif("normal")[:2], "title", {"opsz": TITLE_SIZE, "wght": 550}, preload=True),
    Face("sans", "Ladder Sans", ("sans/WOFF2/VF/SourceSans3VF-Upright.ttf.woff2",), "controls", {"wght": (400, 600)},
         ("kern", "mark", "ccmp", "pnum"), weight="400 600", preload=True),
    Face("math", "Ladder Math", ("math-font/files/stix-two-math-latin-400-normal.woff2",), "mathematics", preload=True),
)  # fmt: skip


@dataclass(frozen=True)
class Fallback:
    """A font on readers' machines, scaled to our face's metrics, so that little moves when ours arrives.

    average: mean advance of SAMPLE in em, in a font with the same metrics as those named in `local`.
    """

    family: str
    stands_for: str
    local: tuple[str, ...]
    average: float


# Averages measured with average_advance() on Liberation Serif and Liberation Sans, which have the same metrics as the
# fonts named beside them.
_TIMES = ("Times New Roman", "Liberation Serif", "Tinos")
_TIMES_ITALIC = ("Times New Roman Italic", "TimesNewRomanPS-ItalicMT", "Liberation Serif Italic", "Tinos Italic")
_TIMES_BOLD = ("Times New Roman Bold", "TimesNewRomanPS-BoldMT", "Liberation Serif Bold", "Tinos Bold")
FALLBACKS = (
    Fallback("Ladder Serif Near", "serif", _TIMES, 0.4010),
    Fallback("Ladder Serif Near", "serif-italic", _TIMES_ITALIC, 0.4026),
    Fallback("Ladder Title Near", "title", _TIMES_BOLD, 0.4275),
    Fallback("Ladder Sans Near", "sans", ("Arial", "Liberation Sans", "Arimo"), 0.4455),
)
SAMPLE = (
    "Registration estimates the transform that takes points measured in one frame to the coordinates of another. "
    "A robot sees one scene from two poses, and the two clouds share a part of what they show. When the pairs are "
    "known, the best rotation and translation follow in closed form; when they are not, every method needs something "
    "to stand in their place."
)


@dataclass(frozen=True)
class FontSet:
    """The fonts of a build.

    files: name, which holds the content's hash → WOFF2 bytes. css: the @font-face rules. preload: files worth a
    <link rel="preload" as="font" type="font/woff2" crossorigin> on pages that use them.
    missing: characters that no face has, so that a reader's own fonts will show them.
    """

    files: dict[str, bytes]
    css: str
    preload: tuple[Preload, ...]
    missing: str


def characters(pages: Iterable[str]) -> tuple[str, str]:
    """The distinct characters that HTML pages use, sorted: (in text, in mathematics). Attributes and scripts count as
    text: some of it is shown too, and parsing the elements would take seven times as long."""
    text: set[str] = set()
    mathematics: set[str] = set()
    for page in pages:
        text.update(unescape(FORMULA.sub("", page)))
        for formula in FORMULA.findall(page):
            mathematics.update(unescape(TAG.sub("", formula)))
            mathematics.update("√" if ROOT.search(formula) else "")
    return "".join(sorted(text)), "".join(sorted(mathematics))


def make(
    text: str = "",
    mathematics: str = "",
    *,
    url: str = "",
    cache: Path | None = None,
    progress: Progress = quiet,
) -> FontSet:
    """Cut every face to BASICS and the characters given; the same characters give the same bytes.

    text, mathematics: characters that the pages show, as `characters` collects them. url: prefix of a file's name in
    the CSS, relative to the style sheet. cache: the folder for originals and cuts; default: the usual cache. Raises
    OutsideError if an original cannot be obtained.
    """
    cache = cache or cache_dir()
    store, memo = Store(cache, "fonts"), Remembered(cache, f"typefaces-{FORMAT}-{fontTools.version}")
    originals = fetch.gather(BUNDLES, cache=cache, progress=progress)
    letters = _letters_by_face(text, mathematics)
    covered: set[int] = set()
    cuts: list[tuple[Face, Path, list[int], Path]] = []
    for face in FACES:
        remaining = set(map(ord, letters[face.wanted]))
        for file in face.files:
            coverage = memo.answer(_digest(originals[file]), partial(_coverage, originals[file]))
            available = remaining.intersection(coverage)
            if available:
                codes = sorted(available)
                cuts.append((face, originals[file], codes, cache))
            remaining -= available
            covered |= available
    pool.make("cutting typefaces", [(_cut, inputs) for inputs in cuts if not store.has(_recipe(*inputs[:3]))], progress)
    files: dict[str, bytes] = {}
    rules: list[str] = []
    preload: list[Preload] = []
    for face, original, codes, _ in cuts:
        data = _cut(face, original, codes, cache)
        name = f"{face.name}-{short_hash(data)}.woff2"
        files[name] = data
        first = original == originals[face.files[0]]
        rules.append(_rule(face, url + name, "" if first else ranges(set(codes))))
        if face.preload and (first or face.style == "normal"):
            preload.append(Preload(url + name, face.name, "" if first else "".join(map(chr, codes))))
        if first:
            for fallback in (f for f in FALLBACKS if f.stands_for == face.name):
                make_rule = partial(_fallback_rule, fallback, face, data)
                rules.append(memo.answer(f"{fallback} {face} {name} {SAMPLE}", make_rule))
    memo.keep()
    missing = {c for c in text + mathematics if ord(c) not in covered and _is_visible(c)}
    return FontSet(files, "\n".join(rules) + "\n", tuple(preload), "".join(sorted(missing)))


def _letters_by_face(text: str, mathematics: str) -> dict[str, str]:
    """The characters that each kind of face needs. Rarer letters in titles may come from the text face."""
    signs = [MATHEMATICS, mathematics, *(ITALIC.get(c, "") for c in mathematics)]
    kinds = {"text": BASICS + text, "controls": BASICS + SYMBOLS + text, "title": TITLES, "mathematics": "".join(signs)}
    return {kind: "".join(filter(_is_visible, chars)) for kind, chars in kinds.items()}


def _is_visible(character: str) -> bool:
    """Whether a font can show the character: controls and joiners are not shown."""
    return not unicodedata.category(character).startswith("C")


def _digest(path: Path) -> str:
    return hashlib.sha256(content(path)).hexdigest()


def _coverage(path: Path) -> list[int]:
    """The code points that an original has."""
    from fontTools.ttLib import (
        TTFont,  # fontTools is imported only where needed: most builds find every cut in the cache
    )

    with TTFont(path, lazy=True) as font:
        return sorted(font.getBestCmap())


def _cut(face: Face, original: Path, codes: Sequence[int], cache: Path) -> bytes:
    """The face as WOFF2 with these code points only, from the cache if it was cut before."""
    return Store(cache, "fonts").get(_recipe(face, original, codes), partial(_subset, face, original, codes))


def _recipe(face: Face, original: Path, codes: Sequence[int]) -> str:
    """The cache key of a cut: all its inputs."""
    return json.dumps([FORMAT, fontTools.version, _digest(original), asdict(face), list(codes)], sort_keys=True)


def _subset(face: Face, original: Path, codes: Sequence[int]) -> bytes:
    from fontTools import subset
    from fontTools.ttLib import TTFont
    from fontTools.varLib import instancer

    options = subset.Options(
        layout_features=list(face.features), hinting=False, name_IDs=[0, 1, 2, 4, 6, 13, 14], notdef_outline=True,
        recalc_timestamp=False,
    )  # fmt: skip
    font = TTFont(original, recalcTimestamp=False)
    subsetter = subset.Subsetter(options)
    subsetter.populate(unicodes=codes)
    subsetter.subset(font)
    if "MATH" in font:
        _script_places(font["MATH"].table.MathConstants)
    if face.limits and "fvar" in font:
        font = instancer.instantiateVariableFont(font, dict(face.limits))
    if "STAT" in font:
        del font["STAT"]  # names for font menus: it refers to names that a cut drops, and Firefox complains
    _rename(font, face)
    font.flavor = "woff2"
    out = io.BytesIO()
    font.save(out)
    return out.getvalue()


def _script_places(constants: Any) -> None:
    """Place sub- and superscripts of single letters where TeX does.

    Browsers push a script past the ink of its base even if that is one letter (TeX does so for boxes only): the
    subscripts of p and w were at different heights. The font's minimum shifts suffice for letters; tall bases still
    push.
    """
    constants.SubscriptBaselineDropMin.Value = 0
    constants.SuperscriptBaselineDropMax.Value = 300
    constants.RadicalVerticalGap.Value = 120  # the bar almost touched lower-case letters


def _rename(font: Any, face: Face) -> None:
    """Give a modified font its own name; its copyright and licence (0, 13, 14) stay."""
    style = "Italic" if face.style == "italic" else "Regular"
    names = {1: face.family, 2: style, 4: f"{face.family} {style}", 6: f"{face.family}-{style}".replace(" ", "")}
    for record in list(font["name"].names):
        if record.nameID in names:
            record.string = names[record.nameID]
        elif record.nameID not in (0, 13, 14):
            font["name"].names.remove(record)


def _rule(face: Face, url: str, characters: str) -> str:
    """The face's @font-face rule.

    "block", because the fonts are preloaded and arrive with the style sheet: in 48 cold loads of three pages nothing
    moved. With "swap" the first paint sometimes came before them, and text moved (a layout shift of up to 0.11); with
    "optional" such a page kept its fallback; fonts inside the style sheet always came after the first paint.
    """
    only = f";unicode-range:{characters}" if characters else ""
    return (
        f'@font-face{{font-family:"{face.family}";font-style:{face.style};font-weight:{face.weight};font-display:block;'
        f'src:url("{url}") format("woff2"){only}}}'
    )


def ranges(codes: Iterable[int]) -> str:
    """Code points as a CSS unicode-range."""
    spans: list[list[int]] = []
    for code in sorted(set(codes)):
        if spans and code == spans[-1][1] + 1:
            spans[-1][1] = code
        else:
            spans.append([code, code])
    return ",".join(f"U+{a:X}" if a == b else f"U+{a:X}-{b:X}" for a, b in spans)


def _fallback_rule(fallback: Fallback, face: Face, data: bytes) -> str:
    """The @font-face rule that scales a reader's own font to the metrics of our face, whose cut is `data`."""
    from fontTools.ttLib import TTFont

    font = TTFont(io.BytesIO(data))
    em, line = font["head"].unitsPerEm, font["hhea"]
    size = average_advance(font) / fallback.average
    src = ",".join(f'local("{name}")' for name in fallback.local)
    return (
        f'@font-face{{font-family:"{fallback.family}";font-style:{face.style};font-weight:{face.weight};src:{src};'
        f"size-adjust:{size:.2%};ascent-override:{line.ascent / em / size:.2%};"
        f"descent-override:{-line.descent / em / size:.2%};line-gap-override:0%}}"
    )


def average_advance(font: Any) -> float:
    """The mean advance of SAMPLE's characters in em, without kerning, at a variable font's default instance."""
    cmap, widths = font.getBestCmap(), font["hmtx"]
    total: int = sum(widths[cmap[ord(c)]][0] for c in SAMPLE)
    return total / len(SAMPLE) / int(font["head"].unitsPerEm)
