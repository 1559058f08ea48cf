"""Environments by name: a sky, a sun that can be turned, a floor that can be chosen.

A low sun is dimmed and reddened by the air that its light crosses (air mass: F. Kasten, A. T. Young, "Revised optical
air mass tables", Applied Optics 28 (1989)), and the picture is exposed for the ground as it is then lit.

    code      symbol   meaning                                              unit
    azimuth            where the sun stands, from +z towards +x             deg
    elevation          its height above the horizon                         deg
    depth     tau      optical depth of the air overhead, per colour        1
"""

import dataclasses
import functools
import math
from typing import get_args

import numpy as np

from wavetank.foundation.errors import WavetankError
from wavetank.scene.light import HIGHEST, LOWEST, Environment, Floor, Light
from wavetank.view.lens import vector
from wavetank.view.look import Look, linear, lit_floor, paper, pool, studio, under_sky
from wavetank.view.panorama import is_picture, panorama

ENVIRONMENTS: tuple[str, ...] = get_args(Environment)
FLOORS: tuple[str, ...] = get_args(Floor)
#: albedo of each floor, None for the environment's own, and the size of its pattern [m]
PAVINGS: dict[str, tuple[str | None, float]] = {
    "plain": (None, 0.0),
    "tiles": ("#b9bcb9", 0.1),
    "stone": ("#a59c8f", 0.3),
    "sand": ("#cdb58c", 0.03),
    "table": ("#d2d0cc", 0.0),
}
HAZES = {"pool": ("#d9e4ec", 3.5), "sky": ("#c9dcee", 2.3), "evening": ("#f0cfa4", 4.5)}  # horizon, turbidity
OWN_FLOORS = {"sky": "stone", "evening": "sand", "overcast": "stone"}
OWN_SUNS = {"sky": (-60.0, 42.0), "evening": (-125.0, 9.0)}
AIR = np.array([0.09, 0.16, 0.32])  # tau at 680, 550, 440 nm or so, clear air with a little haze
USUAL_ELEVATION = 54.1  # deg: of the pool's sun, which its radiances are given for


def usual_environment(dim: int, coloured: bool) -> str:
    """Return the environment of a view that names none."""
    if dim == 2:
        return "paper"
    return "studio" if coloured else "pool"


def chosen_light(own: Light | None, environment: str | None, sun: str | None, floor: str | None) -> Light:
    """Return the light of a scene with what a picture chose instead; raises `WavetankError`."""
    light = own or Light()
    changes: dict[str, object] = {}
    if is_picture(environment):
        if sun is not None:
            raise WavetankError(
                f"render: sun = {sun!r} does not go with environment = {environment!r}: the sun of a picture stands "
                "where it shows it; leave one of them out."
            )
        panorama(str(environment))
        changes |= {"environment": environment, "azimuth": None, "elevation": None}
    elif environment is not None:
        changes["environment"] = _named("environment", environment, ENVIRONMENTS)
    if floor is not None:
        changes["floor"] = _named("floor", floor, FLOORS)
    if sun is not None:
        changes["azimuth"], changes["elevation"] = _sun_in(sun)
    return light.model_copy(update=changes) if changes else light


def look_of(
    environment: str,
    azimuth: float | None = None,
    elevation: float | None = None,
    floor: str | None = None,
    dim: int = 3,
) -> Look:
    """Return a look by the name of its environment, or of a file; the same object for the same light."""
    if is_picture(environment):
        return _paved_once(panorama(environment).look, floor)
    return _look_of(environment, azimuth, elevation, floor, dim)


@functools.lru_cache(maxsize=16)
def _paved_once(look: Look, floor: str | None) -> Look:
    paved = _paved(look, floor)
    return dataclasses.replace(paved, below=lit_floor(paved))


@functools.lru_cache(maxsize=64)
def _look_of(environment: str, azimuth: float | None, elevation: float | None, floor: str | None, dim: int) -> Look:
    own = OWN_SUNS.get(environment)
    if own is not None:
        azimuth, elevation = own[0] if azimuth is None else azimuth, own[1] if elevation is None else elevation
    floor = OWN_FLOORS.get(environment) if floor is None else floor
    plain = {"studio": studio, "paper": paper}.get(environment, pool)()
    if environment == "overcast":
        plain = _overcast()
    if environment == "paper" and dim == 3:  # a plane lies between white panes, and solids in space do not
        plain = _white_room()
    if azimuth is None and elevation is None and floor is None and environment != "overcast":
        return plain
    look = _paved(plain, floor)
    if azimuth is not None or elevation is not None:
        look = dataclasses.replace(look, to_sun=_towards(plain.to_sun, azimuth, elevation))
    if environment not in HAZES:
        return look if environment == "paper" else dataclasses.replace(look, below=lit_floor(look))
    haze, turbidity = HAZES[environment]
    look = dataclasses.replace(look, horizon=linear(haze))
    return under_sky(look if look.to_sun is plain.to_sun else _lit_by_the_sun(look), turbidity)


@functools.lru_cache(maxsize=64)
def without_edges(look: Look) -> Look:
    """Return a look in which the edges of a tank are not seen."""
    return dataclasses.replace(look, line_strength=0.0)


def _paved(look: Look, floor: str | None) -> Look:
    if floor is None:
        return look
    color, size = PAVINGS[floor]
    albedo = look.floor if color is None else linear(color)
    return dataclasses.replace(look, floor=albedo, tile=size, paving=FLOORS.index(floor))


def _towards(usual: np.ndarray, azimuth: float | None, elevation: float | None) -> np.ndarray:
    """Return the unit vector to a sun; what is not told is where the `usual` one stands."""
    x, y, z = (float(part) for part in usual)
    around = math.atan2(x, z) if azimuth is None else math.radians(azimuth)
    # Straight overhead the sun's view has no upright; a hair beside it looks the same.
    height = math.asin(y) if elevation is None else math.radians(min(elevation, 89.5))
    flat = math.cos(height)
    return vector(flat * math.sin(around), math.sin(height), flat * math.cos(around))


def air_mass(elevation: float) -> float:
    """Return the air that light from a height [deg] above the horizon crosses, over that from the zenith."""
    return float(1.0 / (math.sin(math.radians(elevation)) + 0.50572 * (elevation + 6.07995) ** -1.6364))


def _lit_by_the_sun(look: Look) -> Look:
    """Return an open look whose sun and sky are as bright as the sun is high, exposed for its ground."""
    up = float(look.to_sun[1])
    through = np.exp(-AIR * (air_mass(math.degrees(math.asin(up))) - air_mass(USUAL_ELEVATION)))
    share = up / math.sin(math.radians(USUAL_ELEVATION))
    sun, sky = look.sun * through, look.sky * (0.35 + 0.65 * min(share, 1.0)) * (0.6 + 0.4 * through)
    before = float(np.mean(look.sun) * math.sin(math.radians(USUAL_ELEVATION)) + np.mean(look.sky))
    gain = (before / float(np.mean(sun) * up + np.mean(sky))) ** 0.7
    return dataclasses.replace(
        look, sun=vector(*(gain * sun)), sky=vector(*(gain * sky)), ground=vector(*(look.ground * gain**0.5))
    )


@functools.cache
def _overcast() -> Look:
    """An even sky, three times as bright overhead as at the horizon (P. Moon, D. Spencer 1942)."""
    return dataclasses.replace(
        studio(),
        sun=vector(0.16, 0.16, 0.16),
        sky=vector(0.86, 0.90, 0.94),
        horizon=linear("#c3c9ce"),
        zenith=vector(1.35, 1.42, 1.5),
        ground=vector(0.32, 0.32, 0.31),
        sun_size=0.25,
        sparkle=0.0,
        caustic=0.15,
        solid=pool().solid,
        line=pool().line,
    )


@functools.cache
def _white_room() -> Look:
    return dataclasses.replace(paper(), glass=0.0, solid=pool().solid, sun_size=0.1)


def _named(kind: str, name: str, known: tuple[str, ...]) -> str:
    if name not in known:
        also = ", or a picture of one (.hdr)" if kind == "environment" else ""
        raise WavetankError(f"render: {kind} = {name!r} is not known; use one of {', '.join(known)}{also}.")
    return name


def _sun_in(text: str) -> tuple[float, float]:
    """Read azimuth and elevation [deg]."""
    try:
        azimuth, elevation = (float(part) for part in str(text).split(","))
    except ValueError:
        azimuth = elevation = math.nan
    if not (math.isfinite(azimuth) and abs(azimuth) <= 1e6 and LOWEST <= elevation <= HIGHEST):
        raise WavetankError(
            f"render: sun = {text!r} is not allowed; write azimuth and elevation [deg], as 40,25, the elevation from "
            f"{LOWEST:g} to {HIGHEST:g}."
        )
    return azimuth % 360.0, elevation
