"""Forces and other single results of a solve: reactions, rigid bodies, contact, probes."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from ...mechanics.mortar.edge import Edges


@dataclass
class Reaction:
    """What holds a group: `force` (dim,) on the bodies, `moment` (3,) about the origin.

    `group`: a group that supports hold, a rigid body, `axis` for the points on the axis, `springs`
    or `together`. The force along x on axisymmetric bodies is the sum of radial forces around the
    circle, which balances itself; they have no moment.
    """

    group: str
    force: np.ndarray
    moment: np.ndarray

    def __str__(self) -> str:
        force, moment = (", ".join(f"{x:.6g}" for x in v) for v in (self.force, self.moment))
        return f"force ({force}), moment ({moment})"


@dataclass
class RigidMotion:
    """A rigid body: its motion, and the contact force on it.

    `translation` (dim,) and `rotation` (3,) in radians at the reference `point` (dim,); `force`
    (dim,) of contact on the body and its `moment` (3,) about the point. Axisymmetric bodies turn by
    nothing and have no moment.
    """

    body: str
    point: np.ndarray
    translation: np.ndarray
    rotation: np.ndarray
    force: np.ndarray
    moment: np.ndarray

    def __str__(self) -> str:
        names = "point", "translation", "rotation", "force", "moment"
        shown = {name: ", ".join(f"{x:.6g}" for x in getattr(self, name)) for name in names}
        return (
            f"force ({shown['force']}), moment ({shown['moment']}) about ({shown['point']}), "
            f"moved by ({shown['translation']}), turned by ({shown['rotation']})"
        )


@dataclass
class Resultants:
    """The resultants of contact in a zone.

    `area` (3,): that of contact, and bounds below and above; `force` (dim,) on the slave and its
    `moment` (3,) about the origin of the coordinates; `edges`: where contact ends in 2D. In 3D the
    edge is known to one macro-element only: the area is that of the closed ones, its bounds those
    without their rim and with the open ones around it. `pressure` (2,): the smallest and the
    largest of the macro-elements. With friction: `friction`
    (dim,), its part of the force, and `stick` (3,), the area that sticks as that of contact.
    """

    area: np.ndarray
    force: np.ndarray
    moment: np.ndarray
    edges: Edges | None = None
    pressure: np.ndarray | None = None
    friction: np.ndarray | None = None
    stick: np.ndarray | None = None

    def __str__(self) -> str:
        area, *bounds = (f"{value:.5g}" for value in self.area)
        within = "" if {*bounds} == {area} else f" (between {' and '.join(bounds)})"
        force, moment = (", ".join(f"{x:.6g}" for x in v) for v in (self.force, self.moment))
        text = f"contact area {area}{within}, force ({force}) on the slave, "
        if self.friction is not None and self.stick is not None:
            friction = ", ".join(f"{x:.6g}" for x in self.friction)
            text += f"of which friction ({friction}), sticking area {self.stick[0]:.5g}, "
        text += f"moment ({moment})"
        if self.pressure is not None:
            low, high = (f"{value:.6g}" for value in self.pressure)
            text = f"pressure {low} to {high}, {text}"
        if self.edges is None or not len(self.edges.better):
            return text
        places = (
            f"({', '.join(f'{x:.5g}' for x in place)})" + ("" if better else " to one face only")
            for place, better in zip(self.edges.position, self.edges.better, strict=True)
        )
        return f"{text}, edge at {' and '.join(places)}"


@dataclass
class ProbeResult:
    """The values at the `place` (k, dim) of a probe: `displacement` (k, dim) and `stress` (k, 6).

    Or the contact `pressure` (k,). NaN where the probe asks for the other kind.
    """

    place: np.ndarray
    displacement: np.ndarray
    stress: np.ndarray
    pressure: np.ndarray

    def lines(self, most: int = 10) -> Iterator[str]:
        """Each place with its values, `most` of them at most."""
        for i, place in enumerate(self.place[:most]):
            given = (
                f"{name} ({', '.join(f'{x:.6g}' for x in np.atleast_1d(values[i]))})"
                for name, values in vars(self).items()
                if name != "place" and np.isfinite(values[i]).all()
            )
            yield f"at ({', '.join(f'{x:.5g}' for x in place)}): {', '.join(given)}"
        if len(self.place) > most:
            yield f"{len(self.place) - most} further places are in the result file"
