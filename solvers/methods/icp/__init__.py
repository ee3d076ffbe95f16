"""Nearest-point methods: ICP and its variants, with points, planes and covariances."""
