"""Calls and arithmetic in a chapter: what may be written, what is evaluated, and how its number is printed."""

from __future__ import annotations

from pathlib import Path

import pytest

from sitegen.chapters.values import CallError, Values, evaluate, printed, read_call, read_value
from sitegen.figures.gallery import Gallery


@pytest.mark.parametrize(
    ("value", "spec", "text"),
    [
        (3.14159, ".2f", "3.14"),
        (-3.14159, ".2f", "−3.14"),
        (-0.001, ".2f", "0.00"),
        (1234567, ",d", "1,234,567"),
        (1.5e-12, ".1e", "1.5·10⁻¹²"),
        (17, "", "17"),
        (0.25, "", "0.25"),
        (0.5, ".0%", "50%"),
        (-0.001, ".0%", "0%"),
    ],
)
def test_numbers_as_printed(value: float, spec: str, text: str) -> None:
    assert printed(value, spec) == text


def test_a_call_is_evaluated_once_for_one_state_of_the_code(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    call = read_call('solvers.core.validate.number(2.5, "x")')
    assert evaluate(call) == 2.5
    gallery = Gallery({}, tmp_path)
    values = Values(tmp_path, {"solvers": "code", "widgets": "one"}, gallery)
    assert values.value(call) == 2.5
    values.keep()

    def fail(call: object) -> float:
        raise AssertionError("evaluated again")

    monkeypatch.setattr("sitegen.chapters.values.evaluate", fail)
    assert Values(tmp_path, {"solvers": "code", "widgets": "another"}, gallery).value(call) == 2.5
    with pytest.raises(AssertionError, match="again"):
        Values(tmp_path, {"solvers": "other code", "widgets": "one"}, gallery).value(call)


@pytest.mark.parametrize(
    ("text", "number"),
    [("5 / sqrt(16)", 1.25), ("-2**2 + 1", -3.0), ("degrees(pi)", 180.0), ("log2(8) - exp(0)", 2.0)],
)
def test_arithmetic_is_worked_out(text: str, number: float) -> None:
    assert read_value(text) == pytest.approx(number, rel=1e-15)


def test_arithmetic_is_worked_out_as_an_argument() -> None:
    call = read_call("solvers.core.validate.number(29 / 49, low=1 - sqrt(4), name='x')")
    assert evaluate(call) == 29 / 49
    assert evaluate(read_call("solvers.core.validate.count(1 + 2, name='x')")) == 3
    assert call.named["low"] == -1.0


@pytest.mark.parametrize("text", ["1 / 0", "sqrt(-1)", "sqrt()", "1 + x", "True", "exit(1)", "1 if 1 else 2", "9**999"])
def test_what_gives_no_number_is_told(text: str) -> None:
    with pytest.raises(CallError):
        read_value(text)


@pytest.mark.parametrize(
    ("text", "offset"),
    [
        ("solvers.core.validate.number(", 28),
        ("1 + 1", 0),
        ("open('x')", 0),
        ("solvers.f(**{})", 10),
        ("solvers.f(__import__('os'))", 10),
        ("solvers.f(1 / 0)", 10),
        ("solvers.f(sqrt(-1))", 10),
        ("solvers.f(1 + 'x')", 10),
        ("solvers.core.validate.__repr__()", 22),
        ("solvers.é.nothing(1)", 8),
    ],
)
def test_what_is_no_call(text: str, offset: int) -> None:
    with pytest.raises(CallError) as error:
        evaluate(read_call(text))
    assert error.value.offset == offset
