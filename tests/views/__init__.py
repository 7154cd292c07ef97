"""Cases seen otherwise: turned, in other units, renumbered; the answer is the same."""
