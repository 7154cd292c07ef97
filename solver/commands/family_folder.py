"""The command that makes a family in a repository of one's own: cases, workflow, CI."""

import argparse
import re
import shutil
from pathlib import Path
from string import Template
from typing import Any

from ..system.errors import InputError
from ..system.files import write_text
from ..system.package import workflow_folder
from .jobs import PLAIN
from .options import PASSED, add_command

# Where each template of the folder `family/` goes.
FILES = {
    "Snakefile.template": "Snakefile",
    "family.yaml.template": "cases/{}/family.yaml",
    "README.md.template": "README.md",
    "github.yml.template": ".github/workflows/verification.yml",
    "gitlab.yml.template": ".gitlab-ci.yml",
}
_PROFILE = "profiles/default/config.yaml"


def add_commands(commands: Any) -> None:
    """Add `init`."""
    purpose = "make a family in a repository of your own: a case, its page, workflow, CI"
    command = add_command(commands, "init", _init, purpose)
    command.add_argument("folder", type=Path, metavar="FOLDER", help="its name is the family's")


def _init(options: argparse.Namespace) -> int:
    from ..case.template import write_template

    folder, name = options.folder, options.folder.resolve().name
    if not re.fullmatch(PLAIN, name):
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
