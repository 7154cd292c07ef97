"""The one kind of error an installation ends with."""


class InstallError(Exception):
    """What is missing and what to do about it, in one line."""
