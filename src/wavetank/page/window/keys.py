"""Keys: what their actions do here, and the list that `?` shows. Which there are is in `page/keys.py`."""

from collections.abc import Callable

from imgui_bundle import ImVec2, imgui

from wavetank.page.keys import KEYS, SPEEDS, Key, nearest_speed
from wavetank.page.theme import ACCENT, RAISED, SOFT
from wavetank.page.window.desk import Desk
from wavetank.page.window.look import ink, rgba
from wavetank.session.commands import Bookmark, Pause, Reset, Rewind, SetView, Speed, command_of

LONGEST_PAUSE = 1.0  # s between two signs of a key that is held
POINTER = (
    ("left button", "Use the tool"),
    ("right button", "Turn the view"),
    ("right, W A S D Q E", "Fly"),
    ("middle, Shift", "Move the view"),
    ("wheel", "Zoom"),
    ("double click a slider", "Its default"),
    ("Ctrl, click a slider", "Type a value"),
    ("drop a TOML file, an OBJ", "Open the scene, place a solid"),
)


def toggle_pause(desk: Desk) -> None:
    """Pause, or let time run."""
    desk.engine.do(Pause, on=not desk.status["paused"])


def go_back(desk: Desk) -> None:
    """Go one second back."""
    desk.engine.do(Rewind, time=max(0.0, desk.status["time"] - 1.0))


def begin_again(desk: Desk) -> None:
    """Begin the scene anew, with what waits for that."""
    desk.engine.do(Reset, parameters=dict(desk.pending))
    desk.pending.clear()


def change_pace(desk: Desk, steps: int) -> None:
    """Change the pace of time by steps of its list."""
    place = nearest_speed(desk.status["speed"]) + steps
    desk.engine.do(Speed, factor=SPEEDS[min(len(SPEEDS) - 1, max(0, place))][0])


def set_bookmark(desk: Desk) -> None:
    """Bookmark this instant under its time."""
    desk.engine.do(Bookmark, name=f"{desk.status['time']:.2f} s")


def show_help(desk: Desk) -> None:
    """Show the list of keys, or take it away."""
    desk.help = not desk.help


def show_panel(desk: Desk) -> None:
    """Show the panel, or take it away."""
    desk.panel = not desk.panel


def toggle_forces(desk: Desk) -> None:
    """Show what the water does to bodies, or hide it."""
    desk.engine.do(SetView, forces=not desk.world["forces"])


ACTIONS: dict[str, Callable[[Desk], None]] = {
    "pause": toggle_pause,
    "back": go_back,
    "again": begin_again,
    "bookmark": set_bookmark,
    "panel": show_panel,
    "help": show_help,
    "forces": toggle_forces,
    "slower": lambda desk: change_pace(desk, -1),
    "faster": lambda desk: change_pace(desk, 1),
}
HERE = {key.key: key for key in KEYS if not key.page_only}


def press(desk: Desk, key: Key) -> None:
    """Do what a key does."""
    if key.command is not None:
        desk.engine.session.submit(command_of(key.command))
    else:
        ACTIONS[key.action](desk)


def keep_held(desk: Desk, sign: str) -> bool:
    """Keep a sign in mind, and say whether it comes from a key that is held down."""
    before, when = desk.held
    desk.held = (sign, imgui.get_time())
    return sign == before and imgui.get_time() - when < LONGEST_PAUSE


def has_moved() -> bool:
    """Say whether a key has gone down or up. Its sign may come a frame later."""
    codes = range(imgui.Key.named_key_begin, imgui.Key.gamepad_start)
    return any(imgui.is_key_pressed(imgui.Key(code), False) or imgui.is_key_released(imgui.Key(code)) for code in codes)


def read_keys(desk: Desk) -> None:
    """Act on the keys of this frame. Signs are read as characters, because they lie elsewhere on each keyboard."""
    io, name = imgui.get_io(), imgui.Key
    if io.want_text_input or imgui.is_mouse_down(1):  # letters fly while the right button is down
        return
    if desk.held[0] and has_moved():
        desk.held = ("", 0.0)
    for code in io.input_queue_characters:
        sign = chr(code).lower()
        if keep_held(desk, sign) and not (sign in HERE and HERE[sign].repeats):
            continue
        tool = next((tool["name"] for tool in desk.rail if tool["key"] and tool["key"] == sign), None)
        if sign in HERE:
            press(desk, HERE[sign])
        elif tool is not None:
            desk.tool = tool
    if imgui.is_key_pressed(name.escape):
        desk.help = False
    for key, which, repeats in (
        ("Escape", name.escape, True),
        ("ArrowLeft", name.left_arrow, True),
        ("ArrowRight", name.right_arrow, True),
        ("ArrowUp", name.up_arrow, True),
        ("ArrowDown", name.down_arrow, True),
    ):
        if imgui.is_key_pressed(which, repeats):
            press(desk, HERE[key])


def draw_help(desk: Desk) -> None:
    """Draw the list of keys over the window; a click anywhere closes it."""
    if not desk.help:
        return
    em, io = imgui.get_font_size(), imgui.get_io()
    signs = [(key.label, key.text) for key in HERE.values() if key.label]
    tools = [(tool["key"].upper(), tool["label"]) for tool in desk.rail if tool["key"]]
    imgui.set_next_window_pos(ImVec2(0.5 * io.display_size.x, 0.5 * io.display_size.y), 0, ImVec2(0.5, 0.5))
    imgui.set_next_window_focus()
    imgui.push_style_var(imgui.StyleVar_.window_padding, ImVec2(1.6 * em, 1.4 * em))
    flags = (
        imgui.WindowFlags_.no_decoration | imgui.WindowFlags_.always_auto_resize | imgui.WindowFlags_.no_saved_settings
    )
    imgui.begin("keys", None, int(flags))
    for n, (heading, rows) in enumerate((("Keys", signs), ("Tools", tools), ("Pointer", POINTER))):
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
