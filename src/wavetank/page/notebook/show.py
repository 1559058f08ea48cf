"""`wt.show`: an interactive view of a simulation in a notebook.

The simulation runs in the kernel's own thread, as a task of its event loop, between cells: the view shows the same
object that the cells use, no lock is needed, and while a cell runs the water is paused.
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

from wavetank.device.compiler import on_compile
from wavetank.foundation.errors import WavetankError
from wavetank.page.about import hello_message
from wavetank.page.aim import aim
from wavetank.page.fitting import fits
from wavetank.page.loop import REST, Loop, Report
from wavetank.page.notebook.channel import Channel
from wavetank.page.picture import jpeg
from wavetank.page.viewers import Viewer
from wavetank.scene.scene import Scene
from wavetank.session.commands import Pause
from wavetank.session.pace import share_interpreter
from wavetank.session.session import Session
from wavetank.simulation.simulation import Simulation

YIELD_TIME = 0.002  # s between two frames, at least, for the kernel's other tasks
SAVE_EVERY = 4.0  # s between two pictures that are saved in the notebook while the water moves
SAVED_WIDTH = 640  # px, at most, of the saved picture
WIDGET_VIEW = "application/vnd.jupyter.widget-view+json"

_shown: dict[Simulation, "Show"] = {}  # until they are stopped


class Show:
    """An interactive view in a notebook, displayed as the last expression of a cell; `stop` leaves its last picture.

    `sim` is the simulation that was given, or that of the scene; changes by a cell are shown at once.
    """

    def __init__(self, session: Session) -> None:
        self.session = session
        self._events = _running_events()
        self.channel = Channel(session.submit, self._ray, lambda: hello_message(session))
        self.channel.on_message = self._wake
        self.channel.viewers.aim, self.channel.viewers.fit = self._aim, self._fit
        self.loop = Loop(session, self)
        self._woken = asyncio.Event()
        self._encoder = concurrent.futures.ThreadPoolExecutor(1, "wavetank jpeg")
        self._encoding: concurrent.futures.Future[Any] | None = None
        self._saving: concurrent.futures.Future[Any] | None = None
        self._last: np.ndarray | None = None  # shown picture
        self._saved: np.ndarray | None = None  # saved picture
        self._saved_at, self._saved_id = 0.0, f"wavetank-{uuid.uuid4().hex}"
        self._sent: dict[str, Any] = {}
        self._sent_world: dict[str, Any] = {}
        self._stopped = False
        share_interpreter()
        _after_each_cell(self._cell_has_run)
        self._task = self._events.create_task(self._play(), name="wavetank")

    @property
    def sim(self) -> Simulation:
        """The simulation that is shown."""
        return self.session.sim

    def play(self) -> None:
        """Resume."""
        self.session.submit(Pause(on=False))

    def pause(self) -> None:
        """Pause."""
        self.session.submit(Pause(on=True))

    def stop(self) -> None:
        """End the view; its last picture stays in the notebook, and the simulation as it is."""
        if self._stopped:
            return
        self._stopped = True
        self.loop.stop()
        self.session.drain()
        self._save(self._png(self.loop.painter.paint(sharp=True)))
        self.channel.close()
        self._encoder.shutdown(wait=False)
        _shown.pop(self.sim, None)

    def __repr__(self) -> str:
        state = "stopped" if self._stopped else "paused" if self.session.paused else "playing"
        return f"<wavetank in a notebook: {self.sim!r}, {state}>"

    # --- in a cell ---

    def _ipython_display_(self, **_: Any) -> None:
        """Display the saved picture, and the widget below, which hides it."""
        from IPython.display import publish_display_data

        picture = self._picture()
        publish_display_data(picture, transient={"display_id": self._saved_id})
        if not self._stopped:
            publish_display_data(self._widget())

    def _repr_mimebundle_(self, **_: Any) -> dict[str, Any]:
        """Return the widget and, for readers without a kernel, a current picture."""
        return self._picture() | ({} if self._stopped else self._widget())

    def _picture(self) -> dict[str, Any]:
        return self._bundle(self._png(self.loop.painter.paint(sharp=True)))

    def _bundle(self, png: bytes) -> dict[str, Any]:
        return {"image/png": base64.b64encode(png).decode("ascii"), "text/plain": repr(self.sim)}

    def _widget(self) -> dict[str, Any]:
        view = {"version_major": 2, "version_minor": 0, "model_id": self.channel.widget.model_id}
        return {WIDGET_VIEW: view, "text/plain": "wavetank: run this cell to play."}

    def _save(self, png: bytes) -> None:
        """Replace the picture that is saved in the notebook."""
        from IPython.display import publish_display_data

        publish_display_data(self._bundle(png), transient={"display_id": self._saved_id}, update=True)

    # --- the task ---

    async def _play(self) -> None:
        with on_compile(self.loop.report_kernel):
            while not self._stopped:
                self.loop.turn_or_pause()
                self._save_sometimes()
                wait = self.session.time_to_rest(REST, asleep=not self.has_viewers)
                self._woken.clear()
                await asyncio.sleep(YIELD_TIME)
                if wait > YIELD_TIME and not self._woken.is_set():
                    with contextlib.suppress(TimeoutError):
                        await asyncio.wait_for(self._woken.wait(), wait - YIELD_TIME)

    def _wake(self) -> None:
        self._woken.set()

    def _cell_has_run(self, *_: Any) -> bool:
        """Show what a cell has changed, without catching up its time; return whether to be called again."""
        self.session.changes += 1
        self.session.pace.stop()
        self.session.history.forget_from(self.sim.time + 1e-6)
        self._wake()
        return not self._stopped

    def _save_sometimes(self) -> None:
        """Save a picture every few seconds while the water moves, and the last one when it pauses."""
        now, image = self._events.time(), self._last
        rests = self.session.paused or not self.has_viewers
        if image is None or image is self._saved or now - self._saved_at < (0.5 if rests else SAVE_EVERY):
            return
        if self._saving is None or self._saving.done():
            self._saved_at, self._saved = now, image
            self._saving = self._encoder.submit(self._encode_saved, image)

    def _encode_saved(self, image: np.ndarray) -> None:
        png = self._png(image)
        self._events.call_soon_threadsafe(lambda: None if self._stopped else self._save(png))

    def _png(self, image: np.ndarray) -> bytes:
        """Encode a small PNG with few colours, for the notebook."""
        picture = Image.fromarray(image)
        if picture.width > SAVED_WIDTH:
            picture = picture.resize(
                (SAVED_WIDTH, round(picture.height * SAVED_WIDTH / picture.width)), Image.Resampling.LANCZOS
            )
        stream = io.BytesIO()
        picture.quantize(192, Image.Quantize.MEDIANCUT).save(stream, "PNG", optimize=True)
        return stream.getvalue()

    # --- for the loop: see `loop.Audience` ---

    @property
    def has_viewers(self) -> bool:
        """Whether there is a viewer."""
        return self.channel.has_viewers

    @property
    def wants_picture(self) -> bool:
        """Whether a viewer waits for a picture, and none is being encoded."""
        packed = self._encoding is None or self._encoding.done()
        return self.has_viewers and packed and self.channel.seat.next_picture is None

    @property
    def has_new_viewer(self) -> bool:
        """Whether a view was just opened."""
        return self.channel.seat.is_new

    @property
    def size(self) -> tuple[int, int] | None:
        """Width and height of the picture on the screen [px]."""
        return self.channel.seat.size

    @property
    def detail(self) -> str:
        """Resolution of pictures."""
        return self.channel.viewers.detail

    def show(self, image: np.ndarray, regions: list[dict[str, Any]]) -> None:
        """Send a picture."""
        self.channel.seat.is_new, self._last = False, image
        self._encoding = self._encoder.submit(self._encode, image)

    def _encode(self, image: np.ndarray) -> None:
        picture = jpeg(image)
        self._events.call_soon_threadsafe(self._send, picture)

    def _send(self, picture: bytes) -> None:
        if not self._stopped:
            self.channel.show(picture)

    def send_report(self, report: Report, notes: list[str]) -> None:
        """Send the status, where anything has changed."""
        message = {**report.status, "notes": notes, **report.figures}
        if report.world != self._sent_world:
            self._sent_world = message["world"] = report.world
        if message != self._sent:
            self._sent = message
            self.channel.send({"type": "status", **message})

    def send_progress(self, kernel: int) -> None:
        """Send the number of the kernel that is being compiled."""
        self.channel.send({"type": "compiling", "number": kernel})

    def _aim(self, viewer: Viewer, tool: str, u: float, v: float, reach: float) -> None:
        viewer.post({"type": "aim", **aim(self.session, tool, u, v, reach, self.loop.painter.wanted)})

    def _fit(self, viewer: Viewer) -> None:
        viewer.post(fits(self.session))

    def _ray(self, u: float, v: float, tool: str) -> dict[str, Any]:
        width, height = self.loop.painter.wanted
        origin, direction = self.session.camera_for(tool).ray(u * width, v * height, width, height)
        return {"origin": tuple(map(float, origin)), "direction": tuple(map(float, direction))}


def show(what: Any, arch: str = "cpu") -> Show:
    """Show a simulation, a scene, its name or a `Session` in a notebook, with tools.

    The view of a `Simulation` shows that object, and changes by cells at once; a second call returns the same view.
    Raises `WavetankError` outside of a notebook, and without its extra packages.
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
    """Have `act` called after each cell until it returns False."""
    from IPython.core.getipython import get_ipython

    events = get_ipython().events

    def hear(*results: Any) -> None:
        if not act(*results):
            events.unregister("post_run_cell", hear)

    events.register("post_run_cell", hear)
