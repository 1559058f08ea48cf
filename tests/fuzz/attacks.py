"""Inputs that have hurt once, in their smallest form, and what every door must do with any input."""

import io
import json
import time
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

import wavetank as wt

LONGEST = 20.0  # s of a processor: of any refusal, of any valid start; a guard against hangs, four times what a slow one takes


def refused(door: Callable[[], Any], words: str = "") -> str:
    """Return what a door says of an input that it must not take: one sentence of ours, soon."""
    began = time.process_time()
    try:
        door()
    except wt.WavetankError as error:
        text = str(error)
    else:
        raise AssertionError("the door let it in")
    assert time.process_time() - began < LONGEST
    assert text and len(text) < 2000 and "\n" not in text, repr(text[:300])
    assert words in text, text
    return text


class TooSlowError(AssertionError):
    """An input took longer than any may."""


def taken_or_refused(door: Callable[[], Any]) -> Any:
    """Return what a door makes of an input, or None where it refuses it in one sentence; all else is an error."""
    began = time.process_time()
    try:
        return door()
    except wt.WavetankError as error:
        assert str(error) and "\n" not in str(error), repr(str(error)[:300])
        return None
    finally:
        if time.process_time() - began >= LONGEST:
            raise TooSlowError(f"{time.process_time() - began:.1f} s")


def nested(opening: str, closing: str, depth: int, inner: str = "1") -> str:
    return opening * depth + inner + closing * depth


POOL = """
spacing = 0.05
tank.size = [1.0, 0.6]
fluids = [{ lower = [0, 0], upper = [0.5, 0.4] }]
"""
UNION = 'solids = [{ shape = "union", parts = ['
#: scene files, each with a word that its refusal has
SCENES: dict[str, tuple[str, str]] = {
    "a body of 10^9 m": (
        POOL + '[[solids]]\nshape = "cylinder"\nstart = [0.5, 0.3]\nend = [0.6, 0.3]\nradius = 1e9\ndensity = 500',
        "pieces",
    ),
    "deep arrays": ("x = " + "[" * 100_000, "nested"),
    "deep closed arrays": ("x = " + nested("[", "]", 500), "nested"),
    "deep inline tables": ("x = " + "{a=" * 50_000, "nested"),
    "deep dotted keys": ("a" + ".a" * 500_000 + " = 1", "nested"),
    "deep quoted keys": ('"a"' + ' . "a"' * 5_000 + " = 1", "nested"),
    "deep headers": ("[" + "a." * 100_000 + "a]", "nested"),
    "headers that go on": ("\n".join(f"[{'.'.join('a' * n)}]" for n in range(1, 400)), "nested"),
    "long integer": ("spacing = " + "9" * 5000, "digits"),
    "long hexadecimal integer": ("spacing = 0x" + "f" * 100_000, "64 bits"),
    "integer beyond 64 bits": ("foam_seed = " + "9" * 40, "64 bits"),
    "deep union": (
        POOL
        + "solids = ["
        + nested('{shape="union",parts=[', "]}", 300, '{shape="sphere",center=[0,0],radius=1}')
        + "]",
        "nested",
    ),
    "a million particles by a million": (
        "spacing = 1e-4\ntank.size = [100, 100]\nfluids = [{lower = [0, 0], upper = [100, 100]}]",
        "particles",
    ),
    "10^24 cells": ("spacing = 1e-6\ntank.size = [100, 100, 100]\n", "spacing"),
    "1000 km at 1 m": ("spacing = 1\ntank.size = [1e6, 1e6, 1e6]\nfluids = [{lower=[0,0,0],upper=[1,1,1]}]", "cells"),
    "999 m at 1 mm": (
        "spacing = 0.001\ntank.size = [999, 999, 999]\nfluids = [{lower=[0,0,0],upper=[0.1,0.1,0.1]}]",
        "cells",
    ),
    "100,000 solids": (POOL + "solids = [" + "{center=[0.8,0.1],size=[0.1,0.1]}," * 100_000 + "]", "at most"),
    "nested points": (
        POOL + 'fluids = [{shape="points", positions=[[[0.1,0.1]]]}]'.replace("fluids", "[[fluids]]\n#"),
        "",
    ),
    "sway": (POOL + '[[forces]]\nkind = "sway"\nacceleration = [1e30, 0]', "acceleration"),
    "attract": (POOL + '[[forces]]\nkind = "attract"\ncenter = [0, 0]\nradius = 1\nstrength = 1e38', "strength"),
    "wind": (POOL + '[[forces]]\nkind = "wind"\nvelocity = [1e38, 0]', "velocity"),
    "drag": (POOL + '[[forces]]\nkind = "drag"\ncenter = [0, 0]\nradius = 1\nvelocity = [1e38, 0]', "velocity"),
    "vortex": (POOL + '[[forces]]\nkind = "vortex"\ncenter = [0, 0]\nradius = 1e-300\nspeed = 1e300', ""),
    "gravity": (POOL.replace("spacing", "gravity = [1e30, 0]\nspacing", 1), "gravity"),
    "velocity": (POOL.replace("upper", "velocity = [1e38, 0], upper"), "velocity"),
}
del SCENES["nested points"]
SCENES["nested points"] = (
    'spacing = 0.05\ntank.size = [1, 1]\n[[fluids]]\nshape = "points"\npositions = [[[0.1, 0.1]]]',
    "shape",
)

DEEP = nested("[", "]", 50_000)
#: messages of whoever drives, none of which may end the session
MESSAGES: dict[str, str] = {
    "deep TOML": json.dumps({"do": "load", "text": SCENES["deep arrays"][0]}),
    "deep inline tables": json.dumps({"do": "load", "text": SCENES["deep inline tables"][0]}),
    "deep unions": json.dumps({"do": "load", "text": SCENES["deep union"][0]}),
    "long integers": json.dumps({"do": "load", "text": SCENES["long integer"][0]}),
    "2 MB of dots": json.dumps({"do": "load", "text": "a" + ".a" * 990_000 + " = 1"}),
    "2 MB of solids": json.dumps({"do": "load", "text": SCENES["100,000 solids"][0][:1_990_000]}),
    "2 MB of good solids": json.dumps(
        {"do": "load", "text": POOL + "solids = [" + "{center=[9,9],size=[1,1]},\n" * 60_000 + "]"}
    ),
    "999 m at 1 mm": json.dumps({"do": "load", "text": SCENES["999 m at 1 mm"][0]}),
    "empty points": json.dumps({"do": "load", "text": 'spacing = 0.05\n[[fluids]]\nshape = "points"\npositions = []'}),
    "nested points": json.dumps({"do": "load", "text": SCENES["nested points"][0]}),
    "deep JSON": '{"do": "pause", "on": ' + DEEP + "}",
    "deep solid": '{"do": "add-solid", "solid": ' + nested('{"shape":"union","parts":[', "]}", 300) + "}",
    "deep options": '{"do": "tool-begin", "tool": "pour", "options": ' + nested('{"a":', "}", 300) + "}",
    "digits": '{"do": "speed", "factor": ' + "9" * 4000 + "}",
    "more digits": '{"do": "speed", "factor": ' + "9" * 6000 + "}",
    "fine reset": '{"do": "reset", "parameters": {"spacing": 0.0001}}',
    "not a number": '{"do": "set", "name": "gravity", "value": [NaN, 0]}',
    "strong gravity": '{"do": "set", "name": "gravity", "value": [1e300, 1e300]}',
    "strong gravity at a reset": '{"do": "reset", "parameters": {"gravity": [1e30, 0]}}',
    "lone surrogate": '{"do": "load", "text": "title = \\"\\ud800\\""}',
    "lone surrogate in a name": '{"do": "bookmark", "name": "\\ud800"}',
    "zero": '{"do": "load", "name": "\\u0000"}',
    "a solid of 10^9 m": '{"do": "add-solid", "solid": {"shape": "polygon", "points": [[1e9, -1], [1e9, 0], [0, 0]]}}',
    "a pointer of two lines": '{"do": "point-end", "pointer": "a\\nb"}',
}


def state_parts(path: Path) -> dict[str, np.ndarray]:
    """Return what is in a saved state, by name."""
    with np.load(path) as file:
        return {name: file[name] for name in file.files}


def write_state(path: Path, parts: dict[str, Any]) -> Path:
    np.savez(path, **parts)
    return path


def with_about(parts: dict[str, np.ndarray], change: Callable[[dict[str, Any]], Any]) -> dict[str, np.ndarray]:
    """Return the parts of a state with something else in its header."""
    about = json.loads(str(parts["about"]))
    changed = change(about)
    return {**parts, "about": np.array(json.dumps(about if changed is None else changed))}


def _set(*path: Any) -> Callable[[dict[str, Any]], None]:
    *way, last, value = path

    def change(about: dict[str, Any]) -> None:
        for key in way:
            about = about[key]
        about[last] = value

    return change


def _without(*path: Any) -> Callable[[dict[str, Any]], None]:
    *way, last = path

    def change(about: dict[str, Any]) -> None:
        for key in way:
            about = about[key]
        del about[last]

    return change


#: changes of a state's header
HEADERS: dict[str, Callable[[dict[str, Any]], Any]] = {
    "half a particle": _set("numbers", "capacity", -0.5),
    "no room": _set("numbers", "capacity", -1),
    "endless room": _set("numbers", "capacity", 10**11),
    "room as a text": _set("numbers", "capacity", "many"),
    "half a birth": _set("numbers", "foam_born", 1.5),
    "births beyond numbers": _set("numbers", "foam_born", 2**40),
    "endless foam": _set("numbers", "foam_capacity", 10**12),
    "no time": _set("numbers", "time", None),
    "time that is no number": _set("numbers", "time", float("nan")),
    "no time at all": _without("numbers", "time"),
    "no numbers": _without("numbers"),
    "poses a number": _set("poses", 3),
    "poses of texts": _set("poses", ["a", "b"]),
    "few poses": _set("poses", []),
    "a pose that is no number": lambda about: about["poses"][0].__setitem__(0, [float("nan")] * 3),
    "a turn of nothing": lambda about: about["poses"][0].__setitem__(1, [0.0] * 4),
    "names a number": _set("names", 3),
    "few names": _set("names", []),
    "one name for all": lambda about: about.__setitem__("names", ["a"] * len(about["names"])),
    "targets a list": _set("targets", [1]),
    "targets of nobody": _set("targets", {"99": [[0, 0, 0], [1, 0, 0, 0]]}),
    "growing of nobody": _set("growing", {"99": [0.0, 1.0]}),
    "growing in no time": _set("growing", {"0": [0.0, 0.0]}),
    "courses a number": _set("courses", 3),
    "sources a number": _set("sources", 3),
    "sources of nobody": _set("sources", {"emitters": [{"phase": "x"}] * 3, "drains": []}),
    "a list": lambda about: [about],
    "next id in the past": _set("numbers", "next_id", 0),
    "next id beyond numbers": _set("numbers", "next_id", 2**40),
    "ice that is not there": _set("numbers", "frozen_count", 10**6),
    "a box of texts": _set("numbers", "start_box", ["a", "b"]),
}


def _replaced(name: str, change: Callable[[np.ndarray], Any]) -> Callable[[dict[str, np.ndarray]], dict[str, Any]]:
    return lambda parts: {**parts, name: change(parts[name])}


def _dropped(name: str) -> Callable[[dict[str, np.ndarray]], dict[str, Any]]:
    return lambda parts: {key: value for key, value in parts.items() if key != name}


def _put(place: Any, value: Any) -> Callable[[np.ndarray], np.ndarray]:
    def change(array: np.ndarray) -> np.ndarray:
        array = array.copy()
        array[place] = value
        return array

    return change


#: changes of a state's arrays
ARRAYS: dict[str, Callable[[dict[str, np.ndarray]], dict[str, Any]]] = {
    "no lives": _dropped("foam_lives"),
    "no positions": _dropped("x"),
    "no header": _dropped("about"),
    "no scene": _dropped("scene"),
    "few positions": _replaced("x", lambda a: a[:-1]),
    "flat positions": _replaced("x", lambda a: a.reshape(-1)),
    "positions in another world": _replaced("x", lambda a: np.zeros((len(a), 5), np.float32)),
    "positions as whole numbers": _replaced("x", lambda a: a.astype(np.int64)),
    "positions as texts": _replaced("x", lambda a: a.astype(str)),
    "positions that are none": _replaced("x", _put(0, np.nan)),
    "positions far away": _replaced("x", _put(0, 3e38)),
    "velocities that are none": _replaced("v", _put(0, np.inf)),
    "velocities beyond squares": _replaced("v", _put(0, 1e30)),
    "an id twice": _replaced("id", lambda a: np.where(a == a[1], a[0], a)),
    "an id below 0": _replaced("id", _put(0, -5)),
    "a material of nobody": _replaced("material", _put(0, 77)),
    "a material below 0": _replaced("material", _put(0, -1)),
    "half frozen": _replaced("frozen", _put(0, 7)),
    "foam of unequal length": _replaced("foam_ages", lambda a: np.zeros(len(a) + 3, np.float32)),
    "foam of no kind": lambda parts: {
        **parts,
        **{
            name: np.zeros(
                (3, 2) if name in ("foam_positions", "foam_velocities") else 3,
                np.int32 if name in ("foam_kinds", "foam_ids") else np.float32,
            )
            + 9
            for name in parts
            if name.startswith("foam_")
        },
    },
    "a scene that is none": lambda parts: {**parts, "scene": np.array("{")},
    "a scene of lists": lambda parts: {**parts, "scene": np.array("[" * 50_000)},
    "a header of lists": lambda parts: {**parts, "about": np.array("[" * 50_000)},
    "a header of digits": lambda parts: {**parts, "about": np.array("9" * 5000)},
    "objects": lambda parts: {**parts, "x": np.array([{}], object)},
    "bodies of nobody": lambda parts: {
        **parts,
        "bodies_memory": np.zeros((3, 8, 6)),
        "bodies_engine": np.zeros(5, np.uint8),
    },
}


def bomb(shape: str = "(1000000000000,)", member: str = "x") -> bytes:
    """Return an archive whose array says that it is far larger than the file."""
    header = f"{{'descr': '<f4', 'fortran_order': False, 'shape': {shape}, }}".ljust(117) + "\n"
    array = b"\x93NUMPY\x01\x00" + len(header).to_bytes(2, "little") + header.encode()
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w") as archive:
        archive.writestr(f"{member}.npy", array)
    return file.getvalue()


def zeros(gigabytes: float = 2.0) -> bytes:
    """Return a small archive that unpacks to zeros without end."""
    file = io.BytesIO()
    rows = int(gigabytes * 2**30 / 4)
    header = f"{{'descr': '<f4', 'fortran_order': False, 'shape': ({rows},), }}".ljust(117) + "\n"
    with (
        zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive,
        archive.open("x.npy", "w", force_zip64=True) as out,
    ):
        out.write(b"\x93NUMPY\x01\x00" + len(header).to_bytes(2, "little") + header.encode())
        block = bytes(2**24)
        for _ in range(rows * 4 // len(block)):
            out.write(block)
    return file.getvalue()
