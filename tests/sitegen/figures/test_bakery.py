"""The code that a figure's frames depend on."""

from __future__ import annotations

from sitegen.figures.bakery import FIGURES, code_hash, code_of
from widgets.engine.registry import WIDGETS


def test_a_figures_frames_depend_on_its_own_module_and_on_no_other_figures() -> None:
    own, second = code_of("kabsch", WIDGETS), code_of("two-poses", WIDGETS)
    assert own == code_of("kabsch", WIDGETS)
    assert len({own, second, code_hash()}) == 3
    names = {path.name for path in FIGURES.iterdir()} - {"kabsch.py", "__init__.py"}
    assert "race" in names, "a figure of several modules is a folder"
    assert own == code_hash(
        skip=lambda path: path.is_relative_to(FIGURES) and path.relative_to(FIGURES).parts[0] in names
    )
