"""Scenes of SPlisHSPlasH as scenes of ours; files made here in their format."""

import gzip
import json
import math
import struct

import numpy as np
import pytest

import wavetank as wt
from wavetank.cli import main
from wavetank.formats.bgeo import read_bgeo
from wavetank.formats.splishsplash import load_splishsplash

CUBE = [(x, y, z) for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)]
QUADS = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]


def obj_of(vertices, quads):
    faces = [(a, b, c) for a, b, c, _ in quads] + [(a, c, d) for a, _, c, d in quads]
    lines = [f"v {x} {y} {z}" for x, y, z in vertices] + [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in faces]
    return "\n".join(lines) + "\n"


def bgeo_of(points):
    """A file of points, each with an id and a velocity, as Partio writes them."""
    head = b"BgeoV" + struct.pack(">IIIIIIIII", 5, len(points), 0, 0, 0, 2, 0, 0, 0)
    head += struct.pack(">H", 2) + b"id" + struct.pack(">HII", 1, 1, 0)
    head += struct.pack(">H", 8) + b"velocity" + struct.pack(">HI", 3, 5) + struct.pack(">fff", 0, 0, 0)
    rows = b"".join(struct.pack(">ffffIfff", *p, 1.0, k, 7.0, 8.0, 9.0) for k, p in enumerate(points))
    return gzip.compress(head + rows + b"\x00\xff")


@pytest.fixture
def scene(tmp_path):
    """Write a scene; its tables are given by name."""
    (tmp_path / "models").mkdir()
    (tmp_path / "scenes").mkdir()
    (tmp_path / "models" / "UnitBox.obj").write_text(obj_of(CUBE, QUADS))
    shifted = [(2.0 + x, y * (1.0 + 0.5 * (x > 0)), z) for x, y, z in CUBE]  # a wedge off its origin
    (tmp_path / "models" / "wedge.obj").write_text(obj_of(shifted, QUADS))

    def write(**tables):
        tables.setdefault("FluidBlocks", [{"start": [-0.5, 0, -0.5], "end": [0, 0.4, 0.5]}])
        tables["Configuration"] = {"particleRadius": 0.025, **tables.get("Configuration", {})}
        path = tmp_path / "scenes" / "test.json"
        path.write_text(json.dumps(tables))
        return path

    return write


def body(**fields):
    usual = {"geometryFile": "../models/UnitBox.obj", "rotationAxis": [1, 0, 0], "rotationAngle": 0}
    return {**usual, "translation": [0, 1, 0], "scale": [2, 2, 1], **fields}


def test_spacing_tank_blocks_and_gravity(scene):
    path = scene(
        Configuration={"gravitation": [0, -5, 1]},
        RigidBodies=[body(isWall=True, mapInvert=True)],
        FluidBlocks=[
            {
                "start": [-0.5, -0.5, -0.5],
                "end": [0.5, 0.5, 0.5],
                "translation": [0.0, 0.6, 0.0],
                "scale": [1, 0.5, 1],
                "initialVelocity": [1, 0, 0],
            },
            {"start": [-2, 0, -0.5], "end": [-0.8, 0.3, 0.5]},
        ],
    )
    read = load_splishsplash(path)
    assert read.scene.spacing == pytest.approx(0.05)
    assert read.scene.gravity == (0.0, -5.0, 1.0)
    assert np.ravel(read.scene.tank.box()).tolist() == [-1.0, 0.0, -0.5, 1.0, 2.0, 0.5]
    assert read.scene.solids == []
    first, second = read.scene.fluids
    np.testing.assert_allclose([first.lower, first.upper], [(-0.5, 0.35, -0.5), (0.5, 0.85, 0.5)])
    assert first.velocity == (1.0, 0.0, 0.0)
    assert second.lower[0] == -1.0, "what reaches out of the tank ends at its wall"
    assert any("FluidBlocks[1] reaches out of the tank" in note for note in read.notes)


@pytest.mark.parametrize(
    ("walls", "share"), [({}, 0.0), ({"viscosityBoundary": 0.1}, 0.2), ({"viscosityBoundary": 9}, 1.0)]
)
def test_fluids_slide_along_walls_that_do_not_hold_them(scene, walls, share):
    """Their walls have a viscosity of their own, which is nothing where it is not named."""
    weiler = {"id": "Fluid", "viscosityMethod": 6, "Weiler et al. 2018": {"viscosity": 0.5, **walls}}
    assert load_splishsplash(scene(Materials=[weiler])).scene.no_slip == pytest.approx(share)
    other = {"id": "Other", "viscosityMethod": 1, "viscosity": 1.0, "viscosityBoundary": 1.0}
    assert load_splishsplash(scene(Materials=[weiler, other])).scene.no_slip == pytest.approx(share), "nobody uses it"


def test_viscosity_is_kinematic_and_tension_in_newtons_per_metre(scene):
    path = scene(
        Materials=[
            {
                "id": "Fluid",
                "density0": 800,
                "viscosityMethod": 6,
                "Weiler et al. 2018": {"viscosity": 0.5},
                "surfaceTensionMethod": 5,
                "Zorilla, Ritter, et al. 2020": {"surfaceTension": 0.1},
            }
        ]
    )
    material = load_splishsplash(path).scene.materials[0]
    assert material.viscosity == pytest.approx(400.0)
    assert material.density == 800.0
    assert material.surface_tension == pytest.approx(0.1)
    path = scene(
        Materials=[
            {
                "id": "Fluid",
                "density0": 1000,
                "viscosityMethod": 3,
                "Peer et al. 2015": {"viscosity": 0.5},
                "surfaceTensionMethod": 2,
                "vorticityMethod": 1,
            }
        ]
    )
    read = load_splishsplash(path)
    # 1 / (1 + nu dt / h^2) = 0.5 with h = 0.1 m and dt = 1 ms: nu = 10 m^2/s
    assert read.scene.materials[0].viscosity == pytest.approx(1e4, rel=1e-6)
    told = " ".join(read.notes)
    for words in ("share without a unit", "surface tension of method 2", "vorticityMethod"):
        assert words in told


def test_boxes_meshes_and_bodies_stand_where_theirs_do(scene):
    path = scene(
        RigidBodies=[
            body(id=1, rotationAxis=[0, 1, 0], rotationAngle=math.pi / 2, scale=[1, 0.2, 0.4]),
            body(
                id=2,
                geometryFile="../models/wedge.obj",
                isDynamic=True,
                density=300,
                friction=0.4,
                velocity=[0, 0, 1],
                rotationAxis=[0, 0, 1],
                rotationAngle=math.pi / 2,
                scale=[0.5, 0.5, 0.5],
            ),
        ]
    )
    box, wedge = load_splishsplash(path).scene.solids
    assert (box.shape, box.center, box.size) == ("box", (0.0, 1.0, 0.0), (1.0, 0.2, 0.4))
    np.testing.assert_allclose(box.quaternion, [math.sqrt(0.5), 0, math.sqrt(0.5), 0], atol=1e-7)
    # The wedge's own origin is 2 * 0.5 m to its left; turned by a quarter, that is below.
    assert wedge.shape == "mesh"
    np.testing.assert_allclose(wedge.center, (0.0, 2.0, 0.0), atol=1e-6)
    assert wedge.size == pytest.approx(0.75)
    assert (wedge.density, wedge.friction, wedge.velocity) == (300.0, 0.4, (0.0, 0.0, 1.0))


def test_emitters_count_particles(scene):
    path = scene(
        Materials=[{"id": "Fluid", "density0": 1000, "maxEmitterParticles": 500, "emitterReuseParticles": True}],
        Emitters=[
            {
                "width": 8,
                "height": 3,
                "translation": [-0.9, 0.7, 0],
                "rotationAxis": [0, 0, 1],
                "rotationAngle": -math.pi / 2,
                "velocity": 2,
                "type": 0,
                "emitEndTime": 2,
            },
            {"width": 6, "translation": [0.9, 0.7, 0], "velocity": 3, "type": 1, "emitStartTime": 1, "emitEndTime": 5},
        ],
    )
    scene_ = load_splishsplash(path).scene
    first, second = scene_.emitters
    np.testing.assert_allclose(first.direction, (0, -1, 0), atol=1e-7)
    np.testing.assert_allclose(first.size, (0.4, 0.15))
    np.testing.assert_allclose(first.side, (0, 0, 1), atol=1e-7)
    assert (first.speed, first.start, first.duration) == (2.0, 0.0, 2.0)
    assert second.radius == pytest.approx(0.15)
    assert (second.start, second.duration) == (1.0, 4.0)
    assert scene_.most_particles == 10 * 8 * 20 + 500
    assert scene_.when_full == "recycle"


def test_motors_join_a_body_and_the_world(scene):
    path = scene(
        RigidBodies=[
            body(id=0, mapInvert=True),
            body(id=1, translation=[0, 0.6, 0], scale=[0.8, 0.1, 0.2], isDynamic=True, density=2000),
        ],
        TargetVelocityMotorHingeJoints=[
            {"bodyID1": 1, "bodyID2": 0, "position": [0, 0.6, 0], "axis": [0, 1, 0], "target": -6}
        ],
        FluidBlocks=[{"start": [-0.5, 0, -0.5], "end": [0.5, 0.3, 0.5]}],
    )
    scene_ = load_splishsplash(path).scene
    (hinge,) = scene_.joints
    assert (hinge.kind, hinge.first, hinge.second, hinge.axis, hinge.speed) == ("hinge", "body 1", "", (0, 1, 0), -6.0)
    sim = wt.Simulation(scene_)
    sim.advance(0.2)
    assert sim.bodies["body 1"].angular_velocity[1] == pytest.approx(-6.0, abs=0.5)


def test_two_dimensions(scene):
    path = scene(
        Configuration={"sim2D": True, "gravitation": [0, -9.81, 0]},
        RigidBodies=[
            body(mapInvert=True),
            body(geometryFile="../models/wedge.obj", translation=[-1.5, 0.5, 0], scale=[1, 0.5, 1]),
        ],
        Emitters=[{"width": 8, "height": 5, "translation": [-0.8, 1.2, 0], "velocity": 2, "type": 0, "emitEndTime": 4}],
        FluidBlocks=[{"start": [-1, 0, -0.5], "end": [-0.2, 0.4, 0.5]}],
    )
    scene_ = load_splishsplash(path).scene
    assert scene_.dim == 2
    assert scene_.tank.size == (2.0, 2.0)
    (wedge,) = scene_.solids
    corners = np.array(wedge.points)
    np.testing.assert_allclose([corners.min(axis=0), corners.max(axis=0)], [(0.0, 0.125), (1.0, 0.875)], atol=1e-6)
    assert wedge.volume() == pytest.approx(0.5 * (0.5 + 0.75))  # of the section, a trapezium
    assert scene_.emitters[0].width == pytest.approx(0.25)
    wt.Simulation(scene_).advance(0.05)


def test_particles_of_houdini(scene, tmp_path):
    points = [(0.1 * k, 0.05 * k, -0.1 * k) for k in range(5)]
    (tmp_path / "models" / "some.bgeo").write_bytes(bgeo_of(points))
    np.testing.assert_allclose(read_bgeo(tmp_path / "models" / "some.bgeo"), points, atol=1e-7)
    model = {
        "particleFile": "../models/some.bgeo",
        "translation": [0, 1, 0],
        "rotationAxis": [0, 1, 0],
        "rotationAngle": math.pi / 2,
        "scale": [2, 2, 2],
    }
    (fluid,) = load_splishsplash(scene(FluidModels=[model], FluidBlocks=[])).scene.fluids
    expected = [(2 * z, 2 * y + 1, -2 * x) for x, y, z in points]  # a quarter about y takes z to x and x to -z
    np.testing.assert_allclose(fluid.positions, expected, atol=1e-6)
    with pytest.raises(wt.WavetankError, match="another spacing is for fluid blocks only"):
        load_splishsplash(scene(FluidModels=[model]), spacing=0.1)
    for broken in (b"", b"BgeoV", bgeo_of(points)[:-40], b"Bgeo" * 30, gzip.compress(b"BgeoV" + b"\xff" * 90)):
        (tmp_path / "models" / "some.bgeo").write_bytes(broken)
        with pytest.raises(wt.WavetankError, match=r"some\.bgeo"):
            read_bgeo(tmp_path / "models" / "some.bgeo")


def test_what_has_no_counterpart_is_told(scene):
    elastic = [{"id": "Fluid", "elasticityMethod": 3}, {"id": "water"}]
    with pytest.raises(wt.WavetankError, match="it contains no fluid that wavetank can simulate; Fluid is an elastic"):
        load_splishsplash(scene(Materials=elastic))
    blocks = [{"start": [0, 0, 0], "end": [1, 1, 1]}, {"id": "water", "start": [1, 0, 0], "end": [2, 1, 1]}]
    read = load_splishsplash(
        scene(Materials=elastic, FluidBlocks=blocks, AnimationFields=[{"particleField": "velocity"}], Robots=[1])
    )
    assert [fluid.material for fluid in read.scene.fluids] == ["water"]
    for words in (
        "elastic solids have no counterpart",
        "AnimationFields prescribe velocities",
        "Robots has no counter",
    ):
        assert any(words in note for note in read.notes)


def test_the_command_writes_a_scene_that_needs_no_other_file(scene, tmp_path, monkeypatch, capsys):
    path, out = scene(RigidBodies=[body(geometryFile="../models/wedge.obj")]), tmp_path / "out.toml"
    monkeypatch.setattr("sys.argv", ["wavetank", "import", str(path), "-o", str(out), "--json"])
    with pytest.raises(SystemExit) as end:
        main()
    assert end.value.code == 0
    told = json.loads(capsys.readouterr().out.splitlines()[-1])
    assert told["file"] == str(out)
    (tmp_path / "models" / "wedge.obj").unlink()
    assert wt.Scene.load(out).solids[0].volume() == pytest.approx(8 * (1 + 1.5) / 2 * 0.5, rel=1e-3)
    monkeypatch.setattr("sys.argv", ["wavetank", "import", str(path), "-o", str(out)])
    with pytest.raises(SystemExit):
        main()
    assert "there is no file '../models/wedge.obj' next to it" in capsys.readouterr().err


DAMAGED = (
    "",
    "[]",
    "{}",
    '{"Configuration": 3}',
    "{" * 5000,
    '{"Configuration": {"particleRadius": "x"}}',
    '{"Configuration": {}, "FluidBlocks": [{"start": 1}]}',
)


@pytest.mark.parametrize("text", DAMAGED)
def test_damaged_files_are_one_sentence(tmp_path, text):
    path = tmp_path / "a.json"
    path.write_text(text)
    with pytest.raises(wt.WavetankError, match=r"a\.json") as error:
        load_splishsplash(path)
    assert "\n" not in str(error.value)
