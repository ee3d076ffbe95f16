# Leaves numpy's functions unwrapped. The original wraps each one so that other packages' arrays can take over (NEP 18),
# which compares signatures at import and inspects the arguments at every call.
from numpy._core._multiarray_umath import _ArrayFunctionDispatcher, _get_implementing_args, add_docstring  # noqa: F401
from numpy._utils import set_module  # noqa: F401

ARRAY_FUNCTIONS = set()


def finalize_array_function_like(public_api):
    return public_api


def array_function_dispatch(dispatcher=None, module=None, verify=True, docs_from_dispatcher=False):
    return lambda implementation: implementation


def array_function_from_dispatcher(implementation, module=None, verify=True, docs_from_dispatcher=True):
    return lambda dispatcher: implementation
