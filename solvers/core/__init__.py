"""What every solver is made of: arrays, poses, statuses, results, steps, checks, and the list of methods."""
