"""Particles as a table of text: for spreadsheets and for looking at."""

from pathlib import Path
from typing import Any

import numpy as np

from wavetank.foundation.atomic_write import atomic_write

SUFFIXES = (".csv",)
KIND = "particles"


def write_csv(path: str | Path, frame: Any) -> None:
    """Write one line a particle: id, position [m], velocity [m/s], density [kg/m^3], kind, age [s], material.

    Water comes first, kind 0 and age 0; then spray, foam and bubbles, kinds 1 to 3, with numbers of their own,
    density 0 and material 0. Solids follow as comments: name, position [m], quaternion (w, x, y, z). Nine digits bring
    every float32 back exactly. `frame` is a `Frame` or a `State`.
    """
    axes = "xyz"[: frame.dim]
    header = ",".join(["id", *axes, *(f"v{axis}" for axis in axes), "density", "kind", "age", "material"])
    water = np.column_stack([frame.positions, frame.velocities, frame.densities])
    foam = np.column_stack([frame.foam_positions, frame.foam_velocities])
    with atomic_write(path) as partial, partial.open("w", encoding="utf-8", newline="") as file:
        file.write(header + "\n")
        file.writelines(
            f"{number},{_numbers(row)},0,0,{material}\n"
            for number, row, material in zip(frame.ids, water, frame.materials, strict=True)
        )
        file.writelines(
            f"{number},{_numbers(row)},0,{kind},{age:.9g},0\n"
            for number, row, kind, age in zip(frame.foam_ids, foam, frame.foam_kinds, frame.foam_ages, strict=True)
        )
        file.writelines(
            f"# {'_'.join(one.name.split())},{_numbers(one.position)},{_numbers(one.rotation)}\n"
            for one in frame.placed
        )


def _numbers(row: np.ndarray) -> str:
    return ",".join(f"{value:.9g}" for value in row)


write = write_csv
