"""Soft assignment: CPD, FilterReg, mixtures, belief propagation."""
