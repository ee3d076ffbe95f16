"""Figures drawn at build time: frames, tapes and plots, and the detection of faults in them."""
