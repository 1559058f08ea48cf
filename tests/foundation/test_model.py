"""Checked models: true and false stand for no number, wherever one is declared."""

import pytest

import wavetank as wt
from wavetank.foundation.errors import WavetankError
from wavetank.foundation.model import Model, _types
from wavetank.foundation.params import PARAMETERS
from wavetank.session import commands
from wavetank.session.recording import Recording


def all_models(model: type[Model] = Model) -> list[type[Model]]:
    return [found for child in model.__subclasses__() for found in (child, *all_models(child))]


def numeric_fields() -> list[tuple[type[Model], str]]:
    """Every field of every model that takes numbers, alone or in lists, and neither true nor anything."""
    assert commands.Command in all_models()
    assert Recording in all_models()
    return [
        (model, name)
        for model in all_models()
        if model.__module__.startswith("wavetank.")
        for name, field in model.model_fields.items()
        if {int, float} & set(_types(field.annotation)) and bool not in _types(field.annotation)
    ]


def test_there_are_numbers_in_scenes_commands_tools_and_recordings():
    rooms = {model.__module__.rsplit(".", 1)[0] for model, _ in numeric_fields()}
    assert {
        "wavetank.foundation",
        "wavetank.scene",
        "wavetank.scene.forces",
        "wavetank.solids",
        "wavetank.session",
        "wavetank.session.tools",
    } <= rooms
    assert len(numeric_fields()) > 150


@pytest.mark.parametrize("truth", [True, False])
def test_true_and_false_are_refused_wherever_a_number_stands(truth):
    for model, name in numeric_fields():
        message = rf"{name} = {truth} is not allowed; it must be a (whole )?number\."
        given = {"size": 1.0} if model is wt.Mesh and name != "scale" else {}  # it needs one of the two
        with pytest.raises(WavetankError, match=message):
            model.parse({**given, name: truth})
        with pytest.raises(WavetankError, match=message):
            model(**{**given, name: truth})
        with pytest.raises(WavetankError, match=message):
            setattr(model.model_construct(**given), name, truth)


def test_the_sentence_names_the_key_and_what_is_allowed():
    scene = {"spacing": 0.05, "tank": {"size": [1, 1]}, "gravity": [0, -9.81]}
    for change, message in [
        ({"spacing": True}, "spacing = True is not allowed; it must be a number."),
        ({"substeps": False}, "substeps = False is not allowed; it must be a whole number."),
        ({"gravity": [0, True]}, r"gravity = \[0, True\] is not allowed; it must be a list of numbers"),
        ({"tank": {"size": [1, True]}}, r"tank.size = \[1, True\] is not allowed; it must be a list of numbers"),
        ({"fluids": [{"lower": [0, 0], "upper": [1, True]}]}, r"upper = \[1, True\] is not allowed"),
    ]:
        with pytest.raises(WavetankError, match=message):
            wt.Scene.parse({**scene, **change})
    parsed = wt.Scene.parse(scene)
    with pytest.raises(WavetankError, match="viscosity = True is not allowed; it must be a number"):
        parsed.changed(viscosity=True)


def test_no_live_parameter_of_a_running_world_takes_true():
    sim = wt.Simulation(wt.Scene(spacing=0.1, tank=wt.Tank(size=(0.5, 0.5)), gravity=(0, -9.81)))
    for parameter in PARAMETERS:
        if parameter.live and isinstance(parameter.default, int | float):
            with pytest.raises(WavetankError, match=f"{parameter.name} = True is not allowed"):
                setattr(sim, parameter.name, True)
