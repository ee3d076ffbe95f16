"""The project's benchmarks, and the table of their results."""
