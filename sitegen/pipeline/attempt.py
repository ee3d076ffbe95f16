"""One attempt at a build, as the commands see it: returns an outcome, never raises."""

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
from sitegen.progress import Progress, quiet, reporting

# Errors of the machine, not of anyone's code: a full disk, or one that we may not write to.
MACHINE = (errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EACCES, errno.EPERM)


@dataclass(frozen=True)
class Outcome:
    """How a build went: it was published if `problems` and `trouble` are empty.

    trouble: why nothing could be built at all (an external file that cannot be fetched, an error in Python), as text.
    sources: the page of each chapter's source file.
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
        """The outcome as plain data for JSON."""
        return asdict(self)

    @classmethod
    def parsed(cls, plain: dict[str, Any]) -> Outcome:
        """Restore an outcome from the output of plain()."""
        values = {f.name: plain[f.name] for f in fields(cls) if f.name in plain}
        lists = {name: tuple(Problem(**p) for p in plain.get(name, ())) for name in ("problems", "warnings")}
        return cls(**{**values, **lists})

    def lines(self) -> list[str]:
        """What needs fixing, as lines of text."""
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
    """Build the checkout `root` into `dest` and report how it went. For the options, see `BuildContext`."""
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
    """Build site/. The exit code is 1 if anything needs fixing; the previously published site then stays in place."""
    with reporting() as progress:
        outcome = attempt(root, root / "site", progress=progress)
    tell(outcome, root / "site")
    if outcome.good:
        print("open site/index.html, or run `python3 build.py serve`")
    return 0 if outcome.good else 1


def tell(outcome: Outcome, site: Path) -> None:
    """Print how a build went, and what a failure has left in the folder `site`."""
    for line in [*(f"{warning} (note)" for warning in outcome.warnings), *outcome.lines()]:
        print(line, file=sys.stderr)
    if outcome.good:
        print(f"built {outcome.pages} pages in {outcome.seconds:.1f} s", flush=True)
    else:
        count = f"{len(outcome.problems)} to fix; " if outcome.problems else ""
        left = "the previous site is kept" if (site / "index.html").is_file() else "there is no site yet"
        print(f"the build failed: {count}{left}", file=sys.stderr, flush=True)
