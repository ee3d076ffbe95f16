"""Experiments whose results are computed once and committed: the sweep over starts, the training of the flow."""
