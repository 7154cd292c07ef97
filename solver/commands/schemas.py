"""The JSON Schemas of typed files, written from the types: `python -m solver.commands.schemas`.

An editor that knows the schema of a file offers its keys and marks what does not fit.
"""

import json
from importlib import import_module
from pathlib import Path

from solver.case.typed import json_schema
from solver.system.files import write_text

FOLDER = Path(__file__).parents[1] / "case" / "schemas"
TYPES = {
    "benchmark": "solver.studies.benchmark.description:BenchmarkFile",
    "family": "solver.report.families:FamilyFile",
    "infsup": "solver.studies.infsup.description:InfSupFile",
    "ladders": "solver.studies.orders.description:LaddersFile",
    "scaling": "solver.studies.scaling.description:ScalingFile",
    "study": "solver.studies.work_precision.description:StudyFile",
    "sweep": "solver.studies.stability.sweeps:SweepFile",
}


def schema_text(name: str) -> str:
    """The JSON Schema of a kind of file, as written to disk."""
    module, kind = TYPES[name].split(":")
    return json.dumps(json_schema(getattr(import_module(module), kind)), indent=2) + "\n"


if __name__ == "__main__":
    for name in TYPES:
        write_text(FOLDER / f"{name}.schema.json", schema_text(name))
