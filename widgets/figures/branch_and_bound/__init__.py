"""The figure `branch-and-bound`: boxes of poses, and which of them cannot contain the best."""
