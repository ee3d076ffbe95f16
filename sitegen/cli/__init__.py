"""The commands of build.py, and the environment that they run in."""
