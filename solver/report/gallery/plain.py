"""A gallery picture without OpenGL: the report's own drawing, with the bodies deformed."""

from pathlib import Path

from solver.report.layout import magnification
from solver.report.plane import draw_plane
from solver.report.space import draw_space
from solver.system.files import write_text
from solver.verification.results import read_result


def draw(result: Path, target: Path) -> None:
    """Draw a result file into an SVG file."""
    solution = read_result(result).solution
    factor = magnification(solution.displacement, solution.length)
    draw_it = draw_plane if solution.mesh.points.shape[1] == 2 else draw_space
    title = f"{solution.job}: bodies deformed (displacement × {factor:g}), contact pressure"
    write_text(target, draw_it(solution, title, factor))
