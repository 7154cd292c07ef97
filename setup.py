"""Installs the folder solver/ as the package mortarcheck; pyproject.toml has everything else."""

from setuptools import find_packages, setup

setup(
    package_dir={"mortarcheck": "solver"},
    packages=["mortarcheck", *(f"mortarcheck.{name}" for name in find_packages("solver"))],
)
