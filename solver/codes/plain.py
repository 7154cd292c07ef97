"""The evaluated case as one JSON file, `deck.json`: for codes whose format is not written here.

Nodes count from 0, axes are 0, 1, 2. `points`: coordinates; `cells`: nodes by type, in the order of
VTK; `material`: by type, the place of each cell's material in `materials`; `held`: [node, axis,
displacement]; `oblique`: [node, direction, displacement along it]; `forces`: [node, axis, force],
all loads; `start`: displacements (n, dim) that close open bodies which contact alone holds;
`contact`: pairs with the nodes of slave and master faces by type, turned outward, and the initial
gap as [node, gap] (null: as meshed, less `interference`). `face_size`: of a slave face, a length.
`flat`: whether the two surfaces of each pair are flat, and parallel.

A code may answer with `result.json`: `displacement`, `stress` and `pressure`, each rows of a node
and its values. Stress is xx, yy, zz, xy, yz, xz, or in plane strain xx, yy, xy.
"""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..lac.cells.faces import FaceBlock
from ..lac.errors import SolveError
from .deck import Deck, PairedFaces, UnsupportedError, face_size, refuse_rings
from .foreign import Field, ForeignResult

FILE, RESULT = "deck.json", "result.json"


class Plain:
    """Only written: a code of the user reads it."""

    name = "plain"
    layer = False
    follows = False
    install = "only written, by export"
    gave_up = ""
    settings: Mapping[str, str] = {}

    def version(self) -> str:
        """There is nothing to run."""
        return ""

    def write(self, deck: Deck, folder: Path) -> None:
        """Write `deck.json`; UnsupportedError for friction and axisymmetric bodies."""
        refuse_rings(deck, "deck.json")
        if deck.case.frictional:
            raise UnsupportedError("friction: not written for deck.json")
        text = json.dumps(content(deck))
        (folder / FILE).write_text(text, encoding="ascii")

    def command(self, folder: Path) -> Sequence[str]:  # noqa: ARG002
        """There is nothing to run."""
        return []

    def read(self, deck: Deck, folder: Path) -> ForeignResult:
        """The fields in `result.json`; SolveError without one."""
        try:
            found = json.loads((folder / RESULT).read_text(encoding="ascii"))
        except (OSError, ValueError):
            raise SolveError(f"it wrote no {RESULT}") from None
        fields = {name: _by_node(deck, name, np.array(rows)) for name, rows in found.items()}
        return ForeignResult(
            code=self.name,
            displacement=fields.get("displacement"),
            stress=fields.get("stress"),
            pressure=fields.get("pressure"),
            step=deck.case.factors[-1],
        )


def content(deck: Deck) -> dict[str, Any]:
    """The content of the file."""
    nodes, axes = np.nonzero(deck.all_forces)
    forces = deck.all_forces[nodes, axes]
    return {
        "name": deck.case.name,
        "face_size": face_size(deck),
        "flat": deck.flat,
        "points": deck.points.tolist(),
        "cells": {name: cells.tolist() for name, cells in deck.cells.items()},
        "materials": [{"young": m.young, "poisson": m.poisson} for m in deck.materials],
        "material": {name: of.tolist() for name, of in deck.material.items()},
        "held": list(deck.fixed()),
        "oblique": [(of.node, of.direction.tolist(), of.value) for of in deck.oblique],
        "start": deck.start.tolist(),
        "forces": list(zip(nodes.tolist(), axes.tolist(), forces.tolist(), strict=True)),
        "contact": [
            {
                "name": pair.zone.name,
                "slave": _faces(pair.slave),
                "master": _faces(pair.master),
                "gap": _gap(pair),
                "interference": pair.zone.interference if pair.gap is None else 0.0,
            }
            for pair in deck.pairs
        ],
    }


def _by_node(deck: Deck, name: str, rows: np.ndarray) -> Field:
    nodes, values = rows[:, 0].astype(int), rows[:, 1:]
    if name == "pressure":
        values = values[:, 0]
    elif name == "displacement":
        values = values[:, : deck.points.shape[1]]
    elif values.shape[1] == 3:
        values = deck.of_plane_strain(values, nodes)
    return Field(places=deck.points[nodes], values=values, nodes=nodes)


def _gap(pair: PairedFaces) -> list[tuple[int, float]] | None:
    if pair.gap is None:
        return None
    nodes = np.flatnonzero(~np.isnan(pair.gap))
    return list(zip(nodes.tolist(), pair.gap[nodes].tolist(), strict=True))


def _faces(blocks: Sequence[FaceBlock]) -> dict[str, list[list[int]]]:
    found: dict[str, list[list[int]]] = {}
    for block in blocks:
        found.setdefault(block.type.name, []).extend(block.nodes.tolist())
    return found
