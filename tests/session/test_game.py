"""Every level is won by its recorded solution and lost by doing nothing; what a goal asks is what is measured."""

from pathlib import Path

import numpy as np
import pytest

import wavetank as wt
from wavetank.scene.goal import Goal
from wavetank.scene.scene import bundled_levels
from wavetank.session import commands as do
from wavetank.session.game import Game
from wavetank.session.recording import Recording, replay

SOLUTIONS = Path(__file__).parent / "levels"
DOWN = (0.0, 0.0, -1.0)


SLACK = 1.2  # a solution wins where this much more is asked, so that no rounding of another machine decides


@pytest.mark.parametrize("name", bundled_levels())
def test_level_is_won_by_its_recorded_solution(name):
    recording = Recording.load(SOLUTIONS / f"{name}.toml")
    level = wt.Scene.load(name)
    assert wt.Scene.parse(recording.scene).table() == level.table(), "the solution is one of this level"
    for aim in recording.scene["goal"]["aims"]:
        aim["share"] *= 1.0 / SLACK if aim["kind"] == "dry" else SLACK
    for session in replay(recording):
        assert 0.0 <= session.game.progress <= 1.0
        if session.game.outcome:
            break
    while not session.game.outcome:  # where the water came out a little differently, it takes a few frames more
        session.tick()
    assert session.game.outcome == "won"
    assert session.game.progress == 1.0
    assert session.game.stars >= 2
    assert session.game.goal.is_endured or session.game.elapsed <= level.goal.seconds / SLACK


@pytest.mark.parametrize("name", bundled_levels())
def test_level_is_lost_by_doing_nothing(name):
    """Water that nobody touches comes to rest, or is at rest; from then on only the clock runs."""
    session = wt.Session(wt.Scene.load(name))
    game, fastest = session.game, np.inf
    while not game.outcome and session.sim.time < 1.5 and (session.sim.time < 0.25 or fastest > 0.15):
        session.tick()
        fastest = np.linalg.norm(session.sim.velocities, axis=1).max()
    assert game.progress < 0.3 or game.goal.is_endured
    while not game.outcome:
        game.watch(session.sim.frame(), 0.5)
    assert game.outcome == "lost"
    assert game.stars == 0


def scene(goal: dict, **more) -> wt.Scene:
    return wt.Scene(
        spacing=0.05,
        tank=wt.Tank(size=(1.0, 0.6)),
        fluids=[{"lower": (0, 0), "upper": (0.5, 0.4)}, {"lower": (0.5, 0), "upper": (1, 0.4), "material": "red"}],
        materials=[{"name": "red"}],
        goal={"text": "Do it.", "seconds": 5, **goal},
        **more,
    )


def aim(kind: str, share: float, lower=(0, 0), upper=(0.5, 0.6), **more) -> dict:
    return {"kind": kind, "lower": lower, "upper": upper, "share": share, **more}


def measured(*aims: dict) -> list[float]:
    return wt.Session(scene({"aims": list(aims)})).game.values


def test_aims_measure_what_they_say():
    values = measured(
        aim("fill", 0.5),
        aim("dry", 0.9),
        aim("deliver", 0.9),
        aim("deliver", 0.9, material="red"),
        aim("apart", 0.9, lower=(0.5, 0), upper=(1, 0.6), material="red"),
        aim("apart", 0.9, upper=(1, 0.6), material="red"),
        aim("fill", 0.5, color="#e0446a"),
        aim("mix", 0.9, upper=(1, 0.6), material="red"),
    )
    assert values[:-1] == pytest.approx([2 / 3, 2 / 3, 0.5, 0.0, 1.0, 0.5, 0.0], abs=0.08)
    assert values[-1] == pytest.approx(0.2), "one of five columns of cells has both halves in it"


def test_mixture_and_colours_are_seen():
    session = wt.Session(
        scene({"aims": [aim("mix", 0.9, upper=(1, 0.6), color="#e0446a"), aim("deliver", 1, color="#e0446a")]})
    )
    sim = session.sim
    dye = 127 << 24 | 0xE0446A
    every_other = (np.round(sim.positions / 0.05 - 0.5).astype(int).sum(axis=1) % 2 == 0) * dye
    x, v, kinds = sim.positions, sim.velocities, sim.frame().materials
    sim.remove(sim.frame().ids)
    sim.add(x, v, every_other.astype(np.int32), kinds)
    game = Game(session.scene.goal, sim.frame())
    assert game.values[0] > 0.95
    assert game.values[1] == pytest.approx(0.5, abs=0.05)


def test_held_for_a_while_then_won_and_nothing_after_it_counts():
    session = wt.Session(scene({"aims": [aim("deliver", 0.2)], "hold": 0.1, "stars": [0.05, 1.0]}))
    for _ in range(5):
        session.tick()
    assert session.game.outcome == ""
    assert session.game.stars == 2
    for _ in range(3):
        session.tick()
    assert (session.game.outcome, session.game.stars) == ("won", 2)
    elapsed = session.game.elapsed
    session.tick()
    assert session.game.elapsed == elapsed
    session.apply(do.Reset())
    assert (session.game.outcome, session.game.elapsed) == ("", 0.0)


def test_another_attempt_begins_upright():
    session = wt.Session(scene({"aims": [aim("deliver", 0.9)]}))
    session.apply(do.SetParameter(name="foam", value=0.5))
    session.apply(do.ToolBegin(tool="tilt", options={"stay": True}, origin=(0.5, 0.2, 5), direction=DOWN))
    session.apply(do.ToolMove(origin=(0.9, 0.2, 5), direction=DOWN))
    session.apply(do.ToolEnd())
    assert session.sim.gravity[0] > 1.0
    session.apply(do.Reset())
    assert session.sim.gravity[0] == 0.0
    assert session.sim.foam == 0.5


def test_endured_goal_is_won_by_time_and_lost_by_water():
    far = wt.Session(scene({"aims": [aim("dry", 0.1, lower=(0, 0.5))], "seconds": 0.1}))
    wet = wt.Session(scene({"aims": [aim("dry", 0.1)], "seconds": 0.1}))
    for session in (far, wet):
        for _ in range(7):
            session.tick()
    assert (far.game.outcome, far.game.stars, wet.game.outcome) == ("won", 3, "lost")


def test_rewinding_gives_no_time_back():
    session = wt.Session(scene({"aims": [aim("deliver", 0.9)]}))
    for _ in range(12):
        session.tick()
    session.apply(do.Rewind(time=0.0))
    assert session.sim.time < 0.05
    assert session.game.elapsed == pytest.approx(0.2)


def test_only_what_the_level_allows_is_done():
    session = wt.Session(scene({"aims": [aim("deliver", 0.9)], "tools": {"push": {"radius": 0.05}}, "strokes": 1}))
    for command, says in (
        (do.ToolBegin(tool="pour", origin=(0.5, 0.2, 5), direction=DOWN), "its tools are: push"),
        (do.SetParameter(name="gravity", value=(9.81, 0.0)), "A level does not allow"),
        (do.AddSolid(solid=wt.Box(center=(0.5, 0.5), size=(0.1, 0.1))), "A level does not allow"),
    ):
        with pytest.raises(wt.WavetankError, match=says) as error:
            session.apply(command)
        assert "\n" not in str(error.value)
    assert session.log == []
    push = do.ToolBegin(tool="push", origin=(0.5, 0.2, 5), direction=DOWN, options={"radius": 0.5})
    session.apply(push)
    assert session.hands[0][0].radius == 0.05
    assert session.log[0][1].options == {"radius": 0.05}
    with pytest.raises(wt.WavetankError, match="1 strokes"):
        session.apply(push)
    session.apply(do.SetParameter(name="foam", value=0.0))


@pytest.mark.parametrize(
    ("goal", "says"),
    [
        ({"aims": []}, "aims"),
        ({"aims": [aim("flood", 0.5)]}, "'fill', 'dry', 'deliver', 'apart', 'mix'"),
        ({"aims": [aim("fill", 1.5)]}, "share"),
        ({"aims": [aim("fill", 0.5, lower=(0.7, 0))]}, "lower must be below upper"),
        ({"aims": [aim("fill", 0.5, lower=(0, 0, 0), upper=(1, 1, 1))]}, "3 components in a 2-D world"),
        ({"aims": [aim("fill", 0.5, material="oil")]}, "not one of the scene's materials"),
        ({"aims": [aim("fill", 0.5)], "stars": [9, 4]}, "three stars ask for less"),
        ({"aims": [aim("fill", 0.5, shre=0.5)]}, "did you mean 'share'"),
        ({"aims": [aim("fill", 0.5)], "tools": {"hammer": {}}}, "'hammer' is not a tool"),
        ({"aims": [aim("fill", 0.5)], "tools": {"push": {"radius": 9}}}, "radius"),
    ],
)
def test_bad_goals_are_refused_in_one_sentence(goal, says):
    with pytest.raises(wt.WavetankError) as error:
        wt.Session(scene(goal))
    assert says in str(error.value)
    assert "\n" not in str(error.value)


def test_goal_survives_a_file(tmp_path):
    for name in bundled_levels():
        level = wt.Scene.load(name)
        level.save(tmp_path / "level.toml")
        again = wt.Scene.load(tmp_path / "level.toml")
        assert isinstance(again.goal, Goal)
        assert again.goal == level.goal
        assert level.goal.hint
