"""Surfaces made by hand: vertices and faces."""

import numpy as np

CUBE = (
    np.array([(x, y, z) for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)]),
    np.array(
        [
            (0, 1, 3),
            (0, 3, 2),
            (4, 6, 7),
            (4, 7, 5),
            (0, 4, 5),
            (0, 5, 1),
            (2, 3, 7),
            (2, 7, 6),
            (0, 2, 6),
            (0, 6, 4),
            (1, 5, 7),
            (1, 7, 3),
        ]
    ),
)


def turned_around_y(radii, heights, steps=48):
    """A profile of radii and heights, turned around the y axis; its ends are closed where their radius is not zero."""
    t = np.linspace(0.0, 2.0 * np.pi, steps, endpoint=False)
    rings = [np.stack([r * np.cos(t), 0 * t + y, r * np.sin(t)], axis=1) for r, y in zip(radii, heights, strict=True)]
    faces = []
    for ring in range(len(rings) - 1):
        for j in range(steps):
            a, b = ring * steps + j, ring * steps + (j + 1) % steps
            faces += [(a, a + steps, b), (b, a + steps, b + steps)]
    vertices = np.concatenate([*rings, [(0, heights[0], 0), (0, heights[-1], 0)]])
    last = (len(rings) - 1) * steps
    for j in range(steps):
        faces.append((len(vertices) - 2, j, (j + 1) % steps))
        faces.append((len(vertices) - 1, last + (j + 1) % steps, last + j))
    return vertices, np.array(faces)


def ball(steps=64):
    """A ball of radius 1."""
    s = np.linspace(-0.5 * np.pi, 0.5 * np.pi, steps // 2)
    return turned_around_y(np.cos(s), np.sin(s), steps)


def cup(radius, height, wall):
    """A cup with walls and a floor of that thickness, its floor at y = 0."""
    return turned_around_y([radius, radius, radius - wall, radius - wall], [0.0, height, height, wall])


def write_obj(path, vertices, faces):
    lines = [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in vertices]
    lines += ["f " + " ".join(str(corner + 1) for corner in face) for face in faces]
    path.write_text("\n".join(lines) + "\n")
