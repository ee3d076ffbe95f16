"""The figure `pipeline`: a registration in stages: proposal, refinement, verdict."""
