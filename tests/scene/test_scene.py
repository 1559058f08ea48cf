import json
import re

import numpy as np
import pytest

import wavetank as wt
from wavetank.foundation import model
from wavetank.scene.drains import Drain
from wavetank.scene.emitters import Emitter
from wavetank.scene.gauges import Gauge
from wavetank.scene.scene import scene_schema
from wavetank.scene.tank import Tank
from wavetank.solids.motion import Keyframe, Motion

TANK = {"size": (1.0, 1.0, 1.0)}
BLOCK = {"lower": (0, 0, 0), "upper": (0.5, 0.5, 0.5)}


def scene(**keys) -> wt.Scene:
    return wt.Scene(**{"spacing": 0.1, "tank": TANK, "fluids": [BLOCK], **keys})


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ({"substep": 4}, ["'substep'", "4", "did you mean 'substeps'"]),
        ({"spacing": -0.1}, ["spacing", "-0.1", "greater than 0"]),
        ({"spacing": "wide"}, ["spacing", "'wide'", "number"]),
        ({"spacing": float("nan")}, ["spacing", "nan", "finite"]),
        ({"spacing": 1e-5}, ["spacing", "1e-05", "1.25e+14", "100,000,000"]),
        ({"tank": {"size": (1, -1, 1)}}, ["tank.size[1]", "-1", "greater than 0"]),
        ({"tank": {"size": (1, 1, 1), "lid": True}}, ["'tank.lid'", "size"]),
        ({"fluids": [{"lower": (0, 0, 0), "upper": (2, 1, 1)}]}, ["fluids[0]", "outside the tank", "(1, 1, 1)"]),
        ({"fluids": [{"lower": (0.5, 0, 0), "upper": (0.5, 1, 1)}]}, ["lower", "upper", "greater"]),
        ({"fluids": [{"lower": (0, 0), "upper": (1, 1)}]}, ["fluids[0].lower", "2 components", "3-D"]),
        ({"fluids": [{"shape": "blob"}]}, ["fluids[0]", "blob", "'block', 'ball', 'points'"]),
        ({"fluids": [wt.Points(positions=np.zeros((0, 3))), {"shape": "ball", "center": (0, 0, 0)}]}, ["radius"]),
        ({"solids": [{"center": (0, 0, 0), "sise": (1, 1, 1)}]}, ["solids[0].sise", "did you mean 'size'"]),
        ({"solids": [{"name": "a", "center": (0, 0, 0), "size": (1, 1, 1)}] * 2}, ["'a'", "twice"]),
        ({"kernel": "gauss"}, ["kernel", "'gauss'", "'spiky'"]),
        ({"gravity": (0, -9.81)}, ["gravity", "2 components"]),
        ({"gravity": (0, float("inf"), 0)}, ["gravity", "inf", "finite"]),
        ({"iterations": 0}, ["iterations", "0", "at least 1"]),
        ({"substeps": 2.5}, ["substeps", "2.5", "whole number"]),
        ({"preset": "papers"}, ["preset", "'papers'", "'paper'"]),
    ],
)
def test_a_mistake_is_one_sentence(keys, words):
    with pytest.raises(wt.WavetankError) as error:
        scene(**keys)
    text = str(error.value)
    assert "\n" not in text
    for word in words:
        assert word in text, text


def test_points_must_be_finite():
    with pytest.raises(wt.WavetankError, match=r"positions\[1\].*finite"):
        wt.Points(positions=[[0, 0, 0], [0, np.nan, 0]])


@pytest.mark.parametrize("name", wt.bundled_scenes())
def test_bundled_scenes_survive_a_round_trip(name, tmp_path):
    first = wt.Scene.load(name)
    first.save(tmp_path / "again.toml")
    assert wt.Scene.load(tmp_path / "again.toml") == first


def test_everything_survives_a_round_trip(tmp_path):
    first = scene(
        preset="paper",
        viscosity=0.25,
        gravity=(0.0, -1.0, 0.5),
        fluids=[
            BLOCK,
            wt.Ball(center=(0.7, 0.7, 0.7), radius=0.1, velocity=(0, -1, 0)),
            wt.Points(positions=[[0.9, 0.1, 0.1]], velocities=[[0, 0, 1]]),
        ],
        solids=[
            wt.Difference(
                name="cup",
                center=(0.5, 0.5, 0.5),
                rotation=(0, 1, 0, 0),
                parts=[
                    wt.Cylinder(start=(0, 0, 0), end=(0, 0.3, 0), radius=0.1),
                    wt.Union(
                        parts=[
                            wt.Sphere(center=(0, 0, 0), radius=0.1),
                            wt.Capsule(start=(0, 0, 0), end=(1, 0, 0), radius=0.1),
                        ]
                    ),
                ],
            ),
            wt.HalfSpace(point=(0, 0.1, 0), normal=(0, 1, 1), friction=0.3),
        ],
    )
    first.save(tmp_path / "scene.toml")
    again = wt.Scene.load(tmp_path / "scene.toml")
    assert again.table() == first.table()
    np.testing.assert_array_equal(again.particles()[0], first.particles()[0])
    np.testing.assert_array_equal(again.particles()[1], first.particles()[1])


def twins() -> list[str]:
    """Scenes that are flat as well; what moves by itself or comes and goes has other shapes and sizes there."""
    flat = [name for name in wt.bundled_scenes() if name.endswith("-2d")]
    return [name.removesuffix("-2d") for name in flat if not wt.Scene.load(name).is_timed()]


@pytest.mark.parametrize("name", twins())
def test_twins_differ_in_the_third_number_alone(name):
    def numbers(which: str) -> list[str]:
        import importlib.resources

        text = (importlib.resources.files("wavetank.scene") / "scenes" / f"{which}.toml").read_text()
        return re.sub(r"\[([^],]+), ([^],]+), [^],]+\]", r"[\1, \2]", text).splitlines()

    assert numbers(name) == numbers(f"{name}-2d")
    assert wt.Scene.load(name).dim == 3
    assert wt.Scene.load(f"{name}-2d").dim == 2


def test_the_default_scene_is_half_filled():
    world = wt.Scene.load("obstacle-tank")
    assert len(world.particles()[0]) >= 20_000
    volume = np.prod(np.array(world.fluids[0].upper) - np.array(world.fluids[0].lower))
    assert volume == pytest.approx(np.prod(world.tank.size) / 2)
    assert len(world.solids) == 1


def test_a_preset_gives_way_to_what_is_set():
    assert scene(preset="paper").kernel == "poly6-spiky"
    assert scene(preset="paper", kernel="cubic").kernel == "cubic"
    assert scene().changed(preset="paper").force_mixing == wt.PRESETS["paper"]["force_mixing"]


def test_overlapping_fluids_fill_a_place_once():
    both = scene(fluids=[BLOCK, {"lower": (0, 0, 0), "upper": (0.5, 0.5, 1.0)}])
    x, _ = both.particles()
    assert len(x) == 250
    assert len(np.unique(np.round(x, 5), axis=0)) == 250


def test_schema_names_every_parameter():
    schema = json.loads(scene_schema())
    for parameter in wt.PARAMETERS:
        entry = schema["properties"][parameter.name]
        assert entry["description"] == parameter.sentence
        assert entry["unit"] == parameter.unit
    assert schema["additionalProperties"] is False


def test_files_that_are_not_scenes(tmp_path):
    with pytest.raises(wt.WavetankError, match="no file .*no bundled scene of that name.*obstacle-tank"):
        wt.Scene.load("no-such-scene")
    broken = tmp_path / "broken.toml"
    broken.write_text("spacing = = 3")
    with pytest.raises(wt.WavetankError, match=r"broken\.toml: this is not TOML"):
        wt.Scene.load(broken)
    broken.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(wt.WavetankError, match="cannot be read"):
        wt.Scene.load(broken)


def test_scaling_scales_lengths_alone():
    big = wt.Scene.load("obstacle-tank").scaled(10)
    assert big.spacing == pytest.approx(0.25)
    assert big.tank.size == pytest.approx((14, 7, 7))
    assert big.gravity == (0, -9.81, 0)
    assert len(big.particles()[0]) == 21952


def test_scaling_leaves_shares_alone():
    """A tool's radius is a share of the world's length, whatever it is called."""
    goal = {
        "text": "Fill it.",
        "seconds": 5,
        "tools": {"push": {"radius": 0.1}},
        "aims": {"kind": "fill", "lower": (0, 0), "upper": (0.5, 0.5), "share": 0.5},
    }
    ball = wt.Ball(center=(0.5, 0.5), radius=0.2, velocity=(1, 2))
    gust = {"kind": "wind", "velocity": (3, 0), "center": (0.5, 0.25)}
    holes = wt.Union(parts=[wt.Sphere(center=(0.1, 0.2), radius=0.1), wt.Box(center=(0.5, 0.1), size=(0.1, 0.2))])
    points = wt.Points(positions=[[0.75, 0.25]], velocities=[[0.5, 0.5]])
    small = wt.Scene(
        spacing=0.05, tank=wt.Tank(size=(1, 1)), fluids=[ball, points], solids=[holes], forces=[gust], goal=goal
    )
    big = small.scaled(2)
    assert big.goal.tools == {"push": {"radius": 0.1}}
    assert (big.goal.aims[0].upper, big.goal.aims[0].share) == ((1, 1), 0.5)
    assert (big.fluids[0].radius, big.fluids[0].velocity) == (0.4, (1, 2))
    assert (big.fluids[1].positions.tolist(), big.fluids[1].velocities.tolist()) == ([[1.5, 0.5]], [[0.5, 0.5]])
    assert (big.solids[0].parts[0].radius, big.solids[0].parts[1].size) == (0.2, (0.2, 0.4))
    assert (big.forces[0].center, big.forces[0].velocity) == ((1, 0.5), (3, 0))
    assert big.scaled(0.5).table() == small.table()


def test_every_number_of_a_scene_is_a_length_or_known_not_to_be():
    """Who adds a field says which: see `model.METRES`."""
    others = {
        "velocity",
        "velocities",
        "rotation",
        "friction",
        "normal",
        "share",
        "drag",
        "strength",
        "speed",
        "axis",
        "duration",
        "acceleration",
        "scale",
        "frequency",
        "phase",
        "tilt",
        "tilt_axis",
        "direction",
        "side",
        "flow",
        "spread",
        "Emitter.start",
        "Drain.start",
        "suction",
        "time",
        "heights",
        "density",
        "mass",
        "angular_velocity",
        "restitution",
        "stiffness",
        "damping",
        "response",
        "target",
        "limits",
    }
    models = {Tank, Emitter, Drain, Gauge, Motion, Keyframe, *model._MODEL_OF_TAG.values()}
    assert len(models) > 20
    for kind in models:
        for name, field in kind.model_fields.items():
            has_numbers = "float" in str(field.annotation) or "ndarray" in str(field.annotation)
            assert not has_numbers or model.is_length(field) != bool({name, f"{kind.__name__}.{name}"} & others), (
                f"{kind.__name__}.{name}"
            )


def test_materials_in_python_are_those_of_a_file():
    text = 'spacing = 0.02\n[tank]\nsize = [1, 1]\n[[materials]]\nname = "oil"\ndensity = 850\n'
    made = wt.Scene(spacing=0.02, tank=wt.Tank(size=(1, 1)), materials=[wt.Material(name="oil", density=850)])
    assert made.materials == wt.Scene.from_text(text).materials
    with pytest.raises(wt.WavetankError, match="density"):
        wt.Material(name="oil", density=-1)
