"""`wavetank play`: a session in a window or on a page, and its recording."""

import contextlib
import os
import re
import sys
import threading
import webbrowser
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from wavetank.foundation.errors import WavetankError
from wavetank.page.gate import is_loopback
from wavetank.page.recorder import check_folder, recorded
from wavetank.run.signals import stop_on_signal
from wavetank.scene.scene import Scene
from wavetank.session.session import Session


def play(
    scene: Scene,
    arch: str,
    *,
    window: bool = False,
    web: bool = False,
    host: str = "127.0.0.1",
    port: int | None = None,
    browser: bool = True,
    record: Path | None = None,
    most: int = 200_000,
    token: str = "",
) -> None:
    """Open a window where possible, else serve the page and print the reason; `window` or `web` force one of them.

    With a port or another host the page is served. Raises `WavetankError` where `window` is not possible.
    """
    if window and web:
        raise WavetankError("--window and --web exclude each other; give at most one of them.")
    if not web and (window or (host == "127.0.0.1" and port is None and browser)):
        reason = why_no_window()
        if reason is None:
            play_in_window(scene, arch, record=record, most=most)
            return
        if window:
            raise WavetankError(f"--window: {reason}.")
        print(f"no window: {reason}; serving the page instead", flush=True)
    play_in_browser(scene, arch, host=host, port=port, browser=browser, record=record, most=most, token=token)


def why_no_window() -> str | None:
    """Return why a window is not possible here, and how to get one; None where it is."""
    if sys.platform.startswith("linux") and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        return "there is no display (neither DISPLAY nor WAYLAND_DISPLAY is set)"
    try:
        import glfw
        import imgui_bundle  # noqa: F401
        import moderngl  # noqa: F401
        import svg.path  # noqa: F401
    except ModuleNotFoundError as error:
        return f"the package {str(error.name).replace('_', '-')} is missing (pip install 'wavetank[window]')"
    except ImportError as error:
        library = str(error).partition(":")[0]
        return f"the library {library} is missing (on Debian and Ubuntu: apt-get install libgl1 libegl1 libx11-6)"
    glfw.ERROR_REPORTING = "ignore"
    try:
        if not glfw.init():
            return f"the display cannot be opened ({_reason(glfw)})"
        glfw.window_hint(glfw.VISIBLE, glfw.FALSE)
        glfw.window_hint(glfw.CONTEXT_VERSION_MAJOR, 3)
        glfw.window_hint(glfw.CONTEXT_VERSION_MINOR, 3)
        trial = glfw.create_window(16, 16, "wavetank", None, None)
        if not trial:
            return f"there is no OpenGL 3.3 (on Debian and Ubuntu: apt-get install libgl1-mesa-dri; {_reason(glfw)})"
        glfw.destroy_window(trial)
    finally:
        glfw.terminate()
    return None


def _reason(glfw: Any) -> str:
    text = glfw.get_error()[1]
    return (text.decode(errors="replace") if isinstance(text, bytes) else str(text)).rstrip(".")


def play_in_window(scene: Scene, arch: str, *, record: Path | None = None, most: int = 200_000) -> None:
    """Play in a window until it is closed."""
    from wavetank.page.window.window import Window

    check_folder(record)
    window = Window(Session(scene, arch, most_particles=most))
    with _stopped_by_signal(window.stop), recorded(record, window.engine.session, scene, window.engine.loop.call):
        try:
            window.open()
            window.run()
        finally:
            window.close()


def play_in_browser(
    scene: Scene,
    arch: str,
    *,
    host: str = "127.0.0.1",
    port: int | None = None,
    browser: bool = True,
    record: Path | None = None,
    most: int = 200_000,
    token: str = "",
) -> None:
    """Serve the page until Ctrl-C, and print its address with `token`, by default a random one."""
    from wavetank.page.server import PORT, PageServer

    check_folder(record)
    session = Session(scene, arch, most_particles=most)
    server = PageServer(session, host, port, _checked_token(token))
    with _stopped_by_signal(server.stop):
        server.start()
        where = "" if is_loopback(host) else " (anyone with this link can take control; not encrypted)"
        if port is None and server.port != PORT:
            print(f"port {PORT} is in use; using {server.port} (--port chooses another)", flush=True)
        print(f"wavetank plays at {server.url}{where} (Ctrl-C stops it)", flush=True)
        if browser:
            threading.Thread(target=webbrowser.open, args=(server.url,), daemon=True).start()
        with recorded(record, session, scene, server.call):
            try:
                server.run()
            finally:
                server.stop()


def _checked_token(token: str) -> str | None:
    if token and not re.fullmatch(r"[A-Za-z0-9_-]{12,200}", token):
        raise WavetankError(
            "--token must be 12 to 200 letters, digits, - or _, as `openssl rand -hex 16` makes them: anyone who "
            "knows it can take control; without it a random one is used."
        )
    return token or None


@contextlib.contextmanager
def _stopped_by_signal(stop: Callable[[], None]) -> Iterator[None]:
    """Call `stop` at a signal to end; a second one ends at once, except for the recording."""
    with stop_on_signal(lambda: threading.Thread(target=stop, daemon=True).start()):
        yield
