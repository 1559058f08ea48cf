"""Cases of DualSPHysics as scenes of ours; files made here in their format."""

import contextlib
import math
from time import process_time

import numpy as np
import pytest

import wavetank as wt
from wavetank.cli import main
from wavetank.formats.dualsphysics_motion import wave_number


def box(point, size, fill="solid", tag="drawbox"):
    """A command that draws a box."""
    rows = [" ".join(f'{axis}="{value}"' for axis, value in zip("xyz", row, strict=True)) for row in (point, size)]
    return f"<{tag}><boxfill>{fill}</boxfill><point {rows[0]}/><size {rows[1]}/></{tag}>"


def fluid(mk):
    return f'<setmkfluid mk="{mk}"/>'


def bound(mk):
    return f'<setmkbound mk="{mk}"/>'


WALLS = bound(0) + box((0, 0, 0), (1.6, 0.6, 0.4), "bottom | left | right | front | back")
WATER = fluid(0) + box((0, 0, 0), (0.4, 0.6, 0.3))
BAR = bound(3) + box((1, 0.2, 0.1), (0.2, 0.1, 0.1))
THREE = "<parameters><parameter key='TimeMax' value='3'/></parameters>"


@pytest.fixture
def read(tmp_path):
    """Read a case with these commands and other parts."""

    def read_(commands, more="", constants="", execution="", flat=False, spacing=None):
        path = tmp_path / "CaseTest_Def.xml"
        near, far = (0, 0) if flat else (-1, 2)
        path.write_text(f"""<?xml version="1.0"?><case><casedef><constantsdef><gravity x="0" y="0.5" z="-9.81"/>
<rhop0 value="1000"/>{constants}</constantsdef><geometry><definition dp="0.02"><pointmin x="-1" y="{near}" z="-1"/>
<pointmax x="4" y="{far}" z="3"/></definition><commands><list name="ball"><drawsphere radius="0.05">
<point x="1" y="0.3" z="0.2"/></drawsphere></list><mainlist>{commands}</mainlist></commands></geometry>{more}</casedef>
<execution>{execution}</execution></case>""")
        return wt.load_dualsphysics(path, spacing)

    return read_


def test_tank_fluid_and_gravity_stand_upright(read):
    found = read(WATER + WALLS, execution='<parameters><parameter key="TimeMax" value="2"/></parameters>')
    scene = found.scene
    assert (scene.title, scene.spacing, scene.gravity) == ("CaseTest", 0.02, (0.0, -9.81, -0.5))
    np.testing.assert_allclose(np.ravel(scene.tank.box()), [0, 0, -0.6, 1.6, 0.6, 0])
    assert scene.tank.open == ["+y"] and any("go on up to 0.6 m" in note for note in found.notes)
    (water,) = scene.fluids
    np.testing.assert_allclose([water.lower, water.upper], [(0, 0, -0.6), (0.4, 0.3, 0)])
    assert scene.solids == []
    assert wt.Simulation(scene).count == 20 * 15 * 30


def test_a_plane_world_and_another_spacing(read):
    scene = read(WATER + WALLS, flat=True, spacing=0.05).scene
    assert scene.dim == 2 and scene.spacing == 0.05
    np.testing.assert_allclose(np.ravel(scene.tank.box()), [0, 0, 1.6, 0.6])
    assert wt.Simulation(scene).count == 8 * 6


@pytest.mark.parametrize(
    ("faces", "solids"), [("all", 1), ("top|left|right|front|back", 1), ("solid", 1), ("left|right", 2), ("left", 1)]
)
def test_boxes_of_walls(read, faces, solids):
    """A closed one is whole; of an open one each face is a wall that lies outside."""
    found = read(WATER + WALLS + bound(1) + box((0.9, 0.2, 0), (0.1, 0.1, 0.3), faces)).scene.solids
    assert len(found) == solids and found[0].name == "mk 1"
    wanted = {1: [(0.95, 0.15, -0.25)], 2: [(0.88, 0.15, -0.25), (1.02, 0.15, -0.25)]}[solids]
    wanted = [(0.88, 0.15, -0.25)] if faces == "left" else wanted
    np.testing.assert_allclose([solid.center for solid in found], wanted, atol=1e-9)


def test_expressions_lists_and_matrices(read):
    commands = (
        '<newvarcte wide="0.1" _rem="a"/><setvar wide="wide*2"/>' + bound(4) + '<move x="#-wide" y="0" z="Dp*2"/>'
        '<runlist name="ball" times="1"/><matrixreset/><rotate ang="90" x="0" y="0" z="1"/>'
    )
    commands = WATER + WALLS + commands + bound(5) + box((0.1, -1, 0), (0.4, 0.2, 0.1))
    ball, bar = read(commands).scene.solids
    np.testing.assert_allclose(ball.center, (0.8, 0.24, -0.3), atol=1e-9)
    # about their z by 90 degrees (x, y) is (-y, x): the middle (0.3, -0.9) comes to (0.9, 0.3)
    np.testing.assert_allclose(bar.center, (0.9, 0.05, -0.3), atol=1e-9)
    corner = wt.foundation.rotations.turned(np.array(bar.rotation), 0.5 * np.array(bar.size))
    np.testing.assert_allclose(np.abs(corner), (0.1, 0.05, 0.2), atol=1e-9)


def test_what_is_drawn_last_wins_and_void_cuts(read):
    other, hole = box((0.2, 0, 0), (0.2, 0.6, 0.1)), box((0, 0, 0.2), (0.1, 0.6, 0.1))
    commands = WATER + fluid(1) + other + "<setmkvoid/>" + hole + WALLS
    velocity = "<initials><velocity mkfluid='1' x='1' y='0' z='0.5'/></initials>"
    scene = read(commands, velocity).scene
    x, v = scene.particles()
    assert len(x) == 20 * 15 * 30 - 5 * 5 * 30, "nothing twice, nothing in the void"
    assert not ((x[:, 0] < 0.1) & (x[:, 1] > 0.2)).any()
    quick = (x[:, 0] > 0.2) & (x[:, 1] < 0.1)
    np.testing.assert_allclose(v[quick], np.tile([1, 0.5, 0], (quick.sum(), 1)))
    assert not v[~quick].any()


def test_what_is_free_is_filled(read):
    fill = fluid(2) + box((0, -1, 0), (1.6, 2, 0.1), tag="fillbox")
    scene = read(WATER + WALLS + fill).scene
    assert len(scene.particles()[0]) == 20 * 15 * 30 + 60 * 5 * 30


def test_floating_bodies_of_several_parts(read):
    pytest.importorskip("rapier3d")
    sphere = "<drawsphere radius='0.05'><point x='1.1' y='0.25' z='0.25'/></drawsphere>"
    boat = bound(7) + box((1, 0.2, 0.1), (0.2, 0.1, 0.1)) + sphere
    pole = "<drawcylinder radius='0.05'><point x='1.4' y='0.3' z='0'/><point x='1.4' y='0.3' z='0.2'/></drawcylinder>"
    floating = "<floating mkbound='7' rhopbody='300'/><floating mkbound='8'><massbody value='0.5'/></floating>"
    commands, more = WATER + WALLS + boat + bound(8) + pole, f"<floatings>{floating}</floatings>"
    scene = read(commands, more).scene
    boat, pole = scene.solids
    assert (boat.shape, len(boat.parts), boat.density) == ("union", 2, 300.0)
    assert (pole.shape, pole.mass) == ("cylinder", 0.5)
    sim = wt.Simulation(scene)
    mass = 300.0 * (0.2 * 0.1 * 0.1 + 4.0 / 3.0 * math.pi * 0.05**3)
    assert sim.bodies["mk 7"].mass == pytest.approx(mass, rel=0.06)  # the box and the ball overlap
    assert sim.bodies["mk 8"].mass == pytest.approx(0.5)


MOVES = {
    "<begin mov='1' start='0.5'/><mvrect id='1' duration='1' next='2'><vel x='0.2' y='0' z='0'/></mvrect>"
    "<wait id='2' duration='0.5' next='3'/><mvrectace id='3' duration='1'><velini x='0' y='0' z='0.1'/>"
    "<ace x='0' y='0' z='0.2'/></mvrectace>": (
        (0.25, (0, 0, 0)),
        (1.0, (0.1, 0, 0)),
        (1.8, (0.2, 0, 0)),
        (3.0, (0.2, 0.2, 0)),
    ),
    "<begin mov='1' start='0'/><mvrectsinu id='1' duration='10'><freq x='0.5' y='0' z='0'/><ampl x='0.1' y='0' z='0'/>"
    "<phase x='90' y='0' z='0'/></mvrectsinu>": ((0.5, (-0.1, 0, 0)), (1.0, (-0.2, 0, 0)), (2.0, (0, 0, 0))),
}


@pytest.mark.parametrize("moves", MOVES)
def test_moves_one_after_the_other(read, moves):
    more = f"<motion><objreal ref='3'>{moves}</objreal></motion>"
    (bar,) = read(WATER + WALLS + BAR, more, execution=THREE).scene.solids
    path = bar.motion.path()
    for time, way in MOVES[moves]:
        np.testing.assert_allclose(path.position(time), np.array([1.1, 0.15, -0.25]) + way, atol=2e-4)


def test_turns_about_an_axis_elsewhere(read):
    more = (
        "<motion><objreal ref='3'><begin mov='1' start='0'/><mvrot id='1' duration='1'><vel ang='90'/>"
        "<axisp1 x='1' y='0' z='0.1'/><axisp2 x='1' y='1' z='0.1'/></mvrot></objreal></motion>"
    )
    for flat in (False, True):
        commands = WATER + WALLS + bound(3) + box((1, -1, 0.1), (0.2, 2, 0.1))
        (bar,) = read(commands, more, execution=THREE, flat=flat).scene.solids
        # from (1.1, 0.15) about (1, 0.1) in the plane of x and z: theirs turns z to x
        np.testing.assert_allclose(bar.motion.path().position(2.0)[:2], (1.05, 0.0), atol=1e-6)
        turn = bar.motion.path().rotation(2.0)
        np.testing.assert_allclose(turn * np.sign(turn[0]), (math.sqrt(0.5), 0, 0, -math.sqrt(0.5)), atol=1e-6)


def test_a_piston_makes_waves_of_its_height(read):
    """Stroke S = H (2kh + sinh 2kh) / (2 (cosh 2kh - 1)), Biesel and Suquet 1951; omega^2 = g k tanh kh."""
    piston = (
        "<special><wavepaddles><piston><mkbound value='3'/><depth value='0.3'/><waveheight value='0.04'/><waveperiod "
        "value='1.2'/></piston></wavepaddles></special>"
    )
    k = wave_number(1.2, 0.3)
    assert 9.81 * k * math.tanh(0.3 * k) == pytest.approx((math.tau / 1.2) ** 2)
    stroke = 0.04 * (0.6 * k + math.sinh(0.6 * k)) / (2.0 * (math.cosh(0.6 * k) - 1.0))
    (bar,) = read(WATER + WALLS + BAR, execution=piston + THREE).scene.solids
    places = np.array([bar.motion.path().position(t)[0] for t in np.arange(0.0, 2.4, 1 / 60)])
    assert np.ptp(places) == pytest.approx(stroke, rel=2e-3)


def test_what_has_no_counterpart_is_told(read):
    periodic = "<parameters><parameter key='XPeriodicIncZ' value='0'/></parameters>"
    special = "<special><inout/><gauges/><damping active='false'/></special>"
    notes = " ".join(read(WATER + WALLS + "<drawellipsoid radius='1'/>", execution=special + periodic).notes)
    assert all(word in notes for word in ("<drawellipsoid>", "<inout>", "XPeriodicIncZ", "artificial viscosity"))
    assert "gauges" not in notes and "damping" not in notes


def test_laminar_viscosity_and_density(read):
    laminar = (
        "<parameters><parameter key='ViscoTreatment' value='2'/><parameter key='Visco' value='0.001'/></parameters>"
    )
    (fluid,) = read(WATER + WALLS, execution=laminar).scene.materials
    assert fluid.viscosity == pytest.approx(1.0) and fluid.density == 1000.0


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("<case>", "not XML"),
        ("<robot/>", "casedef"),
        ("<!DOCTYPE a><case/>", "document type"),
        ("<case><casedef><geometry><definition dp='0'/></geometry></casedef></case>", "dp = 0"),
        ("<case><casedef><geometry><definition dp='a'/></geometry></casedef></case>", "cannot be read"),
        ("<case><casedef><geometry><definition dp='0.1'/></geometry></casedef></case>", "no fluid"),
        (
            "<case><casedef><geometry><definition dp='0.1'/><commands><list name='a'>"
            "<runlist name='a' times='9'/></list><mainlist>"
            "<runlist name='a'/></mainlist></commands></geometry></casedef></case>",
            "draws too much",
        ),
    ],
)
def test_mistakes_are_one_sentence(tmp_path, text, words, monkeypatch):
    path = tmp_path / "a_Def.xml"
    path.write_text(text)
    with pytest.raises(wt.WavetankError, match=words) as caught:
        wt.load_dualsphysics(path)
    assert str(path) in str(caught.value) and "\n" not in str(caught.value)
    monkeypatch.setattr("sys.argv", ["wavetank", "import", str(path), "-o", str(tmp_path / "out.toml")])
    with pytest.raises(SystemExit) as left:
        main()
    assert left.value.code == 1 and not (tmp_path / "out.toml").exists()


def test_the_command_writes_a_scene_that_runs(read, tmp_path, monkeypatch, capsys):
    move = "<begin mov='1' start='0'/><mvrect id='1' duration='1'><vel x='0.1' y='0' z='0'/></mvrect>"
    read(WATER + WALLS + BAR, f"<motion><objreal ref='3'>{move}</objreal></motion>", execution=THREE)
    out = tmp_path / "case.toml"
    words = ["wavetank", "import", str(tmp_path / "CaseTest_Def.xml"), "-o", str(out), "--spacing", "0.05"]
    monkeypatch.setattr("sys.argv", words)
    with pytest.raises(SystemExit) as left:
        main()
    assert left.value.code == 0 and "go on up to" in capsys.readouterr().out
    sim = wt.Simulation(wt.Scene.load(out))
    sim.advance(0.2)
    assert sim.count == 8 * 6 * 12


PRISM = (
    '<drawprism><point x="0.8" y="0.1" z="0"/><point x="1" y="0.1" z="0"/><point x="0.8" y="0.3" z="0"/>'
    '<point x="0.8" y="0.1" z="0.2"/><point x="1" y="0.1" z="0.2"/><point x="0.8" y="0.3" z="0.2"/></drawprism>'
)
FILE = (
    '<drawfilestl file="cube.stl"><drawscale x="0.2" y="0.2" z="0.2"/><drawmove x="1" y="0.3" z="0.2"/></drawfilestl>'
)


@pytest.mark.parametrize(("drawn", "middle", "size"), [(PRISM, (0.9, 0.1, -0.2), 0.2), (FILE, (1.0, 0.2, -0.3), 0.2)])
def test_prisms_and_files_become_meshes(read, tmp_path, drawn, middle, size):
    trimesh = pytest.importorskip("trimesh")
    trimesh.creation.box().export(tmp_path / "cube.stl")
    scene = read(WALLS + WATER + bound(5) + drawn).scene
    (solid,) = (solid for solid in scene.solids if solid.name == "mk 5")
    assert isinstance(solid, wt.Mesh)
    assert solid.center == pytest.approx(middle) and solid.size == pytest.approx(size)


@pytest.mark.parametrize(
    "bomb",
    [
        '<runlist name="none" times="1e12"/>',
        '<runlist name="none" times="1e300"/>',
        "".join(FILE for _ in range(1900)),
        "".join(
            bound(k) + box((1, 0.2, 0.1), (0.2, 0.1, 0.1)) + "<setmkvoid/>" + box((0, 0, 0), (1, 1, 1))
            for k in range(990)
        ),
        fluid(0)
        + "".join(box((0, 0, 0), (1, 1, 1)) for _ in range(900))
        + "<setmkvoid/>"
        + "".join(box((0.1 * k % 0.9, 0.1, 0.01 * (k % 90)), (0.001, 0.001, 0.001)) for k in range(900)),
    ],
    ids=["repeats", "repeats without end", "files", "holes in solids", "holes in fluids"],
)
def test_repetitions_end_soon(read, tmp_path, bomb):
    trimesh = pytest.importorskip("trimesh")
    trimesh.creation.icosphere(5).export(tmp_path / "cube.stl")
    began = process_time()
    with contextlib.suppress(wt.WavetankError):
        read(WALLS + WATER + bomb)
    assert process_time() - began < 20.0
