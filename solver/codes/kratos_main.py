"""Runs Kratos on the input of this folder, and writes what it finds as `result.json`.

Kratos starts this file in its own environment: it imports nothing of this program.
"""

import json
from pathlib import Path

import KratosMultiphysics as Kratos
import KratosMultiphysics.ContactStructuralMechanicsApplication as Contact
from KratosMultiphysics.StructuralMechanicsApplication import structural_mechanics_analysis


def main() -> None:
    """Solve, and write displacement and stress at all nodes, pressure at slave nodes."""
    parameters = Kratos.Parameters(Path("ProjectParameters.json").read_text(encoding="utf-8"))
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
            [node.Id, *node.GetSolutionStepValue(Kratos.DISPLACEMENT)] for node in part.Nodes
        ],
        "stress": [[node.Id, *node.GetValue(stress)] for node in part.Nodes],
        "pressure": [
            [node.Id, -scale * node.GetSolutionStepValue(pressure)]
            for node in part.Nodes
            if node.Is(Kratos.SLAVE)
        ],
    }
    Path("result.json").write_text(json.dumps(found), encoding="utf-8")


if __name__ == "__main__":
    main()
