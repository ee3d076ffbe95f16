# Python in a page imports nothing from JavaScript, and no package from outside.
def register_js_finder():
    pass


def register_windows_finder():
    pass


def register_js_module(name, proxy):
    pass


def register_module_not_found_hook(packages):
    pass


def add_note_to_module_not_found_error(error):
    pass
