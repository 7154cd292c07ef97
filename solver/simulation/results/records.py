"""What a solution holds beside its fields and zones: numbers of one kind in one record.

A verdict holds `Cost` and `Validity` too.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from typing import Any, Self

import numpy as np

from .forces import ProbeResult


@dataclass
class Validity:
    """How far a solve is from what it takes for granted, the largest of all load steps.

    `strain` (principal) and `rotation` (radians), in the middle of the cells; `slip` of closed
    contact, a mean over the macro-element, by its size; `pushed_past`: how many cells are inside
    another body; `partly_covered`: how many closed macro-elements are under the master's end;
    `unpaired`: the largest share of one, closed or bare, opposite the master but in no segment;
    `facets`, `facet_depth`: what facets of curved surfaces do in the last step, as the share of the
    pressure that they change and their depth by the elastic closing of the contact.
    """

    strain: float = float("nan")
    rotation: float = float("nan")
    slip: float = float("nan")
    pushed_past: int = 0
    partly_covered: int = 0
    unpaired: float = 0.0
    facets: float = 0.0
    facet_depth: float = 0.0

    @classmethod
    def worst(cls, found: Sequence[Self]) -> Self:
        """The largest of each, of one or more.

        >>> Validity.worst([Validity(strain=0.1, slip=0.5), Validity(strain=0.2, slip=0.4)]).slip
        0.5
        """
        return cls(**{f.name: max(getattr(one, f.name) for one in found) for f in fields(cls)})


@dataclass
class Cost:
    """What a solve cost; None where that is unknown, as of other codes.

    `matrix_entries`: those of the stiffness on the free unknowns, both halves; `iterations` of the
    search for the status, in all steps; `linear_iterations` the most that one solution of the
    linear system took, 0 by a factor alone. `seconds` and `stage_cpu_seconds` are wall and
    processor time by stage, `peak_memory_mb` the process's largest resident size.
    """

    dofs: int | None = None
    macro_elements: int | None = None
    iterations: int | None = None
    linear_solver: str | None = None
    linear_iterations: int | None = None
    matrix_entries: int | None = None
    seconds: dict[str, float] = field(default_factory=dict)
    stage_cpu_seconds: dict[str, float] = field(default_factory=dict)
    cpu_seconds: float | None = None
    peak_memory_mb: float | None = None

    @classmethod
    def in_all(cls, seconds: float | None, **more: Any) -> Self:
        """That of another code, of which no stages are known."""
        return cls(seconds={} if seconds is None else {"total": seconds}, **more)


@dataclass
class Scalars:
    """Single numbers of a solution.

    `length` is the largest extent of the mesh, `load_scale` the largest pressure of the load or
    else the largest stress, `strain_energy` that of the last load factor.
    """

    length: float
    load_scale: float
    strain_energy: float | None = None


def largest_of(found: Sequence[dict[str, float]]) -> dict[str, float]:
    """The largest value of each name.

    >>> largest_of([{"force": 0.1, "moment": 0.3}, {"force": 0.2}])
    {'force': 0.2, 'moment': 0.3}
    """
    names = dict.fromkeys(name for one in found for name in one)
    return {name: max(one.get(name, 0.0) for one in found) for name in names}


@dataclass
class Quality:
    """How good a solution is, by itself and where its case names an exact one.

    `balance` names relative imbalances (of forces and moments, relative to the load); `accuracy`
    are the relative errors that rounding alone may cause, by cause (see `equilibrium.state`), both
    the largest of all steps; `errors` the norms of `solver.verification.norms`. `validity`: see
    there.
    """

    balance: dict[str, float] = field(default_factory=dict)
    accuracy: dict[str, float] = field(default_factory=dict)
    errors: dict[str, float] = field(default_factory=dict)
    validity: Validity = field(default_factory=Validity)


@dataclass
class Fields:
    """Fields beside displacement and stress.

    `body` (n,) of each node; `normal_stress` (n,) is d·σ·d with d the mean slave normal of the
    first zone; `reaction` (n, dim) the forces at nodes with which supports, rigid bodies, springs
    and ties hold the bodies, of the last load factor. `by_cell` holds what parts have solved for in
    cells, by type: of the mixed form the stress s at their nodes (n_cells, n_nodes), NaN in other
    cells (see `solver.mechanics.fem.mixed`). `motion` (n, dim) of bodies that may move far, which
    the mesh of the solution has made.
    """

    body: np.ndarray
    normal_stress: np.ndarray
    reaction: np.ndarray | None = None
    by_cell: dict[str, np.ndarray] = field(default_factory=dict)
    motion: np.ndarray | None = None


@dataclass
class Places:
    """What the case names: `probes` by name; `acted`, nodes by the key of the support, or load."""

    probes: dict[str, ProbeResult] = field(default_factory=dict)
    acted: dict[str, np.ndarray] = field(default_factory=dict)
