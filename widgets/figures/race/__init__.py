"""The figure `race`: nine solvers race from one start."""
