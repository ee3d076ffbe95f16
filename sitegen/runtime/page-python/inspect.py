# What Pyodide, dataclasses and pkgutil use of it; the rest would import ast, the disassembler and the tokenizer.
def iscoroutinefunction(function):
    return bool(getattr(getattr(function, "__code__", None), "co_flags", 0) & 0x80)


def signature(function, **options):
    raise ValueError("this runtime knows no signatures")


def unwrap(function):
    while hasattr(function, "__wrapped__"):
        function = function.__wrapped__
    return function


def getmodulename(path):
    from importlib.machinery import all_suffixes

    name = path.rpartition("/")[2]
    endings = (suffix for suffix in sorted(all_suffixes(), key=len, reverse=True) if name.endswith(suffix))
    return next((name.removesuffix(suffix) for suffix in endings), None)
