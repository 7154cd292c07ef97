"""The LAC mortar method: cut, pairing, segments, gap operator, contact status."""
