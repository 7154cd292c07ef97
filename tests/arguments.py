"""Numbers that targets of make are given: `make views COUNT=500`."""

import sys


def whole(name: str, given: str, least: int = 1, most: float = float("inf")) -> int:
    """The number; one line and status 2 for what is none, or would try nothing."""
    if given.isdecimal() and least <= int(given) <= most:
        return int(given)
    bounds = f"from {least} to {most:g}" if most < float("inf") else f"of {least} or more"
    print(f"{name} = {given!r}: must be a whole number {bounds}", file=sys.stderr)
    sys.exit(2)
