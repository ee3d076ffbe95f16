def get_cmeth_docstring(name):
    return f"{name}(*args)\n--\n\n"
