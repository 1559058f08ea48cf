"""Every entrance with what it may be given: an input goes in, and a sentence of ours or something that works comes out.

Each entry of `INPUTS` is a strategy of inputs and a function that tries one: `test_fuzz.py` tries some in every test
run, `long.py` many thousands, atheris drives the same functions by what code they reach.
"""

import functools
import io
import json
from typing import Any

import numpy as np
from attacks import POOL, taken_or_refused
from files import FILES, FOLDER
from hypothesis import strategies as st
from strategies import WEIRD, mutated, of_type, tables, toml_of, torn

import wavetank as wt
from wavetank.foundation.input_limits import parse_toml
from wavetank.page.viewers import Viewers, _table
from wavetank.scene.scene import bundled_levels, bundled_scenes
from wavetank.session.commands import COMMANDS
from wavetank.session.recording import Recording, replay
from wavetank.session.session import Session
from wavetank.simulation.state_file import Header, sealed

MOST = 3000  # particles of a world that is tried
RICH = (
    POOL
    + """
viscosity = 0.1
materials = [{ name = "oil", density = 900.0 }]
solids = [{ name = "ball", shape = "sphere", center = [0.7, 0.2], radius = 0.1, motion = { rotation = "t" } },
          { name = "cup", shape = "difference", center = [0.3, 0.5], parts = [
            { shape = "box", center = [0, 0], size = [0.2, 0.2] }, { shape = "sphere", center = [0, 0], radius = 0.08 }] }]
forces = [{ kind = "wind", velocity = [1.0, 0.0] }, { kind = "vortex", center = [0.5, 0.2], radius = 0.2, speed = 1.0 },
          { kind = "attract", center = [0.5, 0.2], radius = 0.2, strength = 5.0 },
          { kind = "drag", center = [0.5, 0.2], radius = 0.2, velocity = [1.0, 0.0] },
          { kind = "burst", center = [0.5, 0.2], radius = 0.2, speed = 1.0 },
          { kind = "sway", acceleration = [1.0, 0.0], frequency = 1.0 }]
emitters = [{ shape = "line", position = [0.6, 0.5], direction = [0, -1], width = 0.1, speed = 1.0 }]
drains = [{ shape = "sphere", center = [0.1, 0.1], radius = 0.1, suction = 1.0 }]
"""
)


def small(name: str) -> dict[str, Any]:
    """A bundled scene with few particles, as a plain table."""
    scene = wt.Scene.load(name)
    count = sum(fluid.estimate(scene.spacing) for fluid in scene.fluids)
    coarse = scene.changed(spacing=float(f"{scene.spacing * max(1.0, count / 600) ** (1.0 / scene.dim):.3g}"))
    return json.loads(json.dumps(coarse.table()))


@functools.cache
def good_scenes() -> list[dict[str, Any]]:
    found = [parse_toml(RICH, "rich"), parse_toml(POOL, "pool")]
    for name in (*bundled_scenes(), *bundled_levels()):
        if name.endswith("-2d") or name in bundled_levels():
            found.append(small(name))
    return found


def goes(session: Session, frames: int = 2) -> None:
    for _ in range(frames):
        session.tick()
        if session.paused:
            return
    arrays = (session.sim.positions, session.sim.velocities, session.sim.densities)
    assert all(np.isfinite(array).all() for array in arrays), "particles that are no numbers"


scenes = st.one_of(
    mutated(st.deferred(lambda: st.sampled_from(good_scenes())), of_type(Any) | tables(wt.Scene)).map(toml_of),
    torn(st.deferred(lambda: st.sampled_from(good_scenes())).map(lambda t: toml_of(t).encode())).map(
        lambda b: b.decode("utf-8", "replace")
    ),
    tables(wt.Scene).map(lambda table: toml_of({"spacing": 0.1, "tank": {"size": [1, 1]}, **table})),
)


@st.composite
def repetitions(draw: Any) -> str:
    """Scenes whose fluids or solids are there many times."""
    table = dict(draw(st.deferred(lambda: st.sampled_from(good_scenes()))))
    what = draw(st.sampled_from([key for key in ("fluids", "solids") if table.get(key)]))
    rows = [{**row} for row in table[what]]
    for row in rows:
        row.pop("name", None)
    table[what] = (rows * 400)[: draw(st.sampled_from([2, 50, 400]))]
    return toml_of(table)


def try_scene(text: str) -> None:
    scene = taken_or_refused(lambda: wt.Scene.from_text(text, "scene", files=False))
    if scene is not None:
        session = taken_or_refused(lambda: Session(scene, most_particles=MOST))
        if session is not None:
            taken_or_refused(lambda: goes(session))
            assert taken_or_refused(lambda: wt.Scene.from_text(scene.text(), "again", files=False)) is not None


@functools.cache
def good_states() -> list[dict[str, np.ndarray]]:
    FOLDER.mkdir(exist_ok=True)
    found = []
    for number, table in enumerate([good_scenes()[0], small("double-dam-2d"), small("crates"), small("honey-2d")]):
        sim = wt.Simulation(wt.Scene.parse(table))
        for _ in range(8):
            sim.step()
        path = FOLDER / f"state-{number}.npz"
        sim.save(path)
        with np.load(path) as file:
            found.append({name: file[name] for name in file.files})
    return found


@st.composite
def states(draw: Any) -> bytes:
    """A state with a changed header, changed arrays, changed scene, or torn as it lies on the disk."""
    parts = dict(draw(st.deferred(lambda: st.sampled_from(good_states()))))
    what = draw(st.sampled_from(["header", "header", "arrays", "arrays", "scene", "torn"]))
    if what == "header":
        about = draw(mutated(st.just(json.loads(str(parts["about"]))), tables(Header)))
        parts["about"] = np.asarray(json.dumps(about))
    elif what == "scene":
        plain = draw(mutated(st.just(json.loads(str(parts["scene"])))))
        parts["scene"] = np.asarray(json.dumps(plain))
    elif what == "arrays":
        for _ in range(draw(st.integers(1, 3))):
            name = draw(st.sampled_from(sorted(parts)))
            array = parts[name]
            change = draw(st.sampled_from(["drop", "cut", "type", "shape", "value", "engine"]))
            if change == "drop":
                del parts[name]
                continue
            if change == "cut":
                array = array[:-1] if array.ndim else array
            elif change == "type":
                with np.errstate(all="ignore"):
                    array = (
                        array.astype(draw(st.sampled_from(["f8", "f4", "i4", "i8", "u1", "U9", "?"])), copy=True)
                        if array.dtype.kind != "U"
                        else array
                    )
            elif change == "shape":
                array = array.reshape(-1, 1) if array.ndim else array
            elif array.ndim and array.size and array.dtype.kind in "fiu":
                array = array.copy()
                flat = array.reshape(-1)
                with np.errstate(all="ignore"):
                    value = np.asarray(draw(st.sampled_from(EDGE_VALUES))).astype(array.dtype)
                flat[draw(st.integers(0, flat.size - 1))] = value
                if name == "bodies_engine":
                    flat[draw(st.integers(0, flat.size - 1)) :] = draw(st.integers(0, 255))
            parts[name] = array
    file = io.BytesIO()
    np.savez(file, **(sealed(parts) if draw(st.integers(0, 9)) else parts))
    return draw(torn(st.just(file.getvalue()))) if what == "torn" else file.getvalue()


EDGE_VALUES = [0, 1, -1, 7, 0.5, 1e9, 1e10, 1e30, np.inf, np.nan, 2**31 - 1, 255]


def try_state(content: bytes) -> None:
    FOLDER.mkdir(exist_ok=True)
    path = FOLDER / "state.npz"
    path.write_bytes(content)
    sim = taken_or_refused(lambda: wt.Simulation.restore(path))
    if sim is not None:

        def on() -> None:
            sim.step()
            sim.save(path)  # and from there as from here, also with particles that came since
            other = wt.Simulation.restore(path)
            assert other.digest() == sim.digest()
            middle = (
                0.5 * np.ones((1, sim.scene.dim)) if sim.scene.tank is None else np.mean(sim.scene.tank.box(), axis=0)
            )
            for one in (sim, other):
                one.add(np.reshape(middle, (1, -1)))
                one.step()
            assert other.digest() == sim.digest()
            assert np.isfinite(sim.positions).all() and np.isfinite(sim.velocities).all()

        taken_or_refused(on)


messages = st.one_of(
    st.sampled_from(COMMANDS).flatmap(tables).map(json.dumps),
    mutated(st.sampled_from(COMMANDS).flatmap(tables)).map(json.dumps),
    st.tuples(st.just("load"), scenes).map(lambda pair: json.dumps({"do": pair[0], "text": pair[1]})),
    torn(st.sampled_from(COMMANDS).flatmap(tables).map(lambda table: json.dumps(table).encode())).map(
        lambda b: b.decode("utf-8", "replace")
    ),
    st.fixed_dictionaries(
        {
            "do": st.sampled_from(["ack", "size", "drive", "detail", "point-begin", "point-move", "point-end"]),
            "x": WEIRD,
            "y": WEIRD,
            "width": WEIRD,
            "height": WEIRD,
            "pointer": WEIRD,
            "tool": st.sampled_from(["pour", "stir", "cut", "freeze", "", 5, None]),
            "options": WEIRD,
        }
    ).map(json.dumps),
)
_sessions: list[Session] = []


def _session() -> Session:
    """One session that all messages go to, as of one who never stops."""
    if not _sessions:
        _sessions.append(Session(wt.Scene.from_text(POOL), most_particles=MOST))
    return _sessions[0]


def try_message(text: str) -> None:
    session = _session()
    ray = {"origin": (0.5, 0.3, 5.0), "direction": (0.0, 0.0, -1.0)}
    viewers = Viewers(session.submit, lambda u, v, tool: ray, dict)
    from wavetank.page.viewers import Viewer

    viewers.driver = viewer = Viewer(None)
    taken_or_refused(lambda: viewers.hear(viewer, _table({"text": text})))
    session.paused, session.speed = False, 1.0
    before = len(session.notes)
    session.drain()
    session.notes[before:] = [note for note in session.notes[before:] if _is_sentence(note)]
    goes(session, 1)
    if session.sim.count > MOST or len(session.sim.scene.solids) > 40 or len(session.log) > 200:
        _sessions.clear()


def try_watching(text: str) -> None:
    """Whoever watches changes nothing, but may take control."""
    heard: list[Any] = []
    viewers = Viewers(lambda command, tell: heard.append(command) or True, lambda u, v, tool: {}, dict)
    from wavetank.page.viewers import Viewer

    viewers.driver = driver = Viewer(None)
    watcher = Viewer(None)
    viewers.all += [driver, watcher]
    viewers.drop_mesh = viewers.aim = lambda *given: heard.append(given)
    taken_or_refused(lambda: viewers.hear(watcher, _table({"text": text})))
    assert not heard and viewers.detail == "auto" and driver.size == (960, 540)
    assert len(watcher.outbox) < 30


def _is_sentence(note: str) -> bool:
    assert "\n" not in note and len(note) < 2000, note
    return True


recordings = st.one_of(
    st.tuples(
        st.lists(st.sampled_from(COMMANDS).flatmap(tables), max_size=4),
        st.deferred(lambda: st.sampled_from(good_scenes())),
    ).map(
        lambda pair: toml_of(
            {
                "format": 1,
                "frames": 2,
                "scene": pair[1],
                "most_particles": MOST,
                "commands": [{**command, "frame": 1} for command in pair[0]],
            }
        )
    ),
    mutated(
        st.deferred(lambda: st.sampled_from(good_scenes())).map(
            lambda scene: {
                "format": 1,
                "frames": 2,
                "most_particles": MOST,
                "scene": scene,
                "commands": [{"frame": 0, "do": "pause"}, {"frame": 1, "do": "step"}],
            }
        )
    ).map(toml_of),
)


def try_recording(text: str) -> None:
    FOLDER.mkdir(exist_ok=True)
    path = FOLDER / "session.toml"
    path.write_text(text, encoding="utf-8", errors="replace")
    recording = taken_or_refused(lambda: Recording.load(path))
    if recording is None or recording.frames > 5 or recording.most_particles > MOST:
        return

    def play() -> None:
        for session in replay(recording):
            assert np.isfinite(session.sim.positions).all()

    taken_or_refused(play)


@functools.cache
def good_meshes() -> list[tuple[str, bytes]]:
    import trimesh

    box, ball = trimesh.creation.box(), trimesh.creation.icosphere(1)
    return [
        (
            suffix,
            mesh.export(file_type=suffix)
            if isinstance(mesh.export(file_type=suffix), bytes)
            else mesh.export(file_type=suffix).encode(),
        )
        for mesh in (box, ball)
        for suffix in ("obj", "stl", "ply", "glb", "stl_ascii")
    ]


@st.composite
def meshes(draw: Any) -> tuple[str, bytes]:
    kind, content = draw(st.deferred(lambda: st.sampled_from(good_meshes())))
    if not draw(st.integers(0, 4)):
        content = draw(st.sampled_from(HEADERS_ALONE))
    return kind.partition("_")[0], draw(torn(st.just(content)))


#: files that say that much follows, and that begin as another kind
HEADERS_ALONE = [
    b"ply\nformat binary_little_endian 1.0\nelement vertex 1000000000\nproperty float x\nelement face 3\n"
    b"property list uint int vertex_indices\nend_header\n",
    b"ply\nformat ascii 1.0\ncomment TextureFile /etc/passwd\nelement vertex 0\nend_header\n",
    bytes(80) + b"\xff\xff\xff\x7f",
    b"glTF\x02\0\0\0\xff\xff\xff\x7f\xff\xff\xff\x7fJSON{}",
    bytes(1 << 20),
]


def try_mesh(given: tuple[str, bytes]) -> None:
    kind, content = given
    FOLDER.mkdir(exist_ok=True)
    path = FOLDER / f"mesh.{kind}"
    path.write_bytes(content)

    def made() -> None:
        wt.Mesh(path=str(path), center=(0.0, 0.0, 0.0), size=0.3).grid(0.05)

    taken_or_refused(made)


INPUTS: dict[str, tuple[st.SearchStrategy[Any], Any]] = {
    "scene": (scenes, try_scene),
    "repetition": (repetitions(), try_scene),
    "state": (states(), try_state),
    "message": (messages, try_message),
    "watcher": (messages, try_watching),
    "recording": (recordings, try_recording),
    "mesh": (meshes(), try_mesh),
    **FILES,
}
