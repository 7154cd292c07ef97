"""Growth with size: one problem on ever finer meshes, what each solve costs, fitted exponents."""

# All sizes, and the small ones that take about a minute together.
SIZES = FULL, QUICK = "full", "quick"
