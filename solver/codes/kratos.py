"""Kratos Multiphysics: mesh and settings of a case, and what its run writes.

Contact is its augmented Lagrangian mortar method without friction (`ALMContactFrictionless`; V.
Mataix Ferrándiz, Innovative mathematical and numerical models for studying the deformation of
shells during industrial forming processes with the finite element method, UPC 2020, chapter 4).
"""

import json
import shutil
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..lac.errors import SolveError
from ..system.process import printed_by
from .deck import Deck, UnsupportedError, refuse_rings
from .foreign import Field, ForeignResult

# Its own environment, beside the program's.
PYTHON = Path(__file__).resolve().parents[2] / ".venv-kratos/bin/python"
ELEMENTS = {
    "TRIA3": "SmallDisplacementElement2D3N",
    "QUAD4": "SmallDisplacementElement2D4N",
    "TETRA4": "SmallDisplacementElement3D4N",
    "PENTA6": "SmallDisplacementElement3D6N",
    "HEXA8": "SmallDisplacementElement3D8N",
}
_FACES = {
    "SEG2": "LineCondition2D2N",
    "TRIA3": "SurfaceCondition3D3N",
    "QUAD4": "SurfaceCondition3D4N",
}
_VERSION = "import importlib.metadata as m; print(m.version('KratosMultiphysics'))"


class Kratos:
    """Write, run and read; see `solver.codes.run`."""

    name = "kratos"
    layer = False
    install = "make code-environment CODE=kratos"
    gave_up = r"ATTENTION: max iterations \( [^)]*\) exceeded!"

    settings: Mapping[str, str] = {
        "contact": "ALMContactFrictionless, penalty and scale chosen by Kratos",
        "search": "active_check_factor 1",
        "elements": "SmallDisplacementElement; geometry not updated",
    }

    def version(self) -> str:
        """The version; empty if it is not installed."""
        return printed_by(PYTHON, "-I", _VERSION)

    def write(self, deck: Deck, folder: Path) -> None:
        """Write mesh, settings and the script; UnsupportedError for what Kratos lacks."""
        _refuse(deck)
        text = "\n".join(_mesh_lines(deck)) + "\n"
        (folder / "mesh.mdpa").write_text(text, encoding="ascii")
        for name, content in (("ProjectParameters", _project(deck)), ("Materials", _laws(deck))):
            text = json.dumps(content, indent=1) + "\n"
            (folder / f"{name}.json").write_text(text, encoding="ascii")
        shutil.copyfile(Path(__file__).with_name("kratos_main.py"), folder / "main.py")

    def command(self, folder: Path) -> Sequence[str]:  # noqa: ARG002 -- the same for all codes
        """The command to run in `folder`."""
        return [str(PYTHON), "main.py"]

    def read(self, deck: Deck, folder: Path) -> ForeignResult:
        """The fields at the end; SolveError without a result."""
        try:
            found = json.loads((folder / "result.json").read_text(encoding="ascii"))
        except (OSError, ValueError):
            raise SolveError("Kratos: it wrote no result") from None
        displacement, stress, pressure = (
            np.array(found[name]) for name in ("displacement", "stress", "pressure")
        )
        dim = deck.points.shape[1]
        # xx, yy, xy in 2D; xx, yy, zz, xy, yz, xz in 3D.
        values = deck.of_plane_strain(stress[:, 1:]) if dim == 2 else stress[:, 1:]
        return ForeignResult(
            code=self.name,
            displacement=_field(deck, displacement, displacement[:, 1 : 1 + dim]),
            stress=_field(deck, stress, values),
            pressure=_field(deck, pressure, pressure[:, 1]),
            step=deck.case.factors[-1],
        )


def _field(deck: Deck, rows: np.ndarray, values: np.ndarray) -> Field:
    """Values at the nodes whose numbers are the first column of rows."""
    nodes = rows[:, 0].astype(int) - 1
    return Field(places=deck.points[nodes], values=values, nodes=nodes)


def _refuse(deck: Deck) -> None:
    refuse_rings(deck, "Kratos")
    for name in deck.cells:
        if name not in ELEMENTS:
            reason = (
                "no such element" if name == "PYRA5" else "no mortar contact on quadratic faces"
            )
            raise UnsupportedError(f"{name}: Kratos has {reason}")
    if deck.oblique:
        raise UnsupportedError("supports across the axes: not written for Kratos")
    for pair in deck.pairs:
        if pair.gap is not None or pair.zone.interference:
            raise UnsupportedError("an initial gap other than as meshed: not in Kratos")


def _mesh_lines(deck: Deck) -> Iterator[str]:
    used = np.unique(np.concatenate(list(deck.material.values()))).tolist()
    for number in [0, *(m + 1 for m in used)]:
        yield from (f"Begin Properties {number}", "End Properties")
    yield "Begin Nodes"
    for number, place in enumerate(np.pad(deck.points, ((0, 0), (0, 3)))[:, :3].tolist(), start=1):
        yield f"{number} " + " ".join(f"{x:.16e}" for x in place)
    yield "End Nodes"
    members: dict[int, list[int]] = {number: [] for number in used}
    for name, cells in deck.cells.items():
        yield f"Begin Elements {ELEMENTS[name]}"
        numbers = deck.starts[name] + np.arange(len(cells))
        rows = np.column_stack([numbers, deck.material[name] + 1, cells + 1])
        yield from _rows(rows)
        yield "End Elements"
        for material in used:
            members[material] += numbers[deck.material[name] == material].tolist()
    surfaces, number = [], 1
    for pair in deck.pairs:
        for side in (pair.slave, pair.master):
            first = number
            for block in side:
                yield f"Begin Conditions {_FACES[block.type.name]}"
                count = number + np.arange(len(block.nodes))
                yield from _rows(np.column_stack([count, np.zeros_like(count), block.nodes + 1]))
                yield "End Conditions"
                number += len(block.nodes)
            nodes = np.unique(np.concatenate([block.nodes.ravel() for block in side]))
            surfaces.append((nodes, range(first, number)))
    yield from _loads(deck, number)
    yield from _values("DISPLACEMENT", deck.fixed(), "1")
    for material in used:
        yield from _part(
            f"body_{material}", np.arange(len(deck.points)), elements=members[material]
        )
    for i in range(len(deck.pairs)):
        (slave, below), (master, above) = surfaces[2 * i : 2 * i + 2]
        both = np.union1d(slave, master)
        yield from _part(f"contact_{i}", both, conditions=[*below, *above])
        yield from _part(f"slave_{i}", slave, conditions=list(below))
    loaded = np.flatnonzero(deck.all_forces.any(axis=1))
    yield from _part("loaded", loaded, conditions=list(range(number, number + len(loaded))))


def _loads(deck: Deck, first: int) -> Iterator[str]:
    """All loads as forces on nodes."""
    forces = deck.all_forces
    nodes = np.flatnonzero(forces.any(axis=1))
    yield f"Begin Conditions PointLoadCondition{deck.points.shape[1]}D1N"
    yield from _rows(
        np.column_stack([first + np.arange(len(nodes)), np.zeros_like(nodes), nodes + 1])
    )
    yield "End Conditions"
    rows = [
        (int(node), axis, float(forces[node, axis]))
        for node in nodes
        for axis in range(forces.shape[1])
        if forces[node, axis]
    ]
    yield from _values("POINT_LOAD", rows, "0")


def _values(name: str, rows: Any, fixed: str) -> Iterator[str]:
    """Values of nodes by component; `fixed` 1 where they are held."""
    rows = list(rows)
    for axis, letter in enumerate("XYZ"):
        mine = [(node, value) for node, a, value in rows if a == axis]
        if mine:
            yield f"Begin NodalData {name}_{letter}"
            yield from (f"{node + 1} {fixed} {value:.16e}" for node, value in mine)
            yield "End NodalData"


def _part(
    name: str, nodes: np.ndarray, elements: Sequence[int] = (), conditions: Sequence[int] = ()
) -> Iterator[str]:
    yield f"Begin SubModelPart {name}"
    for kind, numbers in (
        ("Nodes", (nodes + 1).tolist()),
        ("Elements", elements),
        ("Conditions", conditions),
    ):
        yield f"Begin SubModelPart{kind}"
        yield from map(str, numbers)
        yield f"End SubModelPart{kind}"
    yield "End SubModelPart"


def _rows(table: np.ndarray) -> Iterator[str]:
    yield from (" ".join(map(str, row)) for row in table.tolist())


def _laws(deck: Deck) -> dict[str, Any]:
    dim = deck.points.shape[1]
    law = "LinearElasticPlaneStrain2DLaw" if dim == 2 else "LinearElastic3DLaw"
    used = np.unique(np.concatenate(list(deck.material.values()))).tolist()
    return {
        "properties": [
            {
                "model_part_name": f"Structure.body_{number}",
                "properties_id": number + 1,
                "Material": {
                    "constitutive_law": {"name": law},
                    "Variables": {
                        "DENSITY": 0.0,
                        "THICKNESS": 1.0,
                        "YOUNG_MODULUS": deck.materials[number].young,
                        "POISSON_RATIO": deck.materials[number].poisson,
                    },
                    "Tables": {},
                },
            }
            for number in used
        ]
    }


def _project(deck: Deck) -> dict[str, Any]:
    zones = range(len(deck.pairs))
    contact = {
        "python_module": "alm_contact_process",
        "kratos_module": "KratosMultiphysics.ContactStructuralMechanicsApplication",
        "Parameters": {
            "model_part_name": "Structure",
            "contact_model_part": {str(i): [f"contact_{i}"] for i in zones},
            "assume_master_slave": {str(i): [f"slave_{i}"] for i in zones},
            "contact_type": "Frictionless",
            # Faces nearer than their size are in contact at first; by default 1 % of it, and the
            # few pairs of a sphere that touches at a point remain the only ones.
            "search_parameters": {"active_check_factor": 1.0},
        },
    }
    return {
        "problem_data": {
            "problem_name": "mesh",
            "parallel_type": "OpenMP",
            "start_time": 0.0,
            "end_time": 1.0,
            "echo_level": 0,
        },
        "solver_settings": {
            "model_part_name": "Structure",
            "domain_size": deck.points.shape[1],
            "echo_level": 0,
            "solver_type": "Static",
            "analysis_type": "non_linear",
            "model_import_settings": {"input_type": "mdpa", "input_filename": "mesh"},
            "material_import_settings": {"materials_filename": "Materials.json"},
            "contact_settings": {"mortar_type": "ALMContactFrictionless"},
            # Linear theory.
            "move_mesh_flag": False,
            "time_stepping": {"time_step": 1.1},
            "convergence_criterion": "contact_residual_criterion",
            "residual_relative_tolerance": 1e-9,
            "residual_absolute_tolerance": 1e-12,
            "max_iteration": 50,
            "linear_solver_settings": {"solver_type": "LinearSolversApplication.sparse_lu"},
        },
        "processes": {
            "contact_process_list": [contact] if deck.pairs else [],
        },
        "output_processes": {},
    }
