"""code_aster: mesh (MED) and command files of a case, for version 15 or later. Only written here.

`lac.comm` uses the LAC method, `continue.comm` the standard continuous formulation (documentation
U4.44.11 for DEFI_CONTACT, U4.23.02 for CREA_MAILLAGE). Both write `result.med`.
"""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

import meshio
import numpy as np

from ..lac.cells.catalogue import BY_NAME
from ..lac.cells.faces import FaceBlock
from ..mesh.files import med
from .deck import Deck, UnsupportedError
from .plain import Plain

_MESH = "mesh.med"
# The largest number of different values of imposed displacements that are written.
_VALUES = 12


class CodeAster(Plain):
    """Only written: no package contains code_aster."""

    name = "code_aster"
    install = "in no package: export its input, run it, then check-result"
    settings: Mapping[str, str] = {"contact": "LAC, or continuous formulation"}

    def write(self, deck: Deck, folder: Path) -> None:
        """Write the mesh and both command files; UnsupportedError for what is not written."""
        _refuse(deck)
        held = _held(deck)
        write_med(deck, held, folder / _MESH)
        for name, lac in (("lac", True), ("continue", False)):
            (folder / f"{name}.comm").write_text(_commands(deck, held, lac), encoding="ascii")

    def command(self, folder: Path) -> Sequence[str]:  # noqa: ARG002
        """The command to run, with `mesh.med` as unit 20 and `result.med` as unit 80."""
        return ["run_aster", "lac.comm"]


Held = list[tuple[int, float, np.ndarray]]


def _refuse(deck: Deck) -> None:
    if deck.case.frictional:
        raise UnsupportedError("friction: code_aster has none with the LAC method")
    if deck.forces.any():
        raise UnsupportedError("loads other than constant pressures: not written for code_aster")
    for pair in deck.pairs:
        if pair.gap is not None or pair.zone.interference:
            raise UnsupportedError(
                "an initial gap other than as meshed: not written for code_aster"
            )


def _held(deck: Deck) -> Held:
    """Axis, value and nodes of each imposed displacement."""
    found: Held = []
    for axis in range(deck.points.shape[1]):
        given = deck.held[:, axis]
        values = np.unique(given[~np.isnan(given)]).tolist()
        if len(values) > _VALUES:
            raise UnsupportedError(
                "imposed displacements that vary from node to node: not written for code_aster"
            )
        found += [(axis, value, np.flatnonzero(given == value)) for value in values]
    return found


def _surfaces(deck: Deck) -> list[tuple[str, Sequence[FaceBlock]]]:
    """The groups of faces by name."""
    pairs = enumerate(deck.pairs)
    sides = [(f"{side}_{i}", getattr(pair, side)) for i, pair in pairs for side in SIDES]
    return sides + [(f"press_{i}", faces) for i, (faces, _) in enumerate(deck.pressures)]


SIDES = ("slave", "master")


def write_med(deck: Deck, held: Held, path: Path) -> None:
    """Write the mesh with its groups: bodies by material, surfaces, held nodes."""
    blocks: list[tuple[str, np.ndarray]] = []
    members: list[dict[str, np.ndarray]] = []
    for name, data in deck.cells.items():
        blocks.append((BY_NAME[name].meshio, data))
        of = deck.material[name]
        members.append({f"body_{n}": np.flatnonzero(of == n) for n in np.unique(of).tolist()})
    for group, faces in _surfaces(deck):
        for face in faces:
            blocks.append((face.type.meshio, face.nodes))
            members.append({group: np.arange(len(face.nodes))})
    none = np.arange(0)
    names = dict.fromkeys(name for groups in members for name in groups)
    nodes = {f"held_{i}": nodes for i, (_, _, nodes) in enumerate(held)}
    nodes |= {f"across_{of.node}": np.array([of.node]) for of in deck.oblique}
    sets = {name: [groups.get(name, none) for groups in members] for name in names}
    med.write(meshio.Mesh(deck.points, blocks, cell_sets=sets, point_sets=nodes), path)


def _commands(deck: Deck, held: Held, lac: bool) -> str:
    count = range(len(deck.pairs))
    materials = np.unique(np.concatenate(list(deck.material.values()))).tolist()
    of = deck.materials
    fixed = [
        f"_F(GROUP_NO='held_{i}', D{'XYZ'[axis]}={value!r})"
        for i, (axis, value, _) in enumerate(held)
    ]
    across = [
        f"_F(GROUP_NO={_tuple([repr(f'across_{of.node}')] * len(of.terms))}, "
        f"DDL={_tuple(repr('D' + 'XYZ'[axis]) for axis, _ in of.terms)}, "
        f"COEF_MULT={_tuple(repr(factor) for _, factor in of.terms)}, COEF_IMPO={of.value!r})"
        for of in deck.oblique
    ]
    pressed = [
        f"_F(GROUP_MA='press_{i}', PRES={value!r})" for i, (_, value) in enumerate(deck.pressures)
    ]
    laws = [f"_F(E={of[n].young!r}, NU={of[n].poisson!r})" for n in materials]
    algorithm = "ALGO_CONT='LAC'" if lac else "ALGO_CONT='STANDARD', COEF_CONT=100.0"
    sides = [f"GROUP_MA_ESCL='slave_{i}', GROUP_MA_MAIT='master_{i}'" for i in count]
    cut = f"DECOUPE_LAC=_F(GROUP_MA_ESCL={_tuple(repr(f'slave_{i}') for i in count)})"
    return _COMMANDS.format(
        cut=f"mesh = CREA_MAILLAGE(MAILLAGE=mesh, {cut})\n" if lac else "",
        surfaces=_tuple(repr(name) for name, _ in _surfaces(deck)),
        kind="AXIS" if deck.case.axisymmetric else "D_PLAN" if len(deck.points[0]) == 2 else "3D",
        laws="\n".join(
            f"mat_{n} = DEFI_MATERIAU(ELAS={law})" for n, law in zip(materials, laws, strict=True)
        ),
        bodies=_tuple(f"_F(GROUP_MA='body_{n}', MATER=mat_{n})" for n in materials),
        loads=", ".join(
            f"{key}={_tuple(parts)}"
            for key, parts in (("DDL_IMPO", fixed), ("LIAISON_DDL", across), ("PRES_REP", pressed))
            if parts
        ),
        zones=_tuple(f"_F({side}, {algorithm})" for side in sides),
    )


def _tuple(parts: Iterable[str]) -> str:
    return f"({', '.join(parts)},)"


_COMMANDS = """\
DEBUT(LANG='EN')
mesh = LIRE_MAILLAGE(FORMAT='MED', UNITE=20)
{cut}mesh = MODI_MAILLAGE(reuse=mesh, MAILLAGE=mesh, ORIE_PEAU=_F(GROUP_MA_PEAU={surfaces}))
model = AFFE_MODELE(
    MAILLAGE=mesh, AFFE=_F(TOUT='OUI', PHENOMENE='MECANIQUE', MODELISATION='{kind}')
)
{laws}
material = AFFE_MATERIAU(MAILLAGE=mesh, AFFE={bodies})
load = AFFE_CHAR_MECA(MODELE=model, {loads})
contact = DEFI_CONTACT(
    MODELE=model,
    FORMULATION='CONTINUE',
    ALGO_RESO_GEOM='NEWTON',
    ALGO_RESO_CONT='NEWTON',
    ZONE={zones},
)
times = DEFI_LIST_REEL(DEBUT=0.0, INTERVALLE=_F(JUSQU_A=1.0, NOMBRE=1))
ramp = DEFI_FONCTION(NOM_PARA='INST', VALE=(0.0, 0.0, 1.0, 1.0))
found = STAT_NON_LINE(
    MODELE=model,
    CHAM_MATER=material,
    CONTACT=contact,
    EXCIT=_F(CHARGE=load, FONC_MULT=ramp),
    INCREMENT=_F(LIST_INST=times),
    COMPORTEMENT=_F(RELATION='ELAS'),
    NEWTON=_F(REAC_ITER=1),
    CONVERGENCE=_F(RESI_GLOB_RELA=1e-10, ITER_GLOB_MAXI=50),
)
found = CALC_CHAMP(reuse=found, RESULTAT=found, CONTRAINTE='SIEF_NOEU')
IMPR_RESU(FORMAT='MED', UNITE=80, RESU=_F(RESULTAT=found, INST=1.0))
FIN()
"""
