# How Python calls JavaScript: without annotations, every argument and every result by Pyodide's default.
from _pyodide_core import JsFuncSignature, js2py_default_call_result, py2js_default

no_default = object()


def _call(*args, **kwargs):
    pass


default_signature = JsFuncSignature(
    _call, False, 0, (), (), py2js_default, (), (), (), py2js_default, js2py_default_call_result
)


def func_to_sig(function):
    return default_signature


def get_attr_sig(signature, name):
    return False, None


def bind_class_sig(signature):
    return signature
