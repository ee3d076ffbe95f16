"""Nearest points: ICP and its kin, with points, planes and covariances."""
