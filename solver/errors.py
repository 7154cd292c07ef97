"""The two ways in which a command ends early: its input is refused, or the solve fails."""


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


class SolveError(Exception):
    """The solve failed (singular system, no convergence): one line with the reason, status 3."""


def _shorten(value: object, length: int = 80) -> str:
    text = " ".join(repr(value).split())
    return text if len(text) <= length else text[: length - 1] + "…"
