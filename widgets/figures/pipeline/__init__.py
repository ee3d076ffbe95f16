"""The figure `pipeline`: proposal, refinement, verdict."""
