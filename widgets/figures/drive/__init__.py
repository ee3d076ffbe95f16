"""A real drive, played: the map that odometry, matched scans and a closed graph make of it."""
