"""The report of many verdicts: one page for people, tables for machines, failures first."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

PAGE = "summary.html"


def write_report(verdicts: Sequence[Path], folder: Path, log: Callable[[str], Any] = print) -> int:
    """Write the report of the verdict files into `folder`; the exit status, always 0.

    Every verdict stands in every file: summary.html, .json, .csv, .md, junit.xml, and failures.txt
    (empty when all passed). Logs one line for each solve that did not pass, then the outcome.
    """
    from solver.files import replacing
    from solver.report import tables
    from solver.report.page import to_html
    from solver.report.rows import read_rows

    folder.mkdir(parents=True, exist_ok=True)
    rows = read_rows(verdicts)
    contents = {
        PAGE: to_html(rows, folder / "pictures", (folder / "orders.html").is_file()),
        "summary.json": tables.to_json(rows),
        "summary.csv": tables.to_csv(rows),
        "summary.md": tables.to_markdown(rows),
        "junit.xml": tables.to_junit(rows),
        "failures.txt": tables.to_failures(rows),
    }
    for name, content in contents.items():
        with replacing(folder / name) as temporary:
            temporary.write_text(content, encoding="utf-8")
    log(f"{contents['failures.txt']}{tables.outcome(rows)} Report: {folder / PAGE}")
    return 0
