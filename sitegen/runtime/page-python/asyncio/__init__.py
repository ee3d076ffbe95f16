# Pyodide's core looks up one name in this module as it starts. Nothing in a page awaits anything in Python.
def get_event_loop():
    raise NotImplementedError("this runtime has no event loop")
