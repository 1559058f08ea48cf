"""A step that is taken again, where a body was hit so hard that it had to be elsewhere."""

from typing import Any

from wavetank.device.compiler import qd
from wavetank.device.state import vectors
from wavetank.physics.world import World


@qd.kernel(fastcache=True)
def copy_motion(
    to_v: qd.types.ndarray(), to_a: qd.types.ndarray(), to_x: qd.types.ndarray(), v: qd.types.ndarray(),
    a: qd.types.ndarray(), x: qd.types.ndarray(), count: qd.i32, places: qd.template(),
):  # fmt: skip
    """Copy velocities and accelerations, and `places` if so."""
    for i in range(count):
        to_v[i] = v[i]
        to_a[i] = a[i]
        if qd.static(places):
            to_x[i] = x[i]


class Retry:
    """What a step changes of particles before it sorts them, for when it has to be taken again.

    They are sorted into the spare ones: until the step has its velocities all else is still there, as it was.
    """

    def __init__(self) -> None:
        self._kept: tuple[Any, Any, Any] | None = None

    def keep(self, world: World) -> None:
        """Keep the motion of particles, and where the world repeats their places, which are brought within."""
        x = world.particles.x
        if self._kept is None or self._kept[0].shape != x.shape:
            count, dim = x.shape[0], x.element_shape[0]
            self._kept = vectors(dim, count), vectors(dim, count), vectors(dim, count if _repeats(world) else 1)
        motion = world.particles.v, world.particles.a, x
        copy_motion(*self._kept, *motion, world.count, _repeats(world))

    def restore(self, world: World) -> None:
        """Let the particles be again what they were."""
        assert self._kept is not None
        world.swap()
        motion = world.particles.v, world.particles.a, world.particles.x
        copy_motion(*motion, *self._kept, world.count, _repeats(world))


def _repeats(world: World) -> int:
    return int(world.grid.periods.axes != 0)
