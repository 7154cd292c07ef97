"""Other codes on the same cases: their results, checked by the checks of our own."""
