"""The bundled models, made anew: each from the formula in its head. `python docs/models.py`"""

from pathlib import Path

import numpy as np
from PIL import Image

FOLDER = Path(__file__).parent.parent / "src" / "wavetank" / "solids" / "models"


def knot(around: int = 144, across: int = 14, tube: float = 0.62) -> tuple[np.ndarray, np.ndarray, str]:
    """Return vertices, quads and the formula of a trefoil knot, a tube around a curve that winds around a torus."""
    t = np.linspace(0.0, 2.0 * np.pi, around, endpoint=False)

    def curve(t: np.ndarray) -> np.ndarray:
        r = 2.0 + np.cos(3.0 * t)
        return np.stack([r * np.cos(2.0 * t), r * np.sin(2.0 * t), 1.2 * np.sin(3.0 * t)], axis=1)

    along = curve(t + 1e-4) - curve(t - 1e-4)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    # The direction to the torus' inner circle, made normal to the curve, turns with it and closes after one round.
    circle = 2.0 * np.stack([np.cos(2.0 * t), np.sin(2.0 * t), 0.0 * t], axis=1)
    side = circle - curve(t)
    side -= np.sum(side * along, axis=1, keepdims=True) * along
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    other = np.cross(along, side)
    s = np.linspace(0.0, 2.0 * np.pi, across, endpoint=False)[:, None]
    rings = curve(t)[:, None] + tube * (np.cos(s) * side[:, None] + np.sin(s) * other[:, None])
    i, j = np.meshgrid(np.arange(around), np.arange(across), indexing="ij")
    number = lambda i, j: (i % around) * across + j % across  # noqa: E731
    quads = np.stack([number(i, j), number(i + 1, j), number(i + 1, j + 1), number(i, j + 1)], axis=-1)
    formula = (
        "c(t) = (r cos 2t, r sin 2t, 1.2 sin 3t), r = 2 + cos 3t: a trefoil knot; "
        f"around it a tube of radius {tube}; {around} steps of t, {across} around the tube"
    )
    return rings.reshape(-1, 3), quads.reshape(-1, 4), formula


def turned(
    rings: list[tuple[float, float, float, float]], around: int, formula: str
) -> tuple[np.ndarray, np.ndarray, str]:
    """Return a closed surface of rings (x, z, y, power): superellipses of these half axes at that height."""
    t = np.linspace(0.0, 2.0 * np.pi, around, endpoint=False)
    points = []
    for a, b, y, power in rings:
        r = (np.abs(np.cos(t)) ** power + np.abs(np.sin(t)) ** power) ** (-1.0 / power)
        points.append(np.stack([a * r * np.cos(t), np.full(around, y), b * r * np.sin(t)], axis=1))
    quads = []
    for k in range(len(rings) - 1):
        for j in range(around):
            n, m = k * around + j, k * around + (j + 1) % around
            quads.append((n, n + around, m + around, m))
    last, first, end = (len(rings) - 1) * around, len(rings) * around, len(rings) * around + 1
    for j in range(around):
        quads.append((first, j, (j + 1) % around, first))
        quads.append((end, last + (j + 1) % around, last + j, end))
    middles = [(0.0, rings[0][2], 0.0), (0.0, rings[-1][2], 0.0)]
    return np.concatenate([*points, middles]), np.array(quads), formula


def bathtub(around: int = 96, wall: float = 0.1) -> tuple[np.ndarray, np.ndarray, str]:
    """Return a bathtub, 1.6 m long, with sloping sides, a round edge and a wall that is as thick everywhere."""
    outer = [(0.62, 0.26, 0.0), (0.68, 0.31, 0.05), (0.74, 0.345, 0.2), (0.77, 0.36, 0.4), (0.785, 0.37, 0.52)]
    edge = [(0.80, 0.385, 0.55), (0.80, 0.385, 0.57), (0.785, 0.37, 0.58), (0.785 - wall, 0.37 - wall, 0.58)]
    inner = [(a - wall, b - wall, max(y, wall + 0.03)) for a, b, y in reversed(outer[2:])]
    floor = [(0.74 - 1.3 * wall, 0.345 - 1.3 * wall, wall)]
    rings = [(a, b, y, 3.0) for a, b, y in [*outer, *edge, *inner, *floor]]
    formula = (
        f"superellipses |x/a|^3 + |z/b|^3 = 1 along a profile: a bathtub open above; wall {wall}; {around} steps around"
    )
    return turned(rings, around, formula)


def boat(around: int = 96, wall: float = 0.045) -> tuple[np.ndarray, np.ndarray, str]:
    """Return an open boat, 1 m long and pointed at both ends, with walls and a floor."""
    outer = [(0.30, 0.10, 0.0), (0.37, 0.135, 0.04), (0.43, 0.165, 0.12), (0.47, 0.18, 0.2), (0.5, 0.19, 0.28)]
    inner = [(a - 1.3 * wall, b - wall, max(y, 0.05)) for a, b, y in reversed(outer[1:])]
    rings = [(a, b, y, 1.55) for a, b, y in [*outer, *inner]]
    formula = (
        f"superellipses |x/a|^1.55 + |z/b|^1.55 = 1 along a profile: an open boat; wall {wall}; {around} steps around"
    )
    return turned(rings, around, formula)


def vase(around: int = 96) -> tuple[np.ndarray, np.ndarray, str]:
    """Return what a vase encloses, closed above its neck: to be a container it is turned inside out."""
    y = np.linspace(0.0, 1.0, 41)
    # Foot, belly, neck and lip.
    r = (
        np.interp(y, [0.0, 0.03], [0.12, 0.14])
        + 0.21 * np.exp(-(((y - 0.38) / 0.2) ** 2))
        + 0.09 * np.clip(y - 0.85, 0, 1) / 0.15
    )
    formula = "r(y) = 0.14 + 0.21 exp(-((y - 0.38) / 0.2)^2) + lip: what a vase encloses, closed above"
    return turned([(float(a), float(a), float(b), 2.0) for a, b in zip(r, y, strict=True)], around, formula)


def jug(around: int = 48) -> tuple[np.ndarray, np.ndarray, str]:
    """Return a jug with walls of an eighth of its foot's radius, and a spout towards +x."""
    outer = [(0.055, 0.0), (0.062, 0.006), (0.078, 0.04), (0.086, 0.075), (0.084, 0.105), (0.07, 0.145), (0.06, 0.172),
             (0.058, 0.19), (0.064, 0.21), (0.072, 0.222)]  # fmt: skip
    inner = [(0.066, 0.222), (0.057, 0.209), (0.05, 0.19), (0.052, 0.171), (0.062, 0.144), (0.076, 0.105),
             (0.078, 0.076), (0.07, 0.042), (0.055, 0.012)]  # fmt: skip
    t = 2.0 * np.pi * np.arange(around) / around
    spout = np.maximum(np.cos(t), 0.0) ** 12
    points, faces = [np.zeros((1, 3))], []
    for r, y in [*outer, *inner]:
        out = r + 0.03 * spout * max(0.0, (y - 0.175) / 0.047)
        up = y + 0.008 * spout * max(0.0, (y - 0.2) / 0.022)
        points.append(np.column_stack([out * np.cos(t), up + 0.0 * t, r * np.sin(t)]))
    points.append(np.array([[0.0, 0.01, 0.0]]))
    last = 1 + around * len([*outer, *inner])
    for j in range(around):
        k = (j + 1) % around
        faces.append((0, 1 + j, 1 + k))
        for first in range(1, last - around, around):
            a, b, c, d = first + j, first + k, first + around + j, first + around + k
            faces += [(a, c, b), (b, c, d)]
        faces.append((last - around + j, last, last - around + k))
    formula = "a profile, turned on a lathe, its lip drawn out by 0.12 cos^12(t): a jug with a spout towards +x"
    return 4.0 * np.concatenate(points), np.array(faces), formula


def valley(columns: int = 161, rows: int = 121) -> np.ndarray:
    """Return heights from 0 to 1 [rows, columns]: a basin behind a gap, a valley that winds down from there."""
    x, z = np.meshgrid(np.linspace(0.0, 4.0, columns), np.linspace(-1.5, 1.5, rows))
    middle = 0.42 * np.sin(1.7 * (x - 0.9)) * np.clip(x - 0.9, 0.0, 1.0)
    bed = 0.52 - 0.115 * x + 0.05 * np.exp(-(((x - 1.25) / 0.16) ** 2))
    wide = 0.62 - 0.34 * np.exp(-(((x - 1.3) / 0.3) ** 2)) + 0.10 * np.clip(x - 1.6, 0.0, 2.0)
    across = np.abs(z - middle) / wide
    sides = 0.42 * across**2 / (1.0 + 0.35 * across**2)
    back = 0.5 * np.clip(0.35 - x, 0.0, 1.0) ** 2 / 0.35**2
    rough = sum(
        0.035 / k * np.sin(k * (3.1 * x + 1.7 * z) + k) * np.sin(k * (2.3 * z - 1.1 * x) + 2 * k)
        for k in (1.0, 2.1, 4.3)
    )
    low = np.where(z > middle, 1.0 - 0.55 * np.clip((x - 1.55) / 0.5, 0.0, 1.0), 1.0)  # the near side, to look in
    h = bed + sides * low + back + rough * np.clip(across - 0.35, 0.0, 1.0)
    # The edge of the plain above is round over four steps of the grid: a sharp one that runs aslant has teeth.
    edge = 0.1
    h = np.minimum(h, 0.98 + edge) - np.clip(h - 0.98 + edge, 0.0, 2.0 * edge) ** 2 / (4.0 * edge)
    return np.clip(h, 0.02, 0.98)


def write_heights(name: str, heights: np.ndarray) -> None:
    """Write heights from 0 to 1 as a picture of 16 bits."""
    Image.fromarray(np.round(heights * 65535.0).astype(np.uint16)).save(FOLDER / f"{name}.png", optimize=True)


def write(name: str, vertices: np.ndarray, faces: np.ndarray, formula: str) -> None:
    """Write an OBJ file."""
    lines = [f"# wavetank: {name}", f"# {formula}", "# made by docs/models.py, MIT licence"]
    lines += [f"v {x:.3f} {y:.3f} {z:.3f}" for x, y, z in vertices]
    lines += ["f " + " ".join(str(corner + 1) for corner in dict.fromkeys(face)) for face in faces]
    (FOLDER / f"{name}.obj").write_text("\n".join(lines) + "\n", encoding="ascii")


if __name__ == "__main__":
    write("knot", *knot())
    write("bathtub", *bathtub())
    write("boat", *boat())
    write("vase", *vase())
    write("jug", *jug())
    write_heights("valley", valley())
