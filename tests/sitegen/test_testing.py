"""`test` uses all of a small machine for a whole run, and one process for what somebody is looking at."""

from __future__ import annotations

import pytest

from sitegen.testing import ENGINE_TESTS, PROCESSES, processes

ALL = ["-v", "--durations=5", "-k", "no_such_name"]
SPREAD = ["--dist=loadfile", "--no-loadscope-reorder"]


@pytest.mark.parametrize(("have", "used"), [(2, 2), (4, 4), (64, PROCESSES)])
def test_a_whole_run_uses_the_machine(have: int, used: int) -> None:
    """As many processes as there are cores, up to a limit."""
    assert processes(ALL, have) == [f"-n{used}", *SPREAD]


@pytest.mark.parametrize("words", [["-n0"], ["--pdb"], ["tests/sitegen"], ["-x", "tests/test_imports.py::test_x"]])
def test_a_part_or_a_word_on_it_is_left_alone(words: list[str]) -> None:
    """A path, a debugger and a given number count."""
    assert processes([*ALL, *words], 2) == []


def test_one_core_and_the_engines_need_no_other_process() -> None:
    """Each engine's browser is one for the run."""
    assert processes(ALL, 1) == [] == processes([ENGINE_TESTS], 2)
