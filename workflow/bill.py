"""The bill of materials: every locked package with version, licence and hashes, as CycloneDX.

`python workflow/bill.py BILL.json` needs the standard library alone: what is locked stands in
requirements*.txt, licences in the metadata of what is installed. The same locks and packages give
the same file.
"""

import json
import re
import sys
import tomllib
from importlib.metadata import PackageNotFoundError, metadata
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
_PIN = re.compile(r"^([\w.-]+)==([^\s;\\]+)(?: ; (.*?))? \\$")
_HASH = re.compile(r"^ +--hash=sha256:([0-9a-f]{64})")
# A field `License` longer than this is the licence's text, not its name.
_NAME = 60
# Of packages whose metadata does not say, or that are installed on some machines only.
_TOLD = {
    "accessible-pygments": "BSD-3-Clause",
    "alabaster": "BSD-3-Clause",
    "babel": "BSD-3-Clause",
    "beautifulsoup4": "MIT",
    "colorama": "BSD-3-Clause",
    "conda-inject": "MIT",
    "cvxopt": "GPL-3.0-or-later",
    "furo": "MIT",
    "imagesize": "MIT",
    "mdit-py-plugins": "MIT",
    "myst-parser": "MIT",
    "pandas": "BSD-3-Clause",
    "pyobjc-core": "MIT",
    "pyobjc-framework-cocoa": "MIT",
    "pyreadline3": "BSD-3-Clause",
    "roman-numerals": "0BSD OR CC0-1.0",
    "snakemake-executor-plugin-slurm": "MIT",
    "snakemake-executor-plugin-slurm-jobstep": "MIT",
    "snakemake-interface-common": "MIT",
    "snakemake-interface-logger-plugins": "MIT",
    "snakemake-interface-report-plugins": "MIT",
    "snakemake-interface-scheduler-plugins": "MIT",
    "snakemake-interface-storage-plugins": "MIT",
    "snowballstemmer": "BSD-3-Clause",
    "soupsieve": "MIT",
    "sphinx": "BSD-2-Clause",
    "sphinx-basic-ng": "MIT",
    "sphinxcontrib-applehelp": "BSD-2-Clause",
    "sphinxcontrib-devhelp": "BSD-2-Clause",
    "sphinxcontrib-htmlhelp": "BSD-2-Clause",
    "sphinxcontrib-jsmath": "BSD-2-Clause",
    "sphinxcontrib-qthelp": "BSD-2-Clause",
    "sphinxcontrib-serializinghtml": "BSD-2-Clause",
    "uv": "MIT OR Apache-2.0",
}
UNKNOWN = "NOASSERTION"


def bill() -> dict[str, Any]:
    """The bill as CycloneDX 1.5: one component for each package and version that is locked."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    found: dict[tuple[str, str], dict[str, Any]] = {}
    for lock in sorted(ROOT.glob("requirements*.txt")):
        for name, version, marker, hashes in locked(lock):
            component = found.setdefault((name, version), _component(name, version))
            known = {entry["content"] for entry in component["hashes"]}
            component["hashes"] += [
                {"alg": "SHA-256", "content": h} for h in hashes if h not in known
            ]
            told = lock.name + (f" ; {marker}" if marker else "")
            component["properties"].append({"name": "locked in", "value": told})
    return {
        "bomFormat": "CycloneDX",
        "specVersion": "1.5",
        "version": 1,
        "metadata": {
            "component": {
                "type": "application",
                "name": project["name"],
                "version": project["version"],
                "licenses": [{"expression": project["license"]}],
            }
        },
        "components": [found[key] for key in sorted(found)],
    }


def locked(lock: Path) -> list[tuple[str, str, str, list[str]]]:
    """The packages of a lock file: name, version, marker, hashes."""
    found: list[tuple[str, str, str, list[str]]] = []
    for line in lock.read_text(encoding="utf-8").splitlines():
        if pin := _PIN.match(line):
            found.append((pin[1], pin[2], pin[3] or "", []))
        elif digest := _HASH.match(line):
            found[-1][3].append(digest[1])
    return found


def licence(name: str) -> str:
    """A package's licence, by its metadata or as told above."""
    if name in _TOLD:
        return _TOLD[name]
    try:
        about = metadata(name)
    except PackageNotFoundError:
        return UNKNOWN
    fields = [*(about.get_all("License-Expression") or ()), *(about.get_all("License") or ()), ""]
    given = fields[0]
    if given and len(given) <= _NAME and "\n" not in given:
        return given
    classes = [c for c in about.get_all("Classifier") or [] if c.startswith("License ::")]
    return ", ".join(c.split(" :: ")[-1] for c in classes) or given.split("\n")[0] or UNKNOWN


def _component(name: str, version: str) -> dict[str, Any]:
    return {
        "type": "library",
        "name": name,
        "version": version,
        "purl": f"pkg:pypi/{name}@{version}",
        "licenses": [{"license": {"name": licence(name)}}],
        "hashes": [],
        "properties": [],
    }


def main(path: str) -> None:
    """Write the bill and print each package with its licence."""
    content = bill()
    target = Path(path)
    target.parent.mkdir(parents=True, exist_ok=True)
    target.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
    for component in content["components"]:
        name = f"{component['name']} {component['version']}"
        print(f"{name:<52}{component['licenses'][0]['license']['name']}")
    print(f"{len(content['components'])} packages: {target}")


if __name__ == "__main__":
    main(*sys.argv[1:])
