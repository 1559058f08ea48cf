"""Robots from MJCF: poses as the engine's own reader has them, masses of solids, limits, motors, what is left out."""

import math
import subprocess
import sys
import time

import numpy as np
import pytest

import wavetank as wt
from wavetank.formats.robot import STANDING
from wavetank.foundation.errors import WavetankError
from wavetank.foundation.rotations import inverse, product

engine = pytest.importorskip("rapier3d")

ARM = """<mujoco model="arm">
  <compiler angle="degree"/>
  <default>
    <geom rgba="1 0.5 0 1"/>
    <default class="thin"><geom type="capsule" size="0.03" density="500"/><joint damping="1"/></default>
  </default>
  <asset><material name="blue" rgba="0 0 1 1"/></asset>
  <worldbody>
    <light pos="0 0 3"/>
    <geom name="ground" type="plane" size="1 1 0.1"/>
    <geom type="box" size="0.1 0.2 0.3" pos="0 1 0.3"/>
    <body name="post" pos="0 0 0.1">
      <geom type="cylinder" size="0.1 0.1" material="blue" rgba="0 0 1 1"/>
      <geom type="sphere" size="9" contype="0" conaffinity="0"/>
      <body name="upper" pos="0 0 0.1" euler="0 0 90">
        <joint name="shoulder" axis="1 0 0" range="-60 60"/>
        <geom type="box" size="0.04 0.03 0.2" pos="0 0 0.2" mass="2"/>
        <body name="fore" pos="0 0 0.4" childclass="thin">
          <joint name="lift" type="slide" axis="0 0 1" range="-0.1 0.2"/>
          <geom name="bone" fromto="0 0 0 0.3 0 0"/>
          <frame pos="0.1 0 0">
            <body name="cup" pos="0.2 0 0"><geom type="sphere" size="0.06" mass="0.5"/></body></frame>
        </body>
      </body>
    </body>
    <body name="float" pos="0.5 0 0.3"><freejoint/><geom type="ellipsoid" size="0.1 0.05 0.05" mass="0.1"/></body>
    <body name="leg" pos="-0.5 0 0.3"><inertial pos="0 0 0" mass="3" diaginertia="1 1 1"/>
      <joint type="ball"/><geom type="capsule" size="0.05 0.1"/></body>
  </worldbody>
  <actuator>
    <position joint="shoulder" kp="50" forcerange="-90 90"/>
    <motor joint="lift" ctrlrange="-1 1" gear="50"/>
  </actuator>
</mujoco>"""


@pytest.fixture
def arm(tmp_path):
    (tmp_path / "arm.xml").write_text(ARM)
    return tmp_path / "arm.xml"


def solids_of(robot):
    return {solid.name: solid for solid in robot.solids}


def test_bodies_stand_and_weigh_what_the_file_says(arm):
    robot = wt.load_robot(arm, (0.5, 0.1, 0.3), prefix="r.")
    solids = solids_of(robot)
    assert [*solids] == ["r.post", "r.upper", "r.fore", "r.float", "r.leg", "r.ground 1"]
    assert (solids["r.post"].mass, solids["r.upper"].mass, solids["r.leg"].mass) == (None, 2.0, 3.0)
    assert (solids["r.post"].color, solids["r.upper"].color) == ("#0000ff", "#ff8000")
    assert solids["r.post"].shape == "cylinder", "what touches nothing is for the eye"
    # A capsule's volume is that of its cylinder and of a ball: pi r^2 (l + 4 r / 3).
    assert solids["r.fore"].mass == pytest.approx(0.5 + 500 * math.pi * 0.03**2 * (0.3 + 0.04))
    assert [part.shape for part in solids["r.fore"].parts] == ["capsule", "sphere"]
    assert solids["r.upper"].origin.tolist() == pytest.approx([0.5, 0.5, 0.3])
    # z there is y here; 90 degrees about it take the forearm's x to their y, which is -z.
    cup = wt.Union.model_validate(vars(solids["r.fore"]))
    from wavetank.foundation.rotations import turned

    place = cup.origin + turned(cup.quaternion, np.array([0.3, 0.0, 0.0]))
    assert place.tolist() == pytest.approx([0.5, 0.7, 0.0], abs=1e-6)
    assert solids["r.ground 1"].origin.tolist() == pytest.approx([0.5, 0.4, -0.7])


def test_joints_have_their_limits_and_motors(arm):
    robot = wt.load_robot(arm, (0.5, 0.1, 0.3))
    shoulder, lift, ball = robot.joints
    assert (shoulder.name, shoulder.first, shoulder.second) == ("shoulder", "upper", "post")
    assert shoulder.at == pytest.approx((0.5, 0.3, 0.3))
    assert shoulder.axis == pytest.approx((0.0, 0.0, -1.0), abs=1e-6)
    assert shoulder.limits == pytest.approx((-math.pi / 3, math.pi / 3))
    assert (shoulder.target, shoulder.strength) == (0.0, 90.0)
    assert (lift.kind, lift.limits, lift.target, lift.strength) == ("slider", (-0.1, 0.2), None, 50.0)
    assert (ball.kind, ball.first, ball.second) == ("ball-joint", "leg", "")
    said = " ".join(robot.notes)
    for words in ("plane 'ground' of the world is left out", "lift has a motor that gives a torque", "damping, stiff"):
        assert words in said


def test_it_stands_on_what_moves_it(arm, wavetank, tmp_path):
    done = wavetank("import", str(arm), "-o", str(tmp_path / "s.toml"), "--into", "still-tank", "--at", "0.6,0,0.4")
    assert done.returncode == 0, done.stderr
    sim = wt.Simulation(wt.Scene.load(tmp_path / "s.toml").changed(spacing=0.08))
    sim.joints["shoulder"].target, sim.joints["lift"].target = 0.5, 0.15
    assert sim.joints["lift"].strength == 50.0, "also of a motor that was not there before"
    sim.advance(0.5)
    assert sim.joints["shoulder"].position == pytest.approx(0.5, abs=0.03)
    assert sim.joints["lift"].position == pytest.approx(0.15, abs=0.01)


@pytest.mark.parametrize("sequence", ["xyz", "zyx", "XYZ", "ZYX"])
def test_rotations_are_those_of_the_engine_own_reader(sequence, tmp_path):
    from rapier3d.loaders import mjcf

    ways = (
        'euler="30 40 50"',
        'axisangle="1 2 3 40"',
        'xyaxes="0 1 0.2 -1 0.1 0"',
        'zaxis="1 1 0.5"',
        'quat="0.5 0.1 0.2 0.3"',
    )
    rows = "".join(
        f'<body name="b{k}" pos="{k} 2 1" {way}><freejoint/><geom type="box" size=".1 .2 .3"/></body>'
        for k, way in enumerate(ways)
    )
    text = f'<mujoco><compiler eulerseq="{sequence}"/><worldbody>{rows}</worldbody></mujoco>'
    (tmp_path / "a.xml").write_text(text)
    world = engine.PhysicsWorld(gravity=(0, 0, 0))
    robot, _ = mjcf.MjcfRobot.from_str(text)
    handles = robot.insert_using_impulse_joints(world.rigid_bodies, world.colliders, world.impulse_joints)
    theirs = [world.rigid_bodies[handle.body] for handle in handles.bodies if handle is not None][-len(ways) :]
    for solid, other in zip(wt.load_robot(tmp_path / "a.xml").solids, theirs, strict=True):
        ours = product(inverse(STANDING), solid.quaternion)
        q = other.rotation
        assert abs(float(ours @ np.array([q.w, q.i, q.j, q.k]))) == pytest.approx(1.0, abs=1e-6), solid.name


def test_free_ones_are_held_where_that_is_asked(arm):
    assert not solids_of(wt.load_robot(arm))["float"].held
    held = solids_of(wt.load_mjcf(arm, held=True))
    assert held["float"].held and held["post"].mass is None
    assert solids_of(wt.load_robot(arm, held=False))["post"].mass > 0.0


def test_meshes_and_other_files_lie_beside_it(arm, tmp_path):
    trimesh = pytest.importorskip("trimesh")
    part = '<body name="block" pos="0 0 1"><freejoint/><geom type="mesh" mesh="block" density="100"/></body>'
    asset = '<asset><mesh name="block" file="block.stl" scale="0.1 0.1 0.2"/></asset>'
    arm.write_text(f'<mujoco><compiler meshdir="meshes"/>{asset}<include file="part.xml"/></mujoco>')
    (tmp_path / "part.xml").write_text(f"<mujocoinclude><worldbody>{part}</worldbody></mujocoinclude>")
    with pytest.raises(WavetankError, match=r"no file block\.stl"):
        wt.load_robot(arm)
    (tmp_path / "meshes").mkdir()
    trimesh.creation.box((1, 1, 1)).export(tmp_path / "meshes" / "block.stl")
    (block,) = wt.load_robot(arm).solids
    assert block.size == pytest.approx((0.1, 0.1, 0.2))
    assert block.mass == pytest.approx(100 * 0.002, rel=1e-6)


def test_several_hinges_of_a_body_are_a_ball_or_the_first(arm):
    hinges = "".join(f'<joint name="h{k}" axis="{axis}"/>' for k, axis in enumerate(("1 0 0", "0 1 0", "0 0 1")))
    arm.write_text(ARM.replace('<joint type="ball"/>', hinges))
    robot = wt.load_robot(arm)
    assert robot.joints[-1].kind == "ball-joint" and any("three hinges" in note for note in robot.notes)
    arm.write_text(ARM.replace('<joint type="ball"/>', '<joint type="slide"/><joint name="second"/>'))
    robot = wt.load_robot(arm)
    assert robot.joints[-1].kind == "slider" and any("the first of them" in note for note in robot.notes)


def test_what_holds_besides_is_joined(arm):
    arm.write_text(
        ARM.replace(
            "<actuator>",
            '<equality><connect body1="leg" body2="post" anchor="0 0 -0.1"/>'
            '<joint joint1="lift"/></equality><actuator>',
        )
    )
    robot = wt.load_robot(arm)
    assert (robot.joints[-1].kind, robot.joints[-1].first, robot.joints[-1].second) == ("ball-joint", "leg", "post")
    assert robot.joints[-1].at == pytest.approx((-0.5, 0.2, 0.0), abs=1e-9)
    assert any("<joint>, is left out" in note for note in robot.notes)


@pytest.mark.parametrize(
    ("before", "after", "what"),
    [
        ("<mujoco", "<mujocoo", "not XML"),
        ('<mujoco model="arm">', '<muj><mujoco model="arm">', "not XML"),
        ('type="sphere" size="0.06"', 'type="cone" size="0.06"', "is a cone; box, sphere"),
        ('type="sphere" size="0.06"', 'type="sphere" size="-1"', "radius = -1"),
        ('type="sphere" size="0.06"', 'type="sphere" size="nan"', "is not 1 numbers"),
        ('type="sphere" size="0.06"', 'type="mesh" mesh="cup"', "the mesh 'cup', which no <asset> has"),
        ('size="0.04 0.03 0.2"', 'size="0.04"', "a box has three sizes, not 1"),
        ('mass="2"', 'mass="much"', "cannot be read"),
        ('mass="2"', 'mass="0"', ""),
        ('childclass="thin"', 'childclass="thick"', "has the class 'thick', which no <default> says"),
        ('euler="0 0 90"', 'euler="0 90"', "not 3 numbers"),
        ('euler="0 0 90"', 'axisangle="0 0 0 90"', "axisangle has no axis"),
        ('euler="0 0 90"', 'xyaxes="1 0 0 2 0 0"', "do not lie on one line"),
        ('euler="0 0 90"', 'quat="0 0 0 0"', "non-zero length"),
        ('<joint type="ball"/>', '<joint type="screw"/>', "is a screw; hinge, slide, ball"),
        ('mass="3" diaginertia', "diaginertia", "has no mass"),
        ('axis="1 0 0"', 'axis="0 0 0"', "has no direction"),
        ('name="leg"', 'name="post"', "two of the same name"),
        ('angle="degree"', 'angle="degree" eulerseq="xyw"', "is three of x, y, z"),
        ("<actuator>", '<include file="../other.xml"/><actuator>', "lies in another folder"),
        ("<actuator>", '<include file="arm.xml"/><actuator>', "included once"),
        ("<worldbody>", "<worldbody>" + "<body>" * 5000 + "</body>" * 5000, "nested too deep|more than 300"),
    ],
)
def test_what_is_no_robot_is_said(arm, before, after, what):
    assert before in ARM
    arm.write_text(ARM.replace(before, after))
    if not what:  # as light as water, and it says so
        assert any("as heavy as water" in note for note in wt.load_robot(arm).notes)
        return
    with pytest.raises(WavetankError, match=what) as said:
        wt.load_robot(arm)
    assert "arm.xml" in str(said.value)
    assert "\n" not in str(said.value)


def test_the_command_says_what_another_file_is(tmp_path):
    (tmp_path / "a.xml").write_text("<mujoco/>")
    done = subprocess.run(
        [sys.executable, "-m", "wavetank", "import", str(tmp_path / "a.xml"), "-o", str(tmp_path / "s.toml")],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode != 0 and "no bodies with a shape" in done.stderr


def test_files_that_include_many_again_and_again(tmp_path):
    """Ten files that include the next ten, each ten times, would be 10^10 of them."""
    for number in range(10):
        rows = "".join(f'<include file="{number + 1}.xml"/>' for _ in range(10))
        (tmp_path / f"{number}.xml").write_text(f"<mujoco>{rows}</mujoco>")
    (tmp_path / "10.xml").write_text("<mujoco/>")
    began = time.process_time()
    with pytest.raises(wt.WavetankError, match="included once"):
        wt.load_robot(tmp_path / "0.xml")
    assert time.process_time() - began < 2.0
