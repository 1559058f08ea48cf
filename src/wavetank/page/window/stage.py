"""The picture, and hands on it: the tool with the left button, the camera with the others, the wheel and keys."""

import math
from typing import Any

import numpy as np
from imgui_bundle import ImVec2, imgui

from wavetank.page.aim import aim
from wavetank.page.theme import ACCENT, GROUND, LINE, NOTE, SOFT, TEXT
from wavetank.page.window.controls import control, words
from wavetank.page.window.desk import Desk
from wavetank.page.window.hud import WIDE, draw_game
from wavetank.page.window.look import button, floating, heading, hint, ink
from wavetank.session.commands import Orbit, Pan, ToolBegin, ToolEnd, ToolMove, Zoom

TURN = 3.2  # rad for a drag over the height of the picture
RINGS = (("drop", "#ffffff", 1.4), ("foot", "#ffffff", 1.4), ("ring", GROUND, 4.0), ("ring", "#ffffff", 1.6))
BETWEEN, SELDOM = 0.05, 0.6  # s between two questions where a hand would act, while it moves and while it rests
FLIGHT = 0.8  # heights in view a second


class Stage:
    """Remembers what the pointer is doing."""

    def __init__(self, desk: Desk) -> None:
        self.desk = desk
        self.mode = ""  # tool, orbit or pan while a button is down
        self.button = 0
        self.box = (0.0, 0.0, 1.0, 1.0)  # x, y, width, height of the picture [px]
        self._sent: tuple[float, float] | None = None
        self._asked: Any = None  # a question where the hand would act
        self._asked_at = 0.0  # s
        self._question: tuple[Any, ...] = ("",)
        self._aim: dict[str, Any] = {}  # the last answer

    def draw(self, texture: Any, at: ImVec2, size: ImVec2) -> None:
        """Draw the picture in a window of its own and turn what happens on it into commands."""
        imgui.set_next_window_pos(at)
        imgui.set_next_window_size(size)
        imgui.push_style_var(imgui.StyleVar_.window_padding, ImVec2(0, 0))
        flags = imgui.WindowFlags_.no_decoration | imgui.WindowFlags_.no_move | imgui.WindowFlags_.no_saved_settings
        imgui.begin("stage", None, int(flags | imgui.WindowFlags_.no_bring_to_front_on_focus))
        imgui.pop_style_var()
        self.box = (at.x, at.y, size.x, size.y)
        self.desk.places["part.stage"] = (at.x, at.y, at.x + size.x, at.y + size.y)
        pixels = imgui.get_io().display_framebuffer_scale
        self.desk.engine.size = (max(32, round(size.x * pixels.x)), max(32, round(size.y * pixels.y)))
        imgui.set_next_item_allow_overlap()
        imgui.invisible_button("picture", size, int(imgui.ButtonFlags_.mouse_button_left))
        draw, end = imgui.get_window_draw_list(), ImVec2(at.x + size.x, at.y + size.y)
        if texture is not None:
            draw.add_image_rounded(texture, at, end, ImVec2(0, 0), ImVec2(1, 1), ink("#ffffff"), 10.0)
        else:
            text = "The water is being prepared …"
            wide = imgui.calc_text_size(text)
            draw.add_text(ImVec2(at.x + 0.5 * (size.x - wide.x), at.y + 0.5 * size.y), ink(SOFT), text)
        draw.add_rect(at, end, ink(LINE), 10.0)
        hovered = imgui.is_item_hovered(imgui.HoveredFlags_.allow_when_blocked_by_active_item)
        self._pointer(hovered)
        if hovered and not self.mode:
            self._wheel()
        self._ring(hovered)
        self._card(at)
        draw_game(self.desk, self.box)
        self._running(ImVec2(at.x + 12, end.y - 2.6 * imgui.get_font_size()))
        self._notes(at, size)
        imgui.end()

    # --- pointer ---

    def _share(self) -> tuple[float, float]:
        mouse, (x, y, width, height) = imgui.get_io().mouse_pos, self.box
        return (mouse.x - x) / width, (mouse.y - y) / height

    def ray(self, u: float, v: float) -> dict[str, Any]:
        """Return the ray through a place of the picture, given as shares of width and height."""
        _, _, width, height = self.box
        camera = self.desk.engine.session.camera_for(self.desk.tool)
        origin, direction = camera.ray(u * width, v * height, width, height)  # type: ignore[arg-type]
        return {"origin": tuple(map(float, origin)), "direction": tuple(map(float, direction))}

    def _pointer(self, hovered: bool) -> None:
        io = imgui.get_io()
        if not self.mode and hovered:
            for number in (0, 1, 2):
                if imgui.is_mouse_clicked(number):
                    self._press(number, io.key_shift)
                    break
        elif self.mode and not imgui.is_mouse_down(self.button):
            self.release()
        elif self.mode:
            self._drag(io.mouse_delta.x, io.mouse_delta.y)
            if self.button == 1:
                self._fly(io.delta_time)

    def _press(self, number: int, shift: bool) -> None:
        looks = self.desk.tool == "look"
        self.button = number
        self.mode = "pan" if number == 2 or shift else "orbit" if number == 1 or looks else "tool"
        if self.mode == "tool":
            self._sent = self._share()
            self.desk.engine.do(
                ToolBegin, tool=self.desk.tool, options=dict(self.desk.options), **self.ray(*self._sent)
            )

    def _drag(self, dx: float, dy: float) -> None:
        engine, height = self.desk.engine, self.box[3]
        if self.mode == "tool":
            if self._share() != self._sent:
                self._sent = self._share()
                engine.do(ToolMove, **self.ray(*self._sent))
        elif not (dx or dy):
            return
        elif self.mode == "pan" or self.desk.world["dim"] == 2:
            engine.do(Pan, right=-dx / height, up=dy / height)
        else:
            engine.do(Orbit, azimuth=-TURN * dx / height, elevation=TURN * dy / height)

    def release(self) -> None:
        """Lift what is held; also when the window loses the focus, or no one would."""
        if self.mode == "tool":
            self.desk.engine.do(ToolEnd)
        self.mode = ""

    def _wheel(self) -> None:
        turned = imgui.get_io().mouse_wheel
        if turned:
            u, v = self._share()
            self.desk.engine.do(Zoom, factor=min(1.6, max(0.6, math.exp(-0.12 * turned))), x=u, y=v)

    def _fly(self, seconds: float) -> None:
        """Move eye and target together with W A S D Q E; a flat world has no way in."""
        keys = imgui.Key
        down = [imgui.is_key_down(key) for key in (keys.d, keys.a, keys.e, keys.q, keys.w, keys.s)]
        way = np.array([down[0] - down[1], down[2] - down[3], down[4] - down[5]], float)
        if not way.any():
            return
        right, up, ahead = (float(part) * FLIGHT * seconds for part in way)
        flat = self.desk.world["dim"] == 2
        self.desk.engine.do(Pan, right=right, up=up + ahead if flat else up, ahead=0.0 if flat else ahead)

    # --- over the picture ---

    def _ring(self, hovered: bool) -> None:
        """Show where and how far the tool reaches: on the surface that the pointer meets, with a line to the floor."""
        hand, options = self.desk.hand, self.desk.options | self.desk.fixed
        shows = (hovered or self.mode == "tool") and self.mode not in ("orbit", "pan") and hand["name"] != "look"
        declared = {about["name"]: about["default"] for about in hand["options"]} | options
        reach = declared.get("radius", 0.5 * declared.get("width", 0.1)) if hand["cursor"] else 0.0
        self._ask(hand["name"] if shows else "", reach)
        if not shows:
            return
        (x, y, width, height), draw = self.box, imgui.get_window_draw_list()
        draw.push_clip_rect(ImVec2(x, y), ImVec2(x + width, y + height), True)
        for part, color, wide in RINGS:
            points: list[Any] = [ImVec2(x + u * width, y + v * height) for u, v in self._aim.get(part, ())]
            if points:
                draw.add_polyline(points, ink(color, 0.75), wide, 0)
        draw.pop_clip_rect()

    def _ask(self, tool: str, reach: float) -> None:
        """Ask where the hand would act, one question at a time."""
        asked = self._asked
        if asked is not None and not asked.done():
            return
        if asked is not None and asked.exception() is None:
            self._aim = asked.result()
        self._asked = None
        question = (tool, self._share() if tool else (0.0, 0.0), reach, self.desk.status["ticks"])
        now = imgui.get_time()
        moved = question[:3] != self._question[:3]
        rests = now - self._asked_at < (BETWEEN if moved else SELDOM)
        if question != self._question and (tool or self._question[0]) and not (rests and tool):
            self._asked_at = now
            (u, v), engine, size = question[1], self.desk.engine, self.desk.engine.painter.wanted
            self._asked = engine.call(lambda: aim(engine.session, tool, u, v, reach, size))
            self._question = question

    def _card(self, at: ImVec2) -> None:
        """The tool in hand and its options."""
        em, hand = imgui.get_font_size(), self.desk.hand
        room = self.box[2] - (12.0 + 12.0 + (WIDE * em + 12.0 if self.desk.game else 0.0))
        wide = min(17.5 * em, max(room, 7.0 * em))
        if wide < 14.0 * em or self.box[3] < 24.0 * em:  # no room for sliders: the tool's name
            with floating("card", ImVec2(at.x + 12, at.y + self.box[3] - 4.2 * em), 7.0 * em), heading(em):
                imgui.text(hand["label"])
                hint(hand["sentence"])
            self._place("card.tool")
            return
        with floating("card", ImVec2(at.x + 12, at.y + 12), wide):
            with heading(em):
                imgui.text(hand["label"])
            imgui.push_text_wrap_pos(0.0)
            imgui.text_disabled(hand["sentence"])
            imgui.pop_text_wrap_pos()
            for about in hand["options"]:
                value = self.desk.options.get(about["name"], about["default"])
                chosen = control(self.desk, about, value, group=f"{hand['name']}.")
                if chosen is not None:
                    self.desk.options[about["name"]] = chosen
        self._place("card.tool")

    def _place(self, name: str) -> None:
        low, high = imgui.get_item_rect_min(), imgui.get_item_rect_max()
        self.desk.places[name] = (low.x, low.y, high.x, high.y)

    def _running(self, at: ImVec2) -> None:
        """Buttons that stop what goes on by itself."""
        from wavetank.session.commands import ToolStop

        for n, name in enumerate(self.desk.status["running"]):
            if n:
                imgui.same_line()
            else:
                imgui.set_cursor_screen_pos(at)
            if button(f"Stop {words(name).lower()}##running", on=True):
                self.desk.engine.do(ToolStop, tool=name)

    def _notes(self, at: ImVec2, size: ImVec2) -> None:
        draw, em, bottom = imgui.get_foreground_draw_list(), imgui.get_font_size(), at.y + size.y - 14
        for text, _ in reversed(self.desk.notes):
            wide = imgui.calc_text_size(text, wrap_width=min(560.0, 0.9 * size.x))
            left, top = at.x + 0.5 * (size.x - wide.x), bottom - wide.y - em
            draw.add_rect_filled(ImVec2(left - em, top), ImVec2(left + wide.x + em, bottom), ink(NOTE, 0.94), 10.0)
            draw.add_rect(ImVec2(left - em, top), ImVec2(left + wide.x + em, bottom), ink(ACCENT, 0.25), 10.0)
            draw.add_text(imgui.get_font(), em, ImVec2(left, top + 0.5 * em), ink(TEXT), text, min(560.0, 0.9 * size.x))
            bottom = top - 6
