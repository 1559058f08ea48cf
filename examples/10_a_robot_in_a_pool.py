"""A robot from a file of MuJoCo: a boat with two wheels rows itself through a pool."""

from pathlib import Path

from PIL import Image

import wavetank as wt

robot = wt.load_robot(Path(__file__).parent / "robots" / "paddle_boat.xml", position=(0.45, 0.33, 0.5))
pool = wt.Scene(
    spacing=0.05, tank=wt.Tank(size=(1.6, 0.75, 1.0)), fluids=[wt.Block(lower=(0, 0, 0), upper=(1.6, 0.33, 1.0))]
)
sim = wt.Simulation(robot.joined(pool))
for name in ("left", "right"):
    sim.joints[name].speed = 7.0  # rad/s
for _ in range(4):
    sim.advance(0.5)
    raft, power = sim.bodies["raft"], sum(joint.power for joint in sim.joints.values())
    print(f"t = {sim.time:.1f} s  x = {raft.position[0]:.2f} m  drag {raft.drag[0]:+.1f} N  motors {power:.1f} W")
Image.fromarray(wt.render(sim, width=960, height=640)).save("boat.png")
