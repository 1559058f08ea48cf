"""Above and below the picture: what is going on, and time: play, step, back, the scrubber, the pace."""

from imgui_bundle import ImVec2, imgui

from wavetank.page.keys import SPEEDS, nearest_speed
from wavetank.page.theme import ACCENT, ACCENT_GROUND, HOVER, SOFT, TEXT
from wavetank.page.window import keys
from wavetank.page.window.desk import Desk
from wavetank.page.window.icons import BACK, BOOKMARK, DROP, PAUSE, PLAY, RESET, STEP
from wavetank.page.window.look import chip, draw_icon, hint, ink, rgba
from wavetank.session.commands import Bookmark, Rewind, Speed, Step

BUTTON = 2.3  # em


def header(desk: Desk, pictures_in_a_second: int) -> None:
    """Draw the line on top: the scene, particles, rates, and the truth about the pace."""
    em, status, world = imgui.get_font_size(), desk.status, desk.world
    at = imgui.get_cursor_screen_pos()
    draw_icon(imgui.get_window_draw_list(), DROP, ImVec2(at.x, at.y + 1), 1.5 * em, ink(ACCENT), 2.0)
    imgui.set_cursor_screen_pos(ImVec2(at.x + 1.9 * em, at.y + 0.25 * em))
    imgui.text("wavetank")
    imgui.same_line(0, em)
    imgui.text_colored(rgba(SOFT), world["title"] or "Scene")
    # A picture that rests is not a slow one.
    rate = "" if status["paused"] else f"{pictures_in_a_second} pictures/s     "
    text = f"{status['count']:,} particles     {rate}{world['arch']}"
    late = status["late"] and status["ticks"] > 10
    pace = "paused" if status["paused"] else f"{status['pace']:.2f} s of water a second"
    if late:
        pace = f"too slow for {status['speed']:g} × real time: {status['pace']:.2f} ×"
    free = imgui.get_window_width() - imgui.get_item_rect_max().x + imgui.get_window_pos().x - 4.0 * em
    for shorter in (f"{status['count']:,} particles", ""):
        if imgui.calc_text_size(text).x + imgui.calc_text_size(pace).x + 20 < free:
            break
        text = shorter
        pace = f"{status['pace']:.2f} ×" if late and not shorter else pace
    wide = imgui.calc_text_size(text).x + imgui.calc_text_size(pace).x + 20 + 2.2 * em
    imgui.same_line(imgui.get_window_width() - wide - 0.8 * em)
    imgui.text_colored(rgba(SOFT), text)
    imgui.same_line(0, 1.2 * em)
    imgui.set_cursor_pos_y(imgui.get_cursor_pos_y() - 3)
    chip(pace, warm=bool(late))
    if late:
        hint("The machine is too slow for this pace, so time runs slower; no step is longer than it should be.")


def icon_button(name: str, path: str, sentence: str, *, big: bool = False) -> bool:
    """Draw a round button with an icon."""
    em = imgui.get_font_size()
    side = BUTTON * em
    at = imgui.get_cursor_screen_pos()
    clicked = imgui.invisible_button(name, ImVec2(side, side))
    hovered = imgui.is_item_hovered()
    draw, middle = imgui.get_window_draw_list(), ImVec2(at.x + 0.5 * side, at.y + 0.5 * side)
    if big or hovered:
        draw.add_circle_filled(middle, 0.5 * side, ink(HOVER if hovered and not big else ACCENT_GROUND), 40)
    size = 1.35 * em
    draw_icon(draw, path, ImVec2(middle.x - 0.5 * size, middle.y - 0.5 * size), size, ink(ACCENT if big else TEXT), 1.8)
    hint(sentence)
    return bool(clicked)


def footer(desk: Desk) -> None:
    """Draw the buttons of time and the scrubber."""
    em, status, engine = imgui.get_font_size(), desk.status, desk.engine
    if icon_button("again", RESET, "Restart (R)"):
        keys.begin_again(desk)
    imgui.same_line()
    if icon_button("back", BACK, "One second back (,)"):
        keys.go_back(desk)
    imgui.same_line()
    if icon_button("play", PLAY if status["paused"] else PAUSE, "Pause, play (space)", big=True):
        keys.toggle_pause(desk)
    imgui.same_line()
    if icon_button("step", STEP, "One frame (.)"):
        engine.do(Step)
    top = imgui.get_cursor_start_pos().y
    middle = top + 0.5 * (BUTTON * em - imgui.get_frame_height())  # of what is less high than the buttons
    imgui.same_line(0, em)
    imgui.set_cursor_pos_y(middle)
    right = imgui.get_window_width() - 15.5 * em
    _scrubber(desk, right - imgui.get_cursor_pos_x())
    imgui.set_cursor_pos(ImVec2(right + em, middle))
    imgui.align_text_to_frame_padding()
    imgui.text(f"{status['time']:.2f} s")
    imgui.set_cursor_pos(ImVec2(right + 5.5 * em, top))
    if icon_button("mark", BOOKMARK, "Bookmark this moment (M)"):
        keys.set_bookmark(desk)
    imgui.set_cursor_pos(ImVec2(right + 8.5 * em, middle))
    imgui.set_next_item_width(6.0 * em)
    names = [name for _, name in SPEEDS]
    changed, number = imgui.combo("##speed", nearest_speed(status["speed"]), names)
    if changed:
        engine.do(Speed, factor=SPEEDS[number][0])
    hint("Speed of time ([ and ])")


def _scrubber(desk: Desk, wide: float) -> None:
    status = desk.status
    first, last = status["past"]
    imgui.set_next_item_width(wide)
    imgui.push_style_var(imgui.StyleVar_.grab_min_size, 14.0)
    changed, time = imgui.slider_float("##scrub", status["time"], first, max(last, first + 0.1), "", 0)
    imgui.pop_style_var()
    low, high = imgui.get_item_rect_min(), imgui.get_item_rect_max()
    if changed:
        desk.engine.do(Rewind, time=max(0.0, time))
    hint("Drag to any moment that is still remembered")
    draw, mouse = imgui.get_window_draw_list(), imgui.get_io().mouse_pos
    for name in status["bookmarks"]:
        try:
            share = (float(name.removesuffix(" s")) - first) / max(last - first, 0.1)
        except ValueError:
            continue  # a script's bookmark, which has no place here
        x = low.x + min(1.0, max(0.0, share)) * (high.x - low.x)
        near = abs(mouse.x - x) < 5 and low.y - 9 < mouse.y < low.y + 2
        draw.add_triangle_filled(
            ImVec2(x - 5, low.y - 8), ImVec2(x + 5, low.y - 8), ImVec2(x, low.y), ink(TEXT if near else ACCENT)
        )
        if near and imgui.is_mouse_clicked(0):
            desk.engine.do(Bookmark, name=name, action="go")
