"""What a term of the step is: where it acts in Algorithm 1, in which steps, and what it does."""

import dataclasses
import enum
from collections.abc import Callable

from wavetank.device.state import Coefficients
from wavetank.foundation.params import Parameters
from wavetank.physics.plan import Plan
from wavetank.physics.world import World


class Hook(enum.Enum):
    """Where in Algorithm 1 a term acts."""

    FORCES = enum.auto()  # after line 7, on velocities and predicted positions: `integrate.accelerate` changes both
    END_OF_ITERATIONS = enum.auto()  # after line 19, on what the iterations have made of predicted positions
    VELOCITIES = enum.auto()  # after line 21, on velocities alone


def always(plan: Plan) -> bool:
    """Act in every step."""
    return True


@dataclasses.dataclass(frozen=True)
class Term:
    """A term of the step; the kernels that `apply` launches may live in any file."""

    name: str
    hook: Hook
    apply: Callable[[World, Plan, Parameters, Coefficients], None]
    acts: Callable[[Plan], bool] = always  # whether it acts in a step
