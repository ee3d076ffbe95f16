"""The normal distributions transform, from points to cells and from cells to cells."""
