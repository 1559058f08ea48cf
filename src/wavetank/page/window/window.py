"""The window itself: opens it, lays it out, shows the picture of the water, and keeps the beat."""

import time
from collections import deque
from pathlib import Path
from typing import Any

import glfw
import moderngl
from imgui_bundle import ImVec2, glfw_utils, hello_imgui, imgui, implot

from wavetank.page.theme import ACCENT, ACCENT_GROUND, GROUND, RAISED, SOFT
from wavetank.page.window import keys, timeline
from wavetank.page.window.desk import Desk
from wavetank.page.window.engine import Engine
from wavetank.page.window.look import draw_icon, hint, ink, load_fonts, rgba, set_style
from wavetank.page.window.panels import panel
from wavetank.page.window.plate import Plate
from wavetank.page.window.stage import Stage
from wavetank.session.session import Session

BEAT = 1.0 / 60.0  # s: between two pictures of the window
NARROW = 64.0  # em: in a narrower window the panel has no place of its own
GAP = 8.0  # px between its parts


class Window:
    """A window on one session. Everything here belongs to the thread that opened it; the water has its own."""

    def __init__(self, session: Session, size: tuple[int, int] = (1440, 900)) -> None:
        self.engine = Engine(session)
        self.desk = Desk(self.engine, session.scene)
        self.stage = Stage(self.desk)
        self.frames = 0
        self._plate: Plate | None = None
        self._shown = 0  # number of the picture on it
        self._pictures: deque[float] = deque(maxlen=120)  # when the last ones came
        self._params = self._settings(size)
        self._stopped = self._was_narrow = False

    def open(self) -> None:
        """Open the window and let the water move."""
        hello_imgui.manual_render.setup_from_runner_params(self._params)
        self._plate = Plate(moderngl.create_context())
        glfw.set_drop_callback(glfw_utils.glfw_window_hello_imgui(), self._dropped)  # type: ignore[arg-type]
        self.engine.start()

    def run(self) -> None:
        """Draw until the window is closed or `stop` is called."""
        while not self._params.app_shall_exit and not self._stopped:
            began = time.perf_counter()
            self.draw()
            # Sleeping lets the water's thread compute, which waiting for the screen inside the driver would not.
            time.sleep(max(0.001, BEAT - (time.perf_counter() - began)))

    def draw(self) -> None:
        """Draw the window once; what happened in the water's thread is raised here."""
        if self.engine.failure is not None:
            raise self.engine.failure
        hello_imgui.manual_render.render()
        self.frames += 1

    def stop(self) -> None:
        """Ask `run` to end."""
        self._stopped = True

    def close(self) -> None:
        """Stop the water and close the window."""
        self.engine.stop()
        if self._plate is not None:
            self._plate.release()
            implot.destroy_context()
            hello_imgui.manual_render.tear_down()
            self._plate = None

    def screenshot(self) -> Any:
        """Return what the window shows, uint8 [height, width, 3], from the framebuffer after `draw`."""
        import numpy as np

        width, height = glfw.get_framebuffer_size(glfw_utils.glfw_window_hello_imgui())
        assert self._plate is not None, "the window is not open"
        screen = self._plate.context.detect_framebuffer(0)
        raw = screen.read(viewport=(0, 0, width, height), components=3, alignment=1)
        return np.frombuffer(raw, np.uint8).reshape(height, width, 3)[::-1]

    def _settings(self, size: tuple[int, int]) -> Any:
        params = hello_imgui.RunnerParams()
        params.app_window_params.window_title = "wavetank"
        params.app_window_params.window_geometry.size = size
        params.app_window_params.restore_previous_geometry = False
        params.imgui_window_params.default_imgui_window_type = hello_imgui.DefaultImGuiWindowType.no_default_window
        params.imgui_window_params.background_color = rgba(GROUND)
        params.ini_disable = True
        # The picture is finished: multisampling would only blur it, and cost. Water does not idle.
        params.renderer_backend_options.open_gl_options = hello_imgui.OpenGlOptions()
        params.renderer_backend_options.open_gl_options.anti_aliasing_samples = 0
        params.fps_idling.enable_idling = False
        params.fps_idling.vsync_to_monitor = False
        params.callbacks.load_additional_fonts = load_fonts
        params.callbacks.setup_imgui_style = self._style
        params.callbacks.show_gui = self._gui
        return params

    def _style(self) -> None:
        implot.create_context()
        set_style()

    def _dropped(self, window: Any, paths: Any) -> None:
        self.desk.open(Path(paths[0]))

    # --- one picture ---

    def _gui(self) -> None:
        self.desk.pass_time()
        self.desk.places.clear()
        self._upload()
        em, room = imgui.get_font_size(), imgui.get_io().display_size
        rail, side, top, bottom = 9.0 * em, 22.5 * em if self.desk.panel else 0.0, 2.6 * em, 3.7 * em
        narrow = room.x < NARROW * em
        if narrow and not self._was_narrow:  # there the panel comes when it is asked for
            self.desk.panel, side = False, 0.0
        self._was_narrow = narrow
        wide = room.x - rail - 3 * GAP - (side + GAP if side else 0.0)
        shown = self._plate.texture if self._plate is not None else None
        texture = imgui.ImTextureRef(shown.glo) if shown is not None else None
        stage = (ImVec2(2 * GAP + rail, top), ImVec2(max(64.0, wide), max(64.0, room.y - top - bottom - 2 * GAP)))
        if self._part("header", ImVec2(GAP, 0), ImVec2(room.x - 2 * GAP, top), bare=True):
            timeline.header(self.desk, self.pictures_in_a_second())
        imgui.end()
        if self._part("tools", ImVec2(GAP, top), ImVec2(rail, room.y - top - GAP)):
            self._tools()
        imgui.end()
        self.stage.draw(texture, *stage)
        below = narrow and side > 0.0  # the panel ends above the line of time, which needs all the width
        line = ImVec2(room.x - rail - 3 * GAP if below else stage[1].x, bottom)
        if self._part("time", ImVec2(2 * GAP + rail, room.y - GAP - bottom), line):
            timeline.footer(self.desk)
        imgui.end()
        if side:
            tall = room.y - top - GAP - (bottom + GAP if below else 0.0)
            if self._part("panel", ImVec2(room.x - GAP - side, top), ImVec2(side, tall)):
                panel(self.desk)
            imgui.end()
        keys.draw_help(self.desk)
        keys.read_keys(self.desk)

    def _part(self, name: str, at: ImVec2, size: ImVec2, *, bare: bool = False) -> bool:
        self.desk.places[f"part.{name}"] = (at.x, at.y, at.x + size.x, at.y + size.y)
        imgui.set_next_window_pos(at)
        imgui.set_next_window_size(size)
        flags = imgui.WindowFlags_.no_decoration | imgui.WindowFlags_.no_move | imgui.WindowFlags_.no_saved_settings
        flags |= imgui.WindowFlags_.no_bring_to_front_on_focus | imgui.WindowFlags_.no_nav
        if bare:
            flags |= imgui.WindowFlags_.no_background
        return bool(imgui.begin(name, None, int(flags))[0])

    def _tools(self) -> None:
        """The rail of tools, two in a row."""
        em = imgui.get_font_size()
        draw, gap = imgui.get_window_draw_list(), 4.0
        wide = 0.5 * (imgui.get_content_region_avail().x - gap)
        running = self.desk.status["running"]
        rows = (len(self.desk.rail) + 1) // 2
        each = imgui.get_content_region_avail().y / rows - imgui.get_style().item_spacing.y
        named = each >= 3.2 * em  # else there is room for icons alone, whose names are told under the pointer
        tall = min(3.5 * em, each) if named else max(2.0 * em, min(3.5 * em, each))
        for n, tool in enumerate(self.desk.rail):
            if n % 2:
                imgui.same_line(0, gap)
            at = imgui.get_cursor_screen_pos()
            size = ImVec2(wide, tall)
            if imgui.invisible_button(tool["name"], size):
                self.desk.tool = tool["name"]
            end = ImVec2(at.x + size.x, at.y + size.y)
            self.desk.places[f"tool.{tool['name']}"] = (at.x, at.y, end.x, end.y)
            hint(f"{tool['label']} ({tool['key'].upper()}): {tool['sentence']}")
            on, hovered = tool["name"] == self.desk.tool, imgui.is_item_hovered()
            if on or hovered:
                draw.add_rect_filled(at, end, ink(ACCENT_GROUND if on else RAISED), 9.0)
            if tool["name"] in running:
                draw.add_rect(at, end, ink(ACCENT), 9.0)
            color = ink(ACCENT if on else SOFT)
            over = 0.45 * em if named else 0.5 * (tall - 1.4 * em)
            draw_icon(draw, tool["icon"], ImVec2(at.x + 0.5 * (wide - 1.4 * em), at.y + over), 1.4 * em, color)
            if not named:
                continue
            text = imgui.calc_text_size(tool["label"])
            draw.add_text(ImVec2(at.x + 0.5 * (wide - text.x), end.y - 1.4 * em), color, tool["label"])

    def _upload(self) -> None:
        """Bring a new picture of the water into the texture."""
        shown = self.desk.shown
        if self._plate is not None and shown.image is not None and shown.number != self._shown:
            self._shown = shown.number
            self._plate.show(shown.image)
            self._pictures.append(time.perf_counter())

    def pictures_in_a_second(self) -> int:
        """Return how many pictures of the water the last second brought; the window itself is drawn more often."""
        now = time.perf_counter()
        return sum(now - came < 1.0 for came in self._pictures)
