"""The commands that write and check case files, and a folder of them."""

import argparse
import re
import shutil
import sys
from pathlib import Path
from string import Template

from ..system.errors import InputError
from ..system.files import write_text
from ..system.package import PROGRAM, workflow_folder
from . import jobs
from .options import PASSED, REFUSED

# Where each template of the folder `family/` goes.
FILES = {
    "Snakefile.template": "Snakefile",
    "family.yaml.template": "cases/{}/family.yaml",
    "README.md.template": "README.md",
    "github.yml.template": ".github/workflows/verification.yml",
    "gitlab.yml.template": ".gitlab-ci.yml",
}
_PROFILE = "profiles/default/config.yaml"


def add_new(command: argparse.ArgumentParser) -> None:
    command.add_argument("name", nargs="?", metavar="NAME", help="default: as FILE")
    command.add_argument("-o", "--output", type=Path, metavar="FILE", help="default: NAME.yaml")


def run_new(options: argparse.Namespace) -> int:
    from ..case.template import write_template

    name = options.name or (options.output.stem if options.output else "new-case")
    path = options.output or Path(f"{name}.yaml")
    write_template(name, path)
    print(f"{path}: written; next: {PROGRAM} solve {path} -o {path.with_suffix('.vtkhdf')}")
    return PASSED


def add_validate(command: argparse.ArgumentParser) -> None:
    command.add_argument("cases", type=Path, nargs="+", metavar="CASE.yaml")
    command.add_argument("--mesh", action="store_true", help="also mesh them and check the groups")


def run_validate(options: argparse.Namespace) -> int:
    status = PASSED
    for path in options.cases:
        try:
            _validate_one(path, options.mesh)
        except InputError as error:
            print(error, file=sys.stderr)
            status = REFUSED
        else:
            print(f"{path}: valid")
    return status


def _validate_one(path: Path, with_mesh: bool) -> None:
    from ..case.reader import check_mesh_file, load_case

    case = load_case(path)
    check_mesh_file(case)
    if "recipe" in case.mesh:
        from ..mesh.recipes import read_recipe

        read_recipe(case.mesh, path)
    if with_mesh:
        from ..simulation.scene.groups import check_groups
        from ..simulation.scene.selections import with_groups
        from ..verification.run import mesh_of

        check_groups(case, with_groups(case, mesh_of(case)))


def add_mesh(command: argparse.ArgumentParser) -> None:
    command.add_argument("case", type=Path, metavar="CASE", help="a case file, or a name")
    command.add_argument("-o", "--output", type=Path, required=True, metavar="MESH")


def run_mesh(options: argparse.Namespace) -> int:
    from ..case.reader import load_case
    from ..mesh import write_mesh
    from ..verification.run import mesh_of

    file, _ = jobs.named(options.case)
    write_mesh(mesh_of(load_case(file), limited=True), options.output)
    return PASSED


def add_init(command: argparse.ArgumentParser) -> None:
    command.add_argument("folder", type=Path, metavar="FOLDER", help="its name is the family's")


def run_init(options: argparse.Namespace) -> int:
    from ..case.template import write_template

    folder, name = options.folder, options.folder.resolve().name
    if not re.fullmatch(jobs.PLAIN, name):
        raise InputError(folder, "name", name, "must be letters, digits, `_`, `-` and `.`")
    if folder.exists() and any(folder.iterdir()):
        raise InputError(folder, "folder", None, "is not empty; name a new one")
    templates = Path(__file__).with_name("family")
    for template, target in FILES.items():
        text = Template((templates / template).read_text(encoding="utf-8")).substitute(name=name)
        write_text(folder / target.format(name), text)
    write_template("block", folder / "cases" / name / "block.yaml")
    write_text(folder / ".gitignore", "results/\n.snakemake/\n")
    (folder / _PROFILE).parent.mkdir(parents=True)
    shutil.copy(workflow_folder() / _PROFILE, folder / _PROFILE)
    print(f"{folder}: written; next: cd {folder} && snakemake --cores all")
    return PASSED
