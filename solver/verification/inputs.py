"""The files that a solve is made of: what a verdict belongs to, by their contents."""

from pathlib import Path


def accepted_file(case: Path, job: str) -> Path:
    """Where the accepted values of a job lie, beside its case file."""
    return case.parent / "regression" / f"{job}.json"


def input_files(case: Path, mesh: Path | None, job: str) -> list[Path]:
    """Those that exist of: the case file, accepted values, its mesh file with what it includes."""
    files = [case, accepted_file(case, job)]
    if mesh is not None and mesh.suffix.lower() == ".inp":
        from ..mesh.files.deck_lines import files_of

        files += files_of(mesh)
    elif mesh is not None:
        files.append(mesh)
    return [file for file in files if file.is_file()]
