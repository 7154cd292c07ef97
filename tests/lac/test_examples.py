"""The examples in the docstrings of the kernel hold, and every public function has one."""

import doctest
import inspect
from importlib import import_module
from pkgutil import iter_modules

import numpy as np
import pytest

from solver import lac
from solver.lac.cells.catalogue import BY_NAME
from solver.mechanics import mortar
from tests.patches import segment_pair

NAMES = [
    f"{package.__name__}.{module.name}"
    for package in (lac, mortar)
    for module in iter_modules(package.__path__)
    if not module.ispkg and module.name not in ("meshes", "threads")
]
MODULES = [import_module(name) for name in NAMES]
PUBLIC = {
    name: value for module in MODULES for name, value in vars(module).items() if name[0] != "_"
}


@pytest.mark.parametrize("module", MODULES, ids=NAMES)
def test_examples(module):
    points, slave, master = segment_pair([0.0, 2.0], [0.0, 1.0, 2.0], 0.5)
    known = (
        PUBLIC
        | vars(module)
        | {
            "np": np,
            "BY_NAME": BY_NAME,
            "points": points,
            "slave": slave,
            "master": master,
        }
    )
    result = doctest.testmod(module, extraglobs=known)
    assert result.failed == 0
    public = [
        function
        for key, function in inspect.getmembers(module, inspect.isfunction)
        if function.__module__ == module.__name__ and not key.startswith("_")
    ]
    assert [f.__name__ for f in public if ">>>" not in f.__doc__] == []
