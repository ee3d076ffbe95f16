"""Scan odometry: a drive's poses from scan to scan or from scan to map, the loops that it closes, and the graph that
distributes the remaining errors.
"""

from solvers.odometry.chain import PREDICTIONS, Chain, keyframes, scan_to_map, scan_to_scan
from solvers.odometry.closing import close, edges_of, missed
from solvers.odometry.loops import LoopOptions, candidates, verified
from solvers.odometry.matching import Matches, MatchOptions, Scans, match, prepare
from solvers.odometry.reading import read_drive
from solvers.odometry.sweep import straightened

__all__ = [
    "PREDICTIONS",
    "Chain",
    "LoopOptions",
    "MatchOptions",
    "Matches",
    "Scans",
    "candidates",
    "close",
    "edges_of",
    "keyframes",
    "match",
    "missed",
    "prepare",
    "read_drive",
    "scan_to_map",
    "scan_to_scan",
    "straightened",
    "verified",
]
