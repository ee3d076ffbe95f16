"""Each method as a function of its own: `solvers.icp(source, target, gate=0.5)`.

Built from `register` and the method's options, so that names, defaults and docstrings are written only once. The types
for editors and type checkers, including those of `register`, are in `solvers/_functions.pyi`; a test checks that they
agree.
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable
from dataclasses import fields
from functools import cache
from typing import Any

from solvers.api import OTHER_NAMES, register
from solvers.core.registry import ALIASES, METHODS
from solvers.core.result import Result

NAMES = {name.replace("-", "_"): name for name in METHODS}
"""From function name to method name."""
ALSO = {alias.replace("-", "_"): name.replace("-", "_") for alias, name in ALIASES.items()}
"""From alias to function name: accepted, but not listed."""


@cache
def function(name: str) -> Callable[..., Result]:
    """Return a method's function.

    Parameters
    ----------
    name : str
        A key of `NAMES` or of `ALSO`.

    Returns
    -------
    callable
        `register` with the method fixed. It takes only the arguments of that method.

    Examples
    --------
    >>> from solvers.per_method import function
    >>> icp = function("icp")
    >>> icp.__name__, list(icp.__signature__.parameters)[:4]
    ('icp', ['source', 'target', 'gate', 'trim'])
    """
    if name in ALSO:
        return function(ALSO[name])
    method = METHODS[NAMES[name]]

    def call(source: Any, target: Any, **options: Any) -> Result:
        if "method" in options:
            alternative = f"register(source, target, {options['method']!r})"
            raise TypeError(f"{name}() takes no method: it runs {method.name!r}; another is run by {alternative}")
        return register(source, target, method.name, **options)

    call.__name__ = call.__qualname__ = name
    call.__module__ = "solvers"
    call.__doc__ = _words(method.name)
    vars(call)["__signature__"] = inspect.Signature(parameters(method.name), return_annotation=Result)
    return call


def parameters(method: str) -> list[inspect.Parameter]:
    """The parameters of a method's function: the clouds, its own options, their other names, and those of `register`.

    Parameters
    ----------
    method : str
        A name in `METHODS`.

    Returns
    -------
    list of inspect.Parameter
        In the order of the signature.
    """
    entry, common = METHODS[method], dict(inspect.signature(register).parameters)
    own = [_option(option.name, option.default, option.type) for option in fields(entry.options)]
    own += [_option(OTHER_NAMES[o.name], o.default, o.annotation) for o in own if o.name in OTHER_NAMES]
    left_out = {"method", "options", "keywords"}
    left_out |= {name for name, accepted in (("pairs", entry.paired), ("weights", entry.weighted)) if not accepted}
    rest = [parameter for name, parameter in common.items() if name not in left_out]
    return [*rest[:2], *own, *rest[2:]]


def _option(name: str, default: Any, annotation: Any) -> inspect.Parameter:
    return inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=annotation)


def _words(method: str) -> str:
    """A numpydoc docstring, assembled from those of the method, its options and `register`."""
    entry = METHODS[method]
    texts = {**_parameters_of(register.__doc__), **_parameters_of(entry.options.__doc__)}
    aliases = {name: alias for name, alias in OTHER_NAMES.items() if name in texts}
    texts |= {alias: f"{alias} : float\n    The same as `{name}`." for name, alias in aliases.items()}
    own_texts = [texts[parameter.name] for parameter in parameters(method) if parameter.name in texts]
    summary = f"{entry.summary[:1].upper()}{entry.summary[1:]}."
    source = f"Source: {entry.source}. The same as `register(…, {method!r})`."
    returns = ["Returns", "-------", "Result", "    As from `register`."]
    return "\n".join([summary, "", source, "", "Parameters", "----------", *own_texts, "", *returns])


def _parameters_of(docstring: str | None) -> dict[str, str]:
    """The entries of a docstring's Parameters section, by name; empty without docstrings (python -OO)."""
    section = re.search(r"^Parameters\n-+\n(.*?)(?=^\w[^\n]*\n-+\n|\Z)", inspect.cleandoc(docstring or ""), re.M | re.S)
    entries = re.split(r"^(?=\S)", section[1].rstrip(), flags=re.M) if section else []
    return {re.split(r"\W", entry, maxsplit=1)[0]: entry.rstrip() for entry in entries if entry.strip()}
