"""The figures that a run of the tests is about: all, or with `-k NAME` that one."""

from __future__ import annotations

import pytest

from widgets.engine.registry import WIDGETS


def figures(request: pytest.FixtureRequest) -> list[str]:
    """Those by which a case of the module that is to run is named."""
    cases = [getattr(item, "callspec", None) for item in request.session.items if item.path == request.path]
    named = {case.params.get("name") for case in cases if case}
    return [name for name in WIDGETS if name in named]
