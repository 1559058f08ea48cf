"""How the window looks: colours, spacing, fonts, and the few things it draws by hand."""

import contextlib
import math
from collections.abc import Iterator, Sequence
from typing import Any

from imgui_bundle import ImVec2, ImVec4, hello_imgui, imgui, implot

from wavetank.page.theme import (
    ACCENT,
    ACCENT_BRIGHT,
    ACCENT_GROUND,
    CARD,
    GRIP,
    GROUND,
    HOVER,
    LINE,
    PANEL,
    RAISED,
    SOFT,
    TEXT,
    WARM,
    WARM_GROUND,
)
from wavetank.page.window.icons import lines

FONT = 15.0  # px at usual density

_fonts: dict[str, Any] = {}  # belong to the one context that imgui has


def rgba(color: str, alpha: float = 1.0) -> ImVec4:
    """Return a colour ``#rrggbb``."""
    red, green, blue = (int(color[k : k + 2], 16) / 255.0 for k in (1, 3, 5))
    return ImVec4(red, green, blue, alpha)


def ink(color: str, alpha: float = 1.0) -> int:
    """Return a colour ``#rrggbb`` as draw lists take it."""
    return int(imgui.color_convert_float4_to_u32(rgba(color, alpha)))


def load_fonts() -> None:
    """Load Roboto, which comes with imgui-bundle; its glyphs are made when they are needed, for any pixel density."""
    hello_imgui.load_font("fonts/Roboto/Roboto-Regular.ttf", FONT)
    _fonts["bold"] = hello_imgui.load_font("fonts/Roboto/Roboto-Bold.ttf", FONT)


@contextlib.contextmanager
def heading(size: float) -> Iterator[None]:
    """Write in bold letters of `size` [px]."""
    imgui.push_font(_fonts["bold"], size / imgui.get_style().font_scale_dpi)
    yield
    imgui.pop_font()


def set_style() -> None:
    """Set colours and spacing."""
    style, c = imgui.get_style(), imgui.Col_
    style.window_rounding = style.child_rounding = style.popup_rounding = 10.0
    style.frame_rounding = style.grab_rounding = 6.0
    style.window_border_size = style.popup_border_size = 1.0
    style.frame_border_size = style.tab_bar_border_size = style.tab_border_size = 0.0
    style.window_padding, style.frame_padding, style.item_spacing = ImVec2(12, 10), ImVec2(8, 4), ImVec2(8, 7)
    style.grab_min_size, style.scrollbar_size, style.scrollbar_rounding = 5.0, 9.0, 6.0
    for which, color, alpha in (
        (c.text, TEXT, 1),
        (c.text_disabled, SOFT, 1),
        (c.window_bg, PANEL, 1),
        (c.child_bg, PANEL, 0),
        (c.popup_bg, CARD, 0.97),
        (c.border, LINE, 1),
        (c.frame_bg, RAISED, 1),
        (c.frame_bg_hovered, HOVER, 1),
        (c.frame_bg_active, HOVER, 1),
        (c.button, RAISED, 1),
        (c.button_hovered, HOVER, 1),
        (c.button_active, ACCENT_GROUND, 1),
        (c.slider_grab, ACCENT, 0.65),
        (c.slider_grab_active, ACCENT_BRIGHT, 1),
        (c.check_mark, ACCENT, 1),
        (c.header, ACCENT_GROUND, 1),
        (c.header_hovered, HOVER, 1),
        (c.header_active, ACCENT_GROUND, 1),
        (c.tab, PANEL, 0),
        (c.tab_hovered, HOVER, 1),
        (c.tab_selected, RAISED, 1),
        (c.tab_selected_overline, ACCENT, 0),
        (c.scrollbar_bg, PANEL, 0),
        (c.scrollbar_grab, GRIP, 1),
        (c.separator, LINE, 1),
        (c.text_selected_bg, ACCENT, 0.35),
        (c.modal_window_dim_bg, GROUND, 0.6),
        (c.nav_cursor, ACCENT, 0),
    ):
        style.set_color_(which, rgba(color, alpha))
    plots, p = implot.get_style(), implot.Col_
    for part, tint, share in (
        (p.frame_bg, PANEL, 0),
        (p.plot_bg, GROUND, 0.55),
        (p.plot_border, LINE, 1),
        (p.axis_grid, SOFT, 0.14),
        (p.axis_text, SOFT, 1),
        (p.legend_bg, PANEL, 0),
        (p.legend_border, PANEL, 0),
        (p.inlay_text, SOFT, 1),
    ):
        plots.set_color_(part, rgba(tint, share))
    plots.plot_padding = ImVec2(0.9 * imgui.get_style().font_size_base, 6)  # room for half a label at either end
    plots.label_padding = ImVec2(4, 3)


def draw_icon(draw: Any, path: str, at: ImVec2, size: float, color: int, weight: float = 1.6) -> None:
    """Draw a line icon in a square of `size` px whose upper left corner is `at`."""
    for line in lines(path):
        places = [ImVec2(at.x + size / 24 * x, at.y + size / 24 * y) for x, y in line]
        draw.add_polyline(places, color, max(1.0, weight * size / 24), 0)


def draw_star(draw: Any, middle: ImVec2, radius: float, color: int) -> None:
    """Draw a filled star of five rays; the letters have none."""
    tips = []
    for k in range(10):
        far, turn = radius if k % 2 == 0 else 0.42 * radius, 0.2 * math.pi * k
        tips.append(ImVec2(middle.x + far * math.sin(turn), middle.y - far * math.cos(turn)))
    draw.add_concave_poly_filled(tips, color)


@contextlib.contextmanager
def floating(name: str, at: ImVec2, wide: float, *, padding: float = 12.0, opaque: bool = False) -> Iterator[None]:
    """Draw a card over the picture whose upper left corner is `at`, as high as what is in it."""
    imgui.set_cursor_screen_pos(at)
    imgui.push_style_color(imgui.Col_.child_bg, ink(CARD, 0.96 if opaque else 0.87))
    imgui.push_style_var(imgui.StyleVar_.window_padding, ImVec2(padding, max(10.0, 0.8 * padding)))
    flags = imgui.ChildFlags_.always_use_window_padding | imgui.ChildFlags_.auto_resize_y | imgui.ChildFlags_.borders
    imgui.begin_child(name, ImVec2(wide, 0), int(flags))
    imgui.pop_style_var()
    yield
    imgui.end_child()
    imgui.pop_style_color()


def chip(text: str, *, warm: bool = False) -> None:
    """Draw a short text on a round ground."""
    size, draw, at = imgui.calc_text_size(text), imgui.get_window_draw_list(), imgui.get_cursor_screen_pos()
    end = ImVec2(at.x + size.x + 20, at.y + size.y + 6)
    draw.add_rect_filled(at, end, ink(WARM_GROUND if warm else ACCENT_GROUND), 20.0)
    draw.add_text(ImVec2(at.x + 10, at.y + 3), ink(WARM if warm else ACCENT), text)
    imgui.dummy(ImVec2(size.x + 20, size.y + 6))


def title(text: str) -> None:
    """Write a small heading."""
    imgui.dummy(ImVec2(0, 2))
    imgui.text_colored(rgba(SOFT), text)


def pills(names: Sequence[tuple[str, str]], chosen: str) -> str | None:
    """Draw a row of choices that wraps; return the one that was clicked."""
    clicked = None
    right = imgui.get_cursor_screen_pos().x + imgui.get_content_region_avail().x
    for n, (value, text) in enumerate(names):
        wide = imgui.calc_text_size(text).x + 2 * imgui.get_style().frame_padding.x
        if n and imgui.get_item_rect_max().x + imgui.get_style().item_spacing.x + wide < right:
            imgui.same_line()
        if button(text, on=value == chosen):
            clicked = value
    return clicked


def button(text: str, *, on: bool = False, wide: float = 0.0) -> bool:
    """Draw a button, with the accent's colours where it is on."""
    imgui.push_style_color(imgui.Col_.button, rgba(ACCENT_GROUND if on else RAISED))
    imgui.push_style_color(imgui.Col_.text, rgba(ACCENT if on else TEXT))
    clicked = imgui.button(text, ImVec2(wide, 0))
    imgui.pop_style_color(2)
    return bool(clicked)


def hint(text: str) -> None:
    """Show a sentence while the pointer rests on the item before."""
    if text and imgui.is_item_hovered(imgui.HoveredFlags_.for_tooltip):
        imgui.begin_tooltip()
        imgui.push_text_wrap_pos(22 * imgui.get_font_size())
        imgui.text_unformatted(text)
        imgui.pop_text_wrap_pos()
        imgui.end_tooltip()
