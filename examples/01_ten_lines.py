"""A scene of your own in ten lines."""

from PIL import Image

import wavetank as wt

scene = wt.Scene(
    spacing=0.03,
    tank=wt.Tank(size=(1.2, 0.8, 0.6)),
    fluids=[wt.Block(lower=(0, 0, 0), upper=(0.4, 0.6, 0.6)), wt.Ball(center=(0.8, 0.6, 0.3), radius=0.12)],
    solids=[wt.Sphere(center=(0.8, 0.1, 0.3), radius=0.12)],
)
sim = wt.Simulation(scene)
for frame in sim.frames(seconds=0.6, fps=10):
    print(f"t = {frame.time:.1f} s, highest particle at {frame.positions[:, 1].max():.2f} m")
Image.fromarray(wt.render(sim, width=960, height=540, color_by="speed")).save("ten-lines.png")
