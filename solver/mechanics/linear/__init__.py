"""Linear systems: condensation of the constraints, the choice of a solver, CHOLMOD."""
