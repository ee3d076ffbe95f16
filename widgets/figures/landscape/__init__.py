"""The figure `landscape`: an objective as terrain."""
