"""A scene in one line."""

from typing import Any


def summary(scene: Any) -> str:
    """Say of a `Scene` what a person would: its title, its size, and how much there is of what."""
    count = sum(fluid.estimate(scene.spacing) for fluid in scene.fluids)
    size = f"tank of {' x '.join(f'{side:g}' for side in scene.tank.size)} m" if scene.tank else "no tank"
    members = {kind: len(getattr(scene, f"{kind}s")) for kind in ("solid", "joint", "emitter", "drain")}
    parts = [f"{number} {kind}{'s' * (number != 1)}" for kind, number in members.items() if number]
    about = [f"{scene.dim}-D", size, f"about {count:,.0f} particles of {scene.spacing:g} m", *parts]
    return f"<Scene {scene.title or 'without title'!r}: {', '.join(about)}>"
