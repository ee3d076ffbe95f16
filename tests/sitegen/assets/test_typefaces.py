"""The fonts contain what a page needs and keep what typesetting needs, and the same input gives the same bytes."""

from __future__ import annotations

import io
import re

import pytest
from fontTools.ttLib import TTFont

from sitegen.assets import typefaces

PAGE = """<html><head><title>Straße</title></head><body><p>Cao, Čech &amp; λ → 6·10⁻¹⁶
<math><mrow><mi>R</mi><mo>≔</mo><mi>θ</mi></mrow></math> between
<math><mrow><mo>∑</mo><mo>√</mo></mrow></math> after</p></body></html>"""


@pytest.fixture(scope="module")
def fonts() -> typefaces.FontSet:
    return typefaces.make(*typefaces.characters([PAGE]), url="fonts/")


def open_font(fonts: typefaces.FontSet, face: str) -> TTFont:
    """The face's main file."""
    names = [n for n in fonts.files if re.fullmatch(rf"{face}-[0-9a-f]{{10}}\.woff2", n)]
    return TTFont(io.BytesIO(fonts.files[names[0]]))


def test_characters_tell_text_from_mathematics() -> None:
    text, mathematics = typefaces.characters([PAGE, "<p>zwei</p>"])
    assert {"ß", "Č", "→", "⁻", "z", "&"} <= set(text)
    assert set(mathematics) == set("R≔θ∑√")
    assert "≔" not in text


@pytest.mark.parametrize("root", ["<msqrt><mi>x</mi></msqrt>", "<mroot><mi>x</mi><mn>3</mn></mroot>"])
def test_a_root_needs_its_sign(root: str) -> None:
    """A browser draws it from the typeface though no text contains it; without it the root of x reads x."""
    _, mathematics = typefaces.characters([f"<math>{root}</math>"])
    assert "√" in mathematics
    assert "√" not in typefaces.characters(["<math><mi>x</mi></math>"])[1]


def test_an_unclosed_formula_does_not_swallow_the_next_page() -> None:
    text, _ = typefaces.characters(["<math><mi>x</mi>", "<p>é</p>"])
    assert "é" in text


def test_every_character_is_in_some_face(fonts: typefaces.FontSet) -> None:
    assert fonts.missing == ""
    codes = set().union(*(TTFont(io.BytesIO(data)).getBestCmap() for data in fonts.files.values()))
    assert {ord(c) for c in typefaces.BASICS + typefaces.SYMBOLS + typefaces.MATHEMATICS + "Č≔𝜃𝑅"} <= codes


def test_a_character_that_nobody_has_is_named() -> None:
    assert typefaces.make("漢字").missing == "字漢"


def test_lone_letters_come_with_their_mathematical_italic(fonts: typefaces.FontSet) -> None:
    assert {ord("𝑅"), ord("𝜃"), ord("≔")} <= set(open_font(fonts, "math").getBestCmap())


def test_typesetting_tables_are_kept(fonts: typefaces.FontSet) -> None:
    math = open_font(fonts, "math")["MATH"].table
    assert math.MathConstants.AxisHeight.Value > 0
    cmap = open_font(fonts, "math").getBestCmap()
    stretchy = math.MathVariants.VertGlyphCoverage.glyphs
    assert {cmap[ord(c)] for c in "()√∑"} <= set(stretchy)
    for face in ("serif", "serif-italic", "title", "sans"):
        features = {r.FeatureTag for r in open_font(fonts, face)["GPOS"].table.FeatureList.FeatureRecord}
        assert "kern" in features, face
    # Figures are tabular by default: all ten have one width. Proportional ones are a feature.
    for face in ("serif", "serif-italic", "sans"):
        font = open_font(fonts, face)
        assert len({font["hmtx"][font.getBestCmap()[ord(d)]][0] for d in "0123456789"}) == 1, face
        assert "pnum" in {r.FeatureTag for r in font["GSUB"].table.FeatureList.FeatureRecord}, face


def test_weights_are_those_of_the_style_sheet(fonts: typefaces.FontSet) -> None:
    for face in ("serif", "sans"):
        (axis,) = open_font(fonts, face)["fvar"].axes
        assert (axis.axisTag, axis.minValue, axis.maxValue) == ("wght", 400, 600)
    assert "fvar" not in open_font(fonts, "serif-italic")


def test_cuts_do_not_carry_the_reserved_name_and_keep_the_licence(fonts: typefaces.FontSet) -> None:
    for name, data in fonts.files.items():
        table = TTFont(io.BytesIO(data))["name"]
        assert table.getDebugName(1).startswith("Ladder "), name
        assert "Source" not in (table.getDebugName(4) + table.getDebugName(6)), name
        assert table.getDebugName(0), name


def test_no_table_names_names_that_are_not_there(fonts: typefaces.FontSet) -> None:
    """STAT consists of such names; Firefox discards it and logs an error for each file."""
    for face in typefaces.FACES:
        assert "STAT" not in open_font(fonts, face.name), face.name


def test_the_whole_set_is_light(fonts: typefaces.FontSet) -> None:
    assert sum(map(len, fonts.files.values())) <= 120_000


def test_the_style_sheet_names_every_file_and_nothing_else(fonts: typefaces.FontSet) -> None:
    assert set(re.findall(r'url\("fonts/([^"]+)"\)', fonts.css)) == set(fonts.files)
    assert {p.url for p in fonts.preload} <= {f"fonts/{name}" for name in fonts.files}
    assert fonts.css.count("size-adjust") == len(typefaces.FALLBACKS)


def test_a_fallback_is_stretched_to_the_measure_of_the_face(fonts: typefaces.FontSet) -> None:
    adjust = re.search(r"Ladder Sans Near.*?size-adjust:([\d.]+)%;ascent-override:([\d.]+)%", fonts.css)
    assert adjust is not None
    size, ascent = (float(v) / 100 for v in adjust.groups())
    sans = open_font(fonts, "sans")
    arial = next(f.average for f in typefaces.FALLBACKS if f.stands_for == "sans")
    assert size * arial == pytest.approx(typefaces.average_advance(sans), rel=1e-3)
    assert size * ascent == pytest.approx(sans["hhea"].ascent / sans["head"].unitsPerEm, rel=1e-3)


def test_ranges_are_what_css_reads() -> None:
    assert typefaces.ranges(map(ord, "abcxé")) == "U+61-63,U+78,U+E9"


def test_an_empty_cache_gives_the_same_bytes(fonts: typefaces.FontSet, tmp_path, monkeypatch) -> None:
    gather = typefaces.fetch.gather
    monkeypatch.setattr(typefaces.fetch, "gather", lambda names, cache=None, progress=None: gather(names))
    second = typefaces.make(*typefaces.characters([PAGE]), url="fonts/", cache=tmp_path)
    assert list((tmp_path / "fonts").iterdir()), "nothing was cut anew"
    assert second.files == fonts.files
    assert second.css == fonts.css
