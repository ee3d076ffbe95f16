"""Markdown and what is added to it: directives, formulas, code, images."""
