"""The default scene: half a second of water, one picture."""

from PIL import Image

import wavetank as wt

sim = wt.Simulation(wt.Scene.load("obstacle-tank"))
sim.advance(0.5)
Image.fromarray(wt.render(sim, width=960, height=540)).save("first-water.png")
print(f"{sim.count:,} particles after {sim.time:.2f} s: first-water.png")
