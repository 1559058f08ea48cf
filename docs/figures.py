"""Make the pictures of README and docs anew: `make figures`, a few minutes on two cores."""

import shutil
import tempfile
from pathlib import Path

from PIL import Image

import wavetank as wt
from wavetank.lab.converge import converge
from wavetank.view.renderer import Renderer

DOCS = Path(__file__).parent
SHOTS = {
    "obstacle-tank": (wt.Scene.load("obstacle-tank"), 0.55),
    "double-dam-2d": (wt.Scene.load("double-dam-2d").changed(spacing=0.008), 0.45),
    "drop": (wt.Scene.load("drop").changed(spacing=0.02), 0.35),
}


def main() -> None:
    """Write every picture."""
    for name, (scene, moment) in SHOTS.items():
        sim = wt.Simulation(scene)
        sim.advance(moment)
        image = Renderer(1280, 720, supersample=2).render(sim.frame())
        Image.fromarray(image).save(DOCS / f"{name}.jpg", quality=88, optimize=True)
    with tempfile.TemporaryDirectory() as folder:
        converge(wt.Scene.load("obstacle-tank"), Path(folder), seconds=1.5)
        shutil.copy(Path(folder) / "converge.png", DOCS / "converge.png")


if __name__ == "__main__":
    main()
