"""What all solvers share: arrays, poses, statuses, results, the step loop, checks, and the list of methods."""
