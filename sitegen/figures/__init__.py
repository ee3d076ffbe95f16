"""Figures drawn ahead: frames, tapes, plots, and what is wrong with them."""
