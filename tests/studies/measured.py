"""Studies of a few lines, and groups with records made by hand."""

from dataclasses import replace
from pathlib import Path

import yaml

from solver.case.typed import read_as
from solver.studies.description import Study, read_study
from solver.studies.page import MeasuredGroup
from solver.studies.points import points_of
from solver.studies.run import identity

CASES = Path(__file__).resolve().parents[2] / "cases"
STABILITY, INFSUP = CASES / "studies/stability.yaml", CASES / "studies/infsup.yaml"
WORK, SCALING = CASES / "studies/study.yaml", CASES / "studies/scaling.yaml"
OURS = sorted([*CASES.glob("*/orders.yaml"), *CASES.glob("studies/*.yaml")])


def study(text: str, folder: Path = CASES / "manufactured") -> Study:
    """The study in a text, as of a file in `folder`."""
    return read_as(Study, yaml.safe_load(text), folder / "study.yaml")


def group(of: Study, record, number: int = 0) -> MeasuredGroup:
    """A group whose points have what `record` says of each of them."""
    member = of.groups[number]
    found = []
    for point in points_of(of, member):
        known = {"outcome": "solved", "reason": ""} | record(point)
        found.append(identity(point) | known)
    machine = {"time_utc": "2026-01-01T00:00", "cpu": "a processor", "revision": "r"}
    return MeasuredGroup(of, member, found, machine)


def point(file: Path, name: str, series: str = "", level: str = "full", **values):
    """A point of a group of one of our studies, with other numbers where `values` has them."""
    of = read_study(file, level)
    found = next(p for p in points_of(of, of.group(name)) if p.series.name.startswith(series))
    return replace(found, numbers={**found.numbers, **values})
