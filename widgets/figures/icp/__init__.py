"""The figure `icp`: unknown pairs."""
