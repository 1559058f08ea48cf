"""Ground from an array of heights, a pond that fills a hollow up to a level, and a tank with an open side."""

import numpy as np
from PIL import Image

import wavetank as wt

x, z = np.meshgrid(np.linspace(-1, 1, 81), np.linspace(-1, 1, 81))
hills = 0.3 + 0.08 * np.sin(3 * x + 1) * np.cos(4 * z) - 0.24 * np.exp(-5 * (x**2 + z**2)) - 0.06 * x

scene = wt.Scene(
    title="A pond in the hills",
    spacing=0.035,
    tank=wt.Tank(size=(2, 1, 2), lower=(-1, -0.1, -1), open=["+x"]),  # what runs over the edge is gone
    solids=[wt.HeightField(name="hills", heights=hills, center=(0, 0, 0), size=(2, 1, 2), base=0.2)],
    fluids=[
        wt.Filled(inside=wt.Box(center=(0, 0.14, 0), size=(1.0, 0.2, 1.0))),  # what the ground leaves of it
        wt.Ball(center=(0, 0.6, 0), radius=0.12),
    ],
)
sim = wt.Simulation(scene)
sim.advance(0.5)
Image.fromarray(wt.render(sim, width=960, height=600)).save("pond.png")
print(f"{sim.count:,} particles: pond.png")
