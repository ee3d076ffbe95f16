"""The figure `drive`: a real drive played back, mapped by odometry, by matched scans or by a closed graph."""
