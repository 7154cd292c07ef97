"""The input: the case file, its model, its rules and the exact solutions it can name."""
