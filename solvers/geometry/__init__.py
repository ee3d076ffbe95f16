"""Rigid fits, eigenvalues, normals, nearest neighbours, fewer points."""
