"""Replay of a recorded session, with a video of it."""

from contextlib import ExitStack
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.progress import Progress

from wavetank.formats.mp4 import VideoWriter
from wavetank.foundation.errors import WavetankError
from wavetank.run.signals import stop_on_signal
from wavetank.session.recording import Recording, replay
from wavetank.view.choices import options
from wavetank.view.renderer import Renderer


def replay_session(
    path: Path,
    *,
    video: Path | None = None,
    fps: float = 60.0,
    size: tuple[int, int] = (1280, 720),
    arch: str = "",
    console: Console | None = None,
) -> dict[str, Any]:
    """Replay a recorded session, write a video where `video` is given, and return the result.

    The video follows the recorded camera, with one video frame for each frame of the session, so slow motion is slow.
    """
    if not 1.0 <= fps <= 240.0:
        raise WavetankError(f"--fps = {fps} is not allowed; it must be a number from 1 to 240.")
    recording = Recording.load(path)
    session = None
    say = "interrupted; completing the video (once more stops at once)" if video is not None else ""
    with stop_on_signal(say=say) as stop, ExitStack() as stack:
        film = stack.enter_context(VideoWriter(video, *size, fps)) if video is not None else None
        renderer: Renderer | None = None
        progress = stack.enter_context(Progress(console=console or Console(stderr=True), transient=True))
        task = progress.add_task("replay", total=recording.frames)
        for session in replay(recording, arch or recording.arch, str(path)):
            session.aspect = size[0] / size[1]
            if film is not None:
                renderer = renderer or Renderer(*size)
                look = options(session.view, session.color_by) | session.light
                film.write(
                    renderer.render(
                        session.sim.frame(), session.tilted_camera, shutter=session.sim.scene.frame_time, **look
                    )
                )
            progress.update(task, completed=session.ticks)
            if stop:
                break
    assert session is not None
    digest = session.sim.digest()
    return {
        "frames": session.ticks,
        "seconds_of_water": session.sim.time,
        "count": session.sim.count,
        "arch": session.sim.arch,
        "same": digest == recording.digest,
        "digest": digest,
        "interrupted": bool(stop),
        "exit_code": stop.code,
    }
