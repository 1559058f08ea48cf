"""Water comes and goes: a tap that keeps a level, and a drain that takes two litres a second."""

from PIL import Image

import wavetank as wt

scene = wt.Scene(
    title="A tap keeps the level of a sink",
    spacing=0.02,
    tank=wt.Tank(size=(0.6, 0.6, 0.4)),
    emitters=[
        wt.Emitter(position=(0.15, 0.5, 0.2), direction=(0, -1, 0), radius=0.04, speed=1.2, level=0.12, dye="#2060d0")
    ],
    drains=[wt.Drain(center=(0.5, 0, 0.2), radius=0.05, direction=(0, 1, 0), flow=2.0, start=1.5)],
)
sim = wt.Simulation(scene)
for _ in range(5):
    sim.advance(0.5)
    stats = sim.stats()
    litres = 1e3 * scene.spacing**3
    print(
        f"{sim.time:.1f} s: {litres * sim.count:5.2f} l in the sink, {litres * stats['emitted']:5.2f} l came, "
        f"{litres * stats['drained']:5.2f} l went"
    )
Image.fromarray(wt.render(sim, width=960, height=640)).save("tap.png")
