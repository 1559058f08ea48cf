"""The page inside a notebook: the same server, in a frame."""

import html
import threading
from typing import Any

from wavetank.front.page.server import WebFront
from wavetank.scene.scene import Scene
from wavetank.session.session import Session


class Show:
    """A running page; its last expression in a cell shows it. `stop` ends it."""

    def __init__(self, session: Session, height: int = 640) -> None:
        self.session, self.height = session, height
        self.front = WebFront(session, port=0)
        self.front.start()
        self._thread = threading.Thread(target=self.front.run, name="wavetank", daemon=True)
        self._thread.start()

    @property
    def url(self) -> str:
        """Address of the page, token included."""
        return self.front.url

    def stop(self) -> None:
        """End the server and the simulation."""
        self.front.stop()
        self._thread.join(10.0)

    def _repr_html_(self) -> str:
        return f'<iframe src="{html.escape(self.url)}" width="100%" height="{self.height}" style="border:0"></iframe>'


def show(what: Any, arch: str = "cpu", height: int = 640) -> Show:
    """Show a scene, its name or a `Session` in a notebook, to be played with; the water moves in a thread of its own.

    A `Simulation` is taken over as it is: leave it to the page until `stop`.
    """
    if isinstance(what, Session):
        return Show(what, height)
    if hasattr(what, "snapshot"):
        session = Session(what.scene, what.arch)
        session.sim.resume(what.snapshot())
        session.sim.forces = [*what.forces]
        return Show(session, height)
    return Show(Session(what if isinstance(what, Scene) else Scene.load(what), arch), height)
