"""Groups that share members, as files know them in which a member belongs to one set alone."""

from collections.abc import Mapping, Sequence

import numpy as np


def combinations(
    count: int, groups: Mapping[str, Sequence[int] | np.ndarray]
) -> tuple[np.ndarray, list[list[str]]]:
    """Which combination (n,) of groups each of `count` members is in, and the names of each.

    >>> of, names = combinations(3, {"a": [0, 1], "b": [1]})
    >>> of.tolist(), names
    ([1, 2, 0], [[], ['a'], ['a', 'b']])
    """
    known = sorted(groups)
    inside = np.zeros((count, len(known)), dtype=bool)
    for column, name in enumerate(known):
        inside[np.asarray(groups[name], dtype=int), column] = True
    found, of = np.unique(inside, axis=0, return_inverse=True)
    return of.ravel(), [[n for n, there in zip(known, row, strict=True) if there] for row in found]
