"""Numerical stability: one quantity pushed until the answer breaks, value by value.

`sweeps` reads what to push from files, `states` and `floor` know the exact answer and what rounding
alone makes of it, `points` solves and measures.
"""
