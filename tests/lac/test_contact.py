"""LAC on scikit-fem's meshes: exact on every pair, equal to the batch, refused in one line."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import skfem
from skfem.models.elasticity import lame_parameters, linear_elasticity

from solver.lac import LocalAverageContact
from solver.lac.cells.catalogue import BY_NAME
from solver.lac.facets import facets
from solver.lac.operator import gap_operator
from tests.lac.blocks import FORM, PAIRS, basis_on, block, pressed

ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.parametrize(
    ("dim", "slave", "master"), PAIRS, ids=lambda v: getattr(v, "__name__", str(v))
)
def test_the_patch_test_is_exact_on_every_pair(dim, slave, master):
    lower, upper = block(master, dim, 2, 0.0), block(slave, dim, 3, 25.0)
    contact = LocalAverageContact(slave=(upper, "bottom"), master=(lower, "top"))
    state, a, b = pressed(contact, lower, dim)
    assert state.pressure == pytest.approx(np.full(len(contact.area), 25.0), rel=1e-12)
    assert state.iterations == 1
    # Uniaxial stress; plane strain in 2D.
    across = 25.0 * 0.3 / 2000.0 * (1.3 if dim == 2 else 1)
    down = 25.0 / 2000.0 * (1 - 0.09 if dim == 2 else 1)
    for basis, first in ((a, 0), (b, a.N)):
        u = state.u[first : first + basis.N]
        for axis in range(dim):
            dofs = basis.get_dofs(elements=True).all([f"u^{axis + 1}"])
            slope = -down if axis == dim - 1 else across
            exact = slope * basis.doflocs[axis, dofs]
            assert u[dofs] == pytest.approx(exact, abs=1e-12 * 50)


def test_b_is_that_of_the_batch_bit_for_bit():
    lower, upper = block(skfem.MeshTri1, 2, 2, 0.0), block(skfem.MeshTri1, 2, 3, 25.0)
    contact = LocalAverageContact(slave=(upper, "bottom"), master=(lower, "top"))
    n = contact.mesh.p.shape[1]
    points = np.hstack([contact.mesh.p, lower.p]).T

    def edges(mesh, name, first, owner):
        nodes = mesh.facets[:, mesh.boundaries[name]].T.copy()
        turned = mesh.p[0, nodes[:, 0]] > mesh.p[0, nodes[:, 1]]
        if name == "top":  # outward: the lower body is on the left of its edges
            turned = ~turned
        nodes[turned] = nodes[turned][:, ::-1]
        return facets(points, BY_NAME["SEG2"], nodes + first, owner)

    middle = contact.mesh.p[0, contact.mesh.facets[:, contact.mesh.boundaries["bottom"]]].mean(
        axis=0
    )
    whole = upper.p[0, upper.facets[:, upper.boundaries["bottom"]]]
    owner = ((whole.min(axis=0) < middle[:, None]) & (middle[:, None] < whole.max(axis=0))).argmax(
        1
    )
    slaves = [edges(contact.mesh, "bottom", 0, owner)]
    masters = [edges(lower, "top", n, np.arange(2))]
    found = gap_operator(slaves, masters, 3, len(points))
    a, b = basis_on(contact.mesh), basis_on(lower)
    unknowns = np.hstack([a.nodal_dofs, a.N + b.nodal_dofs]).T.ravel()
    assert (contact.matrix(a, b)[:, unknowns] != found.matrix).nnz == 0


def test_both_bodies_on_one_mesh():
    lower, upper = block(skfem.MeshQuad1, 2, 2, 0.0), block(skfem.MeshQuad1, 2, 3, 25.0)
    n = lower.p.shape[1]
    mesh = skfem.MeshQuad(np.hstack([lower.p, upper.p]), np.hstack([lower.t, n + upper.t]))
    outside = mesh.boundary_facets()
    middle = mesh.p[:, mesh.facets[:, outside]].mean(axis=1)
    cell = mesh.f2t[0, outside]
    level = np.isclose(middle[1], 25.0)
    mesh = mesh.with_boundaries(
        {
            "under": outside[level & (cell < lower.nelements)],
            "over": outside[level & (cell >= lower.nelements)],
            "left": outside[np.isclose(middle[0], 0)],
            "base": outside[np.isclose(middle[1], 0)],
            "press": outside[np.isclose(middle[1], 50)],
        }
    )
    contact = LocalAverageContact(slave=(mesh, "over"), master=(mesh, "under"))
    basis = basis_on(contact.mesh)
    push = skfem.LinearForm(lambda v, w: -25.0 * v[1])
    f = push.assemble(basis.boundary("press"))
    held = basis.get_dofs("left").all("u^1"), basis.get_dofs("base").all("u^2")
    B = contact.matrix(basis, basis)
    state = contact.solve(FORM.assemble(basis), f, B, D=np.concatenate(held))
    assert state.pressure == pytest.approx([25.0] * 3, rel=1e-12)


def test_mirrored_and_renumbered_cells_change_nothing():
    upper = block(skfem.MeshTet1, 3, 3, 25.0)
    order = np.random.default_rng(1).permutation(upper.p.shape[1])
    points = upper.p[:, np.argsort(order)]
    turned = skfem.MeshTet(points, order[upper.t][[1, 0, 2, 3]], sort_t=False)
    turned = turned.with_boundaries(
        {name: (lambda x, n=name: _of(n, x)) for name in ("bottom", "top", "side0", "side1")}
    )
    lower = block(skfem.MeshHex1, 3, 2, 0.0)
    contact = LocalAverageContact(slave=(turned, "bottom"), master=(lower, "top"))
    state, *_ = pressed(contact, lower, 3)
    assert state.pressure == pytest.approx(np.full(18, 25.0), rel=1e-12)


def _of(name, x):
    axis, value = {"bottom": (2, 25), "top": (2, 50), "side0": (0, 0), "side1": (1, 0)}[name]
    return np.isclose(x[axis], value)


def test_contact_opens_and_carries_the_load():
    lower, upper = block(skfem.MeshQuad1, 2, 8, 0.0), block(skfem.MeshQuad1, 2, 12, 25.0)
    contact = LocalAverageContact(slave=(upper, "bottom"), master=(lower, "top"))
    state, *_ = pressed(contact, lower, 2, lambda x: 100.0 * (x[0] < 12.5))
    assert 0 < state.closed.sum() < 12
    assert (state.pressure >= 0).all()
    assert (state.gap >= 0).all()
    assert not (state.pressure * state.gap).any()
    assert state.pressure @ contact.covered == pytest.approx(100.0 * 12.5, rel=1e-12)
    recovered = contact.recover(state, "linear").state
    assert recovered.pressure @ contact.covered == pytest.approx(100.0 * 12.5, rel=1e-12)
    assert (recovered.pressure >= 0).all()
    assert (recovered.gap >= 0).all()
    assert 0 < np.abs(recovered.pressure - state.pressure).max() < 0.2 * state.pressure.max()


def test_a_status_that_is_not_found_step_by_step_is_that_of_the_complementarity(monkeypatch):
    """Also where the last facet is covered by a third."""
    lower, upper = block(skfem.MeshQuad1, 2, 8, 0.0), block(skfem.MeshQuad1, 2, 12, 25.0)
    contact = LocalAverageContact(
        slave=(upper.translated((2.8, 0.0)), "bottom"), master=(lower, "top")
    )
    assert (contact.covered / contact.area)[[0, -1]] == pytest.approx([1.0, 0.328])
    state, *_ = pressed(contact, lower, 2, lambda x: 100.0 * (x[0] > 40))
    monkeypatch.setattr("solver.lac.status._Search.ended", True)
    other, *_ = pressed(contact, lower, 2, lambda x: 100.0 * (x[0] > 40))
    assert 1 < state.closed.sum() < 12
    assert (other.closed == state.closed).all()
    assert state.closed[-1]


def test_a_facet_that_is_hardly_covered_carries_nothing():
    """Of 0.6 % it would bear almost all that is pressed beyond the master."""
    lower, upper = block(skfem.MeshQuad1, 2, 4, 0.0), block(skfem.MeshQuad1, 2, 4, 25.0)
    for shift, closed in ((0.5, 4), (12.425, 3)):
        contact = LocalAverageContact((upper.translated((shift, 0.0)), "bottom"), (lower, "top"))
        state, *_ = pressed(contact, lower, 2)
        assert contact.covered[-1] / contact.area[-1] == pytest.approx(1 - shift / 12.5)
        assert state.closed.sum() == closed
        assert state.pressure.max() < 100


def test_a_given_gap_takes_the_place_of_the_meshed_one():
    lower, upper = block(skfem.MeshQuad1, 2, 2, 0.0), block(skfem.MeshQuad1, 2, 3, 25.0)
    both = (upper, "bottom"), (lower, "top")
    assert LocalAverageContact(*both, gap=0.3).initial == pytest.approx([5.0] * 3)
    linear = LocalAverageContact(*both, gap=lambda x: x[0] / 50)
    middle = upper.p[0, upper.facets[:, upper.boundaries["bottom"]]].mean(axis=0)
    assert linear.initial == pytest.approx(middle / 50 * 50 / 3)
    assert np.abs(LocalAverageContact(*both).initial).max() < 1e-12


def good():
    return block(skfem.MeshTri1, 2, 2, 0.0), block(skfem.MeshTri1, 2, 3, 25.0)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            lambda lo, up: ((up, "botom"), (lo, "top")),
            "no such boundary of the mesh; there are: bot",
        ),
        (lambda lo, up: ((up, "bottom"), (lo, "bottom")), "no facet of 'bottom' is opposite"),
        (lambda lo, up: ((up, "bottom"), (up, "bottom")), "must be another boundary"),
        (
            lambda lo, up: (
                (up.with_boundaries({"all": np.arange(up.nfacets)}), "all"),
                (lo, "top"),
            ),
            "have a cell on both sides",
        ),
        (
            lambda lo, up: ((up.with_boundaries({"no": np.array([], int)}), "no"), (lo, "top")),
            "no facet",
        ),
        (
            lambda lo, up: ((up, "bottom"), (block(skfem.MeshHex1, 3, 1, 0.0), "top")),
            "one dimension",
        ),
        (
            lambda lo, up: (
                (skfem.MeshWedge1().with_boundaries({"b": lambda x: x[2] == 0}), "b"),
                (block(skfem.MeshHex1, 3, 1, -25.0), "top"),
            ),
            "no LAC on this class; allowed: MeshTri1",
        ),
    ],
)
def test_what_is_refused(arguments, message):
    with pytest.raises(ValueError, match=message) as refusal:
        LocalAverageContact(*arguments(*good()))
    assert "\n" not in str(refusal.value)


def test_folded_cells_are_refused():
    lower, upper = good()
    points = upper.p.copy()
    points[:, upper.t[0, -1]] = points[:, upper.t[1, -1]]
    flat = type(upper)(points, upper.t).with_boundaries({"bottom": lambda x: x[1] == 25})
    with pytest.raises(ValueError, match="cells are flat or folded"):
        LocalAverageContact((flat, "bottom"), (lower, "top"))


@pytest.mark.parametrize(
    ("basis", "message"),
    [
        (
            lambda m: skfem.Basis(m, skfem.ElementVector(skfem.ElementTriP2())),
            "needs ElementVector",
        ),
        (lambda m: skfem.Basis(m, skfem.ElementTriP1()), "needs ElementVector"),
        (lambda m: basis_on(good()[1]), "the mesh after the cut"),
    ],
)
def test_a_basis_that_does_not_fit_is_refused(basis, message):
    lower, upper = good()
    contact = LocalAverageContact((upper, "bottom"), (lower, "top"))
    with pytest.raises(ValueError, match=message):
        contact.matrix(basis(contact.mesh), basis_on(lower))


def test_two_contacts_that_cut_one_mesh_are_refused():
    """The second cut makes the mesh of the first stale: its basis is on another mesh."""
    lower, upper = good()
    halves = {"left": lambda x: np.isclose(x[1], 25) & (x[0] < 17), "side": lambda x: x[0] == 0}
    upper = upper.with_boundaries(halves)
    first = LocalAverageContact((upper, "left"), (lower, "top"))
    second = LocalAverageContact((first.mesh, "bottom"), (lower, "top"))
    with pytest.raises(ValueError, match="the mesh after the cut"):
        first.matrix(basis_on(second.mesh), basis_on(lower))


def test_two_boundaries_of_a_slave_are_one_contact():
    lower, upper = good()
    parts = {
        "left": lambda x: np.isclose(x[1], 25) & (x[0] < 17),
        "right": lambda x: np.isclose(x[1], 25) & (x[0] > 17),
    }
    upper = upper.with_boundaries(parts)
    contact = LocalAverageContact((upper, ["right", "left"]), (lower, "top"))
    state, *_ = pressed(contact, lower, 2, lambda x: 100.0 * (x[0] < 17))
    whole = LocalAverageContact((upper, "bottom"), (lower, "top"))
    other, *_ = pressed(whole, lower, 2, lambda x: 100.0 * (x[0] < 17))
    order = [
        np.flatnonzero(upper.boundaries["bottom"] == f)[0]
        for f in np.concatenate([upper.boundaries["right"], upper.boundaries["left"]])
    ]
    assert state.pressure == pytest.approx(other.pressure[order], rel=1e-12)
    with pytest.raises(ValueError, match="the boundaries share facets"):
        LocalAverageContact((upper, ["left", "bottom"]), (lower, "top"))


@pytest.mark.parametrize(("normal", "share"), [("element", 1.0), ("master", 0.8), ("nodal", 1.0)])
def test_gaps_along_the_normal_asked_for(normal, share):
    """A master whose top falls by 3 in 4: vertical distances times 4 / 5 along its normal."""
    lower, upper = block(skfem.MeshQuad1, 2, 4, 0.0), block(skfem.MeshQuad1, 2, 3, 25.0)
    points = lower.p - np.outer([0, 1], lower.p[0] * 0.75)
    sloping = skfem.MeshQuad(points, lower.t).with_boundaries(lower.boundaries)
    contact = LocalAverageContact((upper, "bottom"), (sloping, "top"), normal=normal)
    middle = upper.p[0, upper.facets[:, upper.boundaries["bottom"]]].mean(axis=0)
    inner = middle < 30  # along the sloping normal the last facet looks past the master
    ratio = contact.initial / contact.covered
    assert ratio[inner] == pytest.approx(share * 0.75 * middle[inner], rel=1e-12)


@pytest.mark.parametrize(("form", "better"), [("linear", 10), ("quadratic", 50), ("automatic", 50)])
@pytest.mark.parametrize("kind", [skfem.MeshTri2, skfem.MeshQuad2])
def test_a_linear_pressure_is_recovered(kind, form, better):
    """With ν = 0: u = (b y² / 2 E, −p y / E), p = a + b x; constants are wrong at the ends."""
    a, b, young = 25.0, 0.4, 2000.0
    lower, upper = block(kind, 2, 8, 0.0), block(kind, 2, 12, 25.0)
    contact = LocalAverageContact((upper, "bottom"), (lower, "top"))
    bases = basis_on(contact.mesh), basis_on(lower)
    form_of_k = linear_elasticity(*lame_parameters(young, 0.0))
    K = skfem.bmat([[form_of_k.assemble(bases[0]), None], [None, form_of_k.assemble(bases[1])]])
    push = skfem.LinearForm(lambda v, w: -(a + b * w.x[0]) * v[1])
    f = np.concatenate([push.assemble(bases[0].boundary("top")), bases[1].zeros()])
    first = bases[0].N
    x, held = np.zeros(len(f)), [first + bases[1].get_dofs("bottom").all()]
    for basis, start in zip(bases, (0, first), strict=True):
        dofs = basis.get_dofs("side0").all("u^1")
        x[start + dofs] = b * basis.doflocs[1, dofs] ** 2 / (2 * young)
        held.append(start + dofs)
    state = contact.solve(K, f, contact.matrix(*bases), x=x, D=np.concatenate(held))
    recovered = contact.recover(state, form)
    facet = np.arange(len(contact.area))
    ends = upper.p[:, upper.facets[:, upper.boundaries["bottom"]]]
    for end in ends[:, 0], ends[:, 1]:
        exact = a + b * end[0]
        constant = np.abs(state.pressure - exact).max()
        assert np.abs(recovered.at(facet, end) - exact).max() < constant / better
    # The L2 norm of b (x − centre) on a facet of length g: b g √(g / 12).
    length = 50 / 12
    assert recovered.error == pytest.approx(np.full(12, b * length * np.sqrt(length / 12)), rel=0.1)


@pytest.mark.parametrize("form", ["linear", "smooth"])
def test_a_body_that_is_all_but_free_to_turn_is_not_recovered(form):
    """It stands on one row of facets: sweeps from rounded pressures turn it ever further."""
    lower = block(skfem.MeshHex1, 3, 4, 0.0)
    upper = block(skfem.MeshHex1, 3, 3, 25.0, rows=1)
    inner = (upper.p[0] > 0) & (upper.p[0] < 50)
    upper.p[0, inner] += np.random.default_rng(1).uniform(-0.2, 0.2, inner.sum())
    contact = LocalAverageContact((upper, "bottom"), (lower, "top"))
    state, *_ = pressed(contact, lower, 3, free=True)
    assert state.pressure == pytest.approx(np.full(3, 25.0), rel=1e-8)
    with pytest.raises(RuntimeError, match="status or pressure do not settle"):
        contact.recover(state, form)


def test_an_unknown_form_is_refused():
    lower, upper = good()
    contact = LocalAverageContact((upper, "bottom"), (lower, "top"))
    state, *_ = pressed(contact, lower, 2)
    with pytest.raises(ValueError, match="must be automatic, linear, quadratic, smooth"):
        contact.recover(state, "none")


def test_it_needs_nothing_else_of_the_program():
    """NumPy, SciPy and scikit-fem, whichever of its modules are used."""
    names = [
        f"solver.lac.{f.relative_to(ROOT / 'solver/lac').with_suffix('')}".replace("/", ".")
        for f in (ROOT / "solver" / "lac").rglob("*.py")
        if f.stem != "__init__"
    ]
    code = f"""if True:
        import sys
        from importlib import import_module
        for name in {names}:
            import_module(name)
        ours = {{n for n in sys.modules if n.startswith("solver.") and n.split(".")[1] != "lac"}}
        print(ours, {{"meshio", "gmsh", "h5py", "msgspec", "numba"}} & {{*sys.modules}})"""
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True)
    assert done.stdout.strip() == "set() set()", done.stderr
