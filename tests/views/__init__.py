"""Cases seen otherwise: elsewhere, in other units, renumbered; the answer is the same."""
