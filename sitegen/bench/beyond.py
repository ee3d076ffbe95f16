"""Beyond two clouds: proofs in the race's rooms, and a real drive chained, natively and in a tab."""

from __future__ import annotations

from sitegen.bench.model import Bench, Row
from sitegen.bench.solvers import asked, in_tab

SETTINGS = ("clean", "noise", "combo")
GAP = 1e-3
PROOFS = """
import json, time
from solvers import register
from solvers.scenes import room, room_start

def proof(setting, seed):
    scene = room(setting, seed=seed)
    began = time.perf_counter()
    found = register(scene.source, scene.target, "branch-and-bound", start=room_start(45.0, 1.43), gap=GAP)
    return time.perf_counter() - began, found.status.label

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


def search(bench: Bench) -> list[Row]:
    """Branch and bound from 45° and 1.43 u, each scene by itself: the slowest of 25 seeds here, of 3 in a tab."""
    here, there = asked(proofs(25)), in_tab(bench, proofs(3))
    rows = []
    for setting in SETTINGS:
        times, labels = zip(*here[setting], strict=True)
        proved = sum(label == "proved" for label in labels)
        note = f"slowest of {len(times)} seeds; {proved} proved; mean {1e3 * sum(times) / len(times):.0f} ms"
        rows.append(Row(f"proof to {GAP:g} u², room '{setting}', natively", 1e3 * max(times), "ms", 1000, note))
    for setting in SETTINGS:
        times, _ = zip(*there[setting], strict=True)
        rows.append(Row(f"  '{setting}', in the tab", 1e3 * max(times), "ms", 5000, f"slowest of {len(times)} seeds"))
    return rows


def drive(bench: Bench) -> list[Row]:
    """All pairs of the drive's successive scans registered, from what odometry says."""
    rows = []
    for what, (seconds, believed, pairs), aim in (
        ("the drive chained, natively", asked(DRIVE), 3000),
        ("the drive chained, in the tab", in_tab(bench, DRIVE), 12000),
    ):
        rows.append(Row(what, 1e3 * seconds, "ms", aim, f"{pairs} pairs, {believed} believed"))
    return rows


def proofs(seeds: int) -> str:
    """What is asked here and in the tab, of so many seeds a room."""
    return f"GAP, SETTINGS, SEEDS = {GAP}, {SETTINGS}, {seeds}\n{PROOFS}"
