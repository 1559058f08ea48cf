import numpy as np
import pytest

from wavetank.formats import EXPORTERS, exporter_for, exporter_named, suffixes
from wavetank.formats.csv import write_csv
from wavetank.formats.npz import read_npz, write_npz
from wavetank.formats.ply import COLUMNS, FOAM_COLUMNS, write_ply
from wavetank.foundation.errors import WavetankError


def read_csv(path):
    """Columns by name, float64 [count]."""
    names, *lines = path.read_text("utf-8").splitlines()
    rows = [line.split(",") for line in lines if not line.startswith("#")]
    return dict(zip(names.split(","), np.array(rows, float).reshape(-1, names.count(",") + 1).T, strict=True))


def read_ply(path):
    """Elements by name, structured arrays [count]."""
    header, _, body = path.read_bytes().partition(b"end_header\n")
    kinds, elements, at = {"float": "<f4", "int": "<i4", "uchar": "u1"}, {}, 0
    for words in map(str.split, header.decode("ascii").splitlines()):
        if words[0] == "element":
            elements[words[1]] = (int(words[2]), [])
        elif words[0] == "property":
            [*elements.values()][-1][1].append((words[2], kinds[words[1]]))
    for name, (count, columns) in elements.items():
        elements[name] = np.frombuffer(body, columns, count, at)
        at += elements[name].nbytes
    assert at == len(body)
    return elements


def test_npz_brings_everything_back(tmp_path, frame):
    write_npz(tmp_path / "a.npz", frame)
    back = read_npz(tmp_path / "a.npz")
    for name in (
        "ids",
        "positions",
        "velocities",
        "densities",
        "dyes",
        "foam_positions",
        "foam_velocities",
        "foam_kinds",
        "foam_ages",
        "foam_lives",
        "foam_ids",
    ):
        assert (back[name] == getattr(frame, name)).all()
        assert back[name].dtype == getattr(frame, name).dtype
    assert (back["materials"] == frame.materials).all()
    assert back["time"] == frame.time
    assert back["number"] == frame.number


def test_csv_brings_every_bit_back(tmp_path, frame):
    write_csv(tmp_path / "a.csv", frame)
    back = read_csv(tmp_path / "a.csv")
    axes = "xyz"[: frame.dim]
    assert list(back) == ["id", *axes, *("v" + axis for axis in axes), "density", "kind", "age", "material"]
    table = {name: column[back["kind"] == 0] for name, column in back.items()}
    assert table["id"].tolist() == frame.ids.tolist()
    assert (np.stack([table[axis] for axis in axes], 1).astype(np.float32) == frame.positions).all()
    assert (np.stack([table["v" + axis] for axis in axes], 1).astype(np.float32) == frame.velocities).all()
    assert (table["density"].astype(np.float32) == frame.densities).all()
    foam = {name: column[back["kind"] > 0] for name, column in back.items()}
    assert foam["id"].tolist() == frame.foam_ids.tolist()
    assert foam["kind"].tolist() == frame.foam_kinds.tolist()
    assert (np.stack([foam[axis] for axis in axes], 1).astype(np.float32) == frame.foam_positions).all()
    assert (np.stack([foam["v" + axis] for axis in axes], 1).astype(np.float32) == frame.foam_velocities).all()
    assert (foam["age"].astype(np.float32) == frame.foam_ages).all()
    assert (table["material"] == frame.materials).all()


def test_ply_brings_every_bit_back(tmp_path, frame):
    write_ply(tmp_path / "a.ply", frame)
    parts = read_ply(tmp_path / "a.ply")
    back, foam = parts["vertex"], parts["foam"]
    assert len(back) == frame.count
    for k in range(3):
        for name, values in (("xyz"[k], frame.positions), ("v" + "xyz"[k], frame.velocities)):
            assert (back[name] == (values[:, k] if k < frame.dim else 0.0)).all()
    assert (back["density"] == frame.densities).all()
    assert (back["material"] == frame.materials).all()
    assert (back["id"] == frame.ids).all()
    dyed, half = frame.dyes != 0, 64 / 127
    palette = np.array([(0x2F, 0x7F, 0xD0), (0xE0, 0xA5, 0x26), (0xE0, 0xA5, 0x26)])[frame.materials]
    colors = np.where(dyed[:, None], (1 - half) * palette + half * np.array((0xC0, 0x10, 0x30)), palette)
    assert (np.stack([back[name] for name in ("red", "green", "blue")], 1) == np.round(colors)).all()
    for k in range(3):
        for name, values in (("xyz"[k], frame.foam_positions), ("v" + "xyz"[k], frame.foam_velocities)):
            assert (foam[name] == (values[:, k] if k < frame.dim else 0.0)).all()
    for name, values in (("age", frame.foam_ages), ("kind", frame.foam_kinds), ("id", frame.foam_ids)):
        assert (foam[name] == values).all()


def test_ply_has_the_header_that_readers_expect(tmp_path, frame):
    write_ply(tmp_path / "a.ply", frame)
    header, _, body = (tmp_path / "a.ply").read_bytes().partition(b"end_header\n")
    lines = header.decode("ascii").split("\n")
    assert lines[:2] == ["ply", "format binary_little_endian 1.0"]
    assert f"element vertex {frame.count}" in lines
    assert f"element foam {len(frame.foam_ids)}" in lines
    properties = [line.split()[-1] for line in lines if line.startswith("property")]
    assert properties == [*COLUMNS, *FOAM_COLUMNS]
    water = 4 * (len(COLUMNS) - 3) + 3  # colours are bytes
    assert len(body) == water * frame.count + 4 * len(FOAM_COLUMNS) * len(frame.foam_ids)


@pytest.mark.parametrize("suffix", suffixes("particles"))
def test_no_particles_are_a_file_too(tmp_path, nothing, suffix):
    path = tmp_path / f"empty{suffix}"
    exporter_for(path).write(path, nothing)
    readers = {".npz": read_npz, ".csv": read_csv, ".ply": lambda path: read_ply(path)["vertex"]}
    back = readers[suffix](path)
    assert len(back["x"] if suffix != ".npz" else back["positions"]) == 0


class Unreadable:
    """An array that fails when it is read."""

    def __array__(self, *args, **kwargs):
        raise RuntimeError("the device is lost")

    view = __array__


@pytest.mark.parametrize("suffix", suffixes("particles"))
def test_a_broken_write_leaves_the_old_file(tmp_path, frame, suffix):
    path = tmp_path / f"a{suffix}"
    path.write_text("old")
    frame.arrays["rho"] = Unreadable()
    with pytest.raises(RuntimeError, match="lost"):
        exporter_for(path).write(path, frame)
    assert [entry.name for entry in tmp_path.iterdir()] == [path.name]
    assert path.read_text() == "old"


def test_exporters_are_found_by_suffix_and_by_name():
    for module in EXPORTERS:
        for suffix in module.SUFFIXES:
            assert exporter_for(f"some/file{suffix.upper()}") is module
            assert exporter_named(suffix[1:], module.KIND) is module
    assert len(set(suffixes())) == len(suffixes())


@pytest.mark.parametrize("path", ["a.xyz", "noending", "a.npz.gz", ""])
def test_unknown_suffixes_name_the_known(path):
    with pytest.raises(WavetankError, match=r"\.png, \.mp4, \.npz"):
        exporter_for(path)


def test_the_wrong_kind_is_refused():
    with pytest.raises(WavetankError, match=r"particles files end in one of \.npz, \.csv, \.ply"):
        exporter_for("a.png", "particles")
    with pytest.raises(WavetankError, match="use one of npz, csv, ply"):
        exporter_named("png")


def test_a_missing_folder_is_named(tmp_path, frame):
    with pytest.raises(WavetankError, match="no folder"):
        write_npz(tmp_path / "missing" / "a.npz", frame)
