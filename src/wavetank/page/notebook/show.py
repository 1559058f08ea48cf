"""`wt.show`: the water in a cell of a notebook, to be played with.

The water moves in the kernel's own thread, as a task of its event loop, between cells: what is shown is the very object
that the cells hold, no lock is needed, and while a cell runs the water stands still.
"""

import asyncio
import base64
import concurrent.futures
import contextlib
import io
import uuid
from typing import Any

import numpy as np
from PIL import Image

from wavetank.foundation.errors import WavetankError
from wavetank.page.about import everything
from wavetank.page.aim import aim
from wavetank.page.fitting import fits
from wavetank.page.loop import REST, Loop, News
from wavetank.page.notebook.channel import Channel
from wavetank.page.picture import jpeg
from wavetank.page.viewers import Viewer
from wavetank.scene.scene import Scene
from wavetank.session.commands import Pause
from wavetank.session.pace import share_interpreter
from wavetank.session.session import Session
from wavetank.simulation.simulation import Simulation

BREATH = 0.002  # s between two frames, at least, in which the kernel hears what it is asked
KEPT_EVERY = 4.0  # s between two pictures that are kept in the notebook while the water moves
KEPT_WIDTH = 640  # px, at most, of the picture that is kept
WIDGET_VIEW = "application/vnd.jupyter.widget-view+json"

_shown: dict[Simulation, "Show"] = {}  # until they are stopped


class Show:
    """Water in a notebook. As the last expression of a cell it is shown; `stop` ends it, and leaves its last picture.

    `sim` is what moves: the simulation that was given, or that of the scene. What a cell does to it is seen at once.
    """

    def __init__(self, session: Session) -> None:
        self.session = session
        self._events = _running_events()
        self.channel = Channel(session.submit, self._ray, lambda: everything(session))
        self.channel.heard = self._wake
        self.channel.viewers.aim, self.channel.viewers.fit = self._aim, self._fit
        self.loop = Loop(session, self)
        self._woken = asyncio.Event()
        self._packer = concurrent.futures.ThreadPoolExecutor(1, "wavetank jpeg")
        self._packing: concurrent.futures.Future[Any] | None = None
        self._keeping: concurrent.futures.Future[Any] | None = None
        self._last: np.ndarray | None = None  # picture that was shown
        self._kept: np.ndarray | None = None  # and that was kept
        self._kept_at, self._keep_id = 0.0, f"wavetank-{uuid.uuid4().hex}"
        self._told: dict[str, Any] = {}
        self._told_world: dict[str, Any] = {}
        self._stopped = False
        share_interpreter()
        _after_each_cell(self._cell_has_run)
        self._task = self._events.create_task(self._play(), name="wavetank")

    @property
    def sim(self) -> Simulation:
        """The simulation that is shown."""
        return self.session.sim

    def play(self) -> None:
        """Let time run."""
        self.session.submit(Pause(on=False))

    def pause(self) -> None:
        """Let time stand still."""
        self.session.submit(Pause(on=True))

    def stop(self) -> None:
        """End the show; its last picture stays in the notebook, and the simulation as it is."""
        if self._stopped:
            return
        self._stopped = True
        self.loop.stop()
        self.session.drain()
        self._keep(self._png(self.loop.painter.paint(sharp=True)))
        self.channel.close()
        self._packer.shutdown(wait=False)
        _shown.pop(self.sim, None)

    def __repr__(self) -> str:
        state = "stopped" if self._stopped else "paused" if self.session.paused else "playing"
        return f"<wavetank in a notebook: {self.sim!r}, {state}>"

    # --- in a cell ---

    def _ipython_display_(self, **_: Any) -> None:
        """Show the picture that stays, and the widget below, which puts itself into the picture's place."""
        from IPython.display import publish_display_data

        picture = self._picture()
        publish_display_data(picture, transient={"display_id": self._keep_id})
        if not self._stopped:
            publish_display_data(self._widget())

    def _repr_mimebundle_(self, **_: Any) -> dict[str, Any]:
        """Return the widget and, for a reader without a kernel, the picture of now."""
        return self._picture() | ({} if self._stopped else self._widget())

    def _picture(self) -> dict[str, Any]:
        return self._bundle(self._png(self.loop.painter.paint(sharp=True)))

    def _bundle(self, png: bytes) -> dict[str, Any]:
        return {"image/png": base64.b64encode(png).decode("ascii"), "text/plain": repr(self.sim)}

    def _widget(self) -> dict[str, Any]:
        view = {"version_major": 2, "version_minor": 0, "model_id": self.channel.widget.model_id}
        return {WIDGET_VIEW: view, "text/plain": "wavetank: run this cell to play."}

    def _keep(self, png: bytes) -> None:
        """Put a picture in the place of the one that the notebook keeps."""
        from IPython.display import publish_display_data

        publish_display_data(self._bundle(png), transient={"display_id": self._keep_id}, update=True)

    # --- the task ---

    async def _play(self) -> None:
        while not self._stopped:
            self.loop.turn_or_pause()
            self._keep_sometimes()
            wait = self.session.time_to_rest(REST, asleep=not self.looks)
            self._woken.clear()
            await asyncio.sleep(BREATH)
            if wait > BREATH and not self._woken.is_set():
                with contextlib.suppress(TimeoutError):
                    await asyncio.wait_for(self._woken.wait(), wait - BREATH)

    def _wake(self) -> None:
        self._woken.set()

    def _cell_has_run(self, *_: Any) -> bool:
        """A cell may have changed the water, and no time passed for it; say whether to hear of the next one, too."""
        self.session.changes += 1
        self.session.pace.stop()
        self.session.history.forget_from(self.sim.time + 1e-6)
        self._wake()
        return not self._stopped

    def _keep_sometimes(self) -> None:
        """Keep a picture every few seconds while the water moves, and the one at which it came to stand."""
        now, image = self._events.time(), self._last
        rests = self.session.paused or not self.looks
        if image is None or image is self._kept or now - self._kept_at < (0.5 if rests else KEPT_EVERY):
            return
        if self._keeping is None or self._keeping.done():
            self._kept_at, self._kept = now, image
            self._keeping = self._packer.submit(self._pack_kept, image)

    def _pack_kept(self, image: np.ndarray) -> None:
        png = self._png(image)
        self._events.call_soon_threadsafe(lambda: None if self._stopped else self._keep(png))

    def _png(self, image: np.ndarray) -> bytes:
        """Pack a picture for the notebook: not large, and of so few colours that it is small."""
        picture = Image.fromarray(image)
        if picture.width > KEPT_WIDTH:
            picture = picture.resize(
                (KEPT_WIDTH, round(picture.height * KEPT_WIDTH / picture.width)), Image.Resampling.LANCZOS
            )
        stream = io.BytesIO()
        picture.quantize(192, Image.Quantize.MEDIANCUT).save(stream, "PNG", optimize=True)
        return stream.getvalue()

    # --- for the loop: see `loop.Audience` ---

    @property
    def looks(self) -> bool:
        """Whether someone looks."""
        return self.channel.looks

    @property
    def is_ready(self) -> bool:
        """Whether someone waits for a picture, and none is being packed."""
        packed = self._packing is None or self._packing.done()
        return self.looks and packed and self.channel.seat.next_picture is None

    @property
    def is_new(self) -> bool:
        """Whether someone has just come."""
        return self.channel.seat.is_new

    @property
    def size(self) -> tuple[int, int] | None:
        """Of the place for the picture [px]."""
        return self.channel.seat.size

    @property
    def detail(self) -> str:
        """How fine pictures are."""
        return self.channel.viewers.detail

    def show(self, image: np.ndarray, regions: list[dict[str, Any]]) -> None:
        """Send a picture."""
        self.channel.seat.is_new, self._last = False, image
        self._packing = self._packer.submit(self._pack, image)

    def _pack(self, image: np.ndarray) -> None:
        picture = jpeg(image)
        self._events.call_soon_threadsafe(self._send, picture)

    def _send(self, picture: bytes) -> None:
        if not self._stopped:
            self.channel.show(picture)

    def tell(self, news: News, notes: list[str]) -> None:
        """Send how things stand, where anything has changed."""
        told = {**news.status, "notes": notes, **news.figures}
        if news.world != self._told_world:
            self._told_world = told["world"] = news.world
        if told != self._told:
            self._told = told
            self.channel.tell({"type": "status", **told})

    def _aim(self, viewer: Viewer, tool: str, u: float, v: float, reach: float) -> None:
        viewer.post({"type": "aim", **aim(self.session, tool, u, v, reach, self.loop.painter.wanted)})

    def _fit(self, viewer: Viewer) -> None:
        viewer.post(fits(self.session))

    def _ray(self, u: float, v: float, tool: str) -> dict[str, Any]:
        width, height = self.loop.painter.wanted
        origin, direction = self.session.camera_of(tool).ray(u * width, v * height, width, height)
        return {"origin": tuple(map(float, origin)), "direction": tuple(map(float, direction))}


def show(what: Any, arch: str = "cpu") -> Show:
    """Show a simulation, a scene, its name or a `Session` in a notebook, to be played with.

    A `Simulation` is shown as the object that it is: `sim.time` is what is seen, and what a cell does to it is seen at
    once. Shown again it is the same show. Raises `WavetankError` outside of a notebook, and without its extra packages.
    """
    if isinstance(what, Simulation):
        if what not in _shown:
            _shown[what] = Show(Session.of(what))
        return _shown[what]
    if isinstance(what, Session):
        return Show(what)
    return show(Simulation(what if isinstance(what, Scene) else Scene.load(what), arch))


def _running_events() -> asyncio.AbstractEventLoop:
    """Return the event loop of the kernel; raises `WavetankError` where there is none."""
    try:
        from IPython.core.getipython import get_ipython

        shell = get_ipython()
    except ModuleNotFoundError:
        shell = None
    try:
        events = asyncio.get_running_loop()
    except RuntimeError:
        shell = None
    if shell is None or not hasattr(shell, "kernel"):
        raise WavetankError(
            "wt.show is for notebooks (Jupyter, VS Code, Colab); in a script use wt.render(sim) for a picture, in a "
            "terminal `wavetank play SCENE`."
        )
    return events


def _after_each_cell(act: Any) -> None:
    """Have `act` called after each cell until it says that it is enough."""
    from IPython.core.getipython import get_ipython

    events = get_ipython().events

    def hear(*results: Any) -> None:
        if not act(*results):
            events.unregister("post_run_cell", hear)

    events.register("post_run_cell", hear)
