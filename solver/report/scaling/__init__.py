"""The page of growth with size: figures, exponents, numbers beside the goals."""
