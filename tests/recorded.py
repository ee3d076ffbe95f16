"""The fixture `why`, in a plugin of its own so that tests inside Pyodide can load it without the site's conftest."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping

import pytest

from sitegen.chapters import whys


@pytest.fixture
def why(request: pytest.FixtureRequest) -> Iterator[Callable[[str, Mapping[str, str]], None]]:
    """Record a cause for the checks page: one factor, {as it is: its outcome, changed: its outcome, ...}.

    A test that takes this fixture and records nothing fails, unless it has already failed.
    """
    node, count = request.node, request.session.testsfailed

    def record(factor: str, outcomes: Mapping[str, str]) -> None:
        assert not hasattr(node, "callspec"), "one claim has one pair of outcomes, so its test has no cases"
        assert whys.recorded(node.user_properties) is None, "one claim names one factor"
        node.user_properties.append((whys.FIXTURE, whys.change(factor, outcomes).plain()))

    yield record
    if request.session.testsfailed == count and whys.recorded(node.user_properties) is None:
        pytest.fail("this test takes the fixture `why` and has recorded no outcomes")
