"""Two numbers instead of three make a 2-D world; everything else stays. Written to a scene file and read back."""

from PIL import Image

import wavetank as wt

wt.Scene(
    title="A wave meets a step",
    spacing=0.012,
    tank=wt.Tank(size=(2.0, 0.8)),
    fluids=[wt.Block(lower=(0, 0), upper=(0.5, 0.6)), wt.Block(lower=(0.5, 0), upper=(1.4, 0.1))],
    solids=[wt.Box(name="step", center=(1.7, 0.1), size=(0.6, 0.2)), wt.Sphere(center=(1.0, 0.25), radius=0.06)],
).save("step.toml")

sim = wt.Simulation(wt.Scene.load("step.toml"))
sim.advance(0.7)
Image.fromarray(wt.render(sim, width=1200, height=560)).save("step.png")
print(f"{sim.count:,} particles: step.toml, step.png")
