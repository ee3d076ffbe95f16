"""The licences of the third-party files that the site serves: the fetched ones, and the data in the package."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from sitegen.external import fetch
from solvers.scenes.drive import FOLDER


def licences(names: Iterable[str], *, cache: Path | None = None) -> list[fetch.Licence]:
    """The licences of the named bundles, then that of the recorded drive."""
    text = Path(FOLDER, "telecom-loop.LICENSE.txt").read_text("utf-8").strip()
    title = "Laser scans of a drive, from the data sets of the Mobile Robot Programming Toolkit"
    return [*fetch.licences(names, cache=cache), fetch.Licence(title, "of 21 January 2006", "BSD-3-Clause", text)]
