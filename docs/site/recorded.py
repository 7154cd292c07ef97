"""Keep what complete studies found, for the report's first screen: `make recorded`."""

import json
import sys
from pathlib import Path

from solver.report.cards import RECORDED
from solver.system.files import write_text

REPORT = Path(__file__).resolve().parents[2] / "results" / "report"


def main() -> None:
    """Copy the cards of the studies that are complete."""
    for name in ("study", "stability"):
        file = REPORT / f"{name}-card.json"
        if not file.is_file():
            sys.exit(f"{file}: no such file; make {name} writes it")
        content = json.loads(file.read_text(encoding="utf-8"))
        write_text(
            RECORDED / f"{name}.json", json.dumps(content, ensure_ascii=False, indent=1) + "\n"
        )


if __name__ == "__main__":
    main()
