"""The LAC mortar method: cut, pairing, segments, gap operator, contact status.

Examples in this package use its public names, NumPy as `np`, the catalogue `BY_NAME`, and two
surfaces in the plane: `slave`, one edge of length 2 on y = 0 that faces up, with the nodes 1 and 0
at its ends (2, 0) and (0, 0); and `master`, two edges of length 1 on y = 1/2 that face down, with
the nodes 2, 3, 4 at x = 0, 1, 2. Their coordinates are `points`.
"""
