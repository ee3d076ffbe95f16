"""The race: nine solvers on one room."""

from solvers.studies.race import CONTESTANTS, EXTRAS, MAX_STEPS, SEEDS, Contestant, Controls, contestants, race_problem

__all__ = ["CONTESTANTS", "EXTRAS", "MAX_STEPS", "SEEDS", "Contestant", "Controls", "contestants", "race_problem"]
