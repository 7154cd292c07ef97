"""The README's pictures from the last batch: `python docs/site/front.py` (`make pictures`).

`docs/front.svg`: meshes and contact pressure of three solves. `docs/error-against-time.svg`: the
error of every solve over its run time. `docs/cattaneo.svg`: pressure and friction of a cylinder.
"""

import sys
from pathlib import Path

from solver.report.page import error_chart
from solver.report.profile import draw_profile
from solver.report.rows import read_rows
from solver.system.files import write_text
from solver.verification.results import read_result

ROOT = Path(__file__).resolve().parents[2]
SHOWN = {
    "ssnp170/ssnp170-z7": "SSNP170, pyramids on tetrahedra: 25 MPa everywhere",
    "hertz/hertz-sphere-hexa8": "A sphere on a plane: Hertz's pressure",
    "lame/lame-spheres-tetra10": "Nested spheres under pressure: Lamé's solution",
}
CATTANEO = "friction-cylinder-tria6"
WIDTH, HEIGHT, LINE = 1040, 400, 34


def main() -> None:
    """Write the pictures."""
    results = ROOT / "results"
    parts = []
    for i, (job, caption) in enumerate(SHOWN.items()):
        file = results / "report" / "pictures" / f"{job.replace('/', '-')}.svg"
        if not file.is_file():
            sys.exit(f"{file}: no such picture; make all-cases draws it")
        top = i * (HEIGHT + LINE)
        parts.append(f'<text x="14" y="{top + 24}" font-size="18">{caption}</text>')
        # The picture's own size, moved down.
        drawing = file.read_text(encoding="utf-8").replace("<svg ", f'<svg y="{top + LINE}" ', 1)
        parts.append(drawing)
    height = len(SHOWN) * (HEIGHT + LINE)
    opening = (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height}" width="{WIDTH}"'
    )
    paper = f'<rect width="{WIDTH}" height="{height}" fill="#ffffff"/>'
    whole = f'{opening} font-family="system-ui, sans-serif">{paper}{"".join(parts)}</svg>\n'
    write_text(ROOT / "docs" / "front.svg", whole)
    chart = error_chart(read_rows(sorted(results.glob("*/*/verdict.json"))))
    assert chart is not None
    write_text(ROOT / "docs" / "error-against-time.svg", chart.svg())
    solution = read_result(results / "friction" / CATTANEO / "result.vtkhdf").solution
    drawn = draw_profile(solution, solution.zones[0], CATTANEO, "Cattaneo's problem")
    write_text(ROOT / "docs" / "cattaneo.svg", drawn.svg())
    print("docs/front.svg, docs/error-against-time.svg, docs/cattaneo.svg")


if __name__ == "__main__":
    main()
