"""The interactive figures: controls, a solver stepper and a picture each. numpy and the standard library only."""
