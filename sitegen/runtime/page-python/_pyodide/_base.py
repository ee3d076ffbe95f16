# The one of Pyodide's ways to run code that the worker uses: run source text and return its last expression's value.
from _ast import Expr, Expression, PyCF_ONLY_AST


def eval_code(source, globals=None, locals=None, *, filename="<exec>"):
    globals = {} if globals is None else globals
    module = compile(source, filename, "exec", PyCF_ONLY_AST)
    last = module.body.pop() if module.body and isinstance(module.body[-1], Expr) else None
    if module.body:
        exec(compile(module, filename, "exec"), globals, locals)
    if last is None:
        return None
    return eval(compile(Expression(last.value), filename, "eval"), globals, locals)


def pyimport_impl(path):
    stem, *names = path.rsplit(".", 1)
    module = __import__(stem, fromlist=names)
    return getattr(module, names[0]) if names else module
