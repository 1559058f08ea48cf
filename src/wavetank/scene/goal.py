"""What a level asks for, as plain data: `[goal]` in a scene file, and how far a frame has come.

An aim measures one number of a frame and compares it with `share`. Volumes are counted in particles, d^dim each, so
that a level means the same at another spacing.
"""

from collections.abc import Iterator
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import BeforeValidator, Field, model_validator
from typing_extensions import override

from wavetank.foundation.model import Model, Positive, Vector, register_model

if TYPE_CHECKING:
    from wavetank.simulation.frame import Frame

Share = Annotated[float, Field(gt=0, le=1, allow_inf_nan=False)]
COLOR_REACH = 90.0  # of 255: how far a dye may be from the colour asked for
STRONG = 32  # of 127: weaker dyes count as clear
CELL = 4.0  # d: edge of the cells in which a mixture is looked at


class Aim(Model):
    """One thing to reach, or to keep from happening, inside a box of the world."""

    forbids: ClassVar[bool] = False  # whether more than `share` loses the game at once
    name: str = ""  # shown beside the outline
    lower: Vector  # m
    upper: Vector  # m
    share: Share
    material: str = ""  # counts only this fluid of the scene's materials
    color: Annotated[str, Field(pattern=r"^(#[0-9a-fA-F]{6})?$")] = ""  # counts only what is dyed about like this

    @model_validator(mode="after")
    def _has_room(self) -> "Aim":
        if any(a >= b for a, b in zip(self.lower, self.upper, strict=False)):
            raise ValueError(f"a region from {self.lower} to {self.upper} is empty; lower must be below upper.")
        return self

    def measure(self, frame: "Frame", start: int) -> float:
        """Return what is compared with `share`; `start` is the number of the counted particles at the beginning."""
        raise NotImplementedError

    def progress(self, value: float) -> float:
        """Return how much of the way is done, 0 to 1."""
        return min(1.0, max(0.0, value / self.share))

    def inside(self, frame: "Frame") -> np.ndarray:
        """Say which particles are in the region, bool [count]."""
        low, high = np.array(self.lower, np.float32), np.array(self.upper, np.float32)
        return np.asarray(((frame.positions >= low) & (frame.positions <= high)).all(axis=1))

    def counted(self, frame: "Frame") -> np.ndarray:
        """Say which particles are of the fluid and the colour that count, bool [count]."""
        counts: np.ndarray = np.ones(frame.count, bool)
        if self.material:
            names = [material.name for material in frame.scene.palette()[1:]]
            counts = frame.materials == 1 + names.index(self.material)
        if self.color:
            wanted = np.array([int(self.color[k : k + 2], 16) for k in (1, 3, 5)], float)
            dyes = frame.dyes
            given = np.stack([(dyes >> shift) & 255 for shift in (16, 8, 0)], axis=1)
            alike: np.ndarray = (dyes >> 24 >= STRONG) & (np.linalg.norm(given - wanted, axis=1) < COLOR_REACH)
            counts &= alike
        return counts

    def wet(self, frame: "Frame") -> float:
        """Return the share of the region's volume that is what counts."""
        volume = float(np.prod(np.subtract(self.upper, self.lower)))
        return float(np.sum(self.inside(frame) & self.counted(frame)) * frame.scene.spacing**frame.dim / volume)


class Fill(Aim):
    """Fill the region to a share of its volume."""

    kind: Literal["fill"] = "fill"

    @override
    def measure(self, frame: "Frame", start: int) -> float:
        return self.wet(frame)


class Dry(Aim):
    """Keep the region dry: more than a share of its volume loses."""

    kind: Literal["dry"] = "dry"
    forbids: ClassVar[bool] = True

    @override
    def measure(self, frame: "Frame", start: int) -> float:
        return self.wet(frame)

    @override
    def progress(self, value: float) -> float:
        return float(value <= self.share)


class Deliver(Aim):
    """Bring a share of what was there at the beginning into the region."""

    kind: Literal["deliver"] = "deliver"

    @override
    def measure(self, frame: "Frame", start: int) -> float:
        return float(np.sum(self.inside(frame) & self.counted(frame)) / max(start, 1))


class Apart(Aim):
    """Gather a fluid or a colour in the region, and nothing else: the lesser of share gathered and purity there."""

    kind: Literal["apart"] = "apart"

    @override
    def measure(self, frame: "Frame", start: int) -> float:
        inside, counted = self.inside(frame), self.counted(frame)
        both = int(np.sum(inside & counted))
        return both / max(int(inside.sum()), start, 1)


class Mix(Aim):
    """Mix a fluid or a colour with the rest: one minus the intensity of segregation.

    That is the variance of its share among cells, over the variance it has unmixed: Danckwerts 1952, Eq. 9,
    doi:10.1007/BF03184936.
    """

    kind: Literal["mix"] = "mix"

    @override
    def measure(self, frame: "Frame", start: int) -> float:
        inside, counted = self.inside(frame), self.counted(frame)
        mean = float(counted[inside].mean()) if inside.any() else 0.0
        if not 0.0 < mean < 1.0:
            return 0.0
        cells = np.floor((frame.positions[inside] - np.array(self.lower)) / (CELL * frame.scene.spacing)).astype(int)
        _, cell = np.unique(cells, axis=0, return_inverse=True)
        number = np.bincount(cell.reshape(-1))
        shares = np.bincount(cell.reshape(-1), weights=counted[inside]) / number
        variance = float(np.sum(number * (shares - mean) ** 2) / number.sum())
        return 1.0 - variance / (mean * (1.0 - mean))


AnyAim = Annotated[Fill | Dry | Deliver | Apart | Mix, Field(discriminator="kind")]
for _kind in (Fill, Dry, Deliver, Apart, Mix):
    register_model(_kind.model_fields["kind"].default, _kind)


def _one_or_many(value: Any) -> Any:
    return [value] if isinstance(value, dict) else value


class Goal(Model):
    """What has to be done in a scene, with what, in which time."""

    text: str  # one sentence for the player
    hint: str = ""  # one more, for who has lost
    number: Annotated[int, Field(ge=0)] = 0  # place in the list of levels
    aims: Annotated[list[AnyAim], BeforeValidator(_one_or_many), Field(min_length=1, max_length=12)]
    seconds: Annotated[float, Field(gt=0, le=3600, allow_inf_nan=False)]  # s of water
    hold: Annotated[float, Field(ge=0, le=60, allow_inf_nan=False)] = 0.5  # s for which all aims must be met
    stars: tuple[Positive, Positive] | None = None  # three and two stars: see `Game.stars`
    tools: dict[str, dict[str, Any]] | None = None  # allowed ones with the options that are fixed; all where None
    strokes: Annotated[int, Field(ge=1)] | None = None  # how often a tool may be put down

    def vectors(self) -> Iterator[tuple[str, tuple[float, ...]]]:
        """Name every corner, to check that all live in one dimension."""
        for number, aim in enumerate(self.aims):
            yield f"aims[{number}].lower", aim.lower
            yield f"aims[{number}].upper", aim.upper

    @property
    def is_endured(self) -> bool:
        """Whether there is nothing to reach: all that is asked is that nothing happens until time is over."""
        return all(aim.forbids for aim in self.aims)

    @model_validator(mode="after")
    def _stars_fall(self) -> "Goal":
        if self.stars is not None and self.stars[0] >= self.stars[1]:
            raise ValueError(f"goal.stars = {self.stars} is not allowed; three stars ask for less than two.")
        return self
