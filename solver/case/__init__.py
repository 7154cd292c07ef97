"""The input: the case file, its model, its rules and the exact solutions it can name."""


def job_name(
    name: str, swapped: bool, hexahedra: str | None = None, recovery: str | None = None
) -> str:
    """The name of one solve of a case: direction and variant, where they are not the case's own."""
    return "-".join(filter(None, [name, "swapped" * swapped, hexahedra, recovery]))
