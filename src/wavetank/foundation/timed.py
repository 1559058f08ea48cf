"""Data whose numbers may change with time: expressions and keyframes wherever a number or a vector is expected."""

from typing import Any, Self

import numpy as np
from pydantic import ValidationError, model_validator

from wavetank.foundation.errors import WavetankError
from wavetank.foundation.expressions import TRIED, TRIES
from wavetank.foundation.model import Model, numeric_fields, sentence
from wavetank.foundation.tracks import checked_track, track, varies


class Timed(Model):
    """Data with numbers that may change; a field holds its value at t = 0, `over_time` the track."""

    over_time: dict[str, Any] = {}  # by the names of fields; made from expressions and keyframes in their places

    @model_validator(mode="before")
    @classmethod
    def _spread(cls, values: Any) -> Any:
        if not isinstance(values, dict):
            return values
        given = values.get("over_time") or {}
        if not isinstance(given, dict):
            raise ValueError("over_time must be a table of expressions or keyframes, by the names of fields.")
        given = dict(given)
        given |= {name: values[name] for name in numeric_fields(cls) if varies(values.get(name))}
        if not given:
            return values
        rest: dict[str, Any] = {}
        for name, plain in given.items():
            if name not in numeric_fields(cls):
                raise ValueError(f"over_time: {name!r} is not a number of {cls.__name__}.")
            try:
                now = np.asarray(track(plain)(0.0)) if not callable(plain) else np.zeros(())
                given[name] = checked_track(plain, name, len(now) if now.shape else None)
            except (WavetankError, TypeError) as error:
                raise ValueError(f"{error}" if str(error).startswith(name) else f"{name}: {error}") from None
            rest[name] = now.tolist()
        return values | rest | {"over_time": given}

    @model_validator(mode="after")
    def _allowed_later(self) -> Self:
        if self.over_time:
            try:
                for number in range(1, round(TRIED * TRIES) + 1):
                    self.at(number / TRIES)
            except WavetankError as error:
                raise ValueError(str(error)) from None
        return self

    def at(self, time: float) -> Self:
        """Return a copy with the values at `time` [s]; raises `WavetankError` for a value that is not allowed."""
        if not self.over_time:
            return self
        now = {name: track(plain)(time).tolist() for name, plain in self.over_time.items()}
        fields = {name: getattr(self, name) for name in type(self).model_fields} | now | {"over_time": {}}
        try:
            result: Self = type(self).model_validate(fields)
        except ValidationError as report:
            raise WavetankError(f"at t = {time:.6g} s: {sentence(report, type(self))}") from None
        return result
