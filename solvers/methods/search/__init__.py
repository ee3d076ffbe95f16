"""Searching all poses."""
