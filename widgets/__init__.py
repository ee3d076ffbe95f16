"""The interactive figures, each with controls, a solver stepper and a picture. They need only numpy and `solvers`."""
