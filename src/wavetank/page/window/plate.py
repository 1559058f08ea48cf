"""The picture of the water on the graphics side."""

from typing import Any

import moderngl
import numpy as np


class Plate:
    """A texture that takes the size of what it shows."""

    def __init__(self, context: "moderngl.Context") -> None:
        self.context = context
        self.texture: Any = None

    def show(self, image: np.ndarray) -> None:
        """Bring a picture, uint8 [height, width, 3], into the texture."""
        height, width = image.shape[:2]
        if self.texture is None or self.texture.size != (width, height):
            self.release()
            self.texture = self.context.texture((width, height), 3, alignment=1)
            self.texture.filter = (moderngl.LINEAR, moderngl.LINEAR)
        self.texture.write(np.ascontiguousarray(image).tobytes())

    def release(self) -> None:
        """Give the texture back."""
        if self.texture is not None:
            self.texture.release()
            self.texture = None
