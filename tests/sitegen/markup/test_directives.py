"""A directive as it is read: its name, text and attributes, and where each stands."""

from __future__ import annotations

import pytest

from sitegen.markup.directives import Attribute, DirectiveError, attributes, read


def test_a_directive_knows_where_its_parts_stand() -> None:
    source = 'see :claim[A `]` and $(0, 1]$ and [x](y)]{a::b key="two words" n=1} end'
    result = read(source, 4, len(source), ":")
    assert result is not None
    assert (result.name, result.text) == ("claim", "A `]` and $(0, 1]$ and [x](y)")
    assert source[result.text_start :].startswith("A `]`")
    assert source[result.end :] == " end"
    words = attributes(result)
    assert [(a.name, a.plain) for a in words] == [("", "a::b"), ("key", "two words"), ("n", 1)]
    assert source[words[1].start :].startswith("key=")
    assert source[words[1].value_start :].startswith('"two')
    assert source[words[1].text_start :].startswith("two")
    assert words[2].text_start == words[2].value_start


@pytest.mark.parametrize("text", ["a: b", ":[x]", ": name[x]", ":Name[x]", ":name", ":name x"])
def test_what_is_no_directive(text: str) -> None:
    assert read(text, text.index(":"), len(text), ":") is None


def test_an_unclosed_quote_is_named() -> None:
    result = read(':x[a]{b c"}', 0, 11, ":")
    assert result is not None
    with pytest.raises(DirectiveError, match="unclosed quote") as error:
        attributes(result)
    assert error.value.offset == 9


@pytest.mark.parametrize(
    ("text", "value"),
    [("true", True), ("false", False), ("3", 3), ("-0.5", -0.5), ("1e-3", 0.001), ("noisy", "noisy"), ("", "")],
)
def test_values_of_attributes(text: str, value: object) -> None:
    plain = Attribute("a", text, 0, 2).plain
    assert plain == value
    assert type(plain) is type(value)
