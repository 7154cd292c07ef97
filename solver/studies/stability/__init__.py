"""Numerical stability: one quantity pushed until the answer breaks, value by value.

`description` reads the sweeps, `states` and `floor` know the exact answer and what rounding alone
makes of it, `point` solves and measures.
"""
