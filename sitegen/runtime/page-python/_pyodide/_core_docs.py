# What Pyodide's core looks up as it starts: two errors, JavaScript's null and bigint, and the docstrings of its
# functions and of its proxies' methods. No page reads those, so each docstring is just the name, which docstring.py
# takes for the whole text.
from json import encoder


class ConversionError(Exception):
    pass


class InternalError(Exception):
    pass


class JsNull:
    def __repr__(self):
        return "jsnull"

    def __bool__(self):
        return False


class JsBigInt(int):
    pass


jsnull = encoder._JSNULL = JsNull()


class _JsProxyMetaClass(type):
    pass


def __getattr__(name):
    return name


class _Undocumented:
    def __getattr__(self, name):
        return name


def _undocumented(token):
    return _Undocumented()


_instantiate_token = None
JsProxy = JsPromise = JsBuffer = JsArray = JsMutableMap = JsDoubleProxy = JsGenerator = _undocumented
