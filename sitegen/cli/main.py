"""The commands: their names, their options, and the functions that do their work.

Standard library only at module level: `--help` and mistakes are answered before .venv exists.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

Arguments = argparse.Namespace
TO_PYTEST = "pytest: files, or -k NAME for tests with that name, run only these tests, after preparing what they need"
UNUSED_BY_PARTS = {  # of `test`
    "pythons": ("hostile", "changed", "engines", "browser_path", "further"),
    "hostile": ("changed", "engines", "browser_path"),
    "changed": ("engines",),
}


@dataclass(frozen=True)
class Command:
    """One command: its help line, its options, its work (root and arguments → exit code)."""

    help: str
    options: Callable[[argparse.ArgumentParser], None]
    run: Callable[[Path, Arguments], int]
    needs_venv: bool = True
    passes_on: str = ""  # the receiver of further arguments; empty if none are allowed
    unused: Mapping[str, Sequence[str]] = field(default_factory=dict)  # option → options that it makes ineffective
    only_with: Mapping[str, str] = field(default_factory=dict)  # option → the one without which it is ineffective


def _no_options(parser: argparse.ArgumentParser) -> None:
    """No options."""


def _port(text: str) -> int:
    """A port number; 0 stands for any free one."""
    if text.isdecimal() and int(text) < 1 << 16:
        return int(text)
    raise argparse.ArgumentTypeError(f"expected a port from 0 to 65535, got {text!r}")


def _serve_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--host", default="127.0.0.1", help="address to listen on (default: this machine only)")
    parser.add_argument(
        "--port", type=_port, default=8000, help="the port, or the next free one after it (default: %(default)s)"
    )
    parser.add_argument("--no-open", action="store_true", help="do not open the browser")
    parser.add_argument(
        "--offline-check", action="store_true", help="visit, stop the server, try every page and figure, then exit"
    )
    parser.add_argument("--browser-path", type=Path, help="the Chromium of that check (default: found or installed)")


def _test_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--browser-path", type=Path, help="the Chromium to use (default: found or installed)")
    parser.add_argument(
        "--engines",
        nargs="?",
        default="",
        const="chromium,firefox,webkit",
        metavar="NAMES",
        help="only the cross-browser tests, on these engines, comma-separated (default: %(const)s)",
    )
    parser.add_argument(
        "--pythons",
        action="store_true",
        help="only the build and the solvers' tests, with every other suitable Python on this machine",
    )
    parser.add_argument(
        "--changed",
        nargs="?",
        default="",
        const="HEAD",
        metavar="COMMIT",
        help="only tests affected by changes since a commit (default: %(const)s), on pages whose chapters changed",
    )
    parser.add_argument(
        "--hostile",
        action="store_true",
        help="only thousands of hostile calls, which takes minutes; --hostile-calls N sets the number of each",
    )


def _bench_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--browser-path", type=Path, help="the Chromium to use (default: found or installed)")
    parser.add_argument("--only", default="", help="groups to measure, comma-separated (default: all)")
    parser.add_argument(
        "--out", type=Path, default=Path("bench.json"), help="the file for the results (default: bench.json)"
    )
    parser.add_argument(
        "--keep", action="store_true", help="write the table into the docs and its headlines into the README"
    )
    parser.add_argument(
        "--gallery",
        type=Path,
        metavar="PYTHON",
        help="only the docs' gallery, with a Python that has the other libraries",
    )


def _sweep_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--processes", type=int, default=0, help="processes to use (default: one per core)")
    parser.add_argument("--scheduler", default="", metavar="ADDRESS", help="a Dask cluster to run on instead")
    parser.add_argument(
        "--only", default="", help="sweeps and long plots, comma-separated: table,basins,four-reach (default: all)"
    )
    parser.add_argument("--methods", default="", help="contestants to run, comma-separated (default: all)")


def _train_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--check", action="store_true", help="train from another seed, write its study to the log, and compare"
    )


def _new_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("kind", choices=("chapter", "figure"))
    parser.add_argument("name", help="lower-case letters, digits and hyphens: names the page or widget")
    parser.add_argument("--title", default="", help="the title (default: the name in words)")


def _publish_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("where", metavar="DEST", help="a folder, or git+REPOSITORY#BRANCH (branch: gh-pages)")
    parser.add_argument(
        "--force",
        action="store_true",
        help="publish even among other files, replacing those of the same name",
    )


def _package_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--tests", action="store_true", help="also run the solvers' tests with each numpy, which takes minutes"
    )


def _clean_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--all",
        action="store_true",
        help="also remove .venv and the user's cache of third-party files and build results",
    )


def _build(root: Path, args: Arguments) -> int:
    from sitegen.pipeline.attempt import build_command

    return build_command(root)


def _serve(root: Path, args: Arguments) -> int:
    if args.offline_check:
        from sitegen.check.offline import offline_check

        return offline_check(root, args.browser_path)
    from sitegen.serve.live import serve

    return serve(root, args.host, args.port, opens=not args.no_open)


def _check(root: Path, args: Arguments) -> int:
    from sitegen.check.command import check_command

    return check_command(root)


def _test(root: Path, args: Arguments) -> int:
    if args.pythons:
        from sitegen.cli.pythons import test_pythons

        return test_pythons(root)
    from sitegen.cli.run_tests import hostile, test, test_changed

    if args.hostile:
        return hostile(root, args.further)
    if args.changed:
        return test_changed(root, args.changed, args.browser_path, args.further)
    return test(root, [name for name in args.engines.split(",") if name], args.browser_path, args.further)


def _bench(root: Path, args: Arguments) -> int:
    if args.gallery:
        from sitegen.bench.gallery import gallery_command

        return gallery_command(root, args.gallery)
    from sitegen.bench.run import bench

    return bench(root, args.out, args.browser_path, [name for name in args.only.split(",") if name], args.keep)


def _sweep(root: Path, args: Arguments) -> int:
    from sitegen.cli.sweep import sweep

    only, methods = ([name for name in text.split(",") if name] for text in (args.only, args.methods))
    return sweep(root, args.processes, args.scheduler, only, methods)


def _train(root: Path, args: Arguments) -> int:
    from sitegen.experiments.training import check_command, train_command

    return check_command() if args.check else train_command()


def _new(root: Path, args: Arguments) -> int:
    from sitegen.cli.new import new_command

    return new_command(root, args.kind, args.name, args.title)


def _publish(root: Path, args: Arguments) -> int:
    from sitegen.cli.publish import publish_command

    return publish_command(root, args.where, force=args.force)


def _package(root: Path, args: Arguments) -> int:
    from sitegen.cli.package import package_command

    return package_command(root, tests=args.tests)


def _clean(root: Path, args: Arguments) -> int:
    from sitegen.cli.clean import clean

    return clean(root, everything=args.all)


COMMANDS: dict[str, Command] = {
    "build": Command("build site/ (the default)", _no_options, _build),
    "serve": Command(
        "build and show the site, and reload the page on every edit",
        _serve_options,
        _serve,
        unused={"offline_check": ("host", "port", "no_open")},
        only_with={"browser_path": "offline_check"},
    ),
    "check": Command("a strict build: links, anchors, references, claims, HTML, sizes", _no_options, _check),
    "test": Command(
        "run every check and test; find or install a browser",
        _test_options,
        _test,
        passes_on=TO_PYTEST,
        unused=UNUSED_BY_PARTS,
    ),
    "bench": Command(
        "measure the project against its targets; write bench.json",
        _bench_options,
        _bench,
        unused={"gallery": ("only", "keep", "out", "browser_path"), "keep": ("only",)},
    ),
    "sweep": Command("run the race on 1,000 seeds, and long plots; resume where it stopped", _sweep_options, _sweep),
    "train": Command("retrain the learned flows' networks with PyTorch; takes most of an hour", _train_options, _train),
    "new": Command("create a working chapter or figure to start from", _new_options, _new),
    "publish": Command("build strictly, then publish site/ to a folder or a git branch", _publish_options, _publish),
    "package": Command("build the pip package in dist/, and try it as a user would", _package_options, _package),
    "clean": Command("remove what the other commands created in this folder", _clean_options, _clean, needs_venv=False),
}


def parse(words: Sequence[str]) -> Arguments:
    """Parse one command's arguments. Ends the process with code 0 for help and 2 for a usage error."""
    parser = argparse.ArgumentParser(
        prog="build.py", description="The Registration Ladder: builds, shows and tests the site.", allow_abbrev=False
    )
    subparsers = parser.add_subparsers(dest="command", metavar="command", title="commands")
    for name, command in COMMANDS.items():
        suffix = f" Further arguments are passed to {command.passes_on}." if command.passes_on else ""
        description = f"{command.help[0].upper()}{command.help[1:]}.{suffix}"
        command.options(subparsers.add_parser(name, help=command.help, description=description, allow_abbrev=False))
    first = next(iter(words), "")
    if first and not first.startswith("-") and first not in COMMANDS:
        from difflib import get_close_matches

        close = get_close_matches(first, COMMANDS, n=1)
        advice = f"did you mean {close[0]!r}?" if close else f"known: {', '.join(COMMANDS)}"
        parser.exit(2, f"build.py: unknown command {first!r}; {advice}\n")
    args, further = parser.parse_known_args(words)
    args.command = args.command or "build"
    args.further = [word for word in further if word != "--"]
    if further and not COMMANDS[args.command].passes_on:
        parser.error(f"{args.command}: unknown arguments {' '.join(further)}")
    subparser: argparse.ArgumentParser = subparsers.choices[args.command]
    given = {name for name, value in vars(args).items() if value not in (subparser.get_default(name), [])}
    for option, conflicts in COMMANDS[args.command].unused.items():
        for conflict in conflicts:
            if {option, conflict} <= given:
                texts = [_argument_text(name, args) for name in (option, conflict)]
                subparser.error(" cannot be combined with ".join(texts))
    for option, other in COMMANDS[args.command].only_with.items():
        if option in given and other not in given:
            subparser.error(f"{_argument_text(option, args)} has no effect without {_argument_text(other, args)}")
    return args


def _argument_text(name: str, args: Arguments) -> str:
    """An argument as it is written on the command line."""
    return " ".join(args.further) if name == "further" else f"--{name.replace('_', '-')}"


def run(root: Path, args: Arguments) -> int:
    """Run the command; the exit code is 0 for success, 1 for problems found, 2 for a usage error."""
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):  # a Windows console's code page may lack ½ and →
            stream.reconfigure(encoding="utf-8", errors="replace")
    return COMMANDS[args.command].run(root, args)
