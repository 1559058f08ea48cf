"""Scenes as small drawings of boxes and balls: flat for 2-D, from above the corner for 3-D."""

from typing import Any

from imgui_bundle import ImVec2, imgui

from wavetank.page import theme
from wavetank.page.theme import ACCENT, GROUND, HOVER, LINE, SOFT, TEXT
from wavetank.page.window.desk import Desk
from wavetank.page.window.hud import stars
from wavetank.page.window.look import hint, ink, title

WATER = (theme.WATER_FRONT, theme.WATER_TOP, theme.WATER_SIDE)
SOLID = (theme.SOLID_FRONT, theme.SOLID_TOP, theme.SOLID_SIDE)
EDGES = ((0, 1), (1, 5), (5, 4), (4, 0), (2, 3), (3, 7), (7, 6), (6, 2), (0, 2), (1, 3), (5, 7), (4, 6))
COLUMNS = 2


def browser(desk: Desk) -> None:
    """Draw a card for each bundled scene; a click opens it."""
    em = imgui.get_font_size()
    imgui.push_text_wrap_pos(0.0)
    imgui.text_disabled("Click to open. Or drop a scene's TOML file on the window.")
    imgui.pop_text_wrap_pos()
    gap = imgui.get_style().item_spacing.x
    wide = (imgui.get_content_region_avail().x - gap * (COLUMNS - 1)) / COLUMNS
    size = ImVec2(wide, 0.72 * wide + 2.9 * em)
    for text, is_level in (("Levels", True), ("Scenes", False)):
        title(text)
        for n, scene in enumerate(scene for scene in desk.declared["scenes"] if bool(scene["goal"]) == is_level):
            if n % COLUMNS:
                imgui.same_line()
            _card(desk, scene, size, 0.72 * wide)


def _card(desk: Desk, scene: dict[str, Any], size: ImVec2, tall: float) -> None:
    at = imgui.get_cursor_screen_pos()
    if imgui.invisible_button(f"scene {scene['name']}", size):
        desk.begin(name=scene["name"])
    low, high = imgui.get_item_rect_min(), imgui.get_item_rect_max()
    desk.places[f"scene.{scene['name']}"] = (low.x, low.y, high.x, high.y)
    hint(scene["goal"] or f"{scene['title']}: {scene['dim']}-D, about {scene['count']:,} particles")
    current = (scene["title"], scene["dim"]) == (desk.world["title"], desk.world["dim"])
    draw, em, hovered = imgui.get_window_draw_list(), imgui.get_font_size(), imgui.is_item_hovered()
    end = ImVec2(at.x + size.x, at.y + size.y)
    draw.add_rect_filled(at, end, ink(HOVER if hovered else GROUND, 0.9), 8.0)
    draw.add_rect(at, end, ink(ACCENT if current else LINE), 8.0, 1.5 if current else 1.0)
    _outline(draw, scene, at.x, at.y, size.x, tall)
    draw.push_clip_rect(at, end, True)
    draw.add_text(ImVec2(at.x + 8, at.y + tall), ink(TEXT), scene["title"])
    if scene["goal"]:
        best = desk.shown.scores.get(scene["name"], {}).get("stars", 0)
        stars(best, ImVec2(at.x + 8, at.y + tall + 1.35 * em), 0.95 * em)
    else:
        draw.add_text(
            ImVec2(at.x + 8, at.y + tall + 1.25 * em), ink(SOFT), f"{scene['dim']}-D · about {scene['count']:,}"
        )
    draw.pop_clip_rect()


def _outline(draw: Any, scene: dict[str, Any], left: float, top: float, width: float, height: float) -> None:
    flat = scene["dim"] == 2

    def project(p: Any) -> tuple[float, float]:
        return (p[0], -p[1]) if flat else (0.9 * p[0] + 0.42 * p[2], -p[1] + 0.3 * p[2] - 0.12 * p[0])

    places = [project(corner) for corner in _corners(scene)]
    low_x, high_x = min(p[0] for p in places), max(p[0] for p in places)
    low_y, high_y = min(p[1] for p in places), max(p[1] for p in places)
    scale = min(0.82 * width / (high_x - low_x), 0.78 * height / (high_y - low_y))

    def to(p: Any) -> ImVec2:
        x, y = project(p)
        return ImVec2(
            left + 0.5 * width + (x - 0.5 * (low_x + high_x)) * scale,
            top + 0.5 * height + (y - 0.5 * (low_y + high_y)) * scale,
        )

    order = sorted(scene["shapes"], key=lambda shape: shape["lower"][2] + 0.1 * shape["lower"][0])
    for shape in order:
        front, up, side = (shape["color"],) * 3 if shape.get("color") else WATER if shape["what"] == "water" else SOLID
        if shape["round"]:
            middle = [0.5 * (a + b) for a, b in zip(shape["lower"], shape["upper"], strict=True)]
            draw.add_circle_filled(to(middle), 0.5 * scale * (shape["upper"][1] - shape["lower"][1]), ink(front), 40)
            continue
        faces = [((0, 1, 3, 2), front)] if flat else [((1, 5, 7, 3), side), ((2, 3, 7, 6), up), ((4, 5, 7, 6), front)]
        corners = _corners(shape)
        for numbers, color in faces:
            draw.add_convex_poly_filled([to(corners[k]) for k in numbers], ink(color))
    corners = _corners(scene)
    for a, b in ((0, 1), (1, 3), (3, 2), (2, 0)) if flat else EDGES:
        draw.add_line(to(corners[a]), to(corners[b]), ink(theme.EDGE), 1.2)


def _corners(box: dict[str, Any]) -> list[list[float]]:
    a, b = box["lower"], box["upper"]
    return [[(b if k >> i & 1 else a)[i] for i in range(3)] for k in range(8)]
