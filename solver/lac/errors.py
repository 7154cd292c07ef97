"""The one way in which a solve fails."""


class SolveError(RuntimeError):
    """The solve failed (singular system, no convergence): one line with the reason, status 3."""
