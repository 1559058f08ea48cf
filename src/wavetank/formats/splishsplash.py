"""Scene files of SPlisHSPlasH (splishsplash.physics-simulation.org), read as scenes of wavetank.

Their lengths are metres and y is up, as ours. Otherwise: the distance of particles is twice `particleRadius`; the tank
is an inverted box around its own centre, anywhere; sizes of emitters count particles; viscosities are kinematic
[m^2/s]; rotations are an axis and an angle. What has no counterpart is told, one sentence each: see docs/formats.md.
"""

import math
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from wavetank.formats.bgeo import read_bgeo
from wavetank.formats.imported import Imported
from wavetank.formats.splishsplash_solids import Solids, arrays_of, turn_of
from wavetank.foundation.errors import WavetankError
from wavetank.foundation.input_limits import explain_errors, one_line, parse_json, printable, read_text, why_unreadable
from wavetank.foundation.materials import Material
from wavetank.foundation.params import PARAMETERS
from wavetank.foundation.rotations import turned
from wavetank.scene.emitters import Emitter
from wavetank.scene.fluids import Block, Points
from wavetank.scene.joints import BallJoint, Hinge
from wavetank.scene.scene import Scene
from wavetank.solids.meshes.files import SUFFIXES

LARGEST_FILE = 50_000_000  # bytes
#: what a file with values of other types than theirs ends in
UNREADABLE = (KeyError, TypeError, ValueError, AttributeError, IndexError, OverflowError, OSError)
ZORILLA = 5  # surfaceTensionMethod in N/m
#: viscosityMethod -> name of its table, and how its number is meant
VISCOSITIES = {
    1: ("Standard viscosity", "kinematic"),
    2: ("Bender and Koschier 2017", "share"),
    3: ("Peer et al. 2015", "share"),
    4: ("Peer et al. 2016", "share"),
    5: ("Takahashi et al. 2015 (improved)", "kinematic"),
    6: ("Weiler et al. 2018", "kinematic"),
}
STEP = 0.001  # s: time step for which their shares of the strain rate that stays are meant
#: keys of `Configuration` that are read here; the others are about how it is solved, shown and written
READ = {"particleRadius", "sim2D", "gravitation", "scriptFile"}
JOINTS = ("TargetVelocityMotorHingeJoints", "HingeJoints", "BallJoints")


def load_splishsplash(path: str | Path, spacing: float | None = None) -> Imported:
    """Read a scene file; `spacing` [m] in place of its own. Raises `WavetankError` for one that has no counterpart."""
    origin = printable(path)
    with explain_errors(origin, "scene"):
        data = parse_json(read_text(path, "scene file", LARGEST_FILE), origin)
        if not isinstance(data, dict) or not isinstance(data.get("Configuration"), dict):
            raise WavetankError(f"{origin}: a scene file of SPlisHSPlasH has a table Configuration; this one has none.")
        try:
            return _Reader(data, Path(path), spacing).read()
        except UNREADABLE as error:
            if isinstance(error, WavetankError):
                raise
            raise WavetankError(f"{origin}: the scene cannot be read: {one_line(why_unreadable(error))}.") from None


class _Reader:
    """Reads one file."""

    def __init__(self, data: dict[str, Any], path: Path, spacing: float | None) -> None:
        self.data, self.path = data, path
        self.settings = data["Configuration"]
        self.own_spacing = float(
            f"{2.0 * float(self.settings.get('particleRadius', 0.025)):.7g}"
        )  # many are in float32
        self.spacing = spacing or self.own_spacing
        self.dim = 2 if self.settings.get("sim2D") else 3
        self.notes: list[str] = []
        self.elastic: set[str] = set()

    def read(self) -> Imported:
        """Return the scene."""
        materials = self._materials()
        solids = Solids(self.path, self.dim, self.spacing, self.notes)
        bodies = self._list("RigidBodies")
        for number, body in enumerate(bodies):
            solids.add(number, body)
        fluids = [*self._blocks(solids.tank), *self._models()]
        emitters = [self._emitter(row, materials) for row in self._list("Emitters") if not self._is_elastic(row)]
        if not fluids and not emitters:
            raise WavetankError(
                f"{self.path}: it contains no fluid that wavetank can simulate"
                + (f"; {', '.join(sorted(self.elastic))} is an elastic solid." if self.elastic else ".")
            )
        used = {fluid.material for fluid in fluids} | {emitter.material for emitter in emitters}
        table: dict[str, Any] = {
            "title": self.path.stem.replace("_", " "),
            "spacing": self.spacing,
            "tank": solids.tank,
            "fluids": fluids,
            "materials": [material for name, material in materials.items() if name in used],
            "solids": solids.found,
            "joints": [*self._joints(solids)],
            "emitters": emitters,
            "gravity": tuple(map(float, self.settings.get("gravitation", (0.0, -9.81, 0.0))))[: self.dim],
            "no_slip": self._hold_of_walls(used),
            **self._most(fluids),
        }
        self._tell_the_rest()
        return Imported(Scene.parse(table, str(self.path)), tuple(dict.fromkeys(self.notes)))

    def _list(self, key: str) -> list[dict[str, Any]]:
        rows = self.data.get(key, [])
        return [row for row in rows if isinstance(row, dict)] if isinstance(rows, list) else []

    def _is_elastic(self, row: dict[str, Any]) -> bool:
        return str(row.get("id", "Fluid")) in self.elastic

    # --- fluids ---

    def _materials(self) -> dict[str, Material]:
        found = {"Fluid": Material(name="Fluid")}
        for row in self._list("Materials"):
            name = str(row.get("id", "Fluid"))
            if row.get("elasticityMethod", 0):
                self.elastic.add(name)
                self.notes.append(f"{name}: elastic solids have no counterpart; what is made of it is left out.")
            density = float(row.get("density0", 1000.0))
            found[name] = Material(
                name=name,
                density=self._allowed("rest_density", density, f"{name}: density0"),
                viscosity=self._viscosity(name, row, density),
                surface_tension=self._tension(name, row),
            )
            for key, what in (("vorticityMethod", "its micropolar vorticity"), ("dragMethod", "the drag of the air")):
                if row.get(key, 0):
                    self.notes.append(f"{name}: {key}, {what}, has no counterpart; it is left out.")
        return found

    def _viscosity(self, name: str, row: dict[str, Any], density: float) -> float | None:
        """Dynamic viscosity [Pa s]."""
        method = int(row.get("viscosityMethod", 0))
        title, meaning = VISCOSITIES.get(method, ("", ""))
        value = float(row.get(title, {}).get("viscosity", row.get("viscosity", 0.0)))
        if not value or not meaning:
            if method and not meaning:
                self.notes.append(f"{name}: viscosityMethod {method} is not known; it is taken as without viscosity.")
            return None
        if meaning == "kinematic":
            return self._allowed("dynamic_viscosity", value * density, f"{name}: viscosity")
        # What is left of the strain rate after a step: 1 / (1 + nu dt / h^2), as implicit viscosity leaves.
        left, support = min(max(value if method != 2 else 1.0 - value, 1e-3), 1.0), 2.0 * self.own_spacing
        viscosity = (1.0 / left - 1.0) * support**2 / float(self.settings.get("timeStepSize", STEP)) * density
        self.notes.append(
            f"{name}: the viscosity of {title} is a share without a unit, {value:g}; it is taken as {viscosity:.3g} "
            "Pa s, which leaves as much of the strain rate in a time step."
        )
        return self._allowed("dynamic_viscosity", viscosity, f"{name}: viscosity")

    def _hold_of_walls(self, used: Collection[str | None]) -> float:
        """Share of the viscosity that solids hold fluids back with: none where it is not named, and fluids slide."""
        shares = {}
        for row in self._list("Materials"):
            own = {**row, **row.get(VISCOSITIES.get(int(row.get("viscosityMethod", 0)), ("", ""))[0], {})}
            fluid, solid = (float(own.get(key, 0.0)) for key in ("viscosity", "viscosityBoundary"))
            if fluid > 0.0 and str(row.get("id", "Fluid")) in used:
                shares[str(row.get("id", "Fluid"))] = min(max(solid / fluid, 0.0), 1.0)
        if len(set(shares.values())) > 1:
            self.notes.append("viscosityBoundary differs between the fluids; the largest share of viscosity is taken.")
        return max(shares.values(), default=0.0)

    def _tension(self, name: str, row: dict[str, Any]) -> float | None:
        method = int(row.get("surfaceTensionMethod", 0))
        if method == ZORILLA:
            value = float(row.get("Zorilla, Ritter, et al. 2020", {}).get("surfaceTension", 0.0))
            return self._allowed("surface_tension", value, f"{name}: surfaceTension")
        if method:
            self.notes.append(
                f"{name}: the surface tension of method {method} is a coefficient without a unit; it is left out, set "
                "surface_tension [N/m]."
            )
        return None

    def _allowed(self, parameter: str, value: float, what: str) -> float:
        low, high = next((p.low, p.high) for p in PARAMETERS if p.name == parameter)
        kept = min(max(value, float(low or 0.0)), math.inf if high is None else float(high))
        if kept != value:
            self.notes.append(f"{what} is {value:g}, outside of what is allowed; it is taken as {kept:g}.")
        return kept

    def _blocks(self, tank: Any) -> Iterator[Block]:
        for number, row in enumerate(self._list("FluidBlocks")):
            if self._is_elastic(row):
                continue
            scale, shift = (
                np.array(row.get(key, usual), float)
                for key, usual in (("scale", (1, 1, 1)), ("translation", (0, 0, 0)))
            )
            ends = np.sort([np.array(row[key], float) * scale + shift for key in ("start", "end")], axis=0)
            lower, upper = ends[:, : self.dim]
            if tank is not None:
                inner = tank.box()
                cut = np.maximum(lower, inner[0]), np.minimum(upper, inner[1])
                if np.abs(np.array(cut) - (lower, upper)).max() > 0.5 * self.spacing:
                    self.notes.append(f"FluidBlocks[{number}] reaches out of the tank; it ends at its walls.")
                lower, upper = cut
            if (upper - lower).min() < 0.5 * self.spacing:
                self.notes.append(f"FluidBlocks[{number}] is thinner than half a particle; it is left out.")
                continue
            velocity = tuple(map(float, row.get("initialVelocity", ())))[: self.dim]
            if row.get("denseMode", 0):
                self.notes.append(
                    f"FluidBlocks[{number}]: denseMode {row['denseMode']} packs more closely; it becomes cubic."
                )
            yield Block(
                lower=tuple(map(float, lower)),
                upper=tuple(map(float, upper)),
                material=str(row.get("id", "Fluid")),
                velocity=velocity if any(velocity) else None,
            )

    def _models(self) -> Iterator[Points]:
        for number, row in enumerate(self._list("FluidModels")):
            if self._is_elastic(row):
                continue
            if self.spacing != self.own_spacing:
                raise WavetankError(
                    f"{self.path}: FluidModels[{number}] are particles {self.own_spacing:g} m apart; another spacing "
                    "is for fluid blocks only."
                )
            points = self._particles(str(row["particleFile"])) * np.array(row.get("scale", (1, 1, 1)), float)
            points = turned(turn_of(row), points) + np.array(row.get("translation", (0, 0, 0)), float)
            velocity = tuple(map(float, row.get("initialVelocity", ())))[: self.dim]
            yield Points(
                positions=points[:, : self.dim],
                material=str(row.get("id", "Fluid")),
                velocity=velocity if any(velocity) else None,
            )

    def _particles(self, name: str) -> np.ndarray:
        place = Solids.find_file(self.path, name)
        if place.suffix.lower() == ".bgeo":
            return read_bgeo(place)
        if place.suffix.lower() in SUFFIXES:
            return arrays_of(place)[0]
        raise WavetankError(f"{place}: particles are read from .bgeo, {', '.join(SUFFIXES)} files; convert this one.")

    # --- sources and joints ---

    def _emitter(self, row: dict[str, Any], materials: dict[str, Material]) -> Emitter:
        turn, d = turn_of(row, planar=self.dim == 2), self.own_spacing
        ahead, across = (turned(turn, axis)[: self.dim] for axis in (np.eye(3)[0], np.eye(3)[2]))
        start = float(row.get("emitStartTime", 0.0))
        lasts = float(row.get("emitEndTime", math.inf)) - start
        width, height = float(row.get("width", 5)) * d, float(row.get("height", 5)) * d
        name = str(row.get("id", "Fluid"))
        fields: dict[str, Any] = {
            "position": tuple(map(float, row["translation"]))[: self.dim],
            "direction": tuple(map(float, ahead)),
            "speed": float(row.get("velocity", 1.0)),
            "start": start,
            "duration": lasts if lasts < 86400.0 else None,
            "material": name if name in materials else None,
        }
        is_disc = int(row.get("type", 0)) == 1
        if self.dim == 2:
            return Emitter(width=width if is_disc else height, **fields)
        if is_disc:
            return Emitter(radius=0.5 * width, **fields)
        return Emitter(size=(width, height), side=tuple(map(float, across)), **fields)

    def _most(self, fluids: list[Any]) -> dict[str, Any]:
        """How many particles emitters may make: theirs is a number for each fluid, ours for all."""
        rows = [row for row in self._list("Materials") if row.get("maxEmitterParticles")]
        if not self._list("Emitters") or not rows:
            return {}
        first = sum(fluid.estimate(self.spacing) for fluid in fluids)
        most = int(first) + sum(int(row["maxEmitterParticles"]) for row in rows)
        reuse = any(row.get("emitterReuseParticles") for row in rows)
        if reuse:
            self.notes.append("emitterReuseParticles takes those that left a box; here it takes the oldest ones.")
        return {"most_particles": min(most, 10_000_000), "when_full": "recycle" if reuse else "stop"}

    def _joints(self, solids: Solids) -> Iterator[Hinge | BallJoint]:
        for kind in JOINTS:
            for row in self._list(kind):
                first, second = (solids.names.get(row.get(key), "") for key in ("bodyID1", "bodyID2"))
                if not first or (second and second not in solids.movable and first not in solids.movable):
                    first, second = second, first
                if first not in solids.movable:
                    self.notes.append(f"{kind}: it joins nothing that moves; it is left out.")
                    continue
                at = tuple(map(float, row["position"]))[: self.dim]
                if kind == "BallJoints":
                    yield BallJoint(first=first, second=second, at=at)
                    continue
                speed = row.get("target")
                if speed is None and row.get("targetSequence"):
                    speed = row["targetSequence"][1]
                    self.notes.append(
                        f"{kind}: a sequence of speeds has no counterpart; the motor keeps the first one."
                    )
                axis = tuple(map(float, row.get("axis", (0, 0, 1))))
                yield Hinge(first=first, second=second, at=at, axis=axis, speed=None if speed is None else float(speed))

    def _tell_the_rest(self) -> None:
        known = {"Configuration", "Materials", "RigidBodies", "FluidBlocks", "FluidModels", "Emitters", *JOINTS}
        told = {
            "AnimationFields": "AnimationFields prescribe velocities in a box, which has no counterpart; left out.",
            "Simulation": "Simulation is about the solver of rigid and deformable bodies; left out.",
        }
        for key in self.data:
            if key not in known and self.data[key]:
                self.notes.append(told.get(key, f"{key} has no counterpart; it is left out."))
        if self.settings.get("scriptFile"):
            self.notes.append("scriptFile is a Python script of theirs, which cannot be run here; left out.")
        if any(key not in READ for key in self.settings):
            self.notes.append("Configuration: how it is solved, shown and written is wavetank's own.")
