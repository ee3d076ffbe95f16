"""Methods compared: the race, its benchmark, four kinds of state on one scene."""
