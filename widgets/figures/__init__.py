"""The site's figures: one module each, or one folder with a figure.py. No figure imports another."""
