"""The recorded drive solved from its scans, for the file that `widgets.parts.drive_table` reads.

A test checks the file against this module. To rewrite it:
`python -c "from widgets.parts import drive_solved; drive_solved.write()"`.
"""

from __future__ import annotations

from itertools import product

import numpy as np
from numpy.typing import NDArray

from solvers import Pose
from solvers.core.edges import Edges
from solvers.odometry import Matches, candidates, close, edges_of, prepare, scan_to_scan, verified
from solvers.posegraph import optimise
from solvers.scenes.drive import telecom_loop
from widgets.parts.drive_table import FILE, KERNELS, WRONG


def with_wrong(edges: Edges, loops: Matches) -> Edges:
    """The edges with the wrong loop appended."""
    later, earlier = WRONG
    return Edges(
        np.append(edges.i, earlier),
        np.append(edges.j, later),
        Pose(np.concatenate([edges.relative.R, np.eye(2)[None]]), np.concatenate([edges.relative.t, np.zeros((1, 2))])),
        np.concatenate([edges.information, np.median(loops.information, axis=0)[None]]),
    )


def made() -> bytes:
    """The table's file, computed from the scans."""
    drive = telecom_loop()
    scans = prepare(drive)
    chain = scan_to_scan(scans, drive.motion)
    loops = verified(scans, chain.poses, *candidates(chain.poses))
    mask = loops.believed
    edges, robust = edges_of(chain, loops)
    pose_sets, weights = [], []
    for kernel, wrong in product(KERNELS, (False, True)):
        if wrong:
            result = optimise(chain.poses, with_wrong(edges, loops), kernel=kernel, robust=np.append(robust, True))
            weights.append(result.weights[-1])
        else:
            result = close(chain, loops, kernel=kernel)
        pose_sets.append(result.poses)
    rows = [_rows(chain.poses), *map(_rows, pose_sets)]
    loop_rows = np.column_stack([loops.source[mask], loops.target[mask], _rows(loops.pose[mask])])
    head = np.array([len(scans), mask.sum(), *weights])
    return b"".join(part.astype("<f4").tobytes() for part in (head, *rows, loop_rows))


def write() -> None:
    """Compute the table and write its file."""
    with open(FILE, "wb") as file:
        file.write(made())


def _rows(pose: Pose) -> NDArray[np.float64]:
    return np.column_stack([pose.t, pose.angle])
