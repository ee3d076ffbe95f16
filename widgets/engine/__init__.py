"""What all figures share: their contract, controls, long jobs, the registry, and the host that answers the page."""
