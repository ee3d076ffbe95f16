"""Points and cells: the normal distributions transform."""
