"""Ctrl-C as a terminal sends it, to every process of the group, while real processes, Node and threads are working;
and the signals of `kill` and of a terminal that closes."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import time
from contextlib import closing
from pathlib import Path

import pytest

from sitegen.stopping import deferred_signals

ROOT = Path(__file__).resolve().parents[1]
PATIENCE = 60.0  # seconds until a wait counts as failed
ENDS = 15.0  # seconds; usually a fraction of one, but machines are busy
ENDINGS = {"build": (130, "build.py: stopped by Ctrl-C"), "serve": (0, "stopped")}
STAGES = {"writing": 3, "counting": 3, "node": 2, "packing": 1}  # and how many processes report that they have begun

pytestmark = pytest.mark.skipif(os.name == "nt", reason="groups of processes are POSIX's")

# A generator that reaches a stage and stays there. Each process at work writes a file that holds its process ID.
BUILD = """\
import hashlib, os
from pathlib import Path
from sitegen.cache import pool
from sitegen.cache.files import write
from sitegen.external.node import run_node
from sitegen.pipeline.output import publish

class Report:
    pages, warnings, sources = ("index.html",), (), ()

def say(root, name):
    write(root / "begun" / name, str(os.getpid()).encode())

def writing(root, name):
    say(root, name)
    while True:
        write(root / "cache" / name, os.urandom(1 << 20))

def counting(root, name):
    say(root, name)
    hashlib.pbkdf2_hmac("sha256", b"", b"", (1 << 31) - 1)  # no signal is heard before this ends, in ten minutes

def build(root, dest, *, strict=False, drafts=False, pack=True, progress=None, memory=None):
    stage = (root / "content" / "page.md").read_text()
    say(root, "build")
    if stage in ("writing", "counting"):
        pool.make("pieces", [(globals()[stage], (root, f"piece-{i}")) for i in range(5)], progress)
        raise AssertionError("these pieces do not end by themselves")
    elif stage == "node":
        run_node(root / "sitegen" / "slow.mjs", str(root / "begun" / "node"))
    elif stage == "packing":
        words = os.urandom(1 << 16).hex().encode()
        files = {f"{i}.txt": b"%d" % i + words * 200 for i in range(40)}
        publish(files, None, dest, True, root / "cache", progress)
    return Report()
"""
NODE = """\
import { readFileSync, renameSync, writeFileSync } from "node:fs";
const said = JSON.parse(readFileSync(0, "utf-8"));
writeFileSync(said + ".new", String(process.pid));
renameSync(said + ".new", said);
setInterval(() => {}, 1000);
"""


class Started:
    """A command in its own session, as a terminal would start it."""

    def __init__(self, root: Path, *words: str) -> None:
        self.root = root
        self.process = subprocess.Popen(
            [sys.executable, "build.py", *words],
            cwd=root,
            env={**os.environ, "PYTHONIOENCODING": "utf-8"},
            start_new_session=True,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )

    def interrupt(self, times: int) -> tuple[int, str]:
        """Press Ctrl-C this many times; the exit code and everything printed, once the command has ended."""
        for _ in range(times):
            os.killpg(self.process.pid, signal.SIGINT)
        return self.end()

    def end(self) -> tuple[int, str]:
        """The exit code and everything printed, once the command has ended."""
        output, _ = self.process.communicate(timeout=ENDS)
        return self.process.returncode, output

    def processes(self) -> list[int]:
        """The IDs of the processes that the build reported as working."""
        return [int(path.read_text()) for path in (self.root / "begun").glob("[!.]*") if path.suffix != ".new"]

    def close(self) -> None:
        for number in [self.process.pid, *self.processes()]:
            if alive(number):
                os.kill(number, signal.SIGKILL)
        self.process.communicate(timeout=ENDS)


def alive(number: int) -> bool:
    """Whether the process is running: neither gone nor a zombie."""
    process = subprocess.run(["ps", "-o", "stat=", "-p", str(number)], capture_output=True, text=True, check=False)
    return bool(process.stdout.strip()) and not process.stdout.strip().startswith("Z")


def wait_for(run: Started, stage: str) -> None:
    """Wait until everything that the stage starts is working."""
    deadline = time.monotonic() + PATIENCE
    while len(run.processes()) < STAGES[stage] or (stage == "packing" and not [*run.root.glob(".site-*/*")]):
        assert run.process.poll() is None, run.process.communicate()[0]
        assert time.monotonic() < deadline
        time.sleep(0.01)


@pytest.fixture
def checkout(tmp_path: Path) -> Path:
    """A checkout with the real commands and the generator above."""
    root = tmp_path / "checkout"
    (root / "content").mkdir(parents=True)
    shutil.copytree(ROOT / "sitegen", root / "sitegen", ignore=shutil.ignore_patterns("__pycache__"))
    for name in ("build.py", "requirements.lock"):
        shutil.copy(ROOT / name, root)
    (root / ".venv").symlink_to((ROOT / ".venv").resolve(), target_is_directory=True)
    (root / "solvers").symlink_to(ROOT / "solvers")
    (root / "widgets").symlink_to(ROOT / "widgets")
    (root / "sitegen" / "pipeline" / "build.py").write_text(BUILD, "utf-8")
    (root / "sitegen" / "slow.mjs").write_text(NODE, "utf-8")
    return root


@pytest.mark.parametrize("times", [1, 2])
@pytest.mark.parametrize("stage", STAGES)
@pytest.mark.parametrize("words", [["build"], ["serve", "--no-open", "--port", "0"]], ids=["build", "serve"])
def test_ctrl_c_ends_everything_and_leaves_nothing(checkout: Path, words: list[str], stage: str, times: int) -> None:
    """Pressed once or twice, at any stage: the command prints one line and exits with every process it started; no
    folder is left beside the site, and no half-written file in the cache."""
    (checkout / "content" / "page.md").write_text(stage, "utf-8")
    with closing(Started(checkout, *words)) as run:
        wait_for(run, stage)
        code, output = run.interrupt(times)
        assert (code, output.strip()) == ENDINGS[words[0]]
        assert [number for number in run.processes() if alive(number)] == []
    assert [path.name for path in checkout.glob(".site*")] == []
    assert [path.name for path in checkout.glob("cache/**/.*")] == []


@pytest.mark.parametrize("stage", STAGES)
@pytest.mark.parametrize("words", [["build"], ["serve", "--no-open", "--port", "0"]], ids=["build", "serve"])
def test_a_terminated_command_cleans_up_as_well(checkout: Path, words: list[str], stage: str) -> None:
    """`kill` and `timeout` send SIGTERM to the one process; it takes all others with it."""
    (checkout / "content" / "page.md").write_text(stage, "utf-8")
    with closing(Started(checkout, *words)) as run:
        wait_for(run, stage)
        run.process.terminate()
        code, output = run.end()
        ending = (143, "build.py: stopped by SIGTERM") if words[0] == "build" else ENDINGS["serve"]
        assert (code, output.strip()) == ending
        assert [number for number in run.processes() if alive(number)] == []
    assert [path.name for path in checkout.glob(".site*")] == []
    assert [path.name for path in checkout.glob("cache/**/.*")] == []


@pytest.mark.parametrize("handler", [signal.SIG_DFL, signal.SIG_IGN], ids=["heard", "ignored"])
def test_a_closed_terminal_ends_a_build_unless_nohup_forbids_it(checkout: Path, handler: signal.Handlers) -> None:
    """SIGHUP comes to all processes of the group; a build inherits whether it is ignored, as `nohup` has it."""
    (checkout / "content" / "page.md").write_text("packing", "utf-8")
    before = signal.signal(signal.SIGHUP, handler)  # whichever way these tests were started
    try:
        with closing(Started(checkout, "build")) as run:
            wait_for(run, "packing")
            os.killpg(run.process.pid, signal.SIGHUP)
            if handler == signal.SIG_IGN:
                time.sleep(0.3)
                assert run.process.poll() is None
                assert run.interrupt(1) == (130, "build.py: stopped by Ctrl-C\n")
            else:
                assert run.end() == (129, "build.py: stopped by SIGHUP\n")
    finally:
        signal.signal(signal.SIGHUP, before)
    assert [path.name for path in checkout.glob(".site*")] == []


def test_an_ignored_signal_takes_no_other_s_place() -> None:
    """When a terminal closes, SIGHUP, which a worker ignores, may come to it just before SIGTERM."""
    calls: list[int] = []
    before = {
        signal.SIGHUP: signal.signal(signal.SIGHUP, signal.SIG_IGN),
        signal.SIGTERM: signal.signal(signal.SIGTERM, lambda number, frame: calls.append(number)),
    }
    try:
        with deferred_signals():
            signal.raise_signal(signal.SIGHUP)
            signal.raise_signal(signal.SIGTERM)
            assert calls == []
        assert calls == [signal.SIGTERM]
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def test_ctrl_c_ends_a_server_that_waits(checkout: Path) -> None:
    """This is how `serve` is meant to end: with code 0, and the process that would have run the next build ends too."""
    (checkout / "content" / "page.md").write_text("nothing", "utf-8")
    with closing(Started(checkout, "serve", "--no-open", "--port", "0")) as run:
        assert run.process.stdout is not None
        while "Ctrl-C" not in (line := run.process.stdout.readline()):
            assert line, "it has ended"
        code, output = run.interrupt(1)
        assert (code, output.strip()) == (0, "stopped")
        assert [number for number in run.processes() if alive(number)] == []
