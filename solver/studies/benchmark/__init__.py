"""Ratios measured side by side in one run: this solver's ways against each other, and CalculiX."""
