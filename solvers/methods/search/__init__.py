"""Global search over all poses: correlative matching, branch and bound."""
