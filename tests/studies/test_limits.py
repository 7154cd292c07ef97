"""Order, limit and band: exact sequences derived by hand, and small cases with known answers."""

import re
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from solver.case.file import HALVINGS_TEXT
from solver.case.reader import load_case
from solver.commands.cli import main
from solver.studies.converge import convergence
from solver.studies.figures.limits import extrapolate, limits, observed_order, outcome, settled
from solver.studies.quantities import known_peak

CASES = Path(__file__).resolve().parents[2] / "cases"
HALVED = (4.0, 2.0, 1.0)


@pytest.mark.parametrize("sizes", [HALVED, (3.0, 2.0, 1.0), (1.0, 0.5, 0.2)])
@pytest.mark.parametrize("order", [0.5, 1.0, 1.7, 2.0])
@pytest.mark.parametrize("c", [2.0, -0.03])
def test_a_power_law_gives_its_order_and_its_limit(sizes, order, c):
    values = [7.0 + c * h**order for h in sizes]
    found = extrapolate(sizes, values, theory=order)
    assert found.kind == "monotone"
    assert found.order == pytest.approx(order, abs=1e-9)
    assert found.value == pytest.approx(7.0, abs=1e-9)
    # The finest value is c h^p away from the limit.
    assert found.band == pytest.approx(1.25 * abs(c) * sizes[-1] ** order, rel=1e-8)


def test_an_order_above_that_of_theory_is_not_used():
    # 1 + h³: changes 56 and 7, order 3. With order 2 the rest is 7 / (4 - 1), three times that.
    found = extrapolate(HALVED, [65.0, 9.0, 2.0], theory=2.0)
    assert (found.order, found.used, found.factor) == (3.0, 2.0, 3.0)
    assert found.band == pytest.approx(7.0)
    assert found.value == pytest.approx(2.0 - 7.0 / 3.0)
    # Up to a tenth above it is credible: 2.1 of at most 2.
    near = extrapolate(HALVED, [h**2.1 for h in HALVED], theory=2.0)
    assert (near.factor, near.used) == (1.25, 2.0)


@pytest.mark.parametrize(
    ("order", "factor"), [(1.79, 3.0), (1.81, 1.25), (2.19, 1.25), (2.21, 3.0)]
)
def test_an_order_is_credible_within_a_tenth_of_theory(order, factor):
    assert extrapolate(HALVED, [h**order for h in HALVED], theory=2.0).factor == factor


def test_a_low_order_has_the_larger_factor():
    # 1 + h^¼ on sizes 256, 16, 1.
    found = extrapolate([256.0, 16.0, 1.0], [5.0, 3.0, 2.0], theory=2.0)
    assert (found.order, found.factor) == (0.25, 3.0)
    assert (found.value, found.band) == (pytest.approx(1.0), pytest.approx(3.0))


def test_with_four_meshes_each_three_neighbours_must_be_credible():
    # Changes 8, 4, 2: order 1 throughout. Changes 40, 4, 2: log2(10) on the coarser meshes.
    sizes = [8.0, *HALVED]
    assert extrapolate(sizes, [14.0, 6.0, 2.0, 0.0], theory=1.0).factor == 1.25
    doubtful = extrapolate(sizes, [46.0, 6.0, 2.0, 0.0], theory=1.0)
    assert (doubtful.order, doubtful.factor, doubtful.value) == (1.0, 3.0, -2.0)
    assert extrapolate(sizes, [2.0, 6.0, 2.0, 0.0], theory=1.0).factor == 3.0


@pytest.mark.parametrize(
    ("values", "kind"),
    [
        ([1.0, 3.0, 2.0], "oscillatory"),
        ([1.0, 2.0, 4.0], "divergent"),  # order -1
        ([1.0, 2.0, 3.0], "divergent"),  # order 0, like a logarithm
        ([3.0, 2.0, 1.05], "divergent"),  # order log2(1 / 0.95) = 0.07
        ([1.0, 2.0, 2.0], "stalled"),
    ],
)
def test_what_does_not_converge_monotonically_has_no_band(values, kind):
    found = extrapolate(HALVED, values, theory=2.0)
    assert (found.kind, found.value, found.band) == (kind, None, None)


def test_orders_of_values_that_run_away():
    assert observed_order(HALVED, [1.0, 2.0, 4.0]) == -1.0
    assert observed_order(HALVED, [1.0, 2.0, 3.0]) == pytest.approx(0.0, abs=1e-9)
    assert observed_order(HALVED, [1.0, 3.0, 2.0]) is None


def test_values_that_do_not_depend_on_the_mesh():
    found = extrapolate(HALVED, [5.0, 5.0 + 1e-14, 5.0], theory=2.0)
    assert (found.kind, found.value, found.band) == ("exact", 5.0, pytest.approx(5e-11))
    # A force that vanishes is rounding compared with the forces of the faces.
    assert extrapolate(HALVED, [1e-13, 3e-13, 1e-13], 2.0, scale=1.0).kind == "exact"
    assert extrapolate(HALVED, [1e-13, 3e-13, 1e-13], 2.0).kind == "oscillatory"


def test_an_exact_value_that_follows_the_mesh_is_unknown():
    # The computed value changes by 1 between the last two meshes, so that 0.1 is allowed.
    def known(*exact):
        pairs = zip((10.0, 12.0, 13.0), exact, strict=True)
        return settled([{"value": value, "known": one, "scale": 0.0} for value, one in pairs])

    assert known(9.0, 11.0, 11.05) == 11.05
    assert known(9.0, 11.0, 11.2) is None
    assert known(11.0, None, 11.0) is None


def test_the_peak_in_the_tip_of_a_wedge_is_infinite():
    case = load_case(CASES / "half-planes" / "wedge-tria6.yaml")
    exact = case.reference.exact
    # Four faces of the length 1/2 on both sides of the tip, each a macro-element.
    points = np.stack([np.linspace(-1, 1, 5), np.zeros(5)], axis=1)
    faces = np.array([[0, 1], [1, 2], [2, 3], [3, 4]])
    zone = SimpleNamespace(name="interface", faces=[("SEG2", faces, np.arange(4))])
    solution = SimpleNamespace(case=case, mesh=SimpleNamespace(points=points))
    assert exact.contact_pressure(points).max() > 5 * exact.contact_pressure(points[1:2])
    assert known_peak(solution, zone) is None


def test_the_band_has_the_exact_value():
    # Linear cells: functionals of the solution have order 2, the largest constant pressure order 1.
    _, [group] = convergence([CASES / "manufactured" / "quad4.yaml"], (1, 2, 4))
    found = {one.name: one for one in limits(group.points)}
    assert found["contact force"].found.order == pytest.approx(2.0, abs=0.02)
    assert found["strain energy"].found.order == pytest.approx(2.0, abs=0.2)
    assert found["peak pressure"].found.order == pytest.approx(1.0, abs=0.1)
    # The pressure 1/100 + (x - 1/2)²/20 is 9/400 at most, its integral over [0, 1] is 17/1200.
    assert found["peak pressure"].known == pytest.approx(9 / 400)
    assert found["contact force"].known == pytest.approx(17 / 1200)
    assert found["contact area"].found.kind == "exact"
    text = outcome(list(found.values()))
    assert text.startswith("3 of 3 bands have the exact value; 2 of 2 that do not depend")


def test_an_exact_reference_is_known(capsys):
    assert main(["converge", str(CASES / "ssnp170" / "a.yaml"), "--levels", "1", "2", "3"]) == 0
    text = capsys.readouterr().out
    assert text.count("does not depend on the mesh") == 5
    # The reference is a pressure of 25.
    assert text.endswith("\n1 of 1 that do not depend on the mesh are exact.\n")


def test_a_mesh_file_is_halved_and_nothing_else(capsys):
    case = str(CASES / "rigid" / "lines-of-the-mesh.yaml")
    assert main(["converge", case]) == 0
    assert capsys.readouterr().out.count("does not depend on the mesh") == 8
    assert main(["converge", case, "--levels", "1", "2", "3"]) == 2
    said = capsys.readouterr().err
    assert said == f"{case}: --refine = 3: of a mesh file must be {HALVINGS_TEXT}\n"


def test_meshes_without_a_solution_are_named_with_their_reason(tmp_path, capsys):
    pulled = (CASES / "ssnp170" / "a.yaml").read_text().replace("pressure: 25", "pressure: -25")
    (tmp_path / "a.yaml").write_text(pulled)
    assert main(["converge", str(tmp_path / "a.yaml")]) == 3
    *lost, end = capsys.readouterr().out.splitlines()
    assert end == "No exact value is known."
    for level, line in zip((1, 2, 4), lost, strict=True):
        assert line.startswith(f"case-0/a/{level}: failed: nothing keeps ")


@pytest.mark.parametrize("levels", [["1", "2"], ["4", "2", "1"]])
def test_levels_are_three_and_rise(levels, capsys):
    assert main(["converge", str(CASES / "ssnp170" / "a.yaml"), "--levels", *levels]) == 2
    said = capsys.readouterr().err
    assert "must be three or more, each finer" in said
    assert said.count("\n") == 1


def test_the_command_and_the_table_of_the_page(tmp_path, monkeypatch, capsys):
    text = (CASES.parent / "docs" / "studies.md").read_text()
    command = re.search(r"-m solver (converge .*)", text).group(1).split()
    monkeypatch.chdir(tmp_path)
    (tmp_path / "cases").symlink_to(CASES)
    assert main(command) == 0
    printed = capsys.readouterr().out
    (shown,) = re.findall(r"```\n(manufactured.*?)```", text, re.DOTALL)
    assert set(shown.splitlines()) <= set(printed.splitlines())
    # A chart for each quantity that changes: peak pressure, contact force, strain energy.
    page = (tmp_path / "results/report/converge.html").read_text()
    assert page.count("<div class=chart ") == 3
