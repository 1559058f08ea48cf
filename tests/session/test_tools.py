"""Each tool does to the water what its sentence says, in 2-D and 3-D."""

import numpy as np
import pytest

import wavetank as wt
from wavetank.session import commands as c
from wavetank.session.session import Session
from wavetank.session.tools import TOOL_NAMES, TOOLS, describe

SPACING = 0.05


def basin(dim: int = 2, **keys) -> wt.Scene:
    """Still water, 0.3 m deep, in a tank of 1.2 m."""
    size = (1.2, 0.8, 0.5)[:dim]
    return wt.Scene(
        **{
            "spacing": SPACING,
            "tank": wt.Tank(size=size),
            "fluids": [wt.Block(lower=(0,) * dim, upper=(1.2, 0.3, 0.5)[:dim])],
            **keys,
        }
    )


def ray(x: float, y: float, z: float = 0.25) -> dict:
    """A ray from the front to a place; in 3-D it comes a little from above."""
    origin = np.array([x, y + 0.5, z + 4.0])
    return {"origin": tuple(origin), "direction": tuple(np.array([x, y, z]) - origin)}


def flat(x: float, y: float) -> dict:
    return {"origin": (x, y, 4.0), "direction": (0.0, 0.0, -1.0)}


def at(session: Session, x: float, y: float) -> dict:
    return flat(x, y) if session.sim.scene.dim == 2 else ray(x, y)


def use(session: Session, tool: str, *path: tuple[float, float], frames: int = 4, lift: bool = True, **options) -> None:
    """Drag a tool along a path, with some frames at each place."""
    session.apply(c.ToolBegin(tool=tool, options=options, **at(session, *path[0])))
    for place in path:
        session.apply(c.ToolMove(**at(session, *place)))
        for _ in range(frames):
            session.tick()
    if lift:
        session.apply(c.ToolEnd())


@pytest.fixture(params=[2, 3])
def session(request) -> Session:
    return Session(basin(request.param))


def test_every_tool_tells_about_itself():
    for tool in TOOLS:
        about = describe(tool)
        assert about["label"]
        assert about["sentence"].endswith(".")
        assert about["icon"].startswith("M")
        for option in about["options"]:
            assert option["sentence"]
            assert option["low"] is None or option["low"] <= option["default"] <= option["high"]
    keys = [tool.key for tool in TOOLS if tool.key]
    assert len(set(keys)) == len(keys)
    assert len(TOOL_NAMES) == len(TOOLS)


def test_push_takes_the_water_along(session):
    use(session, "push", *[(0.4 + 0.04 * k, 0.25) for k in range(8)], frames=1, radius=0.09)
    assert session.sim.velocities[:, 0].max() > 1.0
    momentum = session.sim.velocities.mean(axis=0)
    assert momentum[0] > 3.0 * abs(momentum[1])  # and piles it up: 3.0 to 4.4, by where it is pushed


def test_stir_turns_the_water_round(session):
    use(session, "stir", (0.6, 0.28), frames=20, speed=0.5, radius=0.3, lift=False)
    x, v = session.sim.positions, session.sim.velocities
    away = x - session.hands[0][1].point[: x.shape[1]]
    across = 1 if x.shape[1] == 2 else 2
    turn = away[:, 0] * v[:, across] - away[:, across] * v[:, 0]
    assert (turn.mean() if across == 1 else -turn.mean()) > 0.01


def test_attract_and_repel(session):
    def pull(strength: float) -> float:
        session.apply(c.Reset())
        use(session, "attract", (0.6, 0.28), frames=15, strength=strength, radius=0.4)
        x = session.sim.positions
        return float(np.sum(np.abs(x[:, 0] - 0.6) < 0.25))

    assert pull(12.0) > 1.04 * pull(-12.0)


@pytest.mark.parametrize("aim", ["down", "ahead"])
def test_pour_fills_in_where_there_is_room(session, aim):
    before = session.sim.frame().ids
    use(session, "pour", (0.6, 0.5), frames=40, width=0.15, aim=aim, color="#ff0000", lift=False)
    frame = session.sim.frame()
    new = ~np.isin(frame.ids, before)
    assert new.sum() > 10
    assert (frame.dyes[new] != 0).all()
    assert np.isin(before, frame.ids).all()
    low, high = frame.positions.min(axis=0), frame.positions.max(axis=0)
    assert (low >= 0).all()
    assert (high <= np.array(session.sim.scene.tank.size)).all()
    assert session.sim.stats()["density_error_max"] < 0.25


def test_poured_water_keeps_its_distance(session):
    """At the moment it appears nothing is nearer than nine tenths of a spacing, even with the hose under water."""
    from scipy.spatial import cKDTree

    session.apply(c.ToolBegin(tool="pour", options={"width": 0.3, "speed": 2.0}, **at(session, 0.6, 0.32)))
    for _ in range(25):
        before = session.sim.frame().ids
        for tool, hand in session.hands.values():
            tool.hold(hand, 1 / 60)
        frame = session.sim.frame()
        new = ~np.isin(frame.ids, before)
        if new.any():
            others = cKDTree(frame.positions)
            distances, _ = others.query(frame.positions[new], k=2)
            assert distances[:, 1].min() > 0.89 * SPACING
        session.sim.step()


def test_pour_stops_at_the_limit():
    session = Session(basin(), most_particles=180)
    use(session, "pour", (0.6, 0.7), frames=60, width=0.3, speed=1.0)
    assert session.sim.count <= 180
    assert any("stops at 180" in note for note in session.notes)


def test_drain_takes_water_away_and_nothing_else(session):
    before = session.sim.frame().ids
    use(session, "drain", (0.6, 0.25), frames=20)
    after = session.sim.frame().ids
    assert 0 < len(after) < len(before)
    assert np.isin(after, before).all()


def test_wind_blows_the_way_it_is_dragged(session):
    use(session, "wind", (0.4, 0.3), (0.6, 0.3), frames=10, radius=0.5)
    assert session.sim.velocities[:, 0].mean() > 0.05


def test_an_explosion_throws_water_up(session):
    top = session.sim.positions[:, 1].max()
    use(session, "explosion", (0.6, 0.25), frames=12)
    assert session.sim.positions[:, 1].max() > top + 0.1
    energies = []
    for _ in range(10):
        session.tick()
        stats = session.sim.stats()
        energies.append(stats["kinetic_energy"] + stats["potential_energy"])
    assert max(energies[1:]) <= 1.001 * energies[0], "it bangs once"


def test_ice_keeps_its_place_and_melts(session):
    for _ in range(5):
        session.tick()
    use(session, "freeze", (0.6, 0.25), frames=0, radius=0.2)
    frozen = session.sim.world.frozen
    assert frozen > 5
    ids = session.sim.world.particles.id.to_numpy()[session.sim.world.particles.frozen.to_numpy() == 1]
    before = session.sim.positions[np.isin(session.sim.frame().ids, ids)]
    use(session, "push", *[(0.3 + 0.05 * k, 0.25) for k in range(8)], frames=2)
    frame = session.sim.frame()
    ice = np.isin(frame.ids, ids)
    np.testing.assert_array_equal(frame.positions[ice], before)
    assert np.abs(frame.velocities[ice]).max() == 0.0
    assert np.abs(frame.velocities[~ice]).max() > 0.05
    use(session, "freeze", (0.6, 0.25), frames=0, radius=0.5, melt=True)
    assert session.sim.world.frozen < frozen
    session.apply(c.SetParameter(name="gravity", value=(5.0, -9.81, 0.0)[: session.sim.scene.dim]))
    for _ in range(10):
        session.tick()
    assert np.abs(session.sim.positions[ice] - before).max() > 0.01


def test_dye_goes_with_the_water(session):
    use(session, "dye", (0.3, 0.25), (0.4, 0.25), frames=0, radius=0.1, color="#00ff00")
    frame = session.sim.frame()
    dyed = frame.ids[frame.dyes != 0]
    assert 3 < len(dyed) < session.sim.count
    assert set(frame.dyes[frame.dyes != 0] & 0xFFFFFF) == {0x00FF00}
    use(session, "push", *[(0.3 + 0.05 * k, 0.25) for k in range(8)], frames=2)
    frame = session.sim.frame()
    np.testing.assert_array_equal(frame.ids[frame.dyes != 0], dyed)
    use(session, "dye", (0.3, 0.25), (0.9, 0.25), frames=0, radius=0.5, color="")
    assert (session.sim.frame().dyes == 0).sum() > session.sim.count - len(dyed)


def test_cut_goes_all_the_way_through(session):
    before = session.sim.frame()
    _ = before.ids, before.positions
    use(session, "cut", (0.6, 0.28), (0.6, 0.02), frames=0, radius=0.06)
    after = session.sim.frame()
    gone = before.positions[~np.isin(before.ids, after.ids)]
    assert len(gone) > 4
    assert (np.abs(gone[:, 0] - 0.6) <= 1.5 * SPACING + 1e-3).all()
    if after.dim == 3:
        assert gone[:, 2].max() - gone[:, 2].min() > 0.35
    np.testing.assert_array_equal(after.positions, before.positions[np.isin(before.ids, after.ids)])


@pytest.mark.parametrize("dim", [2, 3])
def test_grab_carries_a_solid_through_the_water(dim):
    ball = wt.Sphere(name="ball", center=(0.3, 0.2, 0.25)[:dim], radius=0.1)
    session = Session(basin(dim, solids=[ball]))
    use(session, "grab", (0.3, 0.2), *[(0.3 + 0.05 * k, 0.2) for k in range(12)], frames=3)
    place = session.sim.solids.poses[session.sim.solids.find("ball")][0]
    assert place[0] == pytest.approx(0.85, abs=0.03)
    distance = np.linalg.norm(session.sim.positions - place[:dim], axis=1)
    assert distance.min() > 0.1
    use(session, "grab", (0.1, 0.7), frames=1)
    assert any("no solid" in note for note in session.notes)


def test_place_and_remove(session):
    for _ in range(3):
        session.tick()
    top = np.percentile(session.sim.positions[:, 1], 95)
    use(session, "place", (0.6, 0.2), frames=40, radius=0.08)
    assert len(session.sim.scene.solids) == 1
    center, radius = session.sim.scene.solids[0].center, session.sim.scene.solids[0].radius
    assert np.linalg.norm(session.sim.positions - center, axis=1).min() > radius
    assert session.sim.stats()["speed_max"] < 4.0, "it swells, it does not burst"
    assert np.percentile(session.sim.positions[:, 1], 95) >= top - 0.01
    use(session, "remove", (0.6, 0.2), frames=1)
    assert session.sim.scene.solids == []
    assert session.sim.solids.names == [
        f"tank {a} {e}" for a in "xyz"[: session.sim.scene.dim] for e in ("lower", "upper")
    ]


def test_paddle_comes_and_goes(session):
    use(session, "paddle", *[(0.3 + 0.04 * k, 0.2) for k in range(10)], frames=4, lift=False)
    name = session.sim.solids.names[-1]
    assert "paddle" in name
    assert session.sim.solids.poses[-1][0][1] < 0.4, "it is down"
    x = session.sim.positions[:, 0]
    assert x.min() > -1e-3
    session.apply(c.ToolEnd())
    assert name not in session.sim.solids.names


@pytest.mark.parametrize("kind", ["sine", "random"])
def test_waves_go_on_until_stopped(session, kind):
    use(session, "waves", (0.1, 0.2), frames=40, kind=kind, stroke=0.06)
    assert list(session.running) == ["waves"]
    assert session.sim.stats()["kinetic_energy"] > 0.0
    before = session.sim.solids.poses[-1][0][0]
    for _ in range(10):
        session.tick()
    assert session.sim.solids.poses[-1][0][0] != before
    assert session.sim.positions[:, 0].min() > -1e-3
    session.apply(c.ToolStop())
    assert not session.running
    assert session.sim.scene.solids == []


def test_tilt_leans_and_comes_upright(session):
    use(session, "tilt", (0.6, 0.3), (0.9, 0.3), frames=10, lift=False)
    gravity = session.sim.gravity
    assert gravity[0] > 3.0
    assert np.linalg.norm(gravity) == pytest.approx(9.81)
    session.apply(c.ToolEnd())
    assert session.sim.gravity == pytest.approx((0.0, -9.81, 0.0)[: len(gravity)])


def test_shake_throws_the_water_back(session):
    use(session, "shake", (0.4, 0.4), (0.6, 0.4), frames=3)
    assert session.sim.velocities[:, 0].mean() < -0.1


def test_a_ray_meets_what_a_person_sees(session):
    from wavetank.session.tools.picking import pick

    dim = session.sim.scene.dim
    session.sim.add_solid(wt.Sphere(name="ball", center=(0.9, 0.5, 0.25)[:dim], radius=0.1))

    def look(x: float, y: float):
        line = at(session, x, y)
        way = np.array(line["direction"])
        return pick(session.sim, np.array(line["origin"]), way / np.linalg.norm(way))

    assert look(0.3, 0.2).kind == "water"
    assert look(0.9, 0.5).kind == "solid"
    assert look(0.9, 0.5).name == "ball"
    assert look(0.3, 0.7).kind == "tank"
    if dim == 3:
        from_above = pick(session.sim, np.array([0.3, 3.0, 0.25]), np.array([0.0, -1.0, 0.0]))
        assert from_above.kind == "water"
        assert from_above.point[1] == pytest.approx(0.3, abs=SPACING)
        beside = pick(session.sim, np.array([5.0, 3.0, 5.0]), np.array([0.0, -1.0, 0.0]))
        assert beside.kind == "air"
        assert np.isfinite(beside.point).all()


def test_a_mistake_in_an_option_is_one_sentence():
    session = Session(basin())
    with pytest.raises(wt.WavetankError, match=r"push: radius = 9.* at most 0.5"):
        session.apply(c.ToolBegin(tool="push", options={"radius": 9.0}, **flat(0.5, 0.2)))
    with pytest.raises(wt.WavetankError, match="did you mean 'radius'"):
        session.apply(c.ToolBegin(tool="push", options={"radios": 0.1}, **flat(0.5, 0.2)))
    with pytest.raises(wt.WavetankError, match="'hammer' is not known; it must be one of push, stir"):
        session.apply(c.ToolBegin(tool="hammer", **flat(0.5, 0.2)))
    assert not session.hands
