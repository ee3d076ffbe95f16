"""Messages to Python's `logging`, at level DEBUG, to the logger "solvers".

`logging` itself is not imported: unless the caller has imported it, nobody is listening, and a page would pay for it.
"""

from __future__ import annotations

import sys


def debug(message: str, *values: object) -> None:
    """Log a message if `logging` has been imported; `values` are filled in by %, as in `logging.debug`."""
    logging = sys.modules.get("logging")
    if logging is not None and hasattr(logging, "getLogger"):  # another thread may have imported half of it
        logging.getLogger("solvers").debug(message, *values)
