"""Proofs in the race's rooms: what the bench's rows say of them."""

from __future__ import annotations

from sitegen.bench import beyond
from sitegen.bench.solvers import asked
from solvers.scenes.rooms import ROOM_SETTINGS


def test_a_row_names_what_is_not_proved() -> None:
    """The slowest and the median time, the largest gap, and the seed of a search that was cut short."""
    results = {"noise": [(0.3, "proved", 9e-4, 40), (2.0, "capped", 0.02, 53), (0.5, "proved", 8e-4, 66)]}
    (row,) = beyond.proof_rows(results)
    assert (row.what, row.value, row.met) == ("proof to 0.001 u², room 'noise', natively", 2000.0, False)
    assert row.note == "slowest of 3 seeds, median 500.0 ms; 2 proved, not proved: 53 (capped); largest gap 0.02 u²"


def test_what_is_asked_proves_every_room() -> None:
    """One seed in each of the six rooms: every search proves its pose, to the gap."""
    result = asked(beyond.proofs(ROOM_SETTINGS, 1))
    assert list(result) == list(ROOM_SETTINGS)
    assert all(label == "proved" and gap <= beyond.GAP for ((_, label, gap, _),) in result.values())
