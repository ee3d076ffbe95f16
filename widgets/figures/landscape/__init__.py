"""The figure `landscape`: the objective as a map."""
