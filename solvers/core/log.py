"""What the package says to Python's `logging`, at level DEBUG, under the name "solvers".

`logging` itself is not imported: whoever has not imported it listens to nothing, and a page would pay for it.
"""

from __future__ import annotations

import sys


def debug(message: str, *values: object) -> None:
    """Pass a message on to whoever listens, in logging's own form: values go in by %."""
    logging = sys.modules.get("logging")
    if logging is not None:
        logging.getLogger("solvers").debug(message, *values)
