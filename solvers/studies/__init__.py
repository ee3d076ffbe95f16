"""Comparisons of methods: the race and its benchmark, the walkthrough of four methods, and the coverage study."""
