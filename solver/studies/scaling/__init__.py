"""Growth with size: one problem on ever finer meshes, what each solve costs, fitted exponents."""
