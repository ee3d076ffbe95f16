"""Clouds from files: CSV, XYZ, PLY, PCD."""
