"""Markdown and our additions to it: directives, formulas, code, images."""
