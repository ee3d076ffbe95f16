"""Runs pytest inside Pyodide: the checkout is mounted at /repo, the virtualenv's packages at /venv.

numpy and Hypothesis are Pyodide's builds and come first on the path; pytest, pure Python, is the virtualenv's.
"""

import contextlib
import io
import json
import os
import sys


def main(text):
    """Run pytest with {"args": its arguments}; return {"code": its exit code, "output": what it printed}."""
    sys.dont_write_bytecode = True
    sys.path.insert(0, "/repo")
    sys.path.append("/venv")
    os.environ |= {"PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1", "HYPOTHESIS_STORAGE_DIRECTORY": "/tmp/hypothesis"}
    os.environ["HYPOTHESIS_NO_PLUGINS"] = "1"  # the virtualenv's are built for another platform
    os.chdir("/repo")
    import pytest
    from hypothesis import settings

    # How long an example takes depends on the machine; which are drawn does not.
    settings.register_profile("page", deadline=None, derandomize=True)
    settings.load_profile("page")
    output = io.StringIO()
    with contextlib.redirect_stdout(output), contextlib.redirect_stderr(output):
        # Rewriting asserts is slow here, so they stay plain; the local variables show what went wrong.
        words = ["--assert=plain", "--showlocals", "-p", "_hypothesis_pytestplugin", "-p", "no:cacheprovider"]
        code = pytest.main([*words, *json.loads(text)["args"]])
    return json.dumps({"code": int(code), "output": output.getvalue()})
