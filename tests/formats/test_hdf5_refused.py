"""HDF5 that is not whole, or stands for more than it holds, is refused before it is read."""

import shutil
from pathlib import Path

import numpy as np
import pytest

import wavetank as wt
from instants import FPS, instants, world
from wavetank.formats import hdf5
from wavetank.formats.growing import open_hdf5
from wavetank.run.outputs import Outputs
from wavetank.simulation.instant import PARTS

h5py = pytest.importorskip("h5py")


@pytest.fixture(scope="module")
def good(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("out")
    with Outputs(folder / "w", world(), ("h5", "vtkhdf"), fps=FPS, only=PARTS) as outputs:
        for number, instant in enumerate(instants()):
            outputs.write(number, instant)
    (folder / "secret").write_bytes(b"secret" * 1000)
    with h5py.File(folder / "other.h5", "w") as file:
        file["dyes"] = np.full(1000, 7, np.int32)
    return folder


def replaced(file, name, **fields):
    del file[name]
    file.create_dataset(name, **fields)


def external(file, folder):
    rows = len(file["water/dyes"])
    replaced(file, "water/dyes", shape=(rows,), dtype="i4", external=[(str(folder / "secret"), 0, h5py.h5f.UNLIMITED)])


def virtual(file, folder):
    rows = len(file["water/dyes"])
    layout = h5py.VirtualLayout(shape=(rows,), dtype="i4")
    layout[:] = h5py.VirtualSource(str(folder / "other.h5"), "dyes", shape=(rows,))
    del file["water/dyes"]
    file.create_virtual_dataset("water/dyes", layout)


def linked(file, folder):
    del file["water/dyes"]
    file["water/dyes"] = h5py.ExternalLink(str(folder / "other.h5"), "dyes")


def linked_group(file, folder):
    del file["foam"]
    file["foam"] = h5py.ExternalLink(str(folder / "other.h5"), "/")


def linked_scene(file, folder):
    del file["scene"]
    file["scene"] = h5py.SoftLink("/water/dyes")


def zeros(name, shape, dtype, chunks):
    def change(file, folder):
        replaced(file, name, shape=shape, dtype=dtype, chunks=chunks, compression="gzip")
        file[name][: chunks[0]] = np.zeros((chunks[0], *shape[1:]), dtype)

    return change


def same_rows_in_each_frame(file, folder):
    file["water/first"][:] = 0


def objects(file, folder):
    for number in range(5000):
        file.create_group(f"more/{number}")


def circle(file, folder):
    file["water/again"] = file["/"]


def shaped(name, shape, dtype="f8"):
    def change(file, folder):
        replaced(file, name, data=np.zeros(shape, dtype))

    return change


CHANGES = {
    "external storage": (external, "other files"),
    "a virtual dataset": (virtual, "other files"),
    "an external link": (linked, "link"),
    "an external link to a group": (linked_group, "link"),
    "a soft link": (linked_scene, "link"),
    "4e9 zeros as a scene": (zeros("scene", (4_000_000_000,), "S1", (1_000_000,)), "takes"),
    "the same rows in each frame": (same_rows_in_each_frame, "begins at row"),
    "thousands of groups": (objects, "more than"),
    "a group in itself": (circle, "more than"),
    "flat positions of solids": (shaped("solids/positions", (8, 2)), "solids/positions"),
    "names that are numbers": (shaped("solids/names", (8,)), "solids/names"),
    "triangles of four corners": (shaped("triangles/corners", (200_000, 4), "i4"), "triangles/corners"),
    "triangles beyond": (
        lambda file, folder: file["triangles/corners"].write_direct(
            np.full(file["triangles/corners"].shape, 10**6, "i4")
        ),
        "triangles",
    ),
    "texts of any length": (
        lambda file, folder: replaced(file, "scene", data="x", dtype=h5py.string_dtype()),
        "fixed length",
    ),
}


@pytest.mark.parametrize("name", CHANGES)
def test_what_is_not_in_the_file_is_refused(name, good, tmp_path):
    change, words = CHANGES[name]
    path = tmp_path / "bad.h5"
    shutil.copy(good / "w.h5", path)
    with h5py.File(path, "r+") as file:
        change(file, good)
    with pytest.raises(wt.WavetankError) as told:
        [*hdf5.read(path)]
    text = str(told.value)
    assert str(path) in text and words in text and "\n" not in text, text


def test_vtkhdf_that_is_kept_is_whole(good, tmp_path):
    """A run that goes on reads its own files back; what was put in their place is not followed."""
    path = tmp_path / "w.vtkhdf"
    shutil.copy(good / "w.vtkhdf", path)
    with h5py.File(path, "r+") as file:
        del file["VTKHDF/Points"]
        file["VTKHDF/Points"] = h5py.ExternalLink(str(good / "other.h5"), "dyes")
    with pytest.raises(wt.WavetankError, match="link"):
        open_hdf5(path)


def test_a_chunk_that_is_larger_than_the_file_may_hold(good, tmp_path):
    """Reading one row would unpack all of its chunk."""
    path = tmp_path / "bad.h5"
    shutil.copy(good / "w.h5", path)
    with h5py.File(path, "r+") as file:
        replaced(file, "water/dyes", shape=(0,), maxshape=(None,), chunks=(2**28,), dtype="i4", compression="gzip")
        file["water/dyes"].resize((1000,))
    with pytest.raises(wt.WavetankError, match="takes"):
        open_hdf5(path)
