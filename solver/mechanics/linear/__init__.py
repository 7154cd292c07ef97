"""Linear systems: condensation of the constraints, direct solvers, multigrid."""
