"""What reading another program's scene gives."""

import dataclasses

from wavetank.scene.scene import Scene


@dataclasses.dataclass(frozen=True)
class Imported:
    """A scene, and what of the file it does not have."""

    scene: Scene
    notes: tuple[str, ...]
