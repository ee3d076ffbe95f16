"""Benchmarks beyond the race: proofs in its rooms, and the chaining of a real drive, natively and in a tab."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from statistics import median

from sitegen.bench.model import Bench, Row, number
from sitegen.bench.pages import IDLE, browser_of, live, number_ms, until, visit, warmed
from sitegen.bench.solvers import asked, in_tab
from sitegen.serve.static_files import serving
from solvers.scenes.rooms import ROOM_SETTINGS

IN_TAB = ("clean", "noise", "combo")
GAP = 1e-3
PROOFS = """
import json, time
from solvers import register
from solvers.scenes import room, room_start

def proof(setting, seed):
    scene = room(setting, seed=seed)
    began = time.perf_counter()
    found = register(scene.source, scene.target, "branch-and-bound", start=room_start(45.0, 1.43), gap=GAP)
    return time.perf_counter() - began, found.status.label, float(found.gap), seed

proof("clean", 40)
json.dumps({setting: [proof(setting, 40 + 13 * k) for k in range(SEEDS)] for setting in SETTINGS})
"""
DRIVE = """
import json, time
from solvers.drives import telecom_loop
from solvers.odometry import prepare, scan_to_scan

drive = telecom_loop()
scans = prepare(drive)
scan_to_scan(prepare(drive, every=8), drive.motion)
began = time.perf_counter()
chain = scan_to_scan(scans, drive.motion)
json.dumps([time.perf_counter() - began, int(chain.believed.sum()) - 1, len(chain.believed) - 1])
"""


Proof = tuple[float, str, float, int]
"""Seconds, how it ended, the remaining gap in u², the seed."""


def search(bench: Bench) -> list[Row]:
    """Branch and bound from 45° and 1.43 u, one scene at a time: 25 seeds of every room natively, three of some in a
    tab; and the figure's own run."""
    native, in_page = asked(proofs(ROOM_SETTINGS, 25)), in_tab(bench, proofs(IN_TAB, 3))
    return [
        *proof_rows(native),
        *(Row(f"  '{room}', in the tab", slowest(runs), "ms", 5000, told(runs)) for room, runs in in_page.items()),
        figure_run(bench),
    ]


def proof_rows(by_room: Mapping[str, Sequence[Proof]]) -> list[Row]:
    """One row per room, with its slowest proof."""
    label = f"proof to {GAP:g} u², room"
    return [
        Row(f"{label} '{room}', natively", slowest(proofs), "ms", 1000, told(proofs))
        for room, proofs in by_room.items()
    ]


def slowest(proofs: Sequence[Proof]) -> float:
    """The longest time, in ms."""
    return 1e3 * max(seconds for seconds, *_ in proofs)


def told(proofs: Sequence[Proof]) -> str:
    """A row's note: the median, the number proved, which seeds are not, and the largest gap."""
    seconds, labels, gaps, seeds = zip(*proofs, strict=True)
    unproved = [f"{seed} ({label})" for label, seed in zip(labels, seeds, strict=True) if label != "proved"]
    remainder = f", not proved: {', '.join(unproved)}" if unproved else ""
    return (
        f"slowest of {len(proofs)} seeds, median {number_ms(1e3 * median(seconds))}; "
        f"{len(proofs) - len(unproved)} proved{remainder}; largest gap {number(max(gaps))} u²"
    )


def figure_run(bench: Bench) -> Row:
    """The time from pressing *Run* in the chapter's figure of the noisy room until it shows the proof."""
    figure = "Ladder.figures.get('fig-everywhere')"
    with ExitStack() as stack:
        server, browser = stack.enter_context(serving(bench.site)), stack.enter_context(browser_of(bench))
        page = stack.enter_context(visit(browser, f"{server.origin}/search.html"))
        live(page)
        warmed(page, "#fig-everywhere")
        began = page.evaluate("performance.now()")
        page.locator('#fig-everywhere [data-button="run"]').click()
        until(page, f"{figure}.frame.disabled.includes('step') && {IDLE}")
        took = page.evaluate("performance.now()") - began
        steps = page.evaluate(f"{figure}.record.log.length")
    return Row("the search figure's Run, to its proof", took, "ms", 20_000, f"{steps} steps, each drawn")


def drive(bench: Bench) -> list[Row]:
    """The registration of all pairs of the drive's successive scans, starting from odometry."""
    rows = []
    for label, (seconds, believed, pairs), aim in (
        ("the drive chained, natively", asked(DRIVE), 3000),
        ("the drive chained, in the tab", in_tab(bench, DRIVE), 12000),
    ):
        rows.append(Row(label, 1e3 * seconds, "ms", aim, f"{pairs} pairs, {believed} believed"))
    return rows


def proofs(settings: Sequence[str], seeds: int) -> str:
    """The code of the proofs for the first `seeds` seeds of these rooms, to run natively and in the tab."""
    return f"GAP, SETTINGS, SEEDS = {GAP}, {tuple(settings)}, {seeds}\n{PROOFS}"
