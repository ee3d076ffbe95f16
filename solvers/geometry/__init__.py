"""Rigid fits, eigenvalues, normals, nearest neighbours, thinning."""
