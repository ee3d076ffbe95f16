"""The command line: `register` (the default), `benchmark`, `drive`, `methods`."""

from __future__ import annotations

import io
import os
import sys
from collections.abc import Callable, Sequence

from solvers.cli.benchmark import race
from solvers.cli.common import program
from solvers.cli.drive import drive
from solvers.cli.methods import methods
from solvers.cli.register import register_files
from solvers.core import validate

COMMANDS: dict[str, Callable[[Sequence[str]], int]] = {
    "register": register_files,
    "benchmark": race,
    "drive": drive,
    "methods": methods,
}
_NAMED = ", ".join(COMMANDS)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return the exit code: 0; 1 if the output cannot be written, or its reader has gone;
    2 if an argument or a file is wrong, or memory runs out; 3 if an answer should not be trusted; 130 after Ctrl-C.
    """
    argv = list(sys.argv[1:] if arguments is None else arguments)
    if sys.stderr is None:  # closed by the caller, as by `2>&-`: print would write to stdout instead
        sys.stderr = io.StringIO()
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="replace")  # a console without σ prints the rest all the same
    try:
        return _run(argv)
    except BrokenPipeError:  # as with `| head` once it has its lines; the rest is silently discarded
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    except OSError as error:
        if error.filename is not None:
            raise
        # Not from a file, so from the output itself, as on a full disk.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        print(f"{program()}: standard output: {error.strerror or error}", file=sys.stderr)
        return 1
    except ValueError as error:
        print(f"{program()}: {_as_typed(str(error), argv)}", file=sys.stderr)
        return 2
    except MemoryError as error:  # numpy's says how much was needed, Python's is empty
        print(f"{program()}: there is not enough memory{f': {error}' if str(error) else ''}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print(f"{program()}: stopped by Ctrl-C", file=sys.stderr)
        return 130


def _run(argv: list[str]) -> int:
    """The command's exit code. What it printed, help included, is written by then, so that an error in it is raised
    here.
    """
    has_command = bool(argv) and argv[0] in COMMANDS
    try:
        code = COMMANDS[argv[0]](argv[1:]) if has_command else register_files(_files(argv))
    except SystemExit:  # argparse's, after help or about an argument
        _flush()
        raise
    _flush()
    return code


def _flush() -> None:
    if sys.stdout is not None:  # closed by the caller, as by `>&-`: print writes nothing then
        sys.stdout.flush()


def _as_typed(message: str, argv: Sequence[str]) -> str:
    """A message that begins with an argument's Python name, with that replaced by the command-line option if it was
    typed. It stays if a method's own option of that name was given as well, since it may mean that one.
    """
    name, colon, rest = message.partition(":")
    name = name.removesuffix(".t")  # of a pose
    option, options = f"--{name.replace('_', '-')}", [text.partition("=")[0] for text in argv]
    return f"{option}:{rest}" if colon and option in options and name not in options else message


def _files(argv: list[str]) -> list[str]:
    """Arguments without a command. Raises ValueError if the first is not a file either, and is nearly a command or the
    only one.
    """
    first = argv[0] if argv else "-"
    if first.startswith("-") or os.path.exists(first):
        return argv
    near = validate.nearest(first, COMMANDS)
    if near or len(argv) == 1:  # no registration has a single argument
        raise ValueError(f"{first!r} is neither a command nor a file{near or f'; the commands are {_NAMED}'}")
    return argv
