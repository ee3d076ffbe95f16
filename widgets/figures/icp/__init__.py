"""The figure `icp`: registration with unknown pairs."""
