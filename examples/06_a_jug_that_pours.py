"""Solids of any shape: a jug and a bowl, turned on a lathe; with a file it is wt.Mesh(path="jug.obj", ...)."""

import math

import numpy as np
from PIL import Image

import wavetank as wt


def turned(profile, steps=64):
    """Vertices and faces of a profile of (radius, height), turned around the y axis, where it begins and ends."""
    t = np.linspace(0.0, 2.0 * np.pi, steps, endpoint=False)
    vertices = [(r * math.cos(a), y, r * math.sin(a)) for r, y in profile for a in t]
    faces = []
    for first in range(0, steps * (len(profile) - 1), steps):
        for j in range(steps):
            a, b = first + j, first + (j + 1) % steps
            faces += [(a, a + steps, b), (b, a + steps, b + steps)]
    return vertices, faces


# Out along the floor and up the outside, over the rim, down the inside: walls of 8 mm, about half a spacing.
JUG = [
    (0, 0),
    (0.07, 0),
    (0.09, 0.08),
    (0.07, 0.18),
    (0.085, 0.22),
    (0.077, 0.22),
    (0.062, 0.18),
    (0.082, 0.08),
    (0.062, 0.008),
    (0, 0.008),
]
BOWL = [(0, 0), (0.06, 0), (0.11, 0.03), (0.15, 0.1), (0.142, 0.1), (0.102, 0.038), (0.055, 0.008), (0, 0.008)]

scene = wt.Scene(
    title="A jug pours into a bowl",
    spacing=0.014,
    foam=0,
    tank=wt.Tank(size=(0.7, 0.6, 0.4)),
    fluids=[wt.Block(lower=(0.205, 0.335, 0.155), upper=(0.295, 0.475, 0.245))],
    solids=[
        wt.Mesh.of(*turned(JUG), name="jug", center=(0.25, 0.42, 0.2), size=0.22),
        wt.Mesh.of(*turned(BOWL), center=(0.44, 0.06, 0.2), size=0.3),
    ],
)
sim = wt.Simulation(scene)
images = []
for k in range(150):
    angle = -1.9 * min(1.0, max(0.0, (k - 20) / 100))
    sim.move("jug", rotation=angle)
    sim.step()
    if k in (20, 92, 104, 149):
        images.append(wt.render(sim, width=640, height=560, view="water", color_by="#a01838"))
Image.fromarray(np.hstack(images)).save("pouring.png")
radius = np.hypot(sim.positions[:, 0] - 0.44, sim.positions[:, 2] - 0.2)
caught = np.mean((radius < 0.15) & (sim.positions[:, 1] < 0.12))
print(f"{sim.count:,} particles, {100 * caught:.0f} % of the water is in the bowl: pouring.png")
