"""Values at points and nodes: fields that the cells reproduce are found to the last digit."""

from pathlib import Path

import numpy as np
import pytest

from solver.case.reader import parse_case
from solver.simulation.simulate import refusals_on, simulate
from solver.system.errors import InputError
from solver.verification.checks import run_checks
from solver.verification.results import read_result, write_result
from solver.verification.run import mesh_of
from tests.scenes import block_mesh, changed_case, moved
from tests.workflow.projects import ROOT

PROBES = """\
groups: {rim: {of: nodes, box: {low: [0, 1], high: [1, 1]}}}
probes:
  inside: {at: [0.3, -0.7]}
  both: {at: [0.4, 0], within: top}
  rim: {group: rim}
  middle: {at: [0.51, 0], zone: interface}
reference:
  kind: analytical
  displacement_at: {inside: [1.4625e-3, -3.4125e-3], rim: [4.875e-3*x, -0.02275]}
  stress_at: {inside: {yy: -25, xx: 0}, both: {zz: -7.5}}
  pressure_at: {middle: 25}
tolerance: 1.0e-11
"""


def solved(*changes, swapped=False):
    """The patch test: σ_yy = −25, u = (4.875e-3 x, −11.375e-3 (y + 1))."""
    case = changed_case(2, *changes, extra=PROBES).as_solved(swapped)
    return simulate(case, moved(block_mesh("QUAD8", "TRIA6", (3, 2)), 0.04))


@pytest.mark.parametrize("swapped", [False, True])
def test_probes_have_the_exact_values_also_stored(swapped, tmp_path):
    solution = solved(swapped=swapped)
    write_result(tmp_path / "r.vtkhdf", solution, [], {})
    for one in (solution, read_result(tmp_path / "r.vtkhdf").solution):
        found = {check.name: check for check in run_checks(one)}
        for name in ("displacement_at", "stress_at", "pressure_at"):
            assert found[name].passed
            assert found[name].error < 1e-12
        assert len(one.places.probes["rim"].place) > 4
        assert one.places.probes["both"].stress[0, 1] == pytest.approx(-25)
        assert np.isnan(one.places.probes["middle"].stress).all()
    (line,) = solution.places.probes["middle"].lines()
    assert line == "at (0.51, 0): pressure (25)"
    assert (
        "2 further places"
        in list(solution.places.probes["rim"].lines(len(solution.places.probes["rim"].place) - 2))[
            -1
        ]
    )


@pytest.mark.parametrize(
    ("name", "wrong"),
    [
        ("displacement_at", ("-0.02275]", "-0.02274]")),
        ("stress_at", ("{zz: -7.5}", "{zz: -7.49}")),
        ("pressure_at", ("middle: 25}", "middle: 25.01}")),
    ],
)
def test_another_value_does_not_pass(name, wrong):
    found = {c.name: c.passed for c in run_checks(solved(wrong))}
    assert [check for check, passed in found.items() if not passed] == [name]


def test_a_recovered_pressure_is_read_within_its_macro_element():
    """Under a load of 25 (1 + x) it is not the constant, which is read without recovery."""
    load = ("pressure: 25.0}", "pressure: 25*(1 + x)}")
    exact = solved(load, ("{name: interface", "{name: interface, recovery: linear"))
    zone, plain = exact.zones[0], solved(load)
    owner = np.abs(zone.centre[:, 0] - 0.51).argmin(keepdims=True)
    linear = zone.recovered.values(zone.multiplier, owner, np.array([[[0.51, 0.0]]]))[0, 0]
    assert exact.places.probes["middle"].pressure[0] == pytest.approx(linear, rel=1e-12)
    assert abs(linear - zone.multiplier[owner[0]]) > 0.01
    assert plain.places.probes["middle"].pressure[0] == plain.zones[0].multiplier[owner[0]]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ((", within: top", ""), r"probes\.both\.at.*bodies meet there; name the cells"),
        (("[0.3, -0.7]", "[0.3, -1.7]"), r"inside\.at.*no cell is there; the nearest is 0\.7"),
        (("[0.51, 0], z", "[0.51, 0.5], z"), r"probes\.middle\.at.*is 0\.5 from the slave surface"),
        (("within: top", "within: bases"), r"probes\.both\.within.*no such group"),
        (("zone: interface}", "zone: interfaces}"), r"probes\.middle\.zone.*no such zone"),
        (("{inside: [", "{insider: ["), r"displacement_at\.insider.*no probe without a zone"),
        (("{middle: 25}", "{inside: 25}"), r"pressure_at\.inside.*no probe with a zone"),
        (("{at: [0.3, -0.7]}", "{at: [0.3, -0.7, 1]}"), r"probes\.inside\.at.*must have 2 comp"),
        (("{group: rim}", "{group: rim, at: [0, 0]}"), r"probes\.rim.*exactly one of at, group"),
        (("{group: rim}", "{group: rim, within: top}"), r"only for a displacement and stress at"),
    ],
)  # fmt: skip
def test_what_is_refused(change, message):
    with pytest.raises(InputError, match=message):
        solved(change)


def test_all_probes_are_refused_before_the_solve():
    """`validate --mesh` names each of them."""
    changes = (("[0.3, -0.7]", "[0.3, -1.7]"), ("[0.51, 0], z", "[0.51, 0.5], z"))
    case, mesh = changed_case(2, *changes, extra=PROBES), block_mesh("QUAD8", "TRIA6", (3, 2))
    told = [str(error) for error in refusals_on(case, moved(mesh, 0.04))]
    assert len(told) == 2
    assert "probes.inside.at = [0.3, -1.7]: no cell is there" in told[0]
    assert "probes.middle.at = [0.51, 0.5]: is 0.5 from the slave surface" in told[1]


def test_a_probe_that_a_moving_surface_leaves_is_refused():
    """A corner of the long block, once the short one has slid on by a face."""
    text = (ROOT / "cases/motion/slide-a.yaml").read_text()
    corner = "  corner: {of: nodes, within: bottom, box: {low: [-0.1, -0.1], high: [0.1, 0.1]}}\n"
    text = text.replace("groups:\n", f"groups:\n{corner}", 1)
    case = parse_case(text + "probes: {face: {group: corner, zone: interface}}\n", Path("p.yaml"))
    with pytest.raises(InputError, match=r"probes\.face\.group = 'corner': is 5 from the slave"):
        simulate(case.as_solved(True), mesh_of(case))


def test_a_pressure_on_a_surface_that_moves_is_no_displacement():
    text = (ROOT / "cases/motion/slide-a.yaml").read_text()
    probes = "probes: {foot: {group: top_contact, zone: interface}, end: {group: press}}\n"
    case = parse_case(text + probes, Path("p.yaml")).as_solved(True)
    found = simulate(case, mesh_of(case)).places.probes
    assert found["foot"].pressure == pytest.approx(25.0 + np.zeros(7), rel=1e-10)
    assert np.isnan(found["foot"].displacement).all()
    assert found["end"].displacement[:, 0] == pytest.approx(40.0 + np.zeros(4), abs=0.1)
