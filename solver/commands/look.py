"""The commands that look at what is there: cases, mesh files, results."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from ..system.errors import InputError, hint
from ..system.package import cases_folder

if TYPE_CHECKING:
    from ..report.inspection import Group


def add_list(command: argparse.ArgumentParser) -> None:
    command.add_argument("family", nargs="?", metavar="FAMILY", help="default: all families")
    command.add_argument(
        "--cases", type=Path, default=cases_folder(), metavar="DIR", help="default: the program's"
    )


def run_list(options: argparse.Namespace) -> int:
    from ..report.families import read_family
    from .jobs import case_files, families_in, list_jobs

    folders = families_in(options.cases)
    if not folders:
        allowed = "no folders with case files; name another folder with --cases"
        raise InputError(options.cases, "cases", None, allowed)
    if options.family is None:
        for name, folder in folders.items():
            file = folder / "family.yaml"
            title = read_family(file).title if file.is_file() else ""
            print(f"{name:<16}{len(case_files(folder)):>4} cases  {title}")
        return 0
    if options.family not in folders:
        allowed = f"no such family; {hint(options.family, folders)}"
        raise InputError(options.cases, "family", options.family, allowed)
    for job in list_jobs([folders[options.family]]):
        print(f"{job.name:<40}{job.file}")
    return 0


def add_inspect(command: argparse.ArgumentParser) -> None:
    command.add_argument("mesh", type=Path, metavar="MESH")
    command.add_argument(
        "--gap", nargs=2, metavar=("SLAVE", "MASTER"), help="the gap between two groups of faces"
    )
    command.add_argument("-o", "--output", type=Path, metavar="PICTURE", help="SVG or PNG")


def run_inspect(options: argparse.Namespace) -> int:
    from ..mesh import read_mesh
    from ..report.inspection import gap_between, groups_of

    mesh = read_mesh(options.mesh)
    gap = gap_between(mesh, options.gap, options.mesh) if options.gap else None
    for group in groups_of(mesh):
        print(_row(group))
    if gap:
        print(
            f"gap of {options.gap[0]} to {options.gap[1]}: "
            f"{gap.smallest:.4g} … {gap.largest:.4g}, mean {gap.mean:.4g}; "
            f"{100 * gap.covered:.4g} % of the area faces it"
        )
    if options.output:
        from ..report.inspection import draw_mesh

        _write_picture(draw_mesh(mesh, options.mesh.name), options.output)
    return 0


def _row(group: "Group") -> str:
    """A group in one line."""
    cells = ", ".join(f"{number} {kind}" for kind, number in group.cells.items())
    box = " × ".join(f"[{a:.4g}, {b:.4g}]" for a, b in zip(group.low, group.high, strict=True))
    parts = [cells or "nodes alone", f"{group.nodes} nodes", box if group.nodes else "empty"]
    if group.size[2]:
        least, mean, most = (f"{size:.3g}" for size in group.size)
        parts.append(f"edges {least} … {most}, mean {mean}")
    return f"{group.name or 'all cells':<24}{'; '.join(parts)}"


def add_plot(command: argparse.ArgumentParser) -> None:
    command.add_argument("result", type=Path, metavar="RESULT.vtkhdf")
    command.add_argument(
        "-o", "--output", type=Path, metavar="PICTURE", help="SVG, PNG or HTML to turn"
    )
    command.add_argument(
        "--profile", action="store_true", help="the pressure along the interface instead"
    )


def run_plot(options: argparse.Namespace) -> int:
    from ..report.pictures import draw, draw_pressure, page
    from ..verification.results import read_result

    solution = read_result(options.result).solution
    output = options.output or options.result.with_suffix(".svg")
    try:
        if options.profile:
            picture = draw_pressure(solution, solution.job).svg()
        elif output.suffix == ".html":
            picture = page(solution, solution.job)
        else:
            picture = str(draw(solution, solution.job))
    except ValueError as error:
        raise InputError(options.result, "picture", None, str(error)) from None
    _write_picture(picture, output, *[".html"] * (not options.profile))
    return 0


def _write_picture(picture: str, output: Path, *others: str) -> None:
    """Write an SVG, as a PNG if the file is called so; `others`: further names that are allowed."""
    from ..system.files import replacing, write_text

    allowed = ".svg", ".png", *others
    if output.suffix not in allowed:
        raise InputError(output, "output", output.suffix, f"allowed: {', '.join(allowed)}")
    if output.suffix == ".png":
        import vl_convert

        with replacing(output) as file:
            file.write_bytes(vl_convert.svg_to_png(picture, scale=2))
    else:
        write_text(output, picture)
    print(f"Picture: {output}")
