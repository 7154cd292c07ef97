"""Whether pages load nothing from elsewhere: `python docs/site/loads.py FOLDER`.

Sphinx itself refuses links that lead nowhere.
"""

import re
import sys
from pathlib import Path

# What a browser fetches without being asked.
_LOADED = re.compile(
    r"<(?:script|img|iframe|source|link)\b[^>]*?\s(?:src|href)=[\"']?((?:https?:)?//[^\"'\s>]+)"
)


def loaded(folder: Path) -> list[str]:
    """One line for each thing that a page loads from elsewhere."""
    return [
        f"{path.relative_to(folder)}: loads {link}"
        for path in sorted(folder.rglob("*.html"))
        for link in _LOADED.findall(path.read_text(encoding="utf-8"))
    ]


if __name__ == "__main__":
    FOUND = loaded(Path(sys.argv[1]))
    sys.exit("\n".join(FOUND) or 0)
