"""The figure `space`: one mug, seen from anywhere, and how much of its pose pairs of points determine."""
