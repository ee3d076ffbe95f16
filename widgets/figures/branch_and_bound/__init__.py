"""Rung 10: all poses in boxes, and those ruled out that cannot hold the best."""
