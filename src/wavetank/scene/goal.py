"""The goal of a level as plain data: `[goal]` in a scene file.

An aim compares one number of a frame with `share`; `session/measures.py` takes it.
"""

from collections.abc import Iterator
from typing import Annotated, Any, ClassVar, Literal

from pydantic import BeforeValidator, Field, model_validator
from typing_extensions import override

from wavetank.foundation.model import Model, Place, Positive, register_model

Share = Annotated[float, Field(gt=0, le=1, allow_inf_nan=False)]


class Aim(Model):
    """One thing to reach, or to keep from happening, inside a box of the world."""

    forbids: ClassVar[bool] = False  # whether a value above `share` loses the game at once
    name: str = ""  # shown next to the outline
    lower: Place
    upper: Place
    share: Share
    material: str = ""  # counts only this fluid of the scene's materials
    color: Annotated[str, Field(pattern=r"^(#[0-9a-fA-F]{6})?$")] = ""  # counts only what is dyed about like this

    @model_validator(mode="after")
    def _has_room(self) -> "Aim":
        if any(a >= b for a, b in zip(self.lower, self.upper, strict=False)):
            raise ValueError(f"a region from {self.lower} to {self.upper} is empty; lower must be below upper.")
        return self

    def progress(self, value: float) -> float:
        """Return the progress, 0 to 1."""
        return min(1.0, max(0.0, value / self.share))


class Fill(Aim):
    """Fill the region to a share of its volume."""

    kind: Literal["fill"] = "fill"


class Dry(Aim):
    """Keep the region dry: more than a share of its volume loses."""

    kind: Literal["dry"] = "dry"
    forbids: ClassVar[bool] = True

    @override
    def progress(self, value: float) -> float:
        return float(value <= self.share)


class Deliver(Aim):
    """Bring a share of what was there at the beginning into the region."""

    kind: Literal["deliver"] = "deliver"


class Apart(Aim):
    """Gather a fluid or a colour in the region, and nothing else: the lesser of share gathered and purity there."""

    kind: Literal["apart"] = "apart"


class Mix(Aim):
    """Mix a fluid or a colour with the rest: `share` is one minus the intensity of segregation."""

    kind: Literal["mix"] = "mix"


class Bring(Aim):
    """Bring a body into the region: `share` is how much of it has to be there."""

    kind: Literal["bring"] = "bring"
    body: str  # the name of a solid with a density or a mass


AnyAim = Annotated[Fill | Dry | Deliver | Apart | Mix | Bring, Field(discriminator="kind")]
for _kind in (Fill, Dry, Deliver, Apart, Mix, Bring):
    register_model(_kind.model_fields["kind"].default, _kind)


def _one_or_many(value: Any) -> Any:
    return [value] if isinstance(value, dict) else value


class Goal(Model):
    """What the player has to do in a scene, with which tools, and in which time."""

    text: str  # one sentence for the player
    hint: str = ""  # another one, shown to a player who has lost
    number: Annotated[int, Field(ge=0)] = 0  # place in the list of levels
    aims: Annotated[list[AnyAim], BeforeValidator(_one_or_many), Field(min_length=1, max_length=12)]
    seconds: Annotated[float, Field(gt=0, le=3600, allow_inf_nan=False)]  # s of water
    hold: Annotated[float, Field(ge=0, le=60, allow_inf_nan=False)] = 0.5  # s for which all aims must be met
    stars: tuple[Positive, Positive] | None = None  # three and two stars: see `Game.stars`
    tools: dict[str, dict[str, Any]] | None = None  # allowed ones with the options that are fixed; all where None
    strokes: Annotated[int, Field(ge=1)] | None = None  # how often a tool may be used

    def vectors(self) -> Iterator[tuple[str, tuple[float, ...]]]:
        """Name every corner, to check that all have the dimension of the world."""
        for number, aim in enumerate(self.aims):
            yield f"aims[{number}].lower", aim.lower
            yield f"aims[{number}].upper", aim.upper

    @property
    def is_endured(self) -> bool:
        """Whether all aims are things to prevent until the time is over."""
        return all(aim.forbids for aim in self.aims)

    @model_validator(mode="after")
    def _stars_fall(self) -> "Goal":
        if self.stars is not None and self.stars[0] >= self.stars[1]:
            raise ValueError(f"goal.stars = {self.stars} is not allowed; three stars ask for less than two.")
        return self
