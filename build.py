"""The project's commands: `python3 build.py --help` lists them. Needs Python 3.11 or newer and nothing else."""

import contextlib
import runpy
import signal
import sys

if sys.version_info < (3, 11):  # noqa: UP036  (an older Python fails here with a clear message)
    sys.exit("build.py needs Python 3.11 or newer; this is Python %d.%d" % sys.version_info[:2])  # noqa: UP031

from pathlib import Path

from sitegen import stopping
from sitegen.cli import environment
from sitegen.cli import main as cli

ROOT = Path(__file__).resolve().parent


def main(words):
    """Parse and run one command, inside .venv (made on first use). Return the exit code."""
    asked = cli.parse(words)  # --help and usage errors exit here, before anything is set up
    stopping.listen()
    try:
        if cli.COMMANDS[asked.command].needs_venv:
            environment.enter(ROOT, Path(__file__).resolve(), words)
        return cli.run(ROOT, asked)
    except environment.SetupError as error:
        sys.stderr.write("build.py: " + str(error) + "\n")
        return 1
    except KeyboardInterrupt as stop:
        for number in stopping.SIGNALS:
            signal.signal(number, signal.SIG_IGN)
        code, cause = stopping.ending(stop)
        with contextlib.suppress(OSError):  # the terminal may be closed
            sys.stdout.flush()
            sys.stderr.write("\n" * sys.stderr.isatty() + "build.py: stopped by " + cause + "\n")
            sys.stderr.flush()
        stopping.leave(code)  # a normal exit would wait for threads that are packing large files


def hand_over():
    """Run PyPA's `build`: in this folder, `python3 -m build` finds this file instead."""
    sys.path[:] = [path for path in sys.path if Path(path or ".").resolve() != ROOT]
    runpy.run_module("build", run_name="__main__", alter_sys=True)


if __name__ == "__main__" and __spec__ is not None:
    hand_over()
elif __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
