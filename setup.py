"""Installs the folder solver/ as the package mortarcheck, with the cases and the workflow in it.

pyproject.toml has everything else.
"""

import shutil

from setuptools import find_packages, setup

# What an earlier build left there would join the wheel.
shutil.rmtree("build/lib", ignore_errors=True)
setup(
    package_dir={
        "mortarcheck": "solver",
        "mortarcheck.cases": "cases",
        "mortarcheck.workflow": "workflow",
    },
    packages=[
        "mortarcheck",
        "mortarcheck.cases",
        "mortarcheck.workflow",
        *(f"mortarcheck.{name}" for name in find_packages("solver")),
    ],
)
