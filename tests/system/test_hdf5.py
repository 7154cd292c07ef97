"""HDF5 files are read only where they hold all of their data, and are not nested without end."""

import time

import h5py
import numpy as np
import pytest

from solver.mesh import read_mesh
from solver.system.errors import InputError
from solver.system.files import seal
from solver.system.hdf5 import read_file
from solver.verification.results import read_result
from tests.mesh.one_cell import write_by_gmsh

POINTS = np.zeros((3, 2))


def by_link(group, name, other):
    group[name] = h5py.ExternalLink(other.name, "/points")


def by_storage(group, name, other):
    place = [(str(other), 0, POINTS.nbytes)]
    group.create_dataset(name, POINTS.shape, "f8", external=place)


def by_virtual_data(group, name, other):
    layout = h5py.VirtualLayout(POINTS.shape, "f8")
    layout[:] = h5py.VirtualSource(other, "points", POINTS.shape)
    group.create_virtual_dataset(name, layout)


@pytest.fixture(params=[by_link, by_storage, by_virtual_data])
def take(request, tmp_path):
    """A function that adds data of another file to a group by a name."""
    other = tmp_path / "other.h5"
    with h5py.File(other, "w") as file:
        file["points"] = POINTS
    return lambda group, name: request.param(group, name, other)


def test_no_reader_takes_data_from_another_file(take, tmp_path):
    path = tmp_path / "m.med"
    write_by_gmsh("TRIA3", path)
    assert len(read_mesh(path).points) == 3
    with h5py.File(path, "a") as file:
        (step,) = next(iter(file["ENS_MAA"].values())).values()
        attributes = dict(step["NOE/COO"].attrs)
        del step["NOE/COO"]
        take(step["NOE"], "COO")
        if isinstance(step["NOE"].get("COO", getlink=True), h5py.HardLink):
            step["NOE/COO"].attrs.update(attributes)
    sealed = tmp_path / "m.vtkhdf"
    sealed.write_bytes(path.read_bytes())
    seal(sealed)
    for read, file in ((read_mesh, path), (read_mesh, sealed), (read_result, sealed)):
        with pytest.raises(InputError, match=r"COO: .*the file must hold all of its data itself"):
            read(file)


def test_links_within_a_file_may_go_round(tmp_path):
    with h5py.File(tmp_path / "f.h5", "w") as file:
        inner = file.create_group("a/b")
        inner["up"] = file["a"]
        inner["root"] = h5py.SoftLink("/")
        file["a/points"] = POINTS
    with read_file(tmp_path / "f.h5") as file:
        assert file["a/b/up/b/root/a/points"].shape == POINTS.shape


def test_groups_nested_without_end_are_refused_at_once(tmp_path):
    path = tmp_path / "deep.vtkhdf"
    with h5py.File(path, "w") as file:
        group = file
        for _ in range(3000):
            group = group.create_group("g")
    seal(path)
    start = time.monotonic()
    with pytest.raises(InputError, match="groups: nested deeper than 32 levels"):
        read_result(path)
    assert time.monotonic() - start < 5
