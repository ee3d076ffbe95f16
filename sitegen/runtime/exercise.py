"""Does once everything that a page may do: modules, methods, figures, and what they use of numpy and Python.

It runs inside Pyodide, for two purposes: on the complete runtime it shows which modules are ever imported
(trace_modules.py), on the shipped one that none of them is missing. Each function returns the names of what it has
exercised.
"""

from __future__ import annotations

import importlib
import json
import pkgutil
import sys
import traceback
import warnings
from typing import Any


def every_module() -> list[str]:
    """Import all modules of solvers and widgets, except those of the command line."""
    names = []
    for top in ("solvers", "widgets"):
        package = importlib.import_module(top)
        modules = [m.name for m in pkgutil.walk_packages(package.__path__, top + ".")]
        names += [top, *(name for name in modules if not name.startswith(("solvers.cli", "solvers.__main__")))]
    for name in names:
        importlib.import_module(name)
    return names


def every_method() -> list[str]:
    """Register a small cloud with a moved copy of itself by every method."""
    import numpy as np

    import solvers

    random = np.random.default_rng(40)
    names = []
    for name, method in solvers.METHODS.items():
        d = 2 if method.dims is None else min(method.dims)
        source = random.normal(size=(24, d))
        turn = np.eye(d)
        turn[:2, :2] = [[np.cos(0.1), -np.sin(0.1)], [np.sin(0.1), np.cos(0.1)]]
        result = solvers.register(source, source @ turn.T + 0.05, method=name)
        assert np.isfinite(result.matrix).all(), name
        names.append(str(name))
    return names


def every_figure() -> list[str]:
    """Draw every preset of every figure, untouched and after each of its buttons."""
    from widgets.engine.contract import preset
    from widgets.engine.host import Host
    from widgets.engine.registry import WIDGETS

    host = Host()
    names = []
    for widget in WIDGETS.values():
        for name in widget.presets:
            plain = preset(widget, name).plain()
            presses = [b.name for b in widget.buttons if b.does == "press"]
            for log in ([], *([["press", press]] for press in presses)):
                request = {"figure": "f", "record": {**plain, "log": log}}
                assert json.loads(host.frame(json.dumps(request)))["panels"], name
            names.append(f"{widget.name} {name}")
    return names


def numpy_at_large() -> list[str]:
    """Use the parts of numpy that solvers and figures may need without importing anything by name."""
    import numpy as np

    random = np.random.default_rng(7)
    a = random.normal(size=(5, 3))
    square = a.T @ a + np.eye(3)
    linalg = np.linalg
    linear_algebra = [
        *(linalg.svd(a), linalg.eigh(square), linalg.eig(square), linalg.eigvalsh(square), linalg.qr(a)),
        *(linalg.det(square), linalg.inv(square), linalg.pinv(a), linalg.solve(square, a.T), linalg.slogdet(square)),
        *(linalg.lstsq(a, a[:, 0], rcond=None), linalg.norm(a, axis=1), linalg.cholesky(square), linalg.cond(square)),
        *(linalg.matrix_rank(a), linalg.matrix_power(square, 3), linalg.multi_dot([a, square, a.T])),
    ]
    draws = [
        *(random.uniform(size=3), random.integers(0, 9, size=3), random.permutation(5), random.exponential(size=2)),
        *(random.standard_normal((2, 2)), random.choice(5, 3, replace=False), random.standard_t(3, size=2)),
        random.poisson(3, 2),
        *(random.multivariate_normal(np.zeros(3), square, size=2), random.spawn(1), random.bytes(4)),
        np.random.default_rng(np.random.SeedSequence([1, 2])).random(),
    ]
    arrays = [
        *(np.einsum("ij,kj->ik", a, a, optimize=True), np.unique(a.round(), axis=0, return_inverse=True)),
        *(np.median(a, axis=0), np.percentile(a, [5, 95]), np.histogram(a, bins=4), np.argpartition(a, 2, axis=0)),
        *(np.lexsort(a.T), np.pad(a, 1), np.interp(0.5, [0, 1], [1, 2]), np.cov(a.T), np.cross(a[0], a[1])),
        *(np.kron(a, a), np.gradient(a[:, 0]), np.meshgrid(a[0], a[1]), np.searchsorted(np.sort(a[:, 0]), 0.0)),
        np.nanmean(a),
        *(np.unravel_index(3, a.shape), np.triu_indices(3), np.ix_([0], [1]), np.isclose(a, a), np.linspace(0, 1, 4)),
        *(np.broadcast_shapes((3, 1), (1, 4)), np.lib.stride_tricks.sliding_window_view(a, (2, 2))),
        *(np.polyfit([0, 1, 2], [1, 3, 5], 1), np.roots([1, -3, 2]), np.apply_along_axis(sum, 0, a)),
    ]
    texts = [
        *(repr(a), str(a), np.array2string(a, precision=2), np.format_float_positional(0.1), a.tolist(), a.tobytes()),
        *(repr(a.dtype), np.get_printoptions(), np.finfo(float).eps, np.iinfo(int).max, np.array(["a", "b"]).tolist()),
    ]
    calls: dict[str, list[Any]] = {"linalg": linear_algebra, "random": draws, "arrays": arrays, "texts": texts}
    with np.errstate(all="ignore"), np.printoptions(precision=3):
        str(np.log(np.zeros(2)) / a[0, 0])
    return [f"{name} {len(results)}" for name, results in calls.items()]


def errors() -> list[str]:
    """Use what is imported only when something goes wrong: tracebacks, warnings, numpy's own errors."""
    import numpy as np

    lines = []
    wrongs = ("np.linalg.inv(np.zeros((2, 3)))", "np.zeros(2) + np.zeros(3)", "{}['key']", "undefined", "1 +")
    for wrong in wrongs:
        try:
            eval(wrong, {"np": np})
        except Exception as error:
            lines.append("".join(traceback.format_exception(error)).splitlines()[-1])
    with warnings.catch_warnings(record=True) as records:
        warnings.simplefilter("always")
        np.log(np.array([-1.0]))
        warnings.warn("shown", stacklevel=1)
        lines += [warnings.formatwarning(w.message, w.category, w.filename, w.lineno) for w in records]
    return lines


def everything() -> dict[str, list[str]]:
    """Run all of the above; their results by name."""
    return {f.__name__: f() for f in (every_module, every_method, every_figure, numpy_at_large, errors)}


def main(text: str) -> str:
    """What was exercised, and every loaded module's origin; `text` is a JSON list of further modules to import."""
    log = everything()
    for name in json.loads(text) or []:
        importlib.import_module(name)
    specs = {name: getattr(module, "__spec__", None) for name, module in list(sys.modules.items())}
    return json.dumps({"done": log, "origins": {n: str(s.origin) for n, s in specs.items() if s is not None}})
