"""Numbers in the settings of make targets, as in `make views COUNT=500`."""

import sys


def whole(name: str, given: str, least: int = 1, most: float = float("inf")) -> int:
    """Return the number given.

    Anything but a whole number within the bounds ends the program with status 2, and one line says
    what is allowed.
    """
    if given.isdecimal() and least <= int(given) <= most:
        return int(given)
    bounds = f"from {least} to {most:g}" if most < float("inf") else f"of {least} or more"
    print(f"{name} = {given!r}: must be a whole number {bounds}", file=sys.stderr)
    sys.exit(2)
