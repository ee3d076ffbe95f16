"""Pages are read so that every element opens and closes."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from sitegen.html_reader import Tag, read

ELEMENTS = ["<p>", "</p>", "<b>", "</b>", "<br>", "<br/>", "<img alt='x'>", "</img>", "<style>", "</style>"]


class Log:
    """Everything read from a page, in order."""

    def __init__(self, html: str) -> None:
        self.events: list[tuple[str, Tag | str]] = []
        read(html, self)

    def opened(self, tag: Tag) -> None:
        self.events.append(("+", tag))

    def closed(self, tag: Tag) -> None:
        self.events.append(("-", tag))

    def text(self, text: str) -> None:
        self.events.append(("", text))


def short(html: str) -> list[str]:
    """Each as +tag, -tag, or the text."""
    return [sign + (part if isinstance(part, str) else part.name) for sign, part in Log(html).events]


def test_elements_and_text_in_order() -> None:
    """Entities are decoded; void elements are closed at once."""
    assert short("<p>a &amp; b<br>c<b>d</b></p>") == ["+p", "a & b", "+br", "-br", "c", "+b", "d", "-b", "-p"]


def test_a_start_tag_has_its_attributes_and_its_place() -> None:
    """Lines and columns count from 1; an attribute without a value is included."""
    tags = [part for sign, part in Log('<p>\n  <input id="one" disabled></p>').events if isinstance(part, Tag)]
    around, tag, repeat, end = tags
    assert (tag.name, tag.line, tag.column) == ("input", 2, 3)
    assert tag.attributes == {"id": "one", "disabled": ""}
    assert tag.get("class") == ""
    assert (repeat is tag, end is around) == (True, True)


def test_an_element_without_an_end_tag_ends_with_what_it_stands_in() -> None:
    """At the latest at the end of the page."""
    assert short("<div><p>a</div>b<i>c") == ["+div", "+p", "a", "-p", "-div", "b", "+i", "c", "-i"]


def test_an_end_tag_that_closes_nothing_is_passed_over() -> None:
    """So is the end tag of a void element."""
    assert short("a</b><br></br><p>c</p>") == ["a", "+br", "-br", "+p", "c", "-p"]


def test_a_self_closing_tag_closes_its_element() -> None:
    """As in SVG."""
    assert short("<svg><path/><g></g></svg>") == ["+svg", "+path", "-path", "+g", "-g", "-svg"]


def test_scripts_and_styles_hold_text_alone() -> None:
    """Exactly as written."""
    assert short("<script>a < b && '<p>'</script>") == ["+script", "a < b && '<p>'", "-script"]


@given(st.lists(st.sampled_from([*ELEMENTS, "a &amp; b"]), max_size=12).map("".join))
def test_whatever_is_written_each_element_closes_once_and_within_its_own(html: str) -> None:
    """In the reverse of the order in which they open."""
    around: list[Tag | str] = []
    for sign, part in Log(html).events:
        if sign == "+":
            around.append(part)
        elif sign == "-":
            assert around.pop() is part
    assert not around
