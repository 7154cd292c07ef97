"""Studies that measure the program, each with its description, measurement and page.

A study comes in two sizes: all of it, and a part that takes some minutes. Scaling has a third one,
beyond the sizes of the others.
"""

SIZES = FULL, QUICK = "full", "quick"
LARGE = "large"
