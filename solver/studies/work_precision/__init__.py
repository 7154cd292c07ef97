"""Error against run time: what is studied, and how one point of it is measured."""

# The whole study, and the part of it that is for a first look.
SIZES = FULL, QUICK = "full", "quick"
