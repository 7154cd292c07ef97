"""The gallery: what PyVista draws of results, and its page."""

import os

import numpy as np
import pytest

from solver.commands.cli import main
from solver.report import gallery
from solver.report.gallery import HEIGHT, WIDTH, draw, magnification, write_gallery
from solver.report.geometry import macro_edges
from solver.system.errors import MachineError
from solver.system.files import seal_of
from solver.verification.results import write_result
from tests import handmade
from tests.report.verdicts import put

pyvista = pytest.importorskip("pyvista", reason="PyVista is not installed")


def written(make, folder):
    path = folder / "result.vtkhdf"
    write_result(path, make(folder), [], {})
    return path


@pytest.mark.parametrize(
    ("largest", "expected"), [(1.0, 5.0), (0.003, 2000.0), (70.0, 0.05), (0.0, 1.0)]
)
def test_the_displacement_is_magnified_by_a_round_number(largest, expected):
    assert magnification(np.array([[0.0, largest]]), 100.0) == expected


def test_edges_of_macro_elements_have_their_mid_nodes():
    faces = [("TRIA6", np.array([[0, 1, 2, 10, 11, 12], [0, 2, 3, 12, 13, 14]]), np.array([5, 5]))]
    found = {tuple(row) for row in macro_edges(faces).tolist()}
    assert found == {(0, 1, 10), (1, 2, 11), (2, 3, 13), (0, 3, 14)}


def batch(folder):
    """Two solves with results, one without."""
    verdicts = []
    for name, make in (("two", handmade.plane), ("one", handmade.solid), ("none", None)):
        place = folder / "results" / "fam" / name
        place.mkdir(parents=True)
        verdict = {"job": name, "family": "fam", "verdict": "passed", "passed": True}
        if make:
            file = written(make, place)
            verdict |= {"result": file.name, "result_sha256": seal_of(file)}
        verdicts.append(put(place / "verdict.json", verdict))
    return verdicts


@pytest.fixture
def no_opengl_needed(monkeypatch):
    """Pictures are files with the name of the result, wherever the test runs."""
    monkeypatch.setattr(gallery, "_TRIAL", "")

    def note(result, png):
        png.parent.mkdir(parents=True, exist_ok=True)
        pyvista.read(result)
        png.write_text(str(result))

    monkeypatch.setattr(gallery, "draw", note)


@pytest.mark.usefixtures("no_opengl_needed")
def test_the_page_has_every_solve(tmp_path, capsys):
    verdicts, out = batch(tmp_path), tmp_path / "out"
    damaged = verdicts[0].parent / "result.vtkhdf"
    damaged.write_bytes(damaged.read_bytes()[:5000])
    assert main(["gallery", "--results", str(tmp_path / "results"), "-o", str(out)]) == 0
    assert capsys.readouterr().out.startswith("1 pictures, 2 without.")
    page = (out / "gallery.html").read_text()
    assert [path.name for path in (out / "gallery").iterdir()] == ["fam-one.png"]
    assert 'src="gallery/fam-one.png"' in page
    assert "no picture: no result" in page
    assert "no picture: the result result.vtkhdf is missing or damaged" in page
    assert main(["gallery", "-o", str(out)]) == 2
    assert capsys.readouterr().err == "gallery: VERDICT.json: no verdict is named or found\n"


@pytest.mark.usefixtures("no_opengl_needed")
def test_pictures_are_drawn_again_for_newer_results_alone(tmp_path):
    verdicts, out = batch(tmp_path), tmp_path / "out"
    write_gallery(verdicts, out)
    one, two = (out / "gallery" / f"fam-{name}.png" for name in ("one", "two"))
    for path in (one, two):
        path.write_text("kept")
    later = two.stat().st_mtime + 10
    os.utime(verdicts[0].parent / "result.vtkhdf", (later, later))
    write_gallery(verdicts, out)
    assert one.read_text() == "kept"
    assert two.read_text() != "kept"


def test_a_machine_that_cannot_draw_is_named_in_one_line(tmp_path, monkeypatch):
    monkeypatch.setattr(
        gallery, "_TRIAL", "import os, signal; os.kill(os.getpid(), signal.SIGSEGV)"
    )
    with pytest.raises(MachineError, match=r"PyVista: cannot draw here .* exit status -11"):
        write_gallery(batch(tmp_path), tmp_path / "out")


@pytest.mark.parametrize("make", [handmade.plane, handmade.solid])
def test_pyvista_draws_all_three(make, tmp_path):
    try:
        write_gallery([], tmp_path)
    except MachineError as error:
        pytest.skip(str(error))
    png = tmp_path / "out" / "picture.png"
    draw(written(make, tmp_path), png)
    image = pyvista.read(png).point_data.active_scalars.reshape(HEIGHT, WIDTH, -1)[..., :3]
    red, _, blue = np.moveaxis(image[120:-60].astype(int), -1, 0)
    left, middle, right = (slice(k * WIDTH // 3, (k + 1) * WIDTH // 3) for k in range(3))
    assert (red > blue + 60)[:, left].mean() > 0.02, "displacement from light to dark orange"
    assert (blue > red + 60)[:, middle].mean() > 0.005, "pressure in blue"
    assert (blue > red + 10)[:, right].mean() > 0.05, "the slave"
    assert (red > blue + 10)[:, right].mean() > 0.05, "the master"
    assert [path.name for path in png.parent.iterdir()] == ["picture.png"]
