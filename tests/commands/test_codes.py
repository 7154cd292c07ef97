"""The commands that run other codes, or write their input."""

import pytest

from solver.commands.cli import main
from tests.commands.test_cli import PLANE


@pytest.fixture
def case(tmp_path):
    path = tmp_path / "small.yaml"
    path.write_text(PLANE)
    return path


def test_export_writes_the_input(case, tmp_path, capsys):
    assert main(["export", str(case), "--code", "calculix", "-o", str(tmp_path / "in")]) == 0
    assert capsys.readouterr().out == f"{tmp_path}/in: written; next, there: ccx -i deck\n"
    pair = "bottom_contact, top_contact"
    assert pair in (tmp_path / "in/deck.inp").read_text().splitlines()
    arguments = ["export", str(case), "--code", "calculix", "--swap", "-o", str(tmp_path / "in")]
    assert main(arguments) == 0
    assert pair not in (tmp_path / "in/deck.inp").read_text().splitlines()


def test_what_export_refuses(case, tmp_path, capsys):
    assert main(["export", str(case), "--code", "calclix", "-o", str(tmp_path)]) == 2
    assert "--code: name = 'calclix': unknown; did you mean calculix" in capsys.readouterr().err
    case.write_text(PLANE.replace("QUAD4", "QUAD9"))
    assert main(["export", str(case), "--code", "calculix", "-o", str(tmp_path)]) == 2
    message = "--code = 'calculix': HEXA27: CalculiX has no such element"
    assert message in capsys.readouterr().err
