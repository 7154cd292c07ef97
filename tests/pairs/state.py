"""The exact state of a row of options: bodies, their displacement and stress.

Bodies are blocks: *lower* below z = 0, *upper* above, and *cap* above z = 1 where there is a second
zone. All deform as u = A x + b, so stress is uniform in each. On plane interfaces with normal n,
A = a nᵀ: nothing stretches along them, and bodies of any stiffness fit. On others A = −e I and
stress is hydrostatic; a body of another material, or beside a rigid one, fits by initial strain.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from .options import BARE, KINKS, LINEAR, POINTS, RIGID, SHAPED, Row

YOUNG, POISSON, PRESSURE, MU, SLIDE, GAP, STRAIN = 2000.0, 0.3, 25.0, 0.4, 0.004, 0.002, 1e-3
# How deep meshes lie in one another where a clearance says how far the bodies are apart.
OVERLAP = 0.3
AXES = "xyz"


@dataclass
class Body:
    """A block: u = gradient · x + shift, its stress (3, 3), of which a plane case has a part."""

    name: str
    cells: str
    low: float
    divisions: int
    young: float
    poisson: float
    gradient: np.ndarray
    shift: np.ndarray
    strain: np.ndarray
    stress: np.ndarray
    rigid: bool = False


@dataclass
class Placed:
    """x' = scale · turn · x + origin."""

    turn: np.ndarray
    origin: np.ndarray
    scale: float = 1.0

    def vector(self, v: np.ndarray) -> list[float]:
        """A direction, turned."""
        return [float(x) for x in self.turn @ v]

    def point(self, x: np.ndarray) -> list[float]:
        """A place, moved."""
        return [float(v) for v in self.scale * self.turn @ x + self.origin]

    def affine(self, direction: np.ndarray, gradient: np.ndarray, shift: np.ndarray) -> str:
        """direction · u as an expression in the new coordinates, u = gradient · x + shift."""
        slope = self.turn @ gradient.T @ direction
        constant = self.scale * float(direction @ shift) - float(slope @ self.origin)
        terms = [f"{s!r}*{a}" for s, a in zip(map(float, slope), AXES, strict=False) if s]
        return " + ".join([repr(constant), *terms])


class States:
    """Where the bodies of a row are, and their states."""

    def __init__(self, row: Row) -> None:
        self.row = row
        self.dim = 3 if row["space"] == "solid" else 2
        self.axisymmetric = row["space"] == "axisymmetric"
        self.start = 1.0 if self.axisymmetric else 0.0  # of x
        self.unit = 1e-3 if row["form"] == "other units" else 1.0
        self.normal = self._up()
        if row["interface"] == "tilted":
            self.normal = self._up() - 0.2 * np.eye(self.dim)[0]
            self.normal /= np.linalg.norm(self.normal)
        self.along = np.eye(self.dim)[0]
        self.along = self.along - self.normal * (self.along @ self.normal)
        self.along /= np.linalg.norm(self.along)
        turn, origin = np.eye(self.dim), np.zeros(self.dim)
        if row["form"] == "rotated":
            c, s = np.cos(0.5), np.sin(0.5)
            turn[:2, :2] = [[c, -s], [s, c]]
            if self.dim == 3:
                turn = turn @ np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
        if row["form"] == "mirrored":
            turn[0, 0] = -1.0
        if row["form"] == "far":
            origin[:] = [0.0, 100.0] if self.axisymmetric else 100.0
        self.placed = Placed(turn, origin, 1e-6 if row["form"] == "other units" else 1.0)
        self.second = row["second zone"] != "none"
        self.bodies = list(self._states())

    def _up(self) -> np.ndarray:
        return np.eye(self.dim)[-1]

    def _moduli(self, young: float, poisson: float) -> tuple[float, float]:
        """λ and G for strains in the plane; in plane stress λ of the plane."""
        shear = young / (2 * (1 + poisson))
        lame = young * poisson / ((1 + poisson) * (1 - 2 * poisson))
        if self.row["space"] == "stress":
            lame = 2 * lame * shear / (lame + 2 * shear)
        return lame, shear

    def _stress(self, young: float, poisson: float, strain: np.ndarray) -> np.ndarray:
        lame, shear = self._moduli(young, poisson)
        return lame * np.trace(strain) * np.eye(len(strain)) + 2 * shear * strain

    def _strain(self, young: float, poisson: float, stress: np.ndarray) -> np.ndarray:
        lame, shear = self._moduli(young, poisson)
        share = lame / (len(stress) * lame + 2 * shear)
        return (stress - share * np.trace(stress) * np.eye(len(stress))) / (2 * shear)

    def _full(self, gradient: np.ndarray) -> np.ndarray:
        """The strain: with that around the axis where there is one."""
        strain = (gradient + gradient.T) / 2
        if self.axisymmetric:
            strain = np.pad(strain, ((0, 1), (0, 1)))
            strain[2, 2] = gradient[0, 0]
        return strain

    @property
    def pressure(self) -> float:
        """Where bodies are followed, so small that none moves by a tenth of a face."""
        return 0.4 * PRESSURE if self.row["motion"] == "large" else PRESSURE

    @property
    def shear(self) -> float:
        """The traction of friction along the interface, over the pressure, on the lower body."""
        return {"stick": 0.5 * MU, "slip": MU, "slip back": -MU}.get(self.row["friction"], 0.0)

    @property
    def factor(self) -> float:
        """What is left of the state in the last step."""
        return (
            0.0 if self.row["steps"] == "unloaded" and self.row["friction"] != "slip back" else 1.0
        )

    @property
    def apart(self) -> np.ndarray:
        """How far the upper bodies are meshed from where they touch."""
        far = {"meshed": GAP, "open": 2 * GAP, "clearance, overlap": -OVERLAP}
        return far.get(self.row["gap"], 0.0) * self.normal

    @property
    def open(self) -> bool:
        """Whether the first zone stays open by `GAP`; loads keep the stress of both bodies."""
        return self.row["gap"] == "open"

    @property
    def moved(self) -> np.ndarray:
        """How far the master moves at the interface: it slides, and closes the gap."""
        slide = {"slip": SLIDE, "slip back": -SLIDE}.get(self.row["friction"], 0.0)
        gap = {"none": 0.0, "clearance 0": 0.0, "interference": -GAP}.get(self.row["gap"], GAP)
        return slide * self.along - gap * self.normal

    @property
    def sizes(self) -> tuple[int, int]:
        """The divisions of slave and master."""
        row = self.row
        if (row["interface"] in SHAPED and not self._quadratic()) or row["treatment"] in POINTS:
            return 2, 2
        most = 4 if row["interface"] in KINKS else 3
        return {"coarser": (most, 2), "as fine": (2, 2), "finer": (2, most)}[row["master size"]]

    def _states(self) -> Iterator[Body]:
        row = self.row
        poisson = 0.4999 if row["materials"] == "nearly incompressible" else POISSON
        stiff = 1e6 if row["materials"] == "stiff master" else 1.0
        if row["interface"] in SHAPED:  # an initial strain of the same stress loses its digits
            stiff = min(stiff, 1e4)
        rigid, sizes, rest = row["master"] in RIGID, self.sizes, np.zeros(self.dim)
        yield self._body("lower", -1.0, sizes[0], 1.0, poisson, rest, False, not rigid)
        if row["master"] in BARE:
            return
        upper = self._body("upper", 0.0, sizes[1], stiff, poisson, self.moved, rigid, True)
        upper.shift = upper.shift - upper.gradient @ self.apart
        yield upper
        if self.second:  # continuous with the body below
            cap = self._body("cap", 1.0, 3, stiff, poisson, rest, False, not rigid)
            at = self._up() + self.apart
            cap.shift = upper.shift + (upper.gradient - cap.gradient) @ at
            yield cap

    def _quadratic(self) -> bool:
        return not {self.row["slave cells"], self.row["master cells"]} & set(LINEAR)

    def _body(
        self,
        name: str,
        low: float,
        divisions: int,
        stiff: float,
        poisson: float,
        shift: np.ndarray,
        rigid: bool,
        deforms: bool,
    ) -> Body:
        """`deforms`: a body beside a rigid one on a shaped interface keeps its shape."""
        young, row = YOUNG * stiff * self.unit, self.row
        lame, shear = self._moduli(young, poisson)
        pressure, size = self.pressure * self.unit, self.dim + self.axisymmetric
        strain = np.zeros((size, size))
        cells = row["master cells"] if name == "upper" else row["slave cells"]
        if row["also"] in ("strain", "temperature"):
            strain = STRAIN * np.eye(size)
            if row["space"] == "strain" and row["also"] == "temperature":
                strain = (1 + poisson) * strain  # what it does across the plane
        if row["interface"] in SHAPED:
            stress = -pressure * np.eye(size)
            first = self._strain(YOUNG * self.unit, poisson, stress)
            gradient = (
                (first + strain)[: self.dim, : self.dim] if deforms else np.zeros((self.dim,) * 2)
            )
            strain = self._full(gradient) - self._strain(young, poisson, stress)
        else:
            shear_now = self.shear if name != "cap" or row["master"] == "meshed" else 0.0
            a = (
                -pressure * self.normal / (lame + 2 * shear)
                + shear_now * pressure / shear * self.along
            )
            gradient = np.outer(a, self.normal)
            # the strain is free along the normal
            free = self._stress(young, poisson, strain)[: self.dim, : self.dim]
            pressed = self.normal @ free @ self.normal
            gradient += np.outer(self.normal, self.normal) * pressed / (lame + 2 * shear)
            stress = self._stress(young, poisson, self._full(gradient) - strain)
        if rigid:
            gradient = np.zeros_like(gradient)
        return Body(
            name, cells, low, divisions, young, poisson, gradient, shift, strain, stress, rigid
        )
