"""The figures that a test run covers: all, or with `-k NAME` only that one."""

from __future__ import annotations

import pytest

from widgets.engine.registry import WIDGETS


def figures(request: pytest.FixtureRequest) -> list[str]:
    """The figures named by the cases of this module that are to run."""
    cases = [getattr(item, "callspec", None) for item in request.session.items if item.path == request.path]
    names = {case.params.get("name") for case in cases if case}
    return [name for name in WIDGETS if name in names]
