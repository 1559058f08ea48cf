"""Air on one side of a body: gates and open boats feel the water on the side where it is."""

import numpy as np
import pytest

import wavetank as wt
from wavetank.lab.cases.hull import draft_of_bowl
from wavetank.physics.bodies import largest_displacement
from wavetank.solids.mass import Ruler, thickness

D = 0.02  # m
BEAM, DEPTH, DRAFT = 20 * D, 0.5, 0.2  # m


def gate_and_water(thick, place, spacing, **changes):
    """Water 20 spacings deep before an upright gate of so many spacings, at that place in the cells; air behind it."""
    deep, face = 20 * spacing, (20 + place) * spacing
    gate = wt.Box(
        name="gate",
        center=(face + 0.5 * thick * spacing, deep),
        size=(thick * spacing, 2.0 * deep),
        density=2000,
        held=True,
    )
    water = wt.Block(lower=(0.0, 0.0), upper=(20 * spacing, deep))
    tank = wt.Tank(size=(32 * spacing, 2.0 * deep))
    sim = wt.Simulation(wt.Scene(spacing=spacing, tank=tank, fluids=[water], solids=[gate], foam=0.0, **changes))
    return sim, sim.count * spacing**2 / face


@pytest.mark.parametrize(
    ("thick", "place", "spacing", "changes"),
    [
        (0.5, 0.0, D, {}),
        (1.0, 0.5, D, {"substeps": 4}),
        (1.0, 0.25, 0.5 * D, {}),
        (2.0, 0.75, D, {"frame_time": 1 / 240}),
        (4.0, 0.5, 50 * D, {}),
    ],
)
def test_a_gate_holds_the_weight_of_the_water_before_it(thick, place, spacing, changes):
    """Hydrostatics, rho g H^2 / 2 at H / 3: it felt 17 to 44 % of that under three spacings."""
    sim, depth = gate_and_water(thick, place, spacing, **changes)
    sim.advance(0.75 * (spacing / D) ** 0.5)
    gate, forces, moments = sim.bodies["gate"], [], []
    for _ in range(15):
        sim.step()
        forces.append(gate.force[0])
        moments.append(gate.position[1] * gate.force[0] - np.atleast_1d(gate.torque)[-1])
    whole = 0.5 * 1000.0 * 9.81 * depth**2
    assert np.mean(forces) / whole == pytest.approx(1.0, abs=0.02)
    assert np.mean(moments) / (whole * depth / 3.0) == pytest.approx(1.0, abs=0.04)


def boat_in_water(thick, aside, draft):
    """A tub of three boards of so many spacings, that much `aside` [d], at the `draft` of its weight in still water."""
    wall, bottom = thick * D, DEPTH - draft
    parts = [
        wt.Box(center=(0.0, 0.5 * (wall - BEAM)), size=(BEAM, wall)),
        wt.Box(center=(0.5 * (wall - BEAM), 0.0), size=(wall, BEAM)),
        wt.Box(center=(0.5 * (BEAM - wall), 0.0), size=(wall, BEAM)),
    ]
    center = (0.6 + aside * D, bottom + 0.5 * BEAM)
    boat = wt.Union(name="boat", center=center, parts=parts, mass=1000.0 * BEAM * draft)
    left, right = center[0] - 0.5 * BEAM, center[0] + 0.5 * BEAM
    fluids = [
        wt.Block(lower=(0.0, 0.0), upper=(1.2, bottom)),
        wt.Block(lower=(0.0, bottom), upper=(left, DEPTH)),
        wt.Block(lower=(right, bottom), upper=(1.2, DEPTH)),
    ]
    tank = wt.Tank(size=(1.2, 1.1))
    return wt.Simulation(wt.Scene(spacing=D, tank=tank, fluids=fluids, solids=[boat], foam=0.0))


@pytest.mark.parametrize(
    ("thick", "aside", "draft"), [(1.0, 0.0, 0.2), (1.0, 0.37, 0.15), (2.0, 0.5, 0.25), (4.0, 0.2, 0.2)]
)
def test_a_boat_of_boards_floats_at_its_draft_and_dry(thick, aside, draft):
    """Archimedes: boards and air together displace its weight. Boats of boards under four spacings filled and sank."""
    sim = boat_in_water(thick, aside, draft)
    boat, drafts = sim.bodies["boat"], []
    for _ in range(240):
        sim.step()
        low = boat.position[1] - 0.5 * BEAM
        drafts.append((sim.count * D**2 - BEAM * low) / (1.2 - BEAM) - low)
    angle = 2.0 * np.arctan2(boat.rotation[3], boat.rotation[0])
    x = (sim.positions - np.asarray(boat.position[:2])) @ [
        [np.cos(angle), -np.sin(angle)],
        [np.sin(angle), np.cos(angle)],
    ]
    assert not np.any((np.abs(x[:, 0]) < 0.5 * BEAM - thick * D) & (np.abs(x[:, 1]) < 0.5 * BEAM))
    assert np.mean(drafts[120:]) == pytest.approx(draft, rel=0.04)


@pytest.mark.parametrize(("spacing", "thick", "draft"), [(0.03, 1.0, 0.125), (0.03, 2.0, 0.15)])
def test_a_bowl_that_is_a_mesh_floats_at_its_draft_and_dry(spacing, thick, draft):
    """The same in space: a cap of a ball displaces pi h^2 (R - h / 3)."""
    found, inside = draft_of_bowl(spacing, thick, draft, 2.5, "cpu")
    assert inside == 0.0
    assert found == pytest.approx(1.0, rel=0.04)


def tub(dim):
    """A tub whose outer edges are 0.4 m and whose walls are 0.02 m, in its own frame."""
    inside = wt.Box(center=(0.0, 0.02, 0.0)[:dim], size=(0.36, 0.4, 0.36)[:dim])
    return wt.Difference(
        center=(0.0,) * dim, parts=[wt.Box(center=(0.0,) * dim, size=(0.4,) * dim), inside], density=500.0
    )


@pytest.mark.parametrize("dim", [2, 3])
def test_a_tub_floats_by_the_volume_to_its_rim(dim):
    for solid, volume in ((tub(dim), 0.4**dim), (wt.Box(center=(0.0,) * dim, size=(0.4,) * dim), 0.4**dim)):
        cut = Ruler(solid, dim, D).cut_for_surface(D)
        inside = cut.volumes > 0.0
        found = largest_displacement(cut.places[inside], cut.edges, cut.volumes[inside])
        assert 0.99 * volume < found < 1.07 * volume  # a little more on its side, where a wall's inner face looks down


@pytest.mark.parametrize("dim", [2, 3])
def test_sheets_are_cut_into_boxes_of_half_their_thickness(dim):
    """Differences of volumes are areas of the surface only where some box is full."""
    cut = Ruler(tub(dim), dim, D).cut_for_surface(D)
    assert thickness(cut) == pytest.approx(0.02, rel=0.3)
    assert cut.edges[:dim].max() <= 0.011
    assert cut.volumes.max() == pytest.approx(np.prod(cut.edges[:dim]))
    assert Ruler(wt.Sphere(center=(0.0,) * dim, radius=0.1), dim, D).cut_for_surface(D).edges[0] > 0.9 * D
