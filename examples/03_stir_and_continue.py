"""Move a named solid through the water, change a parameter on the way, save the state and continue from it."""

import math

import numpy as np
from PIL import Image

import wavetank as wt

scene = wt.Scene(
    spacing=0.03,
    tank=wt.Tank(size=(0.9, 0.6, 0.9)),
    fluids=[wt.Block(lower=(0, 0, 0), upper=(0.9, 0.27, 0.9))],
    solids=[wt.Box(name="paddle", center=(0.65, 0.2, 0.45), size=(0.3, 0.3, 0.06))],
)
sim = wt.Simulation(scene)
for k in range(60):
    angle = 0.06 * (k + 1)
    sim.move(
        "paddle",
        position=(0.45 + 0.2 * math.cos(angle), 0.2, 0.45 - 0.2 * math.sin(angle)),
        rotation=(math.cos(angle / 2), 0, math.sin(angle / 2), 0),
    )
    if k == 30:
        sim.viscosity = 0.3
    sim.step()
sim.save("stirred.npz")

again = wt.Simulation.restore("stirred.npz")
for world in (sim, again):
    world.advance(0.2)
assert np.array_equal(sim.positions, again.positions)
Image.fromarray(wt.render(again, width=960, height=540)).save("stirred.png")
print(f"mean speed {np.linalg.norm(again.velocities, axis=1).mean():.2f} m/s, the same to the last bit: stirred.npz")
