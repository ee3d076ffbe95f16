"""Clouds and pose graphs in files: CSV, XYZ, PLY, PCD and g2o."""
