import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


def run(code):
    """The lines printed by code in a new process that imports in part."""
    text = f"import sys\nfrom solver.system import imports\nimports.defer()\n{code}"
    command = [sys.executable, "-c", text]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    return done.stdout.splitlines()


# For each package: a module that its __init__ imports, a name that one of its modules gives, one
# that needs all of it.
@pytest.mark.parametrize(
    ("package", "module", "part", "whole"),
    [
        ("meshio", "meshio.xdmf", "Mesh", "read"),
        ("numpy.f2py", "numpy.f2py.crackfortran", None, "run_main"),
        ("scipy.sparse.csgraph", "scipy.sparse.csgraph._flow", "connected_components", "dijkstra"),
        ("scipy.spatial", "scipy.spatial.transform", "cKDTree", "ConvexHull"),
        ("skfem", "skfem.utils", None, "condense"),
    ],
)
def test_a_package_is_imported_in_part_until_more_is_asked_for(package, module, part, whole):
    code = f"""
import {package}, importlib
package = sys.modules[{package!r}]
print({module!r} in sys.modules)
parts = [getattr(package, {part!r})] if {part!r} else []
print({module!r} in sys.modules)
print(package.{whole}.__name__, {module!r} in sys.modules)
print(parts == [getattr(package, {part!r})] if {part!r} else True, type(package).__name__)
print(getattr(package, "no_such_name", "none"))
"""
    assert run(code) == ["False", "False", f"{whole} True", "True module", "none"]


def test_modules_of_a_deferred_package_are_imported_as_ever():
    code = """
from skfem.element import ElementTriP1
import skfem.quadrature as quadrature
print("skfem.utils" in sys.modules)
import skfem
print(skfem.ElementTriP1 is ElementTriP1, skfem.quadrature is quadrature)
"""
    assert run(code) == ["False", "True True"]


def test_a_name_that_is_not_where_it_was_is_found_in_the_whole_package():
    code = """
imports._HOMES["scipy.spatial"]["cKDTree"] = "_no_such_module"
imports._HOMES["scipy.sparse.csgraph"]["connected_components"] = "_flow"
from scipy.spatial import cKDTree
from scipy.sparse.csgraph import connected_components
print(cKDTree.__name__, connected_components.__name__)
"""
    assert run(code) == ["cKDTree connected_components"]


def test_threads_that_ask_at_once_wait_for_the_package():
    code = """
from concurrent.futures import ThreadPoolExecutor
import skfem
with ThreadPoolExecutor(8) as pool:
    found = set(pool.map(lambda name: getattr(skfem, name), ["solve"] * 8))
print(len(found))
"""
    assert run(code) == ["1"]


def test_a_library_changes_no_imports():
    code = "import sys, solver; from solver import solve_case; print(len(sys.meta_path))"
    plain = "import sys; print(len(sys.meta_path))"
    lines = [
        subprocess.run([sys.executable, "-c", c], cwd=ROOT, capture_output=True, text=True).stdout
        for c in (plain, code)
    ]
    assert lines[0] == lines[1] != ""
