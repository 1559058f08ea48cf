"""What the water does to bodies and what joints give, as figures of a frame, of a run, and over pictures."""

import csv
import json
import math

import numpy as np
import pytest

import wavetank as wt
from wavetank.page.hud import Hud, three
from wavetank.session import commands as do

pytest.importorskip("rapier3d")


def pool(**others):
    return wt.Scene(
        spacing=0.05,
        tank=wt.Tank(size=(0.8, 0.8, 0.8)),
        foam=0,
        fluids=[wt.Block(lower=(0, 0, 0), upper=(0.8, 0.4, 0.8))],
        **others,
    )


def arm(**motor):
    """A bar of 2 kg that is 0.4 m long, on a hinge at its end, above the water."""
    return pool(
        solids=[wt.Box(name="bar", center=(0.4, 0.65, 0.4), size=(0.4, 0.06, 0.06), mass=2)],
        joints=[wt.Hinge(name="hip", first="bar", at=(0.2, 0.65, 0.4), axis=(0, 0, 1), **motor)],
    )


def test_a_motor_that_lifts_takes_the_weight_times_its_speed():
    """P = m g v of the centre of mass, cos of the angle times the lever; a motor that lets down gets it back."""
    for speed in (0.5, -0.5):
        sim = wt.Simulation(arm(speed=speed))
        sim.advance(0.2)
        row = sim.stats()
        angle = row["joints.hip.position"]
        assert row["joints.hip.velocity"] == pytest.approx(speed, abs=0.03), "it sagged by 0.34 rad/s"
        weight = 2 * 9.81 * 0.2 * math.cos(angle)
        assert row["joints.hip.power"] == pytest.approx(weight * row["joints.hip.velocity"], rel=0.02)
        assert row["joints.hip.power"] == pytest.approx(row["joints.hip.effort"] * row["joints.hip.velocity"])
        assert sim.joints.powers == {"hip": pytest.approx(row["joints.hip.power"])}


def test_a_hinge_without_a_motor_has_no_power_to_be_shown():
    sim = wt.Simulation(arm())
    sim.advance(0.1)
    assert sim.joints.powers == {} and abs(sim.stats()["joints.hip.effort"]) < 0.1


def test_between_two_fluids_each_has_its_share(tmp_path):
    """Archimedes in layers: the lower fluid is 1000, the upper 850 kg/m^3; drag was -8 % of the weight at rest."""
    block = {"spacing": 0.02, "tank": wt.Tank(size=(0.8, 0.8)), "materials": [{"name": "light", "density": 850.0}]}
    layers = [wt.Block(lower=(0, 0), upper=(0.8, 0.3)), wt.Block(lower=(0, 0.3), upper=(0.8, 0.54), material="light")]
    box = wt.Box(name="box", center=(0.4, 0.3), size=(0.24, 0.15), density=925)
    sim = wt.Simulation(wt.Scene(fluids=layers, solids=[box], **block))
    sim.advance(2.0)
    found = sim.bodies["box"]
    displaced = 9.81 * 0.24 * 0.15 * 925.0  # half in each
    assert found.buoyancy[1] == pytest.approx(displaced, rel=0.02)
    assert found.force[1] == pytest.approx(displaced, rel=0.02)
    assert found.position[1] == pytest.approx(0.3, abs=0.1 * 0.02)
    sim.save(tmp_path / "state.npz")
    assert wt.Simulation.restore(tmp_path / "state.npz").bodies["box"].buoyancy[1] == found.buoyancy[1]


def test_force_is_buoyancy_and_drag():
    scene = pool(solids=[wt.Box(name="crate", center=(0.4, 0.2, 0.4), size=(0.2, 0.2, 0.2), density=800, held=True)])
    sim = wt.Simulation(scene)
    sim.advance(0.5)
    crate, weight = sim.bodies["crate"], 1000 * 0.2**3 * 9.81
    assert crate.buoyancy.tolist() == pytest.approx([0, weight, 0], abs=0.02 * weight)
    assert np.linalg.norm(crate.drag) < 0.1 * weight
    assert (crate.buoyancy + crate.drag).tolist() == pytest.approx(crate.force.tolist())
    row = sim.bodies.figures()
    assert row["bodies.crate.force_y"] == pytest.approx(crate.force[1])
    assert {name.rsplit(".", 1)[1] for name in row} == {
        "force_x",
        "force_y",
        "force_z",
        "torque_x",
        "torque_y",
        "torque_z",
        "immersed",
    }


def test_a_flat_world_has_two_parts_and_one_torque():
    scene = wt.Scene(
        spacing=0.05,
        tank=wt.Tank(size=(0.8, 0.8)),
        fluids=[wt.Block(lower=(0, 0), upper=(0.8, 0.4))],
        solids=[wt.Box(name="b", center=(0.4, 0.4), size=(0.2, 0.2), density=500)],
        joints=[wt.Hinge(name="pin", first="b", at=(0.4, 0.4), speed=0.0)],
    )
    sim = wt.Simulation(scene)
    sim.step()
    keys = {name.removeprefix("bodies.b.") for name in sim.stats() if name.startswith("bodies")}
    assert keys == {"force_x", "force_y", "torque_z", "immersed"}
    assert sim.bodies["b"].buoyancy.shape == sim.bodies["b"].drag.shape == (2,)


def test_a_run_has_them_in_a_table_and_means_at_its_end(wavetank, tmp_path):
    arm(speed=0.5).save(tmp_path / "arm.toml")
    done = wavetank("run", str(tmp_path / "arm.toml"), "--seconds", "0.2", "--out", str(tmp_path / "out"))
    assert done.returncode == 0, done.stderr
    with (tmp_path / "out" / "stats.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 7 and rows[0]["milliseconds_per_frame"] == ""
    power = [float(row["joints.hip.power"]) for row in rows]
    told = json.loads((tmp_path / "out" / "stats.json").read_text())
    assert told["mean"]["power"]["hip"] == pytest.approx(np.mean(power[1:]), rel=1e-6)
    assert str(tmp_path / "out" / "stats.csv") in told["files"]


def test_they_are_arrows_and_numbers_over_the_picture_where_asked_for():
    scene = arm(speed=0.5)
    session = wt.Session(
        scene.changed(
            solids=[*scene.solids, wt.Box(name="crate", center=(0.4, 0.2, 0.4), size=(0.2, 0.2, 0.2), density=800)]
        )
    )
    hud = Hud(session)
    session.tick()
    assert hud.regions((640, 360)) == []
    session.apply(do.SetView(forces=True))
    session.apply(do.SetView(view="particles"))
    assert session.shows_forces, "what is not said again stays"
    session.tick()
    shown = hud.regions((640, 360))
    assert {row["mark"] for row in shown} == {"buoyancy", "drag", "power"}
    (crate,) = [row for row in shown if row["mark"] == "buoyancy" and float(row["label"].split()[0]) > 20]
    (u, v), (_, tip) = crate["outline"]
    assert 0 < u < 1 and tip < v, "buoyancy points up"
    assert next(row for row in shown if row["mark"] == "power")["label"].startswith("hip: ")
    session.apply(do.SetView(forces=False))
    assert hud.regions((640, 360)) == []


def test_numbers_have_three_digits():
    assert [three(value) for value in (0.0, 0.0312, -0.5, 7.0, 78.4812, 12345.6)] == [
        "0.00",
        "0.0312",
        "-0.500",
        "7.00",
        "78.5",
        "12346",
    ]


def hung(kind, dim=3, frame_time=1 / 60, **fields):
    """A ball of 2 kg in the air, on a line of 0.2 m to a place above it."""
    aside = (0.4,) * (dim - 2)
    block = wt.Block(lower=(0.0,) * dim, upper=(0.8, 0.1, *(0.8,) * (dim - 2)))
    return wt.Scene(
        spacing=0.05,
        tank=wt.Tank(size=(0.8,) * dim),
        foam=0,
        fluids=[block],
        frame_time=frame_time,
        solids=[wt.Sphere(name="ball", center=(0.4, 0.5, *aside), radius=0.05, mass=2)],
        joints=[kind(name="line", first="ball", at=(0.4, 0.55, *aside), to=(0.4, 0.75, *aside), **fields)],
    )


@pytest.mark.parametrize("frame_time", [1 / 60, 1 / 200])
@pytest.mark.parametrize("dim", [2, 3])
def test_a_rope_bears_what_hangs_on_it(dim, frame_time):
    sim = wt.Simulation(hung(wt.Rope, dim, frame_time))
    sim.advance(1.0)
    line = sim.joints["line"]
    assert line.effort == pytest.approx(2 * 9.81, rel=0.02)
    assert line.position == pytest.approx(0.2, abs=0.002) and abs(line.velocity) < 0.002
    assert sim.stats()["joints.line.effort"] == line.effort
    assert "joints.line.power" not in sim.stats()


def test_a_slack_rope_pulls_nothing():
    """The ball lies on the floor, which bears it."""
    sim = wt.Simulation(hung(wt.Rope, length=0.8))
    sim.advance(1.0)
    assert sim.joints["line"].effort == 0.0
    assert 0.5 < sim.joints["line"].position < 0.8


@pytest.mark.parametrize("stiffness", [200.0, 2000.0])
def test_a_spring_is_longer_by_what_hangs_on_it_over_its_stiffness(stiffness):
    """Hooke's law."""
    sim = wt.Simulation(hung(wt.Spring, stiffness=stiffness, damping=20.0))
    line = sim.joints["line"]
    assert line.effort == 0.0, "before the first step"
    sim.advance(3.0)
    assert line.effort == pytest.approx(2 * 9.81, rel=0.02)
    assert line.position == pytest.approx(0.2 + 2 * 9.81 / stiffness, abs=0.001)


def test_joints_without_an_axis_have_no_effort():
    scene = hung(wt.Rope)
    weld = wt.BallJoint(name="line", first="ball", at=(0.4, 0.55, 0.4))
    sim = wt.Simulation(scene.model_copy(update={"joints": [weld]}))
    sim.step()
    with pytest.raises(wt.WavetankError, match="'line' is a ball-joint"):
        _ = sim.joints["line"].effort


@pytest.mark.parametrize(
    ("spacing", "thickness", "offset"), [(0.02, 3, 0.0), (0.02, 3, 0.25), (0.02, 5, 0.5), (0.01, 4, 0.0)]
)
@pytest.mark.parametrize("height", [0.3, 0.5])
def test_water_on_one_side_presses_on_a_gate_as_hydrostatics_says(spacing, thickness, offset, height):
    """rho g H^2 / 2 at a third of the depth. What was carried on of it was bounded by what the plate displaces."""
    left = 0.6 + offset * spacing
    plate = wt.Box(
        name="gate",
        center=(left + 0.5 * thickness * spacing, 0.4),
        size=(thickness * spacing, 0.8),
        density=1000,
        held=True,
    )
    water = wt.Block(lower=(0, 0), upper=(left, height))
    sim = wt.Simulation(
        wt.Scene(spacing=spacing, tank=wt.Tank(size=(1.0, 0.9)), foam=0, solids=[plate], fluids=[water])
    )
    rows = []
    for frame in range(40):
        sim.step()
        if frame >= 20:
            gate = sim.bodies["gate"]
            rows.append((gate.force[0], gate.torque[-1]))
    force, torque = np.mean(rows, axis=0)
    wanted = 0.5 * 1000 * 9.81 * height**2
    assert force == pytest.approx(wanted, rel=0.04)
    assert torque == pytest.approx(wanted * (0.4 - height / 3), rel=0.06)
