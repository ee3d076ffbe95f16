"""One attempt at a build, as the commands see it: what came of it, never an exception."""

from __future__ import annotations

import errno
import sys
import time
import traceback
from dataclasses import asdict, dataclass, field, fields
from pathlib import Path
from typing import Any

from sitegen.cache.memory import Memory
from sitegen.external.pins import OutsideError
from sitegen.problems import BuildFailed, Problem
from sitegen.progress import Progress, quiet, shown

# What is not a mistake of anybody's code: a full disk, or one that only others may write.
MACHINE = (errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EACCES, errno.EPERM)


@dataclass(frozen=True)
class Outcome:
    """How a build went: nothing in `problems` and `trouble` means that it is published.

    trouble: why there could be no build at all (an outside file that cannot be had, a mistake in Python), as text.
    sources: the page of each chapter's file.
    """

    problems: tuple[Problem, ...] = ()
    warnings: tuple[Problem, ...] = ()
    trouble: str = ""
    seconds: float = 0.0
    pages: int = 0
    sources: dict[str, str] = field(default_factory=dict)

    @property
    def good(self) -> bool:
        """Whether the site is built."""
        return not self.problems and not self.trouble

    def plain(self) -> dict[str, Any]:
        """The outcome as JSON carries it."""
        return asdict(self)

    @classmethod
    def parsed(cls, plain: dict[str, Any]) -> Outcome:
        """The outcome that plain() wrote."""
        known = {one.name: plain[one.name] for one in fields(cls) if one.name in plain}
        lists = {name: tuple(Problem(**one) for one in plain.get(name, ())) for name in ("problems", "warnings")}
        return cls(**{**known, **lists})

    def lines(self) -> list[str]:
        """What there is to mend, a line each."""
        return [*map(str, self.problems), *self.trouble.splitlines()]


def attempt(
    root: Path,
    dest: Path,
    *,
    strict: bool = False,
    drafts: bool = False,
    pack: bool = True,
    progress: Progress = quiet,
    memory: Memory | None = None,
) -> Outcome:
    """Build the checkout `root` into `dest`, with drafts or without, packed for hosts or not, and say how it went.

    memory: see build().
    """
    began = time.monotonic()
    try:
        from sitegen.pipeline.build import build

        report = build(root, dest, strict=strict, drafts=drafts, pack=pack, progress=progress, memory=memory)
    except BuildFailed as failed:
        return Outcome(problems=failed.problems, seconds=time.monotonic() - began)
    except OutsideError as error:
        return Outcome(trouble=str(error), seconds=time.monotonic() - began)
    except OSError as error:
        if error.errno not in MACHINE:
            return Outcome(trouble=traceback.format_exc(), seconds=time.monotonic() - began)
        return Outcome(trouble=f"{error.filename or dest}: {error.strerror}", seconds=time.monotonic() - began)
    except Exception:
        return Outcome(trouble=traceback.format_exc(), seconds=time.monotonic() - began)
    seconds = time.monotonic() - began
    return Outcome((), tuple(report.warnings), "", seconds, len(report.pages), dict(report.sources))


def build_command(root: Path) -> int:
    """Build site/. The exit code is 1 when there is something to mend; what was published before then stays."""
    with shown() as progress:
        outcome = attempt(root, root / "site", progress=progress)
    tell(outcome)
    if outcome.good:
        print("site/index.html is the first page; `python3 build.py serve` shows it")
    return 0 if outcome.good else 1


def tell(outcome: Outcome) -> None:
    """Tell the terminal how a build went."""
    for line in [*(f"{warning} (note)" for warning in outcome.warnings), *outcome.lines()]:
        print(line, file=sys.stderr)
    if outcome.good:
        print(f"built {outcome.pages} pages in {outcome.seconds:.1f} s", flush=True)
    else:
        count = f"{len(outcome.problems)} to mend; " if outcome.problems else ""
        print(f"the build failed: {count}what was published before stays", file=sys.stderr, flush=True)
