"""Forces of a scene act on bodies as on the water in their place; joints tell what they gave."""

import math

import numpy as np
import pytest

import wavetank as wt
from wavetank.scene.forces import Sway, Vortex, Wind

pytest.importorskip("rapier3d")


def above_a_puddle(*bodies, joints=(), forces=(), gravity=(0, -9.81, 0)) -> wt.Simulation:
    return wt.Simulation(
        wt.Scene(
            spacing=0.1,
            tank=wt.Tank(size=(2, 2, 1)),
            fluids=[wt.Block(lower=(0, 0, 0), upper=(2, 0.2, 1))],
            solids=list(bodies),
            joints=list(joints),
            forces=list(forces),
            gravity=gravity,
        )
    )


def test_wind_takes_bodies_along_as_it_takes_water():
    """dv/dt = k (u - v), so v = u (1 - exp(-k t)), whatever the body weighs; nothing turns it."""
    ball = wt.Sphere(name="ball", center=(1, 1.5, 0.5), radius=0.1, density=300)
    sim = above_a_puddle(ball, forces=[Wind(velocity=(0.4, 0, 0), drag=2.0)], gravity=(0, 0, 0))
    sim.advance(0.5)
    assert sim.bodies["ball"].velocity == pytest.approx([0.4 * (1 - math.exp(-1.0)), 0, 0], abs=2e-3)
    assert sim.bodies["ball"].angular_velocity == pytest.approx([0, 0, 0], abs=1e-3)


def test_a_vortex_turns_a_body():
    """In the middle of it a body turns as the vortex does."""
    box = wt.Box(name="box", center=(1, 1.5, 0.5), size=(0.2, 0.1, 0.2), density=2000)
    vortex = Vortex(center=(1, 1.5, 0.5), radius=5.0, speed=10.0, axis=(0, 1, 0), drag=20.0)
    sim = above_a_puddle(box, forces=[vortex], gravity=(0, 0, 0))
    sim.advance(0.5)
    assert sim.bodies["box"].angular_velocity == pytest.approx([0, 2.0, 0], abs=0.05)


def test_a_tank_that_sways_leaves_its_bodies_behind():
    """In the frame of a tank that is accelerated everything falls the other way: v = -a t."""
    ball = wt.Sphere(name="ball", center=(1, 1.5, 0.5), radius=0.1, density=5000)
    sim = above_a_puddle(ball, forces=[Sway(acceleration=(1.5, 0, 0))], gravity=(0, 0, 0))
    sim.advance(0.3)
    assert sim.bodies["ball"].velocity == pytest.approx([-0.45, 0, 0], abs=2e-3)


def arm(name: str, middle: float, mass: float) -> wt.Box:
    return wt.Box(name=name, center=(middle, 1.2, 0.5), size=(0.4, 0.1, 0.1), mass=mass)


def test_motors_tell_what_they_give():
    """Statics: a motor that holds an arm carries the moment of all that hangs on it; a slider its weight."""
    joints = [
        wt.Hinge(name="shoulder", first="upper", at=(0.5, 1.2, 0.5), target=0.0, strength=500.0),
        wt.Hinge(name="elbow", first="lower", second="upper", at=(0.9, 1.2, 0.5), target=0.0, strength=500.0),
    ]
    sim = above_a_puddle(arm("upper", 0.7, 4.0), arm("lower", 1.1, 2.0), joints=joints)
    sim.advance(1.5)
    lower = 2.0 * 9.81 * (sim.bodies["lower"].center[0] - 0.9)
    whole = 9.81 * (4.0 * (sim.bodies["upper"].center[0] - 0.5) + 2.0 * (sim.bodies["lower"].center[0] - 0.5))
    assert sim.joints["elbow"].effort == pytest.approx(lower, rel=0.02)
    assert sim.joints["shoulder"].effort == pytest.approx(whole, rel=0.02)
    slider = wt.Slider(name="lift", first="upper", at=(0.7, 1.2, 0.5), axis=(0, 1, 0), speed=0.2, strength=500.0)
    sim = above_a_puddle(arm("upper", 0.7, 4.0), joints=[slider])
    sim.advance(0.5)
    assert sim.joints["lift"].effort == pytest.approx(4.0 * 9.81, rel=0.01)
    assert sim.joints["lift"].power == pytest.approx(4.0 * 9.81 * 0.2, rel=0.01), "force times speed"


def test_a_ring_of_joints_has_no_effort_of_its_own():
    ring = [
        wt.Hinge(name="left", first="beam", at=(0.5, 1.2, 0.5)),
        wt.Hinge(name="right", first="beam", at=(0.9, 1.2, 0.5)),
        wt.Rope(name="line", first="beam", at=(0.7, 1.2, 0.5), to=(0.7, 1.6, 0.5)),
    ]
    sim = above_a_puddle(arm("beam", 0.7, 2.0), joints=ring)
    assert sim.joints["left"].effort == 0.0, "before the first step"
    sim.advance(0.1)
    assert np.isnan(sim.joints["left"].effort)


def test_what_clings_to_a_body_pulls_it():
    """Newton's third law for adhesion: a drop that wets a box draws it near, and the sum of momenta stays zero."""
    scene = wt.Scene(
        spacing=0.002,
        gravity=(0, 0, 0),
        calming=0,
        surface_tension=0.07,
        fluids=[wt.Block(lower=(-0.01, -0.01, -0.01), upper=(0.01, 0.01, 0.01))],
        solids=[wt.Box(name="box", center=(0.021, 0, 0), size=(0.02, 0.03, 0.03), density=600)],
    )
    sim, largest = wt.Simulation(scene), 0.0
    box, mass = sim.bodies["box"], 1000 * 0.002**3
    for _ in range(24):
        sim.step()
        momentum = box.mass * box.velocity + box.pending_impulse[:3]
        largest = max(largest, float(np.linalg.norm(momentum)))
    total = mass * sim.velocities.astype(float).sum(axis=0) + momentum
    assert box.position[0] < 0.0205, "it is drawn near"
    assert np.linalg.norm(total) < 2e-3 * largest
