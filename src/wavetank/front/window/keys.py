"""Keys: what they do, and the list that `?` shows."""

from collections.abc import Callable

from imgui_bundle import ImVec2, imgui

from wavetank.front.window.desk import Desk
from wavetank.front.window.look import ACCENT, RAISED, SOFT, ink, rgba
from wavetank.session.commands import Bookmark, Home, Orbit, Pause, Reset, Rewind, Speed, Step, ToolStop, Zoom

SPEEDS = (1 / 16, 1 / 8, 1 / 4, 1 / 2, 1.0, 2.0)
SHOWN = (
    ("Space", "Pause, play"), (".", "One frame"), (",", "One second back"), ("R", "Start again"),
    ("[ ]", "Slower, faster"), ("M", "Bookmark"), ("H", "See all"), ("Esc", "Stop all tools"), ("Tab", "Panel"),
    ("+ −", "Closer, farther"), ("Arrows", "Turn"), ("?", "This list"),
)  # fmt: skip
POINTER = (
    ("left button", "Use the tool"), ("right button", "Turn the view"), ("right, W A S D Q E", "Fly"),
    ("middle, Shift", "Move the view"), ("wheel", "Zoom"), ("double click a slider", "Its default"),
    ("Ctrl, click a slider", "Type a value"), ("drop a TOML file", "Open the scene"),
)  # fmt: skip


def toggle(desk: Desk) -> None:
    """Pause, or let time run."""
    desk.engine.do(Pause, on=not desk.status["paused"])


def back(desk: Desk) -> None:
    """Go one second back."""
    desk.engine.do(Rewind, time=max(0.0, desk.status["time"] - 1.0))


def again(desk: Desk) -> None:
    """Begin the scene anew, with what waits for that."""
    desk.engine.do(Reset, parameters=dict(desk.pending))
    desk.pending.clear()
    desk.engine.do(Pause, on=False)


def faster(desk: Desk, steps: int) -> None:
    """Change the pace of time by steps of its list."""
    near = min(range(len(SPEEDS)), key=lambda n: abs(SPEEDS[n] - desk.status["speed"]))
    desk.engine.do(Speed, factor=SPEEDS[min(len(SPEEDS) - 1, max(0, near + steps))])


def bookmark(desk: Desk) -> None:
    """Bookmark this instant under its time."""
    desk.engine.do(Bookmark, name=f"{desk.status['time']:.2f} s")


def typed(desk: Desk) -> None:
    """Act on the keys of this frame. Signs are read as characters, because they lie elsewhere on each keyboard."""
    io, key = imgui.get_io(), imgui.Key
    if io.want_text_input:
        return
    signs: dict[str, Callable[[], None]] = {
        " ": lambda: toggle(desk), ".": lambda: desk.engine.do(Step), ",": lambda: back(desk), "r": lambda: again(desk),
        "[": lambda: faster(desk, -1), "]": lambda: faster(desk, 1), "m": lambda: bookmark(desk),
        "h": lambda: desk.engine.do(Home), "+": lambda: desk.engine.do(Zoom, factor=0.85),
        "-": lambda: desk.engine.do(Zoom, factor=1.18), "?": lambda: setattr(desk, "help", not desk.help),
    }  # fmt: skip
    if imgui.is_mouse_down(1):
        return  # letters fly
    for code in io.input_queue_characters:
        sign = chr(code).lower()
        tool = next((tool["name"] for tool in desk.rail if tool["key"] and tool["key"] == sign), None)
        if sign in signs:
            signs[sign]()
        elif tool is not None:
            desk.tool = tool
    if imgui.is_key_pressed(key.escape):
        desk.help = False
        desk.engine.do(ToolStop)
    if imgui.is_key_pressed(key.tab, False):
        desk.panel = not desk.panel
    turns = (
        (key.left_arrow, -0.12, 0.0),
        (key.right_arrow, 0.12, 0.0),
        (key.up_arrow, 0.0, 0.08),
        (key.down_arrow, 0.0, -0.08),
    )
    for which, azimuth, elevation in turns:
        if imgui.is_key_pressed(which):
            desk.engine.do(Orbit, azimuth=azimuth, elevation=elevation)


def draw_help(desk: Desk) -> None:
    """Draw the list of keys over the window; a click anywhere closes it."""
    if not desk.help:
        return
    em, io = imgui.get_font_size(), imgui.get_io()
    tools = [(tool["key"].upper(), tool["label"]) for tool in desk.rail if tool["key"]]
    imgui.set_next_window_pos(ImVec2(0.5 * io.display_size.x, 0.5 * io.display_size.y), 0, ImVec2(0.5, 0.5))
    imgui.set_next_window_focus()
    imgui.push_style_var(imgui.StyleVar_.window_padding, ImVec2(1.6 * em, 1.4 * em))
    flags = (
        imgui.WindowFlags_.no_decoration | imgui.WindowFlags_.always_auto_resize | imgui.WindowFlags_.no_saved_settings
    )
    imgui.begin("keys", None, int(flags))
    for n, (heading, rows) in enumerate((("Keys", SHOWN), ("Tools", tools), ("Pointer", POINTER))):
        if n:
            imgui.same_line(0, 2.5 * em)
        imgui.begin_group()
        imgui.text_colored(rgba(ACCENT), heading)
        imgui.dummy(ImVec2(0, 0.2 * em))
        for label, text in rows:
            _row(label, text, (5.0, 3.2, 11.0)[n] * em)
        imgui.end_group()
    imgui.end()
    imgui.pop_style_var()
    if imgui.is_mouse_clicked(0):
        desk.help = False


def _row(label: str, text: str, wide: float) -> None:
    at, size, draw = imgui.get_cursor_screen_pos(), imgui.calc_text_size(label), imgui.get_window_draw_list()
    draw.add_rect_filled(ImVec2(at.x, at.y - 2), ImVec2(at.x + size.x + 14, at.y + size.y + 3), ink(RAISED), 5.0)
    draw.add_text(ImVec2(at.x + 7, at.y), ink(SOFT), label)
    imgui.dummy(ImVec2(wide, size.y))
    imgui.same_line()
    imgui.text(text)
