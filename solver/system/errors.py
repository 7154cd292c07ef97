"""The ways in which a command ends early: its input is refused, or the solve fails."""


class InputError(Exception):
    """The input is refused: one line that names the file, the key, the value and what is allowed.

    The command line prints the line and exits with status 2.
    """

    def __init__(self, where: object, key: str, value: object, allowed: str):
        """Compose the line; `value` None leaves the value out (a key that is missing).

        `told` is the line without the file.
        """
        self.where, self.key, self.value, self.allowed = str(where), key, value, allowed
        shown = "" if value is None else f" = {_shorten(value)}"
        self.told = f"{key}{shown}: {allowed}"
        super().__init__(f"{self.where}: {self.told}")


class MachineError(InputError):
    """Refused not for what the input says, but for what the machine has now: another run may do."""


class SolveError(Exception):
    """The solve failed (singular system, no convergence): one line with the reason, status 3."""


def of_machine(error: Exception) -> str:
    """In one line what the machine lacks, memory or a file that can be used; else nothing."""
    said = " ".join(str(error).split())
    if isinstance(error, MemoryError) or _is_unmapped(error):
        return f"out of memory: {said or 'no more is to be had'}"
    if isinstance(error, OSError) and error.errno:
        return f"{error.filename or 'output'}: {error.strerror}"
    return ""


def _is_unmapped(error: Exception) -> bool:
    """Whether a library could not be loaded for want of memory."""
    return isinstance(error, ImportError) and "failed to map segment" in str(error)


def _shorten(value: object, length: int = 80) -> str:
    text = " ".join(repr(value).split())
    return text if len(text) <= length else text[: length - 1] + "…"
