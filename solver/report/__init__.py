"""The report of many verdicts: pages for people, tables for machines, failures first."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any


def write_report(
    verdicts: Sequence[Path],
    folder: Path,
    families: Sequence[Path] = (),
    older: Sequence[Path] = (),
) -> str:
    """Write the report of the verdict files into `folder`; returns what it found.

    Every verdict is in every file: the main page and the page of its family, summary.json, .csv,
    .md; `bench.html` where other codes have results. junit.xml is of our own solves. `older` are
    the verdicts of solves that the batch did not ask for: all these files show them too, but
    failures.txt does not. It lists what did not pass, and is empty when all passed; results of
    other codes are no failures of a batch. `families` are files `family.yaml`, each in the folder
    of its family. Returned are the processor time by family, a line for each solve that did not
    pass, and the outcome.
    """
    from ..system.files import write_text
    from . import tables
    from .bench import write_bench
    from .charts import write_script
    from .formats import PAGE
    from .page import family_page, main_page
    from .pictures import write_viewer
    from .rows import read_rows
    from .sections import sections
    from .tables import to_junit

    folder.mkdir(parents=True, exist_ok=True)
    files = {file.resolve().parent.name: file for file in families}
    parts = sections(read_rows([*verdicts, *older]), files, folder / "pictures")
    rows = [row for part in parts for row in part.rows]
    earlier = {verdict.parent for verdict in older}
    asked = [row for row in rows if row.folder not in earlier]
    folders = [file.resolve().parent for file in families]
    write_bench(rows, folder, folders)
    contents = {
        PAGE: main_page(parts, folder),
        "summary.json": tables.to_json(rows),
        "summary.csv": tables.to_csv(rows),
        "summary.md": tables.to_markdown(rows),
        "junit.xml": to_junit([row for row in rows if not row.verdict.foreign.code]),
        "failures.txt": tables.to_failures([row for row in asked if not row.verdict.foreign.code]),
    }
    contents |= {part.page: family_page(part, folder, parts) for part in parts}
    for name, content in contents.items():
        write_text(folder / name, content)
    write_script(folder)
    write_viewer(folder)
    problems = "".join(f"{c}\n" for part in parts if (c := part.family.refusal))
    said = tables.outcome(asked)
    if older:
        rest = tables.outcome([row for row in rows if row.folder in earlier])
        said = f"Older results in the report, not of this run: {rest}\nThis run: {said}"
    outcome = f"{said} Report: {folder / PAGE}"
    return f"{problems}{_costs(parts)}\n{contents['failures.txt']}{outcome}"


def _costs(sections: Sequence[Any]) -> str:
    shares = ", ".join(f"{s.name} {s.cpu:.1f} s ({len(s.rows)})" for s in sections)
    return f"Processor time by family (solves): {shares or 'none'}."
