"""Promises of captions and buttons about a figure's readouts: parsed by the survey, checked by the rendering.

A promise is a record and the expectations there: `rms < 0.1; stop is converged; rotation_error falls`. "falls", "rises"
and "stays" compare with the figure's initial state.
"""

from __future__ import annotations

import operator
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from sitegen.chapters.placing import changed, presses
from sitegen.figures.model import Figure
from sitegen.figures.wire import Plain
from sitegen.markup.directives import Attribute, Directive, DirectiveError, read
from sitegen.problems import Place, Problems, hint
from widgets.drawing.picture import SUPERSCRIPT, small
from widgets.engine.contract import MAX_LOG, parsed

OWN = ("expect", "then")
COMPARED: dict[str, Callable[[float, float], bool]] = {
    "<": operator.lt, "<=": operator.le, ">": operator.gt, ">=": operator.ge,
}
EXPECTED = re.compile(
    r"(?P<name>\w+)\s+(?:(?P<than>[<>]=?)\s*(?P<number>[-−]?(?:\d+(?:\.\d*)?|\.\d+)(?:e[-+]?\d+)?)"
    r"|is\s+(?P<words>.+)|(?P<goes>falls|rises|stays))"
)
WRITTEN = "expected NAME < 1.5 (or <=, >, >=), NAME is WORDS, NAME falls, NAME rises or NAME stays"
PROMISING = re.compile(
    r"\b(?:arrive[sd]?|breaks?|broken?|fail(?:s|ed)?|falls?|fell|fallen|jump(?:s|ed)?|loses?|lost|recover(?:s|ed)?"
    r"|refuse[sd]?|rises?|rose|risen)\b",
    re.IGNORECASE,
)
CHANGE = "expect what changes, or say NAME stays"
HELD = ("promise", "claim", "readout")  # their texts are checked by the build or a test
HOLDS = ':promise[…]{press=finish expect="rms < 0.1"}'
TESTED = ":claim[…]{tests/claims/test_race.py::test_…}"  # for plots' captions, since plots have no readouts
LINE = re.compile(r"^[ \t]*(::).*$", re.MULTILINE)
NUMBER = re.compile(r"(−?\d[\d,\u202f]*(?:\.\d+)?)(?:·10([⁻⁰¹²³⁴-⁹]+))?")
POWER = {value: key for key, value in SUPERSCRIPT.items()}
Readouts = Callable[[Figure, Plain], Mapping[str, str]]


@dataclass(frozen=True)
class Expectation:
    """An expectation of one readout: compared with a number, equal to some words, or relative to its initial value."""

    text: str
    place: Place
    name: str
    than: str
    number: float
    words: str
    goes: str


@dataclass(frozen=True)
class Promise:
    """The expectations of a figure in a state."""

    figure: Figure
    record: Plain
    expected: tuple[Expectation, ...]


def promise(
    figure: Figure, attributes: Iterable[Attribute], at: Callable[[int], Place], problems: Problems
) -> Promise | None:
    """The promise that a directive's attributes make about a figure: control values, `press=`, and `then=` for what the
    text asks to press after that. None if nothing is expected; faults go to `problems`."""
    by_name = {a.name: a for a in attributes if a.name}
    own = {name: by_name.pop(name) for name in OWN if name in by_name}
    record = changed(figure.widget, figure.record, by_name.values(), at, problems, OWN).plain()
    if "expect" not in own:
        if "then" in own:
            problems.add(at(own["then"].start), "then= without expect=: add what holds after its presses")
        return None
    log = [*record["log"], *(presses(figure.widget, own["then"], at, problems) if "then" in own else [])]
    if len(log) > MAX_LOG:
        problems.add(at(own["then"].start), f"too many actions: a log holds at most {MAX_LOG}")
        return None
    record = parsed(figure.widget, {**record, "log": log}).plain()
    return Promise(figure, record, expected(own["expect"], at, problems))


def expected(attribute: Attribute, at: Callable[[int], Place], problems: Problems) -> tuple[Expectation, ...]:
    """The expectations in `expect=`, in order; faults go to `problems`."""
    start, expectations = attribute.text_start, []
    for part in attribute.value.split(";"):
        place = at(start + len(part) - len(part.lstrip()))
        match = EXPECTED.fullmatch(part.strip())
        if match is None:
            problems.add(place, f"{part.strip()!r}: {WRITTEN}")
        else:
            name, than, number, words, trend = match.group("name", "than", "number", "words", "goes")
            value = float((number or "0").replace("−", "-"))
            expectations.append(Expectation(match[0], place, name, than or "", value, words or "", trend or ""))
        start += len(part) + 1
    return tuple(expectations)


def unheld(text: str) -> Iterator[tuple[str, int]]:
    """Yield the promising words of a text, with their offsets, that are outside of checked directives. `::` lines in it
    are skipped, however they are wrapped, since they are checked separately."""
    for line in LINE.finditer(text):
        block = _read(text, line.start(1), "::")
        end = max(line.end(), block.end if block else 0)
        text = text[: line.start()] + " " * (end - line.start()) + text[end:]
    i = 0
    while (colon := text.find(":", i)) >= 0:
        directive = _read(text, colon, ":")
        i = colon + 1
        if directive is not None and directive.name in HELD:
            i = directive.end
            text = text[:colon] + " " * (i - colon) + text[i:]
    for match in PROMISING.finditer(text):
        yield match[0], match.start()


def _read(text: str, start: int, colons: str) -> Directive | None:
    """The directive at `start`; None if there is none, or a faulty one, which has been reported."""
    try:
        return read(text, start, len(text), colons)
    except DirectiveError:
        return None


def tell_unheld(text: str, at: Callable[[int], Place], problems: Problems, suggestion: str = HOLDS) -> None:
    """Report each unchecked promising word of a text. at: maps its offsets to places; suggestion: what to use."""
    for word, offset in unheld(text):
        problems.add(at(offset), f"untested promise {word!r}: use {suggestion}")


def hold(promise: Promise, readouts: Readouts, problems: Problems, *, idle: bool = False) -> None:
    """Check a promise about a figure; each unmet expectation is a problem that states the actual value. So is a promise
    that the figure keeps as it opens, unless it may be idle, as a picture's may."""
    unmet = list(_unmet(promise.figure, promise.record, promise.expected, readouts, problems))
    for expectation, actual in unmet:
        problems.add(expectation.place, f"promised {expectation.text}, but {actual}")
    if not (idle or unmet) and _kept_at_first(promise, readouts):
        words = "; ".join(expectation.text for expectation in promise.expected)
        problems.add(promise.expected[0].place, f"promised {words}, but so the figure opens: {CHANGE}")


def _kept_at_first(promise: Promise, readouts: Readouts) -> bool:
    """Whether a promise about another state of the figure holds when it opens, without any "stays" that says so."""
    opening = promise.figure.record.plain()
    texts = readouts(promise.figure, opening) if promise.expected and promise.record != opening else {}
    return bool(texts) and all(
        e.name in texts and not e.goes and _holds(e, "", texts[e.name]) for e in promise.expected
    )


def holds(
    figure: Figure, record: Plain, expectations: Sequence[Expectation], readouts: Readouts, problems: Problems
) -> bool:
    """Whether a figure in a state meets all expectations; readouts that it does not have are reported."""
    return not list(_unmet(figure, record, expectations, readouts, problems))


def _unmet(
    figure: Figure, record: Plain, expectations: Sequence[Expectation], readouts: Readouts, problems: Problems
) -> Iterator[tuple[Expectation, str]]:
    """Yield the unmet expectations, each with the actual value in words."""
    texts = readouts(figure, record)
    for expectation in expectations if texts else ():  # a figure that cannot be drawn has been reported
        if expectation.name not in texts:
            problems.add(expectation.place, f"unknown readout {expectation.name!r}{hint(expectation.name, texts)}")
            continue
        initial = readouts(figure, figure.record.plain())[expectation.name] if expectation.goes else ""
        if not _holds(expectation, initial, texts[expectation.name]):
            text = texts[expectation.name]
            yield expectation, f"it goes from {initial} to {text}" if expectation.goes else f"it is {text}"


def _holds(expectation: Expectation, initial: str, text: str) -> bool:
    """Whether a readout's text meets an expectation. Words may be followed by a comma and more text; comparisons fail
    if a value is not a number."""
    if expectation.words:
        return text == expectation.words or text.startswith(f"{expectation.words},")
    if expectation.goes == "stays":
        return text == initial
    value, bound = _number(text), _number(initial) if expectation.goes else expectation.number
    if value is None or bound is None:
        return False
    than = expectation.than or ("<" if expectation.goes == "falls" else ">")
    return COMPARED[than](value, bound)


def _number(text: str) -> float | None:
    """The number at the start of a readout; None if there is none. One too small to be printed is zero."""
    if text == small(0.0):
        return 0.0
    match = NUMBER.match(text)
    if match is None:
        return None
    power = (match[2] or "⁰").translate(POWER)
    return float(re.sub("[,\u202f]", "", match[1]).replace("−", "-") + f"e{power}")
