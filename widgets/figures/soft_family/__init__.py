"""The figure `soft-family`: soft assignment."""
