"""The figures of the site: a module each, or a folder with its figure.py. None imports another."""
