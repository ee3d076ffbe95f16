"""The data of a figure in a page's HTML."""

from __future__ import annotations

import json
from html.parser import HTMLParser

import pytest

from sitegen.figures.wire import attribute

HOSTILE = {"a 'quoted' \"name\"": [1.5, "<b>&amp;</b>", "&#39;&quot;", "x=y onclick='z'"]}


@pytest.mark.parametrize("data", [HOSTILE, [], ["it’s"], {"size": 3}])
def test_json_in_an_attribute_is_read_back(data: object) -> None:
    """Whatever the data contain, nothing of them leaves the attribute."""
    found: list[object] = []

    class Reader(HTMLParser):
        def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
            found.extend([tag, *attrs])

    Reader().feed(f"<p data-record={attribute(data)}>")
    tag, (name, value) = found
    assert (tag, name) == ("p", "data-record")
    assert json.loads(value) == data
    assert "&#34;" not in attribute(data)
