"""Runs Kratos on `deck.json` of this folder, and writes what it finds as `result.json`.

Kratos starts this file in its own environment: it imports nothing of this program. Contact is its
augmented Lagrangian mortar method without friction (`ALMContactFrictionless`; V. Mataix Ferrándiz,
Innovative mathematical and numerical models for studying the deformation of shells during
industrial forming processes with the finite element method, UPC 2020, chapter 4).
"""

import json
from itertools import chain
from pathlib import Path

ELEMENTS = {
    "TRIA3": "SmallDisplacementElement2D3N",
    "QUAD4": "SmallDisplacementElement2D4N",
    "TETRA4": "SmallDisplacementElement3D4N",
    "PENTA6": "SmallDisplacementElement3D6N",
    "HEXA8": "SmallDisplacementElement3D8N",
}
FACES = {
    "SEG2": "LineCondition2D2N",
    "TRIA3": "SurfaceCondition3D3N",
    "QUAD4": "SurfaceCondition3D4N",
}
SIDES = ("slave", "master")


def mesh_lines(deck):
    """The lines of the file `mesh.mdpa`: numbers of nodes, elements and conditions begin at 1."""
    materials, dim = used(deck), len(deck["points"][0])
    for number in [0, *(m + 1 for m in materials)]:
        yield from block(f"Properties {number}", [])
    places = ([*point, 0.0][:3] for point in deck["points"])
    rows = ([i, *(f"{x:.16e}" for x in place)] for i, place in enumerate(places, start=1))
    yield from block("Nodes", rows)
    members, count = {material: [] for material in materials}, 0
    for name, cells in deck["cells"].items():
        rows = []
        for nodes, material in zip(cells, deck["material"][name]):  # noqa: B905
            count += 1
            rows.append([count, material + 1, *(n + 1 for n in nodes)])
            members[material].append(count)
        yield from block(f"Elements {ELEMENTS[name]}", rows)
    count, sides = 0, []
    for pair in deck["contact"]:
        for side in SIDES:
            first = count + 1
            for name, faces in pair[side].items():
                rows = [[count + i, 0, *(n + 1 for n in f)] for i, f in enumerate(faces, start=1)]
                yield from block(f"Conditions {FACES[name]}", rows)
                count += len(faces)
            nodes = {n for faces in pair[side].values() for n in chain(*faces)}
            sides.append((nodes, range(first, count + 1)))
    loaded = sorted({node for node, *_ in deck["forces"]})
    numbers = range(count + 1, count + 1 + len(loaded))
    rows = [[number, 0, node + 1] for number, node in zip(numbers, loaded)]  # noqa: B905
    yield from block(f"Conditions PointLoadCondition{dim}D1N", rows)
    yield from values("POINT_LOAD", deck["forces"], "0")
    yield from values("DISPLACEMENT", deck["held"], "1")
    for material in materials:
        yield from part(f"body_{material}", range(len(deck["points"])), members[material], [])
    for i in range(len(deck["contact"])):
        (slave, below), (master, above) = sides[2 * i : 2 * i + 2]
        yield from part(f"contact_{i}", slave | master, [], [*below, *above])
        yield from part(f"slave_{i}", slave, [], below)
    yield from part("loaded", loaded, [], numbers)


def used(deck):
    """The numbers of the materials that occur."""
    return sorted(set(chain(*deck["material"].values())))


def block(title, rows):
    """The lines of a block."""
    yield f"Begin {title}"
    yield from (" ".join(map(str, row)) for row in rows)
    yield f"End {title.split()[0]}"


def values(name, rows, fixed):
    """Values of nodes by component; `fixed` 1 where they are held."""
    for axis, letter in enumerate("XYZ"):
        mine = [[node + 1, fixed, f"{value:.16e}"] for node, a, value in rows if a == axis]
        if mine:
            yield from block(f"NodalData {name}_{letter}", mine)


def part(name, nodes, elements, conditions):
    """A named part of the model."""
    members = {"Nodes": [n + 1 for n in sorted(nodes)], "Elements": elements}
    yield f"Begin SubModelPart {name}"
    for kind, numbers in (members | {"Conditions": conditions}).items():
        yield from block(f"SubModelPart{kind}", ([number] for number in numbers))
    yield "End SubModelPart"


def laws(deck):
    """The materials."""
    law = "LinearElasticPlaneStrain2DLaw" if len(deck["points"][0]) == 2 else "LinearElastic3DLaw"
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
                        "YOUNG_MODULUS": deck["materials"][number]["young"],
                        "POISSON_RATIO": deck["materials"][number]["poisson"],
                    },
                    "Tables": {},
                },
            }
            for number in used(deck)
        ]
    }


def project(deck):
    """The settings of the solve."""
    zones = range(len(deck["contact"]))
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
            "domain_size": len(deck["points"][0]),
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
            "contact_process_list": [contact] if deck["contact"] else [],
        },
        "output_processes": {},
    }


def main():
    """Solve, and write displacement and stress at all nodes, pressure at slave nodes."""
    import KratosMultiphysics as Kratos
    import KratosMultiphysics.ContactStructuralMechanicsApplication as Contact
    from KratosMultiphysics.StructuralMechanicsApplication import structural_mechanics_analysis

    deck = json.loads(Path("deck.json").read_text(encoding="ascii"))
    Path("mesh.mdpa").write_text("\n".join(mesh_lines(deck)) + "\n", encoding="ascii")
    Path("Materials.json").write_text(json.dumps(laws(deck)), encoding="ascii")
    parameters = Kratos.Parameters(json.dumps(project(deck)))
    model = Kratos.Model()
    analysis = structural_mechanics_analysis.StructuralMechanicsAnalysis(model, parameters)
    analysis.Run()
    part = model["Structure"]
    wanted = {"list_of_variables": ["CAUCHY_STRESS_VECTOR"], "extrapolate_non_historical": True}
    extrapolation = Kratos.IntegrationValuesExtrapolationToNodesProcess(
        part, Kratos.Parameters(json.dumps(wanted))
    )
    extrapolation.ExecuteBeforeSolutionLoop()
    extrapolation.ExecuteFinalizeSolutionStep()
    scale = part.ProcessInfo[Kratos.SCALE_FACTOR]
    pressure = Contact.LAGRANGE_MULTIPLIER_CONTACT_PRESSURE
    stress = Kratos.CAUCHY_STRESS_VECTOR
    found = {
        "displacement": [
            [node.Id - 1, *node.GetSolutionStepValue(Kratos.DISPLACEMENT)] for node in part.Nodes
        ],
        "stress": [[node.Id - 1, *node.GetValue(stress)] for node in part.Nodes],
        "pressure": [
            [node.Id - 1, -scale * node.GetSolutionStepValue(pressure)]
            for node in part.Nodes
            if node.Is(Kratos.SLAVE)
        ],
    }
    Path("result.json").write_text(json.dumps(found), encoding="utf-8")


if __name__ == "__main__":
    main()
