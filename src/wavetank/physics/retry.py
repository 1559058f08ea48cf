"""A step that is taken again, where a body was hit so hard that it had to be elsewhere."""

from typing import Any

from wavetank.device.compiler import qd
from wavetank.device.state import vectors
from wavetank.physics.world import World


@qd.kernel(fastcache=True)
def copy_motion(
    to_v: qd.types.ndarray(), to_a: qd.types.ndarray(), v: qd.types.ndarray(), a: qd.types.ndarray(), count: qd.i32
):
    """Copy velocities and accelerations."""
    for i in range(count):
        to_v[i] = v[i]
        to_a[i] = a[i]


class Retry:
    """What a step changes of particles before it sorts them, for when it has to be taken again.

    They are sorted into the spare ones: until the step has its velocities all else is still there, as it was. (Places
    are not in worlds that repeat, which have no bodies.)
    """

    def __init__(self) -> None:
        self._kept: tuple[Any, Any] | None = None

    def keep(self, world: World) -> None:
        """Keep the motion of the particles."""
        v, a = world.particles.v, world.particles.a
        if self._kept is None or self._kept[0].shape != v.shape:
            dim, count = v.element_shape[0], v.shape[0]
            self._kept = vectors(dim, count), vectors(dim, count)
        copy_motion(*self._kept, v, a, world.count)

    def restore(self, world: World) -> None:
        """Let the particles be again what they were."""
        assert self._kept is not None
        world.swap()
        copy_motion(world.particles.v, world.particles.a, *self._kept, world.count)
