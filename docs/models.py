"""The bundled models, made anew: each from the formula in its head. `python docs/models.py`"""

from pathlib import Path

import numpy as np

FOLDER = Path(__file__).parent.parent / "src" / "wavetank" / "models"


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


def write(name: str, vertices: np.ndarray, faces: np.ndarray, formula: str) -> None:
    """Write an OBJ file."""
    lines = [f"# wavetank: {name}", f"# {formula}", "# made by docs/models.py, MIT licence"]
    lines += [f"v {x:.3f} {y:.3f} {z:.3f}" for x, y, z in vertices]
    lines += ["f " + " ".join(str(corner + 1) for corner in face) for face in faces]
    (FOLDER / f"{name}.obj").write_text("\n".join(lines) + "\n", encoding="ascii")


if __name__ == "__main__":
    write("knot", *knot())
