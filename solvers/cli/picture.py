"""The command line's pictures: two clouds before and after a registration, and a drive's map by two sets of poses."""

from __future__ import annotations

import io
import re
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from solvers.core.arrays import FloatArray
from solvers.core.pose import Pose
from solvers.geometry.downsample import thinned

MOST = 4000  # points drawn per cloud: more could not be told apart
MOST_ECHOES = 40_000
SOURCE, TARGET = "#c45d14", "#2760bd"
NO_XML = re.compile(r"[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


def before_after(source: ArrayLike, target: ArrayLike, start: Pose, end: Pose, title: str, kind: str) -> bytes:
    """An SVG or PNG file: source (m, d) at both poses over target (n, d), d = 2 or 3, with the same axis limits."""
    from matplotlib.figure import Figure

    p, q = (thinned(np.asarray(x, dtype=float), MOST) for x in (source, target))
    figure = Figure(figsize=(10.0, 5.0), layout="constrained")
    left, right = figure.subplots(1, 2, sharex=True, sharey=True)
    halves = (("before", left, start, "Before: the source at its start"), ("after", right, end, "After: at the pose"))
    for name, axes, pose, caption in halves:
        axes.scatter(q[:, 0], q[:, 1], s=8, c=TARGET, marker="s", linewidths=0, label="target", gid=f"{name}-target")
        moved = pose.apply(p)
        axes.scatter(moved[:, 0], moved[:, 1], s=8, c=SOURCE, linewidths=0, label="source", gid=f"{name}-source")
        axes.set_title(caption, loc="left", fontsize="medium")
        axes.set_aspect("equal", adjustable="box")
        axes.grid(alpha=0.25)
        axes.legend(loc="best", fontsize="small")
    return _file(figure, kind, {"Title": NO_XML.sub("\ufffd", title)})


def drive_maps(maps: Mapping[str, tuple[FloatArray, FloatArray]], kind: str) -> bytes:
    """Maps of one drive side by side at the same scale, as an SVG or PNG file: for each name, echoes (n, 2) and the
    robot's path (k, 2).
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.0 * len(maps), 7.5), layout="compressed")
    panels = figure.subplots(1, len(maps), sharex=True, sharey=True, squeeze=False)[0]
    for k, (axes, (name, (points, path))) in enumerate(zip(panels, maps.items(), strict=True)):
        echoes = thinned(points, MOST_ECHOES)
        axes.scatter(echoes[:, 0], echoes[:, 1], s=1, c=TARGET, linewidths=0, label="echoes", gid=f"map-{k}")
        axes.plot(path[:, 0], path[:, 1], c=SOURCE, lw=1.5, label="path", gid=f"way-{k}")
        axes.set_title(name, loc="left", fontsize="medium")
        axes.set_aspect("equal", adjustable="box")
        axes.set_xlabel("x, m")
        axes.grid(alpha=0.25)
    panels[0].set_ylabel("y, m")
    panels[0].legend(loc="best", fontsize="small")
    return _file(figure, kind, {})


def _file(figure: Any, kind: str, metadata: Mapping[str, str]) -> bytes:
    """A matplotlib figure as a file of this kind, "svg" or "png", with its metadata."""
    from matplotlib import rc_context

    out = io.BytesIO()
    # Without a date a picture is the same each time; a PNG would only name the software.
    left_out = {"Date": None} if kind == "svg" else {"Software": None}
    with rc_context({"svg.hashsalt": "solvers", "svg.fonttype": "none"}):
        figure.savefig(out, format=kind, dpi=150, metadata={**left_out, **metadata})
    return out.getvalue()
