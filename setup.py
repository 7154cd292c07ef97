"""Installs the folder solver/ as the package mortarcheck; pyproject.toml has everything else."""

import shutil

from setuptools import find_packages, setup

# What an earlier build left there would join the wheel.
shutil.rmtree("build/lib", ignore_errors=True)
setup(
    package_dir={"mortarcheck": "solver"},
    packages=["mortarcheck", *(f"mortarcheck.{name}" for name in find_packages("solver"))],
)
