"""Studies that measure the program, each with its description, measurement and page."""
