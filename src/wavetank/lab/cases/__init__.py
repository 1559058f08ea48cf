"""Experiments of `wavetank validate`: one file per case, each with a `CASE`, listed in `CASES`."""

from wavetank.lab.cases import (
    buckling,
    buoyancy,
    calm_vorticity,
    coiling,
    column,
    creep,
    cup,
    drop,
    elliptical_drop,
    emitter,
    energy,
    gravity_current,
    heave,
    layers,
    lobovsky,
    lock_exchange,
    martin_moyce,
    momentum,
    resolution,
    rest,
    seeds,
    shear_wave,
    solids_at_rest,
    standing_wave,
    still_tank,
    tension_drop,
    water_entry,
)
from wavetank.lab.cases.case import Case

CASES: tuple[Case, ...] = (
    still_tank.CASE, column.CASE, martin_moyce.CASE, lobovsky.CASE, standing_wave.CASE, elliptical_drop.CASE,
    drop.CASE, energy.CASE, rest.CASE, solids_at_rest.CASE, creep.CASE, momentum.CASE, cup.CASE, seeds.CASE,
    resolution.CASE, layers.CASE, lock_exchange.CASE, shear_wave.CASE, gravity_current.CASE, buckling.CASE,
    coiling.CASE, tension_drop.CASE,
    calm_vorticity.CASE, emitter.CASE, buoyancy.CASE, heave.CASE,
    water_entry.CASE,
)  # fmt: skip
