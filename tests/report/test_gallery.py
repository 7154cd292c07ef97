"""The gallery: what PyVista draws of results, and what takes its place where it cannot."""

import os
import re
import signal
import subprocess

import numpy as np
import pytest

from solver.commands.cli import main
from solver.report.gallery import probe, write_gallery
from solver.report.geometry import macro_edges
from solver.report.layout import magnification
from solver.report.plane import draw_plane
from solver.report.space import draw_space
from solver.system.files import seal_of
from solver.verification.results import write_result
from tests import handmade
from tests.report.verdicts import put

pyvista = pytest.importorskip("pyvista", reason="PyVista is not installed")

from solver.report.gallery.drawing import HEIGHT, WIDTH, draw  # noqa: E402
from solver.report.gallery.shapes import Shape  # noqa: E402


@pytest.fixture(scope="module")
def opengl():
    if why := probe.set_up():
        pytest.skip(why)


def written(make, folder, name="result"):
    folder.mkdir(exist_ok=True)
    path = folder / f"{name}.vtkhdf"
    write_result(path, make(folder), [], {})
    return path


def shape_of(make, folder):
    return Shape.of(pyvista.read(written(make, folder)))


def test_the_shape_of_a_result_in_space(tmp_path):
    shape = shape_of(handmade.solid, tmp_path)
    assert (shape.dim, shape.size, shape.slaves.tolist()) == (3, 20.0, [0])
    assert shape.of_slaves.tolist() == [True, False, False]
    np.testing.assert_allclose(shape.normal, [0, 0, 1], atol=1e-15)
    assert shape.eye[2] > 0, "seen from above, where the slave's faces are"
    assert abs(shape.eye @ shape.up) < 1e-15
    # The slave is moved down by 0.3 of 20.
    assert set(np.round((shape.apart - shape.points)[:, 2], 12)) == {-6.0, 0.0}
    assert sorted(shape.pressure) == [24.0, 25.0, 25.0, 25.0, 25.0]
    everything, all_of_it = shape.pressed()
    assert all_of_it
    assert everything.all()
    # Both macro-elements of the example are the same square: its four sides, and no diagonal.
    edges = shape.macro_outlines(everything)
    assert edges.shape == (4, 5, 3)
    assert set(np.round(np.linalg.norm(edges[:, 4] - edges[:, 0], axis=1), 12)) == {10.0}


def test_the_shape_of_a_result_in_the_plane(tmp_path):
    shape = shape_of(handmade.plane, tmp_path)
    assert shape.dim == 2
    np.testing.assert_allclose(shape.normal, [0, 1, 0], atol=1e-15)
    bars = shape.bars()
    assert bars.shape == (6, 4, 3)
    # The largest pressure is as high as a quarter of the interface is wide.
    np.testing.assert_allclose(bars[:, 2:, 1] - bars[:, :2, 1][:, ::-1], 12.5, atol=1e-12)
    ends = shape.macro_outlines(np.ones(6, dtype=bool))
    assert sorted(ends[:, 0]) == [0.0, 25.0, 50.0]


def test_only_what_presses_is_shown_of_a_wide_surface(tmp_path):
    def half_open(folder):
        solution = handmade.plane(folder)
        zone = solution.zones[0]
        zone.faces = [("SEG2", zone.faces[0][1], np.array([0, 0, 1, 1, 1, 1]))]
        zone.multiplier = np.array([25.0, 0.0])
        return solution

    shape = shape_of(half_open, tmp_path)
    shown, all_of_it = shape.pressed()
    assert not all_of_it
    assert shown[shape.pressure > 0].all()
    assert not shown.all()


def test_the_displacement_is_magnified_by_a_round_number():
    for largest, expected in ((1.0, 5.0), (0.003, 2000.0), (70.0, 0.05), (0.0, 1.0)):
        assert magnification(np.array([[0.0, largest]]), 100.0) == expected


def test_the_report_draws_bodies_deformed_too(tmp_path):
    for draw_it, make in ((draw_plane, handmade.plane), (draw_space, handmade.solid)):
        plain, deformed = (draw_it(make(tmp_path), "", times) for times in (0.0, 50.0))
        assert "displacement" not in plain
        assert ">displacement × 50<" in deformed
        paths = [re.findall(r' d="([^"]*)"', svg) for svg in (plain, deformed)]
        assert len(paths[0]) == len(paths[1])
        assert paths[0] != paths[1]


def test_edges_of_macro_elements_have_their_mid_nodes():
    faces = [("TRIA6", np.array([[0, 1, 2, 10, 11, 12], [0, 2, 3, 12, 13, 14]]), np.array([5, 5]))]
    found = {tuple(row) for row in macro_edges(faces).tolist()}
    assert found == {(0, 1, 10), (1, 2, 11), (2, 3, 13), (0, 3, 14)}


@pytest.mark.usefixtures("opengl")
@pytest.mark.parametrize("make", [handmade.plane, handmade.solid])
def test_pyvista_draws_all_three(make, tmp_path):
    png = tmp_path / "out" / "picture.png"
    draw(written(make, tmp_path), png)
    image = pyvista.read(png).point_data.active_scalars.reshape(HEIGHT, WIDTH, -1)[..., :3]
    middle = image[80:-80].astype(int)
    red, _, blue = np.moveaxis(middle, -1, 0)
    left, centre, right = (slice(k * WIDTH // 3, (k + 1) * WIDTH // 3) for k in range(3))
    warm, cold = red > blue + 60, blue > red + 60
    assert warm[:, left].mean() > 0.02, "displacement from light to dark orange"
    assert cold[:, centre].mean() > 0.005, "pressure in blue"
    assert (red < 250)[:, right].mean() > 0.05, "cells"
    assert [path.name for path in png.parent.iterdir()] == ["picture.png"]


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


def test_without_opengl_the_report_draws_and_says_why(tmp_path, monkeypatch):
    monkeypatch.setattr(probe, "set_up", lambda: "VTK finds no OpenGL here (SIGSEGV)")
    said = []
    write_gallery(batch(tmp_path), tmp_path / "out", log=said.append)
    assert said[0] == "Drawing without OpenGL: VTK finds no OpenGL here (SIGSEGV)."
    assert said[-1].startswith("2 pictures, 1 without.")
    page = (tmp_path / "out" / "gallery.html").read_text()
    assert "without OpenGL (VTK finds no OpenGL here (SIGSEGV))" in page
    assert "no picture: no result" in page
    names = sorted(path.name for path in (tmp_path / "out" / "gallery").iterdir())
    assert names == ["fam-one-plain.svg", "fam-two-plain.svg"]
    assert all(f'src="gallery/{name}"' in page for name in names)


def test_pictures_are_drawn_again_for_newer_results_alone(tmp_path):
    verdicts, out = batch(tmp_path), tmp_path / "out"
    write_gallery(verdicts, out, plain=True, log=lambda _: None)
    one, two = (out / "gallery" / f"fam-{name}-plain.svg" for name in ("one", "two"))
    for path in (one, two):
        path.write_bytes(b"kept")
    later = two.stat().st_mtime + 10
    os.utime(verdicts[0].parent / "result.vtkhdf", (later, later))
    write_gallery(verdicts, out, plain=True, log=lambda _: None)
    assert one.read_bytes() == b"kept"
    assert two.read_bytes()[:4] == b"<svg"


def test_a_damaged_result_is_said_in_place_of_its_picture(tmp_path):
    verdicts = batch(tmp_path)
    result = verdicts[0].parent / "result.vtkhdf"
    result.write_bytes(result.read_bytes()[:5000])
    write_gallery(verdicts, tmp_path / "out", plain=True, log=lambda _: None)
    page = (tmp_path / "out" / "gallery.html").read_text()
    assert "no picture: the result result.vtkhdf is missing or damaged" in page


def test_the_command(tmp_path, capsys):
    batch(tmp_path)
    out = tmp_path / "out"
    given = ["gallery", "--results", str(tmp_path / "results"), "-o", str(out), "--plain"]
    assert main(given) == 0
    assert "Drawing without OpenGL: asked for." in capsys.readouterr().out
    assert main(["gallery", "-o", str(out)]) == 2
    assert capsys.readouterr().err == "gallery: VERDICT.json: there is none\n"


@pytest.mark.parametrize(
    ("status", "said", "expected"),
    [
        (-signal.SIGSEGV, "x| \x1b[0mno X11 library\x1b[0m\n", "SIGSEGV: no X11 library"),
        (1, "nothing was drawn\n", "status 1: nothing was drawn"),
        (-signal.SIGABRT, "", "SIGABRT"),
    ],
)
def test_why_pyvista_cannot_draw(status, said, expected, monkeypatch):
    ended = subprocess.CompletedProcess([], status, "", said)
    monkeypatch.setattr(subprocess, "run", lambda *_, **__: ended)
    assert probe.set_up() == f"VTK finds no OpenGL here ({expected})"


def test_osmesa_is_named_where_it_is_what_works(monkeypatch):
    def only_osmesa(command, env, **_):
        works = env.get("VTK_DEFAULT_OPENGL_WINDOW") == "vtkOSOpenGLRenderWindow"
        return subprocess.CompletedProcess(command, 0 if works else -signal.SIGSEGV, "", "")

    monkeypatch.setattr(subprocess, "run", only_osmesa)
    monkeypatch.setenv("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")
    assert probe.set_up() == "VTK finds no OpenGL here (SIGSEGV)", "what a user names is kept"
    monkeypatch.delenv("VTK_DEFAULT_OPENGL_WINDOW")
    assert probe.set_up() == ""
    assert os.environ["VTK_DEFAULT_OPENGL_WINDOW"] == "vtkOSOpenGLRenderWindow"


def test_why_pyvista_cannot_draw_when_it_is_not_there(monkeypatch):
    monkeypatch.setattr(probe, "find_spec", lambda _: None)
    assert probe.set_up() == "PyVista is not installed (make gallery installs it)"


def test_a_driver_that_never_ends(monkeypatch):
    def hang(command, timeout, **_):
        raise subprocess.TimeoutExpired(command, timeout)

    monkeypatch.setattr(subprocess, "run", hang)
    assert probe.set_up() == "VTK has drawn nothing within 120 s"
