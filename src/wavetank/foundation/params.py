"""Every parameter of a world, declared once.

From its one line come the validation, the key in a scene file, the option of the command line, the slider, the line
in the reference, and whether it may change while the water moves (live) or needs a reset.
"""

import dataclasses
import difflib
import math
from typing import Annotated, Any, Literal

from pydantic import Field

from wavetank.foundation.errors import WavetankError
from wavetank.foundation.model import METRES, Model, Vector


@dataclasses.dataclass(frozen=True)
class Parameter:
    """One declaration, for lists of parameters."""

    name: str
    default: Any  # None where it must be given
    low: float | None
    high: float | None
    unit: str
    symbol: str
    sentence: str
    live: bool


def parameter(
    default: float | str,
    low: float | None,
    high: float | None,
    unit: str,
    symbol: str,
    sentence: str,
    *,
    live: bool = True,
) -> Any:
    """Declare a parameter: default, range (inclusive), unit, symbol, one sentence, live or needs-reset."""
    note: Any = {"unit": unit, "symbol": symbol, "live": live}
    limits: dict[str, Any] = {} if isinstance(default, str) else {"ge": low, "le": high}
    if isinstance(default, float):
        limits["allow_inf_nan"] = False
    return Field(default=default, description=sentence, json_schema_extra=note, **limits)


USUAL_FALL = 0.1089  # spacings: fall of water at rest in a usual time step
SURFACE_TENSION = 0.0728  # N/m, of water against air at 20 degrees Celsius

KernelName = Literal["spiky", "poly6", "cubic", "wendland", "poly6-spiky"]


# fmt: off
class Parameters(Model):
    """All parameters. Lengths that scale with the resolution are given in particle spacings, d."""

    spacing: Annotated[float, Field(gt=0, allow_inf_nan=False, description="Distance between particles at rest.", json_schema_extra={"unit": "m", "symbol": "d", "live": False}), METRES]
    gravity: Annotated[Vector, Field(description="Gravitational acceleration.", json_schema_extra={"unit": "m/s^2", "symbol": "g", "live": True})] = (0.0, -9.81, 0.0)
    rest_density: float = parameter(1000.0, 1e-3, 1e5, "kg/m^3", "rho_0", "Rest density of fluids whose material names none.", live=False)
    support: float = parameter(1.9, 1.2, 3.0, "d", "h/d", "Support radius of the smoothing kernel.", live=False)
    kernel: KernelName = parameter("spiky", None, None, "", "W", "Smoothing kernel; poly6-spiky uses Poly6 for the density and Spiky for its gradient.", live=False)
    frame_time: float = parameter(1 / 60, 1e-5, 1.0, "s", "T", "Time of water in one frame.", live=False)
    substeps: int = parameter(1, 1, 100, "", "n", "Smallest number of time steps in a frame.")
    courant: float = parameter(1.2, 0.05, 100.0, "d", "CFL", "Largest displacement of a particle in a time step; two thirds of it without a pressure grid.")
    wave_courant: float = parameter(0.35, 0.05, 100.0, "d", "", "Largest distance of the fastest gravity wave, sqrt(g depth), in a time step without a pressure grid; limits the compression of deep water.")
    largest_substeps: int = parameter(32, 1, 1000, "", "", "Largest number of time steps in a frame.")
    iterations: int = parameter(5, 1, 100, "", "", "Solver iterations in a time step.")
    relaxation: float = parameter(1.0, 0.1, 3.0, "", "omega", "First relaxation factor of a time step, in units of the largest stable one.")
    slowest_mode: float = parameter(0.15, 0.0, 0.5, "", "a", "Lower end of the interval of eigenvalues for the Chebyshev iteration; 0 is plain Jacobi.")
    force_mixing: float = parameter(0.01, 0.0, 1e4, "S_0", "eps", "Constraint force mixing (Eq. 5), relative to the sum of squared gradients in the rest lattice.")
    tensile_strength: float = parameter(0.01, 0.0, 1.0, "1/S_0", "k", "Artificial pressure against clustering (Eq. 7) in a usual step, 1/60 s at 25 mm; less in shorter steps and weaker gravity.")
    tensile_exponent: float = parameter(4.0, 1.0, 8.0, "", "n", "Exponent of the artificial pressure (Eq. 7).")
    tensile_distance: float = parameter(0.3, 0.05, 0.95, "h", "dq", "Distance at which the artificial pressure is k (Eq. 7).")
    grid_pressure: float = parameter(1.0, 0.0, 1.0, "", "", "Share of the density error that the coarse pressure grid removes before the iterations; 0 switches it off.")
    attraction: float = parameter(0.0, 0.0, 1.0, "", "", "Share of negative pressure that is allowed; with 0 water separates freely.")
    calming: float = parameter(0.95, 0.0, 1.0, "", "", "Share of slow motion relative to neighbours and solids that is damped in a usual step, 1/60 s at 25 mm; with 0 calm water creeps.")
    viscosity: float = parameter(0.08, 0.0, 1.0, "", "c", "XSPH viscosity (Eq. 11), dimensionless, for a step of 1/240 s; less by what the fluids have of their own.")
    dynamic_viscosity: float = parameter(0.0, 0.0, 1e6, "Pa s", "mu", "Dynamic viscosity of fluids whose material names none, solved implicitly; honey has 10.")
    viscosity_iterations: int = parameter(100, 1, 1000, "", "", "Largest number of iterations of the implicit viscosity in a time step.")
    no_slip: float = parameter(1.0, 0.0, 1.0, "", "", "Share of the viscous drag of solids; 1 is no-slip, 0 is free slip.")
    surface_tension: float = parameter(0.0, 0.0, 10.0, "N/m", "sigma", "Surface tension of fluids whose material names none; water has 0.072.")
    contact_angle: float = parameter(90.0, 0.0, 180.0, "deg", "theta", "Contact angle on solids of fluids whose material names none, with surface tension; 0 wets.")
    vorticity: float = parameter(0.0, 0.0, 100.0, "m/s", "eps_w", "Vorticity confinement (Eq. 10).")
    vorticity_coherence: float = parameter(0.7, 0.0, 1.0, "", "", "How similar the vorticity of neighbours must be for confinement; 0 confines noise too, as Eq. 10 does.")
    friction: float = parameter(0.0, 0.0, 1.0, "", "mu", "Coulomb friction of walls and of solids that name none.", live=False)
    speed_limit: float = parameter(1.0, 0.1, 1e6, "", "", "Speed limit, in units of what gravity and moving solids can cause in this tank.")
    wall_density: float = parameter(1.0, 0.0, 1.0, "", "", "Share of the density that walls contribute; 0 leaves contact alone.")
    wall_gap: float = parameter(0.25, 0.0, 0.5, "d", "", "Distance that particle centres keep from walls.")
    foam: float = parameter(1.0, 0.0, 100.0, "", "", "Amount of spray, foam and bubbles; 0 makes none.")
    foam_lifetime: float = parameter(2.0, 0.01, 1000.0, "s", "", "Mean lifetime of spray, foam and bubbles.")
    foam_capacity: int = parameter(200000, 1, 4000000, "", "", "Largest number of spray, foam and bubbles; from half of it on fewer are made.", live=False)
    foam_seed: int = parameter(0, 0, 2147483647, "", "", "Seed of the random numbers for foam.", live=False)
    foam_threshold: float = parameter(1000.0, 0.001, 1e9, "", "We", "Weber number rho v^2 d / sigma above which a water particle counts as foam (the report's rule).")
# fmt: on

    @property
    def dim(self) -> int:
        """Number of dimensions of the world, 2 or 3: that of gravity."""
        return len(self.gravity)

    @property
    def particle_mass(self) -> float:
        """Mass of a particle, rho_0 d^dim [kg] (per metre of depth in a 2-D world)."""
        return float(self.rest_density * self.spacing**self.dim)

    def usual_steps(self, dt: float) -> float:
        """Return how many usual time steps one of `dt` [s] is, 1 at most.

        In a usual step water at rest falls by `USUAL_FALL` spacings, g dt^2 / d: 1/60 s at 25 mm. What acts in a step
        goes by this, so that it is the same at any frame rate, and in tanks of any size (Froude's similarity).
        """
        return min(1.0, math.sqrt(math.hypot(*self.gravity) * dt**2 / self.spacing / USUAL_FALL))

    @property
    def foaming_speed(self) -> float:
        """Speed [m/s] at which the Weber number of a particle, rho_0 v^2 d / sigma, reaches `foam_threshold`."""
        return math.sqrt(self.foam_threshold * SURFACE_TENSION / (self.rest_density * self.spacing))


PARAMETERS: tuple[Parameter, ...] = tuple(
    Parameter(
        name=name,
        default=None if field.is_required() else field.default,
        low=next((m.ge for m in field.metadata if hasattr(m, "ge")), None),
        high=next((m.le for m in field.metadata if hasattr(m, "le")), None),
        sentence=field.description or "",
        **field.json_schema_extra,  # type: ignore[arg-type]
    )
    for name, field in Parameters.model_fields.items()
)
LIVE = frozenset(p.name for p in PARAMETERS if p.live)


def refuse_assignment(name: str) -> None:
    """Raise `WavetankError` for an attribute of a running simulation that is, or resembles, a parameter."""
    if any(p.name == name for p in PARAMETERS):
        raise WavetankError(
            f"{name} cannot change during a simulation; make a new one: Simulation(sim.scene.changed({name}=...))."
        )
    for near in difflib.get_close_matches(name, LIVE, 1, 0.8):
        raise WavetankError(f"{name!r} is not a parameter; did you mean {near!r}?")



#: Values that a preset puts in place of the defaults. `paper` is the report's Table 1, which belongs to its own units:
#: h = 1.1, m = 1, rho_0 = 3, so that d = 0.68195 is the lattice whose Poly6 density is 3. There S_0 = 1.3607, so that
#: eps = 100 and k = 1e-4 become multiples of it; c = 0.01 becomes c rho_0 / m = 0.03 once the sum of Eq. 11 is a mean.
#: Walls are plain clamps, as in the report.
PAPER_SPACING = 0.681947
PAPER_S0 = 1.360689
PAPER_RELAXATION = 0.8105  # the largest stable one for that lattice: Jacobi with 1 is beyond it
PRESETS: dict[str, dict[str, Any]] = {
    "standard": {},
    "paper": {
        "support": 1.1 / PAPER_SPACING,
        "kernel": "poly6-spiky",
        "substeps": 1,
        "courant": 100.0,
        "wave_courant": 100.0,
        "grid_pressure": 0.0,
        "iterations": 5,
        "relaxation": 1.0 / PAPER_RELAXATION,
        "slowest_mode": 0.0,
        "force_mixing": 100.0 / PAPER_S0,
        "tensile_strength": 1e-4 * PAPER_S0,
        "tensile_exponent": 4.0,
        "tensile_distance": 0.3,
        "attraction": 1.0,
        "calming": 0.0,
        "viscosity": 0.03,
        "vorticity": 0.01,
        "vorticity_coherence": 0.0,
        "wall_density": 0.0,
        "foam": 0.0,
    },
}

#: Operating points of the method: what `quality` puts in place of the defaults. Figures of each: docs/method.md.
QUALITIES: dict[str, dict[str, Any]] = {
    "draft": {"substeps": 1, "iterations": 3, "wave_courant": 0.6, "courant": 1.35, "calming": 1.0},
    "standard": {},
    "high": {"substeps": 4, "iterations": 4, "wave_courant": 0.2, "courant": 0.6},
}
