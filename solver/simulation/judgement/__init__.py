"""What a solution is worth: its plan, its limits, whether its fields fit one another."""
