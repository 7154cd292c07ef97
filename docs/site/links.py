"""Whether every link of a built site leads somewhere: `python docs/site/links.py FOLDER`.

Links within the site have to name a file of it, and an anchor that the file has. Nothing that a
page loads by itself may come from elsewhere; links to elsewhere are not followed.
"""

import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

# What a browser fetches without being asked.
_LOADED = {
    ("script", "src"),
    ("img", "src"),
    ("link", "href"),
    ("iframe", "src"),
    ("source", "src"),
}


class Page(HTMLParser):
    """The anchors of a page, its links, and what it loads."""

    def __init__(self, html: str):
        super().__init__()
        self.anchors: set[str] = {""}
        self.links: list[str] = []
        self.loaded: list[str] = []
        self.feed(html)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Note ids, names, links and sources."""
        for name, value in attrs:
            if value is None:
                continue
            if name == "id" or (tag == "a" and name == "name"):
                self.anchors.add(value)
            elif (tag, name) in _LOADED:
                self.loaded.append(value)
            elif name == "href":
                self.links.append(value)


def broken(folder: Path) -> list[str]:
    """One line for each link that leads nowhere, and for each thing that is loaded from outside."""
    folder = folder.resolve()
    pages = {
        path: Page(path.read_text(encoding="utf-8")) for path in sorted(folder.rglob("*.html"))
    }
    found = []
    for path, page in pages.items():
        name = path.relative_to(folder)
        for link in [*page.links, *page.loaded]:
            parts = urlsplit(link)
            if parts.scheme or parts.netloc:
                if link in page.loaded and parts.scheme != "data":
                    found.append(f"{name}: loads {link}")
                continue
            to = (path.parent / unquote(parts.path)).resolve() if parts.path else path
            if not to.is_file() or not to.is_relative_to(folder):
                found.append(f"{name}: {link}: there is no such file")
            elif to in pages and unquote(parts.fragment) not in pages[to].anchors:
                found.append(f"{name}: {link}: there is no such anchor")
    return found


def main() -> int:
    """Print what is broken; the exit status."""
    folder = Path(sys.argv[1])
    lines = broken(folder)
    for line in lines:
        print(line, file=sys.stderr)
    count = len(list(folder.rglob("*.html")))
    if not count:
        print(f"{folder}: there is no page", file=sys.stderr)
    elif not lines:
        print(f"{count} pages, every link leads somewhere: {folder}/index.html")
    return 1 if lines or not count else 0


if __name__ == "__main__":
    sys.exit(main())
