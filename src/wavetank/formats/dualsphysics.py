"""Cases of DualSPHysics (dual.sphysics.org), NAME_Def.xml, read as scenes of wavetank.

There z is up, here y: x stays, their z is our y, their y our -z. A case draws its shapes on a lattice, one over the
other, so that the last one wins; here the first fluid wins, and solids are exact. The box of walls that holds the fluid
becomes the tank. What has no counterpart is told, one sentence each: see docs/formats.md.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from wavetank.formats.dualsphysics_drawing import Drawing, Item, meeting, numbers_of
from wavetank.formats.dualsphysics_motion import courses
from wavetank.formats.dualsphysics_solids import OURS, Placed, placed_solids
from wavetank.formats.imported import Imported
from wavetank.foundation.errors import WavetankError
from wavetank.foundation.input_limits import explain_errors, one_line, parse_xml, printable, read_text, why_unreadable
from wavetank.foundation.materials import Material
from wavetank.scene.filled import Filled
from wavetank.scene.fluids import Ball, Block, Fluid
from wavetank.scene.scene import Scene
from wavetank.scene.tank import Tank

LARGEST = 20_000_000  # characters
MOST_PARTS = 1000  # boxes that a box of fluid without voids may become, and all of them twice as many
MOST_TIME = 600.0  # s, over which motions are written down
#: face of a box -> side of our tank
SIDES = {"bottom": "-y", "top": "+y", "left": "-x", "right": "+x", "front": "+z", "back": "-z"}
LAMINAR = 2  # ViscoTreatment
UNREADABLE = (LookupError, ValueError, TypeError, AttributeError, OverflowError, ZeroDivisionError, OSError)


def load_dualsphysics(path: str | Path, spacing: float | None = None) -> Imported:
    """Read NAME_Def.xml; `spacing` [m] in place of its own dp. Raises `WavetankError` for what has no counterpart."""
    origin = printable(path)
    with explain_errors(origin, "scene"):
        text = read_text(path, "case", LARGEST)
        root = parse_xml(text, origin, "a case of DualSPHysics")
        if root.tag != "case" or root.find("casedef/geometry/definition") is None:
            raise WavetankError(f"{origin}: a case of DualSPHysics has case/casedef/geometry/definition; this has not.")
        try:
            return _Reader(root, Path(path), spacing).read()
        except (WavetankError, *UNREADABLE) as error:
            raise WavetankError(f"{origin}: the case cannot be read: {one_line(why_unreadable(error))}.") from None


class _Reader:
    """Reads one file."""

    def __init__(self, root: ElementTree.Element, path: Path, spacing: float | None) -> None:
        self.root, self.path, self.notes = root, path, list[str]()
        geometry = root.find("casedef/geometry")
        definition = root.find("casedef/geometry/definition")
        assert geometry is not None and definition is not None
        dp = float(definition.attrib["dp"])
        if not 0.0 < dp < 1e6:
            raise WavetankError(f"dp = {dp:g} is not a particle spacing; it must be above 0 m.")
        self.drawing = Drawing(path, geometry, dp, self.notes)
        self.spacing = spacing or dp
        self.domain = [self.drawing.vector(definition.find(f"point{end}")) for end in ("min", "max")]
        self.dim = 2 if self.domain[0][1] == self.domain[1][1] else 3

    def read(self) -> Imported:
        """Return the scene."""
        items = self.drawing.items
        drawn = [item for item in items if item.what == "fluid"]
        if not drawn:
            raise WavetankError("it contains no fluid that wavetank can simulate")
        walls = self._walls(items, drawn)
        tank = self._tank(walls, items)
        self._tell_of_holes(items, walls)
        seconds = min(self._parameter("TimeMax", 10.0), MOST_TIME)
        rows = [item for item in items if item.what == "bound" and item is not walls]
        place = Placed(self.dim, self.spacing, float(self.domain[0][1]), self.notes)
        materials, material = self._material()
        table: dict[str, Any] = {
            "title": self.path.stem.removesuffix("_Def").replace("_", " "),
            "spacing": self.spacing,
            "tank": tank,
            "fluids": [*self._fluids(items, tank, place, material)],
            "materials": materials,
            "gravity": self._ours(self._vector("casedef/constantsdef/gravity", (0.0, 0.0, -9.81))),
            "solids": placed_solids(
                rows, drawn, self._floatings(), courses(self.root, self.drawing, seconds, self.notes), seconds, place
            ),
        }
        self._tell_the_rest()
        return Imported(Scene.parse(table, str(self.path)), tuple(dict.fromkeys(self.notes)))

    def _vector(self, tag: str, usual: tuple[float, ...]) -> np.ndarray:
        row = self.root.find(tag)
        return np.array(usual) if row is None else self.drawing.vector(row)

    def _ours(self, vector: np.ndarray) -> tuple[float, ...]:
        return tuple(map(float, (OURS @ vector)[: self.dim]))

    def _parameter(self, key: str, usual: float) -> float:
        for row in self.root.findall("execution/parameters/parameter"):
            if row.get("key") == key:
                return self.drawing.number(row.get("value", str(usual)))
        return usual

    # --- tank and fluids ---

    def _walls(self, items: list[Item], fluids: list[Item]) -> Item | None:
        """Return the box of walls that becomes the tank: the largest one that holds the middle of the most fluid."""
        moving = {int(row.get("ref", -1)) for row in self.root.findall("casedef/motion/objreal")} | {*self._floatings()}
        boxes = [
            item
            for item in items
            if item.what == "bound"
            and item.shape == "box"
            and item.faces
            and item.is_straight
            and "bottom" in item.faces
            and item.mk not in moving
        ]
        largest = max(fluids, key=_volume)
        middle = 0.5 * sum(largest.corners())
        around = [box for box in boxes if (box.corners()[0] <= middle).all() and (middle <= box.corners()[1]).all()]
        return max(around, key=_volume, default=None)

    def _tank(self, walls: Item | None, items: list[Item]) -> Tank:
        """Return the tank: the box of walls, open where it has none, as high as the domain; else all that is there."""
        if walls is None:
            ends = [item.corners() for item in items if item.what != "void"]
            lower, upper = np.min([a for a, _ in ends], axis=0), np.max([b for _, b in ends], axis=0)
            margin = np.maximum(4.0 * self.spacing, 0.1 * (upper - lower))
            lower, upper = lower - margin, upper + margin
            faces: tuple[str, ...] = ()
            self.notes.append("no box of walls surrounds the fluid; the tank is open on all sides.")
        else:
            (lower, upper), faces = walls.corners(), walls.faces
            if "top" not in faces:
                upper = upper + np.array([0.0, 0.0, self._room_above(lower[2], upper[2])])
                self.notes.append(
                    f"the walls go on up to {upper[2]:.4g} m, where the tank is open; theirs end, and what passes the "
                    "domain is lost."
                )
        sides = [SIDES[name] for name in SIDES if name not in faces and (self.dim == 3 or "z" not in SIDES[name])]
        ours = np.sort([OURS @ lower, OURS @ upper], axis=0)[:, : self.dim]
        return Tank(size=tuple(map(float, ours[1] - ours[0])), lower=tuple(map(float, ours[0])), open=sides)

    def _room_above(self, low: float, high: float) -> float:
        """Return how far the domain of the simulation goes above the walls [m]: half their height unless told."""
        row = self.root.find("execution/parameters/simulationdomain/posmax")
        text = (row.get("z", "") if row is not None else "").replace(" ", "")
        if text.startswith("default+") and text.endswith("%"):
            return self.drawing.number(text[8:-1]) / 100.0 * (high - low)
        if text and not text.startswith("default"):
            return max(self.drawing.number(text) - high, 0.0)
        return 0.5 * (high - low)

    def _fluids(self, items: list[Item], tank: Tank, place: Placed, material: str | None) -> Iterator[Fluid]:
        """Yield the fluids, the last one that was drawn first; what fills what is free comes after all others."""
        speeds, blocks = self._speeds(), 0
        order = [k for k in reversed(range(len(items))) if not items[k].is_filling]
        order += [k for k in range(len(items)) if items[k].is_filling]
        for k in order:
            item = items[k]
            if item.what != "fluid":
                continue
            velocity = speeds.get(item.mk)
            fields = {"material": material, "velocity": None if velocity is None else self._ours(velocity)}
            if item.shape == "box" and item.is_straight:
                voids = [other for other in items[k + 1 :] if other.what == "void" and other.is_straight]
                holes = [voids[n].corners() for n in np.flatnonzero(meeting(item, voids))]
                parts = _without(item.corners(), holes)
                for box in parts:
                    yield from self._block(box, tank, fields)
                blocks += len(parts)
                if blocks > 2 * MOST_PARTS:
                    raise WavetankError(f"its fluid is more than {2 * MOST_PARTS:,} boxes.")
            elif item.shape == "sphere":
                yield Ball(
                    center=self._ours(item.corners()[0] + item.radius * item.scale),
                    radius=item.radius * item.scale,
                    **fields,
                )
            else:
                for solid in place.shapes(item, "fluid"):
                    yield Filled(inside=solid, **fields)

    def _block(self, box: tuple[np.ndarray, np.ndarray], tank: Tank, fields: dict[str, Any]) -> Iterator[Block]:
        ours = np.sort([OURS @ box[0], OURS @ box[1]], axis=0)[:, : self.dim]
        inner = tank.box()
        lower, upper = np.maximum(ours[0], inner[0]), np.minimum(ours[1], inner[1])
        if (upper - lower).min() >= 0.5 * self.spacing:
            yield Block(lower=tuple(map(float, lower)), upper=tuple(map(float, upper)), **fields)

    def _speeds(self) -> dict[int, np.ndarray]:
        found = {}
        for row in self.root.findall("casedef/initials/*"):
            if row.tag != "velocity" or row.find("velocity2") is not None or row.find("onlypos") is not None:
                self.notes.append(f"<{row.tag}> of the initials has no counterpart (a uniform velocity has); left out.")
                continue
            speed = self.drawing.vector(row)
            along, uniform = row.find("direction"), row.find("velocity")
            if along is not None and uniform is not None:
                way = self.drawing.vector(along)
                speed = way / np.linalg.norm(way) * self.drawing.number(uniform.get("v", "0"))
            for mk in numbers_of(row.get("mkfluid", "")):
                found[mk] = speed
        return found

    def _material(self) -> tuple[list[Material], str | None]:
        row = self.root.find("casedef/constantsdef/rhop0")
        density = 1000.0 if row is None else self.drawing.number(row.get("value", "1000"))
        viscosity = None
        if self._parameter("ViscoTreatment", 1.0) == LAMINAR:
            viscosity = self._parameter("Visco", 1e-6) * density
        else:
            self.notes.append("Visco of artificial viscosity is a coefficient without a unit; water's own is taken.")
        if viscosity is None and density == 1000.0:
            return [], None
        return [Material(name="fluid", density=density, viscosity=viscosity)], "fluid"

    # --- bodies ---

    def _floatings(self) -> dict[int, dict[str, Any]]:
        """Return what makes the bound of a mk a body."""
        found: dict[int, dict[str, Any]] = {}
        for row in self.root.findall("casedef/floatings/floating"):
            mass, fields = row.find("massbody"), dict[str, Any]()
            if mass is not None:
                fields["mass"] = self.drawing.number(mass.get("value", "0"))
            else:
                fields["density"] = self.drawing.number(row.get("rhopbody", "1000"))
            speed = row.find("linearvelini")
            if speed is not None:
                fields["velocity"] = self._ours(self.drawing.vector(speed))
            for tag in row:
                if tag.tag not in ("massbody", "masspart", "linearvelini"):
                    self.notes.append(f"<{tag.tag}> of floating {row.get('mkbound', '')} is left out.")
            for mk in numbers_of(row.get("mkbound", "")):
                found[mk] = fields
        return found

    # --- what is told ---

    def _tell_of_holes(self, items: list[Item], walls: Item | None) -> None:
        for k, hole in enumerate(items):
            solid = [item for item in items[:k] if item.what == "bound" and item is not walls]
            if hole.what == "void" and solid and (cut := meeting(hole, solid)).any():
                mk = solid[int(np.argmax(cut))].mk
                self.notes.append(f"what is drawn void in mk {mk} is left out: solids stay whole.")

    def _tell_the_rest(self) -> None:
        told = {"gauges": "", "wavepaddles": "", "timeout": "", "savedt": "", "outputparts": ""}
        for row in self.root.findall("execution/special/*"):
            if told.get(str(row.tag), "-") and row.get("active", "true") not in ("false", "0"):
                self.notes.append(f"<{one_line(row.tag, 40)}> of the execution has no counterpart; it is left out.")
        for row in self.root.findall("execution/parameters/parameter"):
            if "Periodic" in row.get("key", "")[:9]:
                self.notes.append(f"{row.get('key')}: periodic sides are not imported; walls stand there.")
        self.notes.append("How it is solved, shown and written is wavetank's own.")


def _volume(item: Item) -> float:
    lower, upper = item.corners()
    return float(np.prod(np.maximum(upper - lower, 1e-9)))


def _cut_off(
    box: tuple[np.ndarray, np.ndarray], low: np.ndarray, high: np.ndarray
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Yield the parts of a box that planes through the corners `low` and `high` of a hole cut off, axis by axis."""
    lower, upper = box[0].copy(), box[1].copy()
    for axis in range(3):
        if lower[axis] < low[axis] < upper[axis]:
            before = upper.copy()
            before[axis] = low[axis]
            yield lower.copy(), before
            lower[axis] = low[axis]
        if lower[axis] < high[axis] < upper[axis]:
            after = lower.copy()
            after[axis] = high[axis]
            yield after, upper.copy()
            upper[axis] = high[axis]


def _without(box: tuple[np.ndarray, np.ndarray], holes: list[Any]) -> list[tuple[np.ndarray, np.ndarray]]:
    """Return a box less others, as boxes."""
    parts = [box]
    for low, high in holes:
        corners = np.array(parts).reshape(-1, 2, 3)
        overlaps = (np.minimum(corners[:, 1], high) - np.maximum(corners[:, 0], low) > 1e-12).all(axis=1)
        left = [part for part, overlap in zip(parts, overlaps, strict=True) if not overlap]
        for number in np.flatnonzero(overlaps):
            left += _cut_off(parts[number], low, high)
        parts = left
        if not parts:
            break
        if len(parts) > MOST_PARTS:
            raise WavetankError(f"its void boxes cut the fluid into more than {MOST_PARTS:,} parts.")
    return parts
