"""`test`'s checks of the pages' scripts: TypeScript's compiler, which reads their JSDoc types, and ESLint."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from sitegen.assets.bundle import read_files
from sitegen.external import fetch
from sitegen.external.node import environment, node_command, run_node
from sitegen.problems import Problem, Problems

LINT = Path(__file__).with_name("lint.mjs")
# The page's own, those of its workers, and those of the preview.
PROJECTS = ("templates/assets/js", "templates/assets", "sitegen/serve/preview")


def script_types(root: Path) -> int:
    """Check the types of all scripts, project by project. The exit code is 1 if tsc reports anything."""
    compiler = fetch.gather(["typescript"])["typescript/lib/_tsc.js"]
    codes = []
    for project in PROJECTS:
        command = node_command(compiler, "--project", root / project, "--pretty", "false")
        codes.append(subprocess.run(command, cwd=root, env=environment(), check=False).returncode)
    return 1 if any(codes) else 0


def script_lint(root: Path) -> int:
    """Lint all scripts in the templates and in sitegen. The exit code is 1 if there are problems."""
    problems = lint_problems(root)
    for problem in problems:
        print(problem, file=sys.stderr)
    return 1 if problems else 0


def lint_problems(root: Path) -> list[Problem]:
    """ESLint's findings, in order."""
    problems = Problems()
    files: dict[str, str] = {}
    for folder, pattern in (("templates", "*.js"), ("templates", "*.mjs"), ("sitegen", "*.js"), ("sitegen", "*.mjs")):
        files |= read_files(root, folder, pattern, problems)
    library = fetch.gather(["eslint"])["eslint/linter.mjs"]
    answer = run_node(LINT, {"library": str(library), "files": files}, timeout=120)
    faults = [Problem(finding["path"], finding["line"], finding["column"], finding["message"]) for finding in answer]
    return sorted([*problems.found, *faults])
