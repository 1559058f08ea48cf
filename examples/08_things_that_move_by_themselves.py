"""Motion is part of the scene: a gate by keyframes, a paddle by an expression, a tank that leans."""

import numpy as np
from PIL import Image

import wavetank as wt

scene = wt.Scene(
    title="A gate, a paddle, a tank that leans",
    spacing=0.016,
    tank=wt.Tank(size=(1.6, 0.7), tilt="5*deg*sin(2*pi*0.25*t)"),
    fluids=[wt.Block(lower=(0, 0), upper=(0.5, 0.45)), wt.Block(lower=(0.6, 0), upper=(1.6, 0.1))],
    solids=[
        wt.Box(
            name="gate",
            center=(0.55, 0.35),
            size=(0.05, 0.7),
            motion=[{"time": 0.3, "position": (0.55, 0.35)}, {"time": 0.9, "position": (0.55, 0.5)}],
        ),
        wt.Box(
            name="paddle", center=("1.5 + 0.08*sin(2*pi*1.2*t)", 0.3), size=(0.05, 0.5), rotation="0.2*sin(2*pi*1.2*t)"
        ),
    ],
)
scene.save("moving.toml")  # all of it is data
sim = wt.Simulation(wt.Scene.load("moving.toml"))
images = []
for moment in (0.3, 0.7, 1.2, 2.0):
    sim.advance(moment - sim.time)
    images.append(wt.render(sim, width=640, height=320))
sim.move("paddle", position=(1.3, 0.3))  # a hand takes the paddle
sim.step()
sim.release("paddle", within=0.5)  # and gives it back
sim.advance(0.5)
Image.fromarray(np.vstack(images)).save("moving.png")
print(f"{sim.count:,} particles after {sim.time:.2f} s, gravity {sim.gravity[0]:.2f}, {sim.gravity[1]:.2f}: moving.png")
