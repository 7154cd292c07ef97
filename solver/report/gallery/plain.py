"""A gallery picture without OpenGL: the report's own drawing, with the bodies deformed."""

from pathlib import Path

from solver.report.layout import magnification
from solver.report.plane import draw_plane
from solver.report.raster import available, to_png
from solver.report.space import draw_space
from solver.system.files import replacing
from solver.verification.results import read_result

ENDING = ".png" if available() else ".svg"


def draw(result: Path, target: Path) -> None:
    """Draw a result file into a PNG file, or an SVG file where there is no matplotlib."""
    solution = read_result(result).solution
    factor = magnification(solution.displacement, solution.length)
    draw_it = draw_plane if solution.mesh.points.shape[1] == 2 else draw_space
    title = f"{solution.job}: bodies deformed (displacement × {factor:g}), contact pressure"
    svg = draw_it(solution, title, factor)
    content = to_png(svg) if target.suffix == ".png" else svg.encode()
    with replacing(target) as temporary:
        temporary.write_bytes(content)
