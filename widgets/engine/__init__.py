"""What every figure stands on: its contract, controls, long jobs, the registry, and the host that the page asks."""
