"""Which method: tables from four answers to a path of rungs and a verdict on every other rung. Nothing is run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Literal, TypeVar

Of = TypeVar("Of")
Verdict = Literal["take", "can", "not", "idle"]

QUESTIONS: Mapping[str, Mapping[str, str]] = {
    "pairs": {"right": "All right", "some": "Some wrong", "none": "None"},
    "start": {"near": "Close", "rough": "Rough", "none": "None"},
    "overlap": {"most": "Most", "half": "About half"},
    "surfaces": {"walls": "Walls", "points": "Scattered points"},
}
"""Each question's answers: the name here → the text that a reader sees."""


@dataclass(frozen=True)
class Rung:
    """A rung as the figure's ladder shows it.

    method: its name in `solvers.METHODS`, "" for the rung that judges. title: its name in a sentence.
    """

    number: str
    says: str
    method: str
    title: str


RUNGS: Mapping[str, Rung] = {
    "kabsch": Rung("1", "Closed form", "kabsch", "the closed form"),
    "ransac": Rung("2", "Vote on pairs", "ransac", "a vote on the pairs"),
    "icp": Rung("3", "ICP", "icp", "ICP"),
    "gicp": Rung("3½", "GICP", "gicp", "GICP"),
    "ndt": Rung("4", "NDT", "ndt", "NDT"),
    "soft": Rung("5a", "Soft weights", "soft-annealed", "soft weights"),
    "mmd": Rung("5b", "MMD", "mmd", "MMD"),
    "propose": Rung("8", "Propose", "ransac-congruent", "a proposal by RANSAC"),
    "judge": Rung("8", "Judge", "", "judge the pose"),
    "search": Rung("10", "Search", "correlative", "a search of all poses"),
}
"""The rungs from the bottom up."""


@dataclass(frozen=True)
class Answers:
    """One answer to each of QUESTIONS."""

    pairs: str = "none"
    start: str = "rough"
    overlap: str = "most"
    surfaces: str = "walls"


@dataclass(frozen=True)
class Advice:
    """path: the rungs to take, in order. why: the verdict on every rung, and its reason in words."""

    path: tuple[str, ...]
    why: Mapping[str, tuple[Verdict, str]]

    def of(self, *verdicts: Verdict) -> tuple[str, ...]:
        """The rungs of these verdicts, from the bottom up."""
        return tuple(name for name, (verdict, _) in self.why.items() if verdict in verdicts)


Row = tuple[Mapping[str, str], Of]  # the answers that matter, and what they lead to

PATHS: tuple[Row[tuple[str, ...]], ...] = (
    ({"pairs": "right"}, ("kabsch", "judge")),
    ({"pairs": "some"}, ("ransac", "judge")),
    ({"start": "none"}, ("search", "refine", "judge")),
    ({"start": "rough", "overlap": "half"}, ("propose", "refine", "judge")),
    ({"start": "rough"}, ("soft", "refine", "judge")),
    ({"overlap": "half", "surfaces": "points"}, ("propose", "refine", "judge")),
    ({"surfaces": "points"}, ("soft", "refine", "judge")),
    ({}, ("refine", "judge")),
)
"""The paths; the first row that fits applies."""

REFINE = {"walls": "gicp", "points": "icp"}
"""The method that refines, by the answer on surfaces."""

TAKES: Mapping[str, str] = {
    "kabsch": "the best motion, at once",
    "ransac": "finds the pairs that agree",
    "icp": "refines, with a narrow gate",
    "gicp": "refines along the walls",
    "soft": "gets close from far off",
    "propose": "tries poses everywhere",
    "judge": "may still refuse it",
    "search": "finds the best pose of a grid",
}
"""What each rung does on a path."""

_FAR: tuple[Row[tuple[Verdict, str]], ...] = (
    ({"start": "none"}, ("not", "alone, it needs a start")),
    ({"start": "rough"}, ("not", "alone, the start is too far")),
)
_MISLED: tuple[Verdict, str] = ("not", "half overlap misleads it")
OTHERS: Mapping[str, tuple[Row[tuple[Verdict, str]], ...]] = {
    "kabsch": (({"pairs": "none"}, ("not", "there are no pairs")), ({}, ("not", "trusts every pair"))),
    "ransac": (({"pairs": "none"}, ("not", "there are no pairs")), ({}, ("can", "has nothing to vote out"))),
    "icp": (*_FAR, ({"surfaces": "walls"}, ("can", "less exact on walls")), ({}, ("can", "finds most of them"))),
    "gicp": (*_FAR, ({}, ("can", "less exact without walls"))),
    "ndt": (*_FAR, ({"surfaces": "points"}, ("not", "misses without walls")), ({}, ("can", "finds nearly all"))),
    "soft": (
        _FAR[0],
        ({"overlap": "half", "start": "rough"}, _MISLED),
        ({"overlap": "half", "surfaces": "points"}, _MISLED),
        ({}, ("can", "finds nearly all")),
    ),
    "mmd": (_FAR[0], ({"overlap": "half"}, _MISLED), ({}, ("can", "finds nearly all"))),
    "propose": (({}, ("can", "needs no start")),),
    "search": (({}, ("idle", "not needed: there is a start")),),
}
"""For each rung off the path, whether it would do alone, and why; the first row that fits applies."""

UNUSED = "leaves the pairs unused"


def advise(answers: Answers) -> Advice:
    """The path for four answers, and a verdict on every rung."""
    path = tuple(REFINE[answers.surfaces] if name == "refine" else name for name in _first(PATHS, answers))
    why: dict[str, tuple[Verdict, str]] = {}
    for name in RUNGS:
        if name in path:
            why[name] = "take", TAKES[name]
        elif answers.pairs != "none" and name not in ("kabsch", "ransac"):
            why[name] = "idle", UNUSED
        else:
            why[name] = _first(OTHERS[name], answers)
    return Advice(path, why)


def _first(table: Sequence[Row[Of]], answers: Answers) -> Of:
    """The result of the first row that fits the answers."""
    return next(
        result for conditions, result in table if all(getattr(answers, k) == v for k, v in conditions.items())
    )


def every() -> tuple[Answers, ...]:
    """All possible answers."""
    return tuple(Answers(*values) for values in product(*QUESTIONS.values()))
