"""Robots from URDF: where links are (homogeneous transforms of the chain), what they weigh, how joints move them."""

import json

import numpy as np
import pytest

import wavetank as wt
from wavetank.foundation.errors import WavetankError

pytest.importorskip("rapier3d")

ARM = """<?xml version="1.0"?>
<!-- an arm of two links on a post, and a cup that is fixed to it -->
<robot name="arm">
  <material name="orange"><color rgba="1 0.5 0 1"/></material>
  <link name="post"><collision>
    <origin xyz="0 0 0.1"/><geometry><cylinder radius="0.1" length="0.2"/></geometry></collision></link>
  <link name="upper"><inertial><mass value="2"/></inertial>
    <visual><geometry><box size="9 9 9"/></geometry><material name="orange"/></visual>
    <collision><origin xyz="0 0 0.2"/><geometry><box size="0.08 0.06 0.4"/></geometry></collision></link>
  <link name="fore"><inertial><mass value="1"/></inertial>
    <collision><origin xyz="0.15 0 0"/><geometry><box size="0.3 0.05 0.05"/></geometry></collision></link>
  <link name="cup"><inertial><mass value="0.5"/></inertial>
    <collision><geometry><sphere radius="0.06"/></geometry></collision></link>
  <link name="tool"/>
  <joint name="shoulder" type="revolute"><parent link="post"/><child link="upper"/>
    <origin xyz="0 0 0.2" rpy="0 0 1.5707963"/>
    <axis xyz="1 0 0"/><limit lower="-1" upper="1" effort="90"/></joint>
  <joint name="lift" type="prismatic"><parent link="upper"/><child link="fore"/><origin xyz="0 0 0.4"/>
    <axis xyz="0 0 1"/><limit lower="0.05" upper="0.2" effort="50"/></joint>
  <joint name="grip" type="fixed"><parent link="fore"/><child link="cup"/><origin xyz="0.3 0 0"/></joint>
  <joint name="tip" type="fixed"><parent link="cup"/><child link="tool"/></joint>
</robot>"""


@pytest.fixture
def arm(tmp_path):
    (tmp_path / "arm.urdf").write_text(ARM)
    return tmp_path / "arm.urdf"


def test_links_stand_where_the_chain_puts_them(arm):
    robot = wt.load_urdf(arm, (0.5, 0.1, 0.3), prefix="r.")
    assert [solid.name for solid in robot.solids] == ["r.post", "r.upper", "r.fore"]
    post, upper, fore = robot.solids
    assert (fore.mass, upper.mass, post.mass) == (1.5, 2.0, None)
    assert upper.color == "#ff8000"
    assert post.origin.tolist() == pytest.approx([0.5, 0.2, 0.3])
    assert upper.origin.tolist() == pytest.approx([0.5, 0.5, 0.3]), "collisions, not what is to be seen"
    # Yaw 90 degrees takes the fore's x to the file's y, which is -z here.
    ends = wt.Scene(spacing=0.1, tank=wt.Tank(size=(1, 2, 1)), solids=[fore]).solids[0]
    frame, turn = np.array(ends.center), ends.quaternion
    from wavetank.foundation.rotations import turned

    assert (frame + turned(turn, np.array([0.3, 0, 0]))).tolist() == pytest.approx([0.5, 0.7, 0.0], abs=1e-6)
    shoulder, lift = sorted(robot.joints, key=lambda joint: joint.name, reverse=True)
    assert shoulder.at == pytest.approx((0.5, 0.3, 0.3))
    assert shoulder.axis == pytest.approx((0.0, 0.0, -1.0), abs=1e-6)
    assert (shoulder.first, shoulder.second, shoulder.strength) == ("r.upper", "r.post", 90.0)
    assert (lift.limits, lift.target, lift.axis) == ((0.05, 0.2), 0.05, pytest.approx((0, 1, 0), abs=1e-6))


def test_its_motors_move_it(arm, wavetank, tmp_path):
    done = wavetank("import", str(arm), "-o", str(tmp_path / "s.toml"), "--into", "still-tank", "--at", "0.4,0,0.4")
    assert done.returncode == 0, done.stderr
    sim = wt.Simulation(wt.Scene.load(tmp_path / "s.toml").changed(spacing=0.06))
    sim.joints["shoulder"].target, sim.joints["lift"].target = 0.5, 0.15
    sim.advance(0.5)
    assert sim.joints["shoulder"].position == pytest.approx(0.5, abs=0.03)
    assert sim.joints["lift"].position == pytest.approx(0.15, abs=0.01)


def test_open_meshes_get_walls_of_a_thickness(arm):
    trimesh = pytest.importorskip("trimesh")
    box = trimesh.creation.box((1, 1, 1))
    box.update_faces(box.face_normals[:, 2] < 0.5)
    (arm.parent / "meshes").mkdir()
    box.export(arm.parent / "meshes" / "block.stl")
    mesh = "<mesh filename='package://arm/meshes/block.stl' scale='0.1 0.1 0.2'/>"
    arm.write_text(ARM.replace('<sphere radius="0.06"/>', mesh))
    cup = wt.load_urdf(arm, thickness=0.01).solids[-1].parts[-1]
    assert isinstance(cup, wt.Mesh) and cup.thickness == 0.01
    with pytest.raises(WavetankError, match="thickness = -1"):
        wt.load_robot(arm, thickness=-1)


def test_meshes_lie_beside_it(arm):
    mesh = "<mesh filename='package://arm/meshes/block.stl' scale='0.1 0.1 0.2'/>"
    arm.write_text(ARM.replace('<sphere radius="0.06"/>', mesh))
    with pytest.raises(WavetankError, match="no file package://arm/meshes/block.stl"):
        wt.load_urdf(arm)
    trimesh = pytest.importorskip("trimesh")
    (arm.parent / "meshes").mkdir()
    trimesh.creation.box((1, 1, 1)).export(arm.parent / "meshes" / "block.stl")
    cup = wt.load_urdf(arm).solids[-1].parts[-1]
    assert cup.size == pytest.approx((0.1, 0.1, 0.2))


@pytest.mark.parametrize(
    ("before", "after", "what"),
    [
        ("<robot", "<robt", "not XML"),
        ('<child link="cup"/>', '<child link="cap"/>', "does not have: cap"),
        ('<parent link="post"/>', '<parent link="cup"/>', "no joints lead from its root to cup, fore"),
        ('<sphere radius="0.06"/>', "<cone/>", "has a cone; box, sphere"),
        ('<sphere radius="0.06"/>', '<sphere radius="-1"/>', "radius = -1"),
        ('<mass value="2"/>', '<mass value="much"/>', "cannot be read"),
        ('<?xml version="1.0"?>', '<!DOCTYPE r [<!ENTITY a "b">]>', "document type"),
    ],
)
def test_what_is_no_robot_is_said(arm, before, after, what):
    arm.write_text(ARM.replace(before, after))
    with pytest.raises(WavetankError, match=what) as said:
        wt.load_urdf(arm)
    assert "arm.urdf" in str(said.value)


def test_names_that_are_taken_are_said(arm):
    robot = wt.load_urdf(arm)
    scene = robot.joined(wt.Scene.load("still-tank"))
    with pytest.raises(WavetankError, match="fore, post, upper already"):
        robot.joined(scene)
    assert json.loads(scene.model_dump_json())["joints"][0]["name"] in ("shoulder", "lift")
