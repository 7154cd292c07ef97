"""The JSON Schemas of typed files, written from the types: `python -m solver.commands.schemas`.

An editor that knows the schema of a file offers its keys and marks what does not fit.
"""

import json
from importlib import import_module
from pathlib import Path

from ..case.typed import Section, json_schema
from ..mesh.keys import RECIPES, MeshFileKeys
from ..system.files import write_text

FOLDER = Path(__file__).parents[1] / "case" / "schemas"
TYPES = {
    "case": "..case.file:CaseFile",
    "code": "..codes.run:PluginFile",
    "family": "..report.families:FamilyFile",
    "map": "..codes.files.map:ResultMap",
    "recorded": "..codes.recorded:RecordedFile",
    "study": "..studies.description:Study",
}


def schema_text(name: str) -> str:
    """The JSON Schema of a kind of file, as written to disk."""
    module, kind = TYPES[name].split(":")
    meshes: list[type[Section]] = [MeshFileKeys, *RECIPES.values()]
    parts = {"mesh": meshes} if name == "case" else {}
    schema = json_schema(getattr(import_module(module, __package__), kind), **parts)
    return json.dumps(schema, indent=2) + "\n"


if __name__ == "__main__":
    for name in TYPES:
        write_text(FOLDER / f"{name}.schema.json", schema_text(name))
