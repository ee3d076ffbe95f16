"""Distributions: maximum mean discrepancy, its derivative, objectives as maps."""
