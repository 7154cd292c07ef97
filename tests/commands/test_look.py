"""The commands that look at cases, meshes and results."""

import re
import subprocess
import sys

import meshio
import numpy as np
import pytest

from solver.commands.cli import main
from solver.mesh import write_mesh
from solver.report.inspection import draw_mesh, gap_between, groups_of
from solver.system.errors import InputError
from solver.verification.results import write_result
from tests import handmade


def two_squares(gap):
    """A unit square, and above it by a gap another one of two cells, shifted by a quarter."""
    points = [[0, 0], [1, 0], [1, 1], [0, 1]]
    points += [[0.25 + x, 1 + gap + y] for y in (0, 1) for x in (0, 0.5, 1)]
    quads = [[0, 1, 2, 3], [4, 5, 8, 7], [5, 6, 9, 8]]
    lines = [[2, 3], [4, 5], [5, 6]]
    sets = {"lower": [[0], []], "top of lower": [[], [0]], "foot": [[], [1, 2]]}
    return meshio.Mesh(
        np.array(points), [("quad", np.array(quads)), ("line", np.array(lines))], cell_sets=sets
    )


def test_groups_and_sizes():
    whole, lower, top, foot = groups_of(two_squares(0.5))
    assert (whole.name, whole.cells, whole.nodes) == ("", {"QUAD4": 3}, 10)
    assert (whole.low.tolist(), whole.high.tolist()) == ([0, 0], [1.25, 2.5])
    # 4 edges of 1 below, above 4 of 1 and 4 of 1/2
    assert whole.size == pytest.approx((0.5, 10 / 12, 1.0))
    assert (lower.cells, lower.size) == ({"QUAD4": 1}, (1.0, 1.0, 1.0))
    assert (top.cells, foot.cells, foot.nodes) == ({"SEG2": 1}, {"SEG2": 2}, 3)


@pytest.mark.parametrize("gap", [0.5, 0.0, -0.125])
def test_gap_and_the_share_that_faces_the_other(gap):
    found = gap_between(two_squares(gap), ("foot", "top of lower"), "m")
    assert (found.smallest, found.mean, found.largest) == pytest.approx((gap, gap, gap))
    assert found.covered == pytest.approx(0.75)


@pytest.mark.parametrize(
    ("names", "message"),
    [
        (("foott", "foot"), "m: gap = 'foott': no such group; did you mean foot?"),
        (("foot", "foot"), "m: gap = 'foot, foot': the surfaces do not face each other"),
    ],
)
def test_gaps_that_cannot_be_are_refused(names, message):
    with pytest.raises(InputError, match=f"^{re.escape(message)}"):
        gap_between(two_squares(0.5), names, "m")


def test_inspect(tmp_path, capsys):
    file, picture = tmp_path / "m.vtkhdf", tmp_path / "m.svg"
    write_mesh(two_squares(0.5), file)
    assert main(["inspect", str(file), "--gap", "foot", "top of lower", "-o", str(picture)]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].startswith("all cells ")
    assert "3 QUAD4; 10 nodes; [0, 1.25] × [0, 2.5]; edges 0.5 … 1" in lines[0]
    assert lines[-2].startswith("gap of foot to top of lower: 0.5 … 0.5, mean 0.5; 75 % of the")
    assert ">top of lower</text>" in picture.read_text()
    assert main(["inspect", str(file), "-o", str(tmp_path / "m.png")]) == 0
    assert (tmp_path / "m.png").read_bytes().startswith(b"\x89PNG")
    assert main(["inspect", str(file), "-o", str(tmp_path / "m.html")]) == 2
    assert capsys.readouterr().err.endswith("output = '.html': allowed: .svg, .png\n")


def test_a_mesh_in_space_is_drawn_with_what_the_eye_sees(tmp_path):
    mesh = handmade.solid(tmp_path).mesh
    drawn = draw_mesh(mesh, "solid")
    assert drawn.count("<path") > len(mesh.cell_sets)


def test_plot(tmp_path, capsys):
    file = tmp_path / "r.vtkhdf"
    write_result(file, handmade.plane(tmp_path), [], {})
    assert main(["plot", str(file)]) == 0
    assert "<svg" in (tmp_path / "r.svg").read_text()
    assert main(["plot", str(file), "--profile", "-o", str(tmp_path / "p.png")]) == 0
    assert (tmp_path / "p.png").read_bytes().startswith(b"\x89PNG")
    assert main(["plot", str(file), "-o", str(tmp_path / "p.html")]) == 0
    page = (tmp_path / "p.html").read_text()
    assert "<svg" in page
    assert 'surfaces(...["two-blocks",' in page
    assert 'data-surfaces="two-blocks"' in page
    assert "src=" not in page, "it stands alone"
    assert main(["plot", str(file), "--profile", "-o", str(tmp_path / "q.html")]) == 2
    assert main(["plot", str(file), "-o", str(tmp_path / "p.gif")]) == 2
    assert capsys.readouterr().err.endswith("output = '.gif': allowed: .svg, .png, .html\n")


def test_list(capsys):
    assert main(["list"]) == 0
    assert re.search(r"^ssnp170 +\d+ cases +Patch test", capsys.readouterr().out, re.MULTILINE)
    assert main(["list", "loads"]) == 0
    assert "cases/loads/" in capsys.readouterr().out
    assert main(["list", "load"]) == 2
    assert "did you mean loads?" in capsys.readouterr().err


def test_an_unknown_command_names_the_nearest_and_no_internal_one(capsys):
    with pytest.raises(SystemExit) as ended:
        main(["slove", "case.yaml"])
    assert ended.value.code == 2
    said = capsys.readouterr().err
    assert "no such command: slove; did you mean solve? (allowed: accept, check, " in said
    assert not {"serve", "crashed", "orders"} & set(re.findall(r"\w+", said))


def test_help_lists_what_people_use_in_the_order_of_use(capsys):
    with pytest.raises(SystemExit):
        main(["--help"])
    shown = re.findall(r"^ {4}([a-z-]+)", capsys.readouterr().out, re.MULTILINE)
    assert shown[:4] == ["new", "validate", "mesh", "solve"]
    assert not {"serve", "crashed", "study"} & set(shown)


@pytest.mark.parametrize("words", [["--version", "--verbose"], ["list"]])
def test_a_reader_that_leaves_is_no_error(words):
    """As `head` does: no traceback."""
    command = [sys.executable, "-m", "solver", *words]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as run:
        run.stdout.close()
        assert run.stderr.read() == b""
