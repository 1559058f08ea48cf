"""What a hand does, done by a script: the same commands, recorded, and replayed to the last bit."""

from PIL import Image

import wavetank as wt
from wavetank import commands as do


def down(x, y):
    """A pointer straight at a place of a 2-D world."""
    return {"origin": (x, y, 5.0), "direction": (0.0, 0.0, -1.0)}


scene = wt.Scene(spacing=0.02, tank=wt.Tank(size=(1.2, 0.8)), fluids=[wt.Block(lower=(0, 0), upper=(1.2, 0.25))])
session = wt.Session(scene)
session.apply(do.AddSolid(solid=wt.Sphere(name="ball", center=(0.85, 0.2), radius=0.1)))
session.apply(do.ToolBegin(tool="pour", options={"width": 0.1, "color": "#e0446a", "keep": True}, **down(0.25, 0.7)))
session.apply(do.ToolEnd())
for frame in range(60):
    if frame == 20:
        session.apply(do.Bookmark(name="calm"))
        session.apply(do.ToolBegin(tool="stir", options={"radius": 0.15}, **down(0.6, 0.2)))
    if frame > 20:
        session.apply(do.ToolMove(**down(0.6 + 0.004 * frame, 0.2)))
    session.tick()
session.apply(do.ToolEnd())

recording = wt.Recording.of(session, scene)
recording.save("session.toml")
*_, again = wt.replay(wt.Recording.load("session.toml"))
assert again.sim.digest() == session.sim.digest()
Image.fromarray(wt.render(again.sim, width=1200, height=700)).save("session.png")
print(f"{session.sim.count:,} particles, {len(recording.commands)} commands, twice the same: session.toml, session.png")
