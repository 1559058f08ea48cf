"""Experiments of `wavetank validate`: one file per case, each with a `CASE`, listed in `CASES`."""

from wavetank.lab.cases import (
    column,
    cup,
    drop,
    elliptical_drop,
    energy,
    martin_moyce,
    momentum,
    resolution,
    seeds,
    standing_wave,
    still_tank,
)
from wavetank.lab.cases.case import Case

CASES: tuple[Case, ...] = (
    still_tank.CASE, column.CASE, martin_moyce.CASE, standing_wave.CASE, elliptical_drop.CASE, drop.CASE, energy.CASE,
    momentum.CASE, cup.CASE, seeds.CASE, resolution.CASE,
)  # fmt: skip
