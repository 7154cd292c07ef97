"""`validate`: all files are gone through, and each that is not valid is named in its own line."""

import re

from solver.commands.cli import main
from solver.lac.errors import SolveError

from .test_cli import PLANE


def test_validate_goes_through_all_files(tmp_path, capsys):
    cases = {
        "bad": PLANE.replace("small", "a/b"),
        "c": PLANE,
        "even": PLANE.replace("size: 50.0", "size: -50.0"),
        "lost": re.sub("mesh:\n(  .*\n)+", "mesh: {file: lost.msh}\n", PLANE),
    }
    for name, text in cases.items():
        (tmp_path / f"{name}.yaml").write_text(text)
    paths = [str(tmp_path / f"{name}.yaml") for name in (*cases, "none")]
    assert main(["validate", *paths]) == 2
    printed = capsys.readouterr()
    assert printed.out == f"{paths[1]}: valid\n"
    assert "lost.yaml: mesh.file = " in printed.err
    assert "even.yaml: mesh.size = -50.0: must be a positive number" in printed.err
    assert len(printed.err.splitlines()) == 4


def test_a_case_that_cannot_be_put_on_its_mesh_is_named_and_does_not_end_the_rest(
    tmp_path, monkeypatch, capsys
):
    def lost(case, _mesh):
        if case.name == "lost":
            raise SolveError("3 points could not be projected")
        return ()

    monkeypatch.setattr("solver.simulation.simulate.refusals_on", lost)
    for name in ("lost", "small"):
        (tmp_path / f"{name}.yaml").write_text(PLANE.replace("name: small", f"name: {name}"))
    paths = [str(tmp_path / f"{name}.yaml") for name in ("lost", "small")]
    assert main(["validate", "--mesh", *paths]) == 2
    printed = capsys.readouterr()
    assert printed.out == f"{paths[1]}: valid\n"
    assert printed.err == f"{paths[0]}: 3 points could not be projected\n"
