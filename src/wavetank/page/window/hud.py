"""A level: what is asked and how it stands, its regions over the picture, and what became of it."""

import itertools
from typing import Any

from imgui_bundle import ImVec2, imgui

from wavetank.page.theme import FORBIDDEN, FORCES, GOLD, GOOD, MET, RAISED, SOFT, TEXT, UNLIT, WANTED, WARM
from wavetank.page.window import keys
from wavetank.page.window.desk import Desk
from wavetank.page.window.look import button, draw_star, floating, heading, ink, rgba

EDGES = ((0, 1), (1, 3), (3, 2), (2, 0), (4, 5), (5, 7), (7, 6), (6, 4), (0, 4), (1, 5), (2, 6), (3, 7))
WIDE, MARGIN = 21.0, 12.0  # em, px: of the card
HURRY = 5.0  # s before the end

Box = tuple[float, float, float, float]  # x, y, width, height [px]


def draw_game(desk: Desk, box: Box) -> None:
    """Draw the mouths of emitters and drains, and what there is of a game, over the picture."""
    _mouths(desk, box)
    _forces(desk, box)
    game = desk.game
    if game is None:
        return
    _regions(desk, game, box)
    _card(desk, game, box)
    if game["outcome"]:
        _banner(desk, game, box)


def stars(count: int, at: ImVec2, size: float) -> None:
    """Draw three stars, `count` of them lit."""
    draw = imgui.get_window_draw_list()
    for k in range(3):
        middle = ImVec2(at.x + (1.15 * k + 0.5) * size, at.y + 0.5 * size)
        draw_star(draw, middle, 0.5 * size, ink(GOLD if k < count else UNLIT))


def _regions(desk: Desk, game: dict[str, Any], box: Box) -> None:
    """Outline the regions as they lie in the picture, each with what is asked of it."""
    draw, em, (x, y, width, height) = imgui.get_window_draw_list(), imgui.get_font_size(), box
    draw.push_clip_rect(ImVec2(x, y), ImVec2(x + width, y + height), True)
    for k, (aim, region) in enumerate(zip(game["aims"], desk.shown.regions, strict=False)):
        outline = [ImVec2(x + u * width, y + v * height) for u, v in region["outline"]]
        corners = [ImVec2(x + u * width, y + v * height) for u, v in region["corners"]]
        if not corners:
            continue
        met = aim["progress"] >= 1.0 and not aim["forbids"]
        color = FORBIDDEN if aim["forbids"] else MET if met else WANTED
        draw.add_convex_poly_filled([*outline], ink(color, 0.16 if met else 0.09))
        for a, b in EDGES:
            if max(a, b) < len(corners):
                _line(draw, corners[a], corners[b], ink(color), dashed=not met)
        xs, low = [place.x for place in outline], max(place.y for place in outline)
        desk.places[f"region.{k}"] = (min(xs), min(place.y for place in outline), max(xs), low)
        size = imgui.calc_text_size(aim["label"])
        left = 0.5 * (min(xs) + max(xs) - size.x)
        bottom = min(low, y + height) - 8.0
        low_corner = ImVec2(left + size.x + 10, bottom)
        draw.add_rect_filled(ImVec2(left - 10, bottom - size.y - 6), low_corner, ink(color), 20.0)
        with heading(em):
            draw.add_text(ImVec2(left - 2, bottom - size.y - 3), ink("#ffffff"), aim["label"])
    draw.pop_clip_rect()


def _mouths(desk: Desk, box: Box) -> None:
    """Outline where water comes from and where it goes; drains are dashed."""
    draw, (x, y, width, height) = imgui.get_window_draw_list(), box
    draw.push_clip_rect(ImVec2(x, y), ImVec2(x + width, y + height), True)
    for region in desk.shown.regions:
        points = [ImVec2(x + u * width, y + v * height) for u, v in region["outline"]]
        dashed = region.get("mark") == "drain"
        for number, (a, b) in enumerate(
            itertools.pairwise(points) if "mark" in region and "label" not in region else ()
        ):
            if not (dashed and number % 2):
                draw.add_line(a, b, ink(TEXT, 0.7), 1.5)
    draw.pop_clip_rect()


def _forces(desk: Desk, box: Box) -> None:
    """Draw what the water does to bodies as arrows with their numbers, and the power of joints as numbers."""
    draw, em, (x, y, width, height) = imgui.get_window_draw_list(), imgui.get_font_size(), box
    draw.push_clip_rect(ImVec2(x, y), ImVec2(x + width, y + height), True)
    numbers = []
    for region in desk.shown.regions:
        if "label" not in region:
            continue
        points = [ImVec2(x + u * width, y + v * height) for u, v in region["outline"]]
        end = points[-1]
        if len(points) > 1:
            _arrow(draw, points[0], end, ink(FORCES[region["mark"]]), em)
        size = imgui.calc_text_size(region["label"])
        left, top = end.x + 0.6 * em, end.y - 0.5 * size.y - 2
        numbers.append((region, (left, top, left + size.x + 10, top + size.y + 4)))
    numbers.sort(key=lambda number: number[1][1])
    for (region, _), place in zip(numbers, parted([place for _, place in numbers]), strict=True):
        draw.add_rect_filled(ImVec2(*place[:2]), ImVec2(*place[2:]), ink(FORCES[region["mark"]], 0.9), 5.0)
        draw.add_text(ImVec2(place[0] + 5, place[1] + 2), ink("#ffffff"), region["label"])
        desk.places[f"force.{region['mark']}"] = place
    draw.pop_clip_rect()


def parted(boxes: list[Box], gap: float = 2.0) -> list[Box]:
    """Return boxes (left, top, right, bottom) [px], which come from above to below, each moved below those it met."""
    placed: list[Box] = []
    for left, top, right, bottom in boxes:
        high = bottom - top
        for other in sorted(placed, key=lambda box: box[1]):
            beside = left >= other[2] + gap or other[0] >= right + gap
            if not beside and top < other[3] + gap and other[1] < top + high + gap:
                top = other[3] + gap
        placed.append((left, top, right, top + high))
    return placed


def _arrow(draw: Any, start: ImVec2, end: ImVec2, color: int, em: float) -> None:
    dx, dy = end.x - start.x, end.y - start.y
    length = (dx * dx + dy * dy) ** 0.5
    if length < 2.0:
        return
    ux, uy, head = dx / length, dy / length, min(0.7 * em, length)
    back = ImVec2(end.x - head * ux, end.y - head * uy)
    draw.add_line(start, back, color, 3.0)
    side = 0.45 * head
    draw.add_triangle_filled(
        end, ImVec2(back.x - side * uy, back.y + side * ux), ImVec2(back.x + side * uy, back.y - side * ux), color
    )


def _line(draw: Any, a: ImVec2, b: ImVec2, color: int, *, dashed: bool) -> None:
    dx, dy = b.x - a.x, b.y - a.y
    pieces = max(1, round((dx * dx + dy * dy) ** 0.5 / 12.0)) if dashed else 1
    for n in range(pieces):
        s, t = n / pieces, (n + (0.6 if dashed else 1.0)) / pieces
        draw.add_line(ImVec2(a.x + s * dx, a.y + s * dy), ImVec2(a.x + t * dx, a.y + t * dy), color, 2.0)


def _card(desk: Desk, game: dict[str, Any], box: Box) -> None:
    """Level, what is left of tool and time, the stars that a win now is worth, the goal, how much is done."""
    em, (x, y, width, _) = imgui.get_font_size(), box
    wide = min(WIDE * em, width - 2 * MARGIN)
    with floating("goal", ImVec2(x + width - wide - MARGIN, y + MARGIN), wide):
        at, right = imgui.get_cursor_screen_pos(), imgui.get_content_region_avail().x
        imgui.dummy(ImVec2(0, 1.4 * em))
        draw, middle = imgui.get_window_draw_list(), at.y + 0.2 * em
        draw.add_text(ImVec2(at.x, middle), ink(SOFT), game["heading"])
        left = max(0.0, game["seconds"] - game["elapsed"])
        short = left < HURRY and not game["outcome"] and not game["endured"]
        with heading(1.25 * em):
            clock = f"{left:.1f} s"
            size = imgui.calc_text_size(clock)
            draw.add_text(ImVec2(at.x + right - size.x, at.y), ink(WARM if short else TEXT), clock)
        stars(game["stars"], ImVec2(at.x + right - 8.2 * em, middle), em)
        if game["strokes"] is not None:
            strokes = f"{game['strokes']} left"
            far = imgui.calc_text_size(strokes).x + 9.2 * em
            draw.add_text(ImVec2(at.x + right - far, middle), ink(SOFT), strokes)
        imgui.push_text_wrap_pos(0.0)
        imgui.text_unformatted(game["text"].replace(" %", "\u00a0%"))
        imgui.pop_text_wrap_pos()
        if desk.status["waits"]:
            imgui.text_colored(rgba(WARM), "Time starts with your first touch.")
        at = imgui.get_cursor_screen_pos()
        draw.add_rect_filled(at, ImVec2(at.x + right, at.y + 7), ink(RAISED), 7.0)
        done = max(7.0, game["progress"] * right)
        draw.add_rect_filled(at, ImVec2(at.x + done, at.y + 7), ink(GOOD if game["progress"] >= 1.0 else WARM), 7.0)
        imgui.dummy(ImVec2(right, 7))
    low, high = imgui.get_item_rect_min(), imgui.get_item_rect_max()
    desk.places["card.goal"] = (low.x, low.y, high.x, high.y)


def _banner(desk: Desk, game: dict[str, Any], box: Box) -> None:
    """Won or lost: how, and where to go from here."""
    em, (x, y, width, height) = imgui.get_font_size(), box
    won, wide = game["outcome"] == "won", min(25.0 * em, width - 2 * MARGIN)
    at = ImVec2(x + 0.5 * (width - wide), y + 0.46 * height - 0.5 * desk.banner_height)
    with floating("banner", at, wide, padding=1.5 * em, opaque=True):
        full = imgui.get_content_region_avail().x
        with heading(1.8 * em):
            _centred(game["headline"], full, GOOD if won else WARM)
        if won:
            place = imgui.get_cursor_screen_pos()
            size = 2.4 * em
            stars(game["stars"], ImVec2(place.x + 0.5 * full - 1.65 * size, place.y + 0.2 * em), size)
            imgui.dummy(ImVec2(full, size + 0.6 * em))
        _centred(game["verdict"], full, SOFT)
        imgui.dummy(ImVec2(0, 0.4 * em))
        buttons = [("retry", "Play again" if won else "Try again")] + [("next", "Next level")] * bool(game["next"])
        each = 8.0 * em
        start = imgui.get_cursor_pos_x() + 0.5 * (full - each * len(buttons) - 0.6 * em * (len(buttons) - 1))
        for n, (name, text) in enumerate(buttons):
            imgui.same_line(start + n * (each + 0.6 * em))
            # What comes next in the game stands out: another try after a loss, the next level after a win.
            if button(text, on=name == ("next" if won and game["next"] else "retry"), wide=each):
                keys.begin_again(desk) if name == "retry" else desk.begin(name=game["next"])
            low, high = imgui.get_item_rect_min(), imgui.get_item_rect_max()
            desk.places[name] = (low.x, low.y, high.x, high.y)
    desk.banner_height = imgui.get_item_rect_size().y


def _centred(text: str, full: float, color: str) -> None:
    """Write lines that are as long as there is room, each in the middle."""
    line = ""
    lines = []
    for word in text.split():
        if line and imgui.calc_text_size(f"{line} {word}").x > full:
            lines.append(line)
            line = word
        else:
            line = f"{line} {word}".strip()
    for row in [*lines, line]:
        imgui.set_cursor_pos_x(imgui.get_cursor_pos_x() + 0.5 * (full - imgui.calc_text_size(row).x))
        imgui.text_colored(rgba(color), row)
