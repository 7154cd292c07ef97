"""Constraints, the state of each step, friction, and the recovered pressure."""
