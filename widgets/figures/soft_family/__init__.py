"""The figure `soft-family`: registration by soft assignment."""
