"""What the fluid does to light, and the scale of the maps of its thickness."""

import dataclasses

from wavetank.device.compiler import qd
from wavetank.device.state import interned
from wavetank.view.lens import vec3, vector
from wavetank.view.optics.ray_interpolation import APART, GROUP
from wavetank.view.shot import Shot
from wavetank.view.water_buffers import UNIT

DISC = {2: 6.0, 3: 1.5}  # d: radius of a particle's disc; wide in a plane, where it shades from the rim to the depth
TEXELS = 2.0  # of a map of thickness per spacing, at most


@dataclasses.dataclass(frozen=True, eq=False)
class Optics:
    """What the fluid does to light, and the scale of the maps of its thickness, on the device."""

    absorption: vec3  # 1/m
    scattering: qd.f32  # 1/m
    glow: vec3  # radiance of light that comes back out of deep water
    usual: qd.f32  # m: water that gives its colour to what is behind it
    coarse: qd.f32  # pixels per texel of the thickness
    fine: qd.f32  # and of what tells fluids apart
    unit: qd.f32  # m per step of it
    spacing: qd.f32  # m
    disc: qd.f32  # m: radius of a particle's disc in a plane
    slack: qd.f32  # m: depth by which an edge of the tank wins
    samples: qd.i32  # computed pixels beside each other that see the same through a body of water,
    tall: qd.i32  # and rows of them
    apart: qd.f32  # computed pixels between the ends of two rays, up to which those between need not be followed
    turn: qd.i32  # columns by which the first group of those is fewer


def optics_of(shot: Shot, samples: int = 1, tall: int = 1) -> Optics:
    """Return what the fluid of a picture does to light."""
    return interned(
        Optics(
            absorption=shot.absorption,
            scattering=shot.scattering,
            glow=vector(*(shot.look.glow * shot.tint)),
            usual=shot.usual,
            coarse=float(coarseness(shot)),
            fine=float(fineness(shot)),
            unit=shot.extent.spacing / UNIT,
            spacing=shot.extent.spacing,
            disc=DISC[2] * shot.extent.spacing,
            slack=2.0 * shot.radius,
            samples=samples,
            tall=tall,
            apart=APART * GROUP * samples,
            turn=shot.turn * samples,
        )
    )


def coarseness(shot: Shot) -> int:
    """Pixels per texel of the thickness map, at least 2."""
    lens, extent = shot.lens, shot.extent
    scale = float(lens.focal)
    if float(lens.perspective) > 0.5:
        distance = float((extent.middle - lens.eye) @ lens.forward)
        scale /= max(distance, 0.5 * extent.radius)
    return max(2, min(64, round(scale * extent.spacing * DISC[extent.dim] / (DISC[3] * TEXELS))))


def fineness(shot: Shot) -> int:
    """Pixels per texel of the map that tells fluids apart: half a spacing in a plane, where discs are wide."""
    return coarseness(shot) if shot.extent.dim == 3 else max(2, coarseness(shot) // 4)


def grain_of(shot: Shot, samples: int) -> int:
    """Return the pixels of a texel of coarse maps: about a spacing in the middle of the world, at least 2."""
    lens, extent = shot.lens, shot.extent
    scale = float(lens.focal) / samples
    if float(lens.perspective) > 0.5:
        scale /= max(float((extent.middle - lens.eye) @ lens.forward), 0.5 * extent.radius)
    return max(2, min(64, round(scale * extent.spacing)))


@qd.func
def refracted(ahead, n, cosi):
    """Direction in the water of a ray from the air, which comes in at an angle of that cosine with the normal `n`."""
    return 0.7519 * ahead + (0.7519 * cosi - qd.sqrt(1.0 - 0.5653 * (1.0 - cosi * cosi))) * n


@qd.func
def above_floor(travel, at, direction):
    """As much of a way from the point `at` as lies above the floor."""
    result = travel
    if direction.y < -1e-3 and at.y > 0.0:
        result = qd.min(travel, -at.y / direction.y)
    return result


@qd.func
def dimmed(radiance, travel, absorption, scattering, glow):
    """Radiance behind so much water: what the way leaves of it, and what shines out of the water (Beer-Lambert)."""
    return radiance * qd.exp(-travel * absorption) + (1.0 - qd.exp(-travel * scattering)) * glow
