"""The build from beginning to end, and the site that it leaves."""
