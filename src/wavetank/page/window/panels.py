"""The panel on the right: parameters, scenes, views, curves, files."""

import functools
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from imgui_bundle import ImVec2, imgui, implot

from wavetank.formats import exporter_for
from wavetank.page.theme import ACCENT, GROUND, PAINTS, SOFT, WARM
from wavetank.page.units import digits
from wavetank.page.window import keys, scenes
from wavetank.page.window.controls import control, words
from wavetank.page.window.desk import Desk
from wavetank.page.window.look import button, hint, ink, pills, rgba, title
from wavetank.session.commands import SetLight, SetView
from wavetank.session.recording import Recording

DETAILS = (("auto", "Automatic"), ("full", "Sharp"), ("half", "Fast"))
GRAVITIES = (("None", 0.0), ("Moon", 1.62), ("Earth", 9.81), ("Jupiter", 24.8))  # m/s^2
CURVES: tuple[tuple[str, str, tuple[tuple[str, str, float], ...]], ...] = (
    ("Density error [%]", "density", (("density_error_mean", "mean", 100.0), ("density_error_max", "largest", 100.0))),
    ("Energy [J]", "energy", (("kinetic_energy", "kinetic", 1.0), ("potential_energy", "potential", 1.0))),
    ("Time of a frame [ms]", "timings", (("frame_ms", "water", 1.0), ("picture_ms", "picture", 1.0))),
)
TINTS = (ACCENT, WARM)


def panel(desk: Desk) -> None:
    """Draw the tabs."""
    pages: tuple[tuple[str, Callable[[Desk], None]], ...] = (
        ("Water", _water),
        ("Scenes", scenes.browser),
        ("Look", _look),
        ("Curves", _curves),
        ("Keep", _keep),
    )
    if not imgui.begin_tab_bar("pages"):
        return
    for name, draw in pages:
        shown, _ = imgui.begin_tab_item(name)
        low, high = imgui.get_item_rect_min(), imgui.get_item_rect_max()
        desk.places[f"page.{name}"] = (low.x, low.y, high.x, high.y)
        if shown:
            at, size = imgui.get_cursor_screen_pos(), imgui.get_content_region_avail()
            desk.places["panel"] = (at.x, at.y, at.x + size.x, at.y + size.y)
            if imgui.begin_child(name):
                draw(desk)
            imgui.end_child()
            imgui.end_tab_item()
    imgui.end_tab_bar()


def _water(desk: Desk) -> None:
    """All parameters: what is live acts at once, the rest waits for a reset."""
    if desk.pending:
        imgui.push_text_wrap_pos(0.0)
        imgui.text_colored(
            rgba(WARM),
            ", ".join(
                f"{words(name)} = {digits(value) % value}" if isinstance(value, float) else f"{words(name)} = {value}"
                for name, value in desk.pending.items()
            ),
        )
        imgui.pop_text_wrap_pos()
        if button("Restart with these", on=True, wide=-1):
            keys.begin_again(desk)
        low, high = imgui.get_item_rect_min(), imgui.get_item_rect_max()
        desk.places["again"] = (low.x, low.y, high.x, high.y)
        imgui.separator()
    declared = desk.declared["parameters"]
    _gravity(desk, next(about for about in declared if about["name"] == "gravity"))
    for about in declared:
        if about["everyday"] and about["name"] != "gravity":
            _parameter(desk, about)
    imgui.dummy(ImVec2(0, 4))
    imgui.set_next_item_width(-1)
    _, desk.filter = imgui.input_text_with_hint("##filter", "All parameters: search …", desk.filter)
    for about in declared:
        if not about["everyday"] and desk.filter.lower().replace(" ", "_") in about["name"]:
            _parameter(desk, about)


def _parameter(desk: Desk, about: dict[str, Any]) -> None:
    if about["name"] == "spacing":
        # It has no range of its own: half to twice what the scene has is what one wants to try.
        now = desk.world["values"]["spacing"]
        about = {**about, "low": 0.5 * now, "high": 2.0 * now, "default": None, "whole": False}
    value = control(desk, about, desk.value(about["name"]))
    if value is not None:
        desk.set(about, value)


def _gravity(desk: Desk, about: dict[str, Any]) -> None:
    """A dial for the direction in the plane of the picture, a slider for the strength."""
    now = [float(part) for part in desk.value("gravity")]
    strength = math.hypot(*now)
    em, at = imgui.get_font_size(), imgui.get_cursor_screen_pos()
    side = 5.2 * em
    middle = ImVec2(at.x + 0.5 * side, at.y + 0.5 * side)
    imgui.invisible_button("gravity", ImVec2(side, side))
    desk.places["gravity"] = (at.x, at.y, at.x + side, at.y + side)
    hint("Gravity: drag to where down shall be")
    draw, radius = imgui.get_window_draw_list(), 0.46 * side
    draw.add_circle_filled(middle, radius, ink(GROUND), 48)
    draw.add_circle(middle, radius, ink(SOFT, 0.5), 48)
    if imgui.is_item_active():
        mouse = imgui.get_io().mouse_pos
        dx, dy = mouse.x - middle.x, middle.y - mouse.y
        far = math.hypot(dx, dy)
        if far > 4.0:
            pull = strength or 9.81
            desk.set(about, (pull * dx / far, pull * dy / far, *[0.0] * (len(now) - 2)))
    length = radius * min(1.0, 0.25 + strength / 14.0) if strength else 0.0
    tip = ImVec2(middle.x + length * now[0] / (strength or 1.0), middle.y - length * now[1] / (strength or 1.0))
    draw.add_line(middle, tip, ink(ACCENT), 2.5)
    draw.add_circle_filled(tip, 0.32 * em, ink(ACCENT), 24)
    imgui.same_line(0, em)
    imgui.begin_group()
    imgui.text("Gravity")
    imgui.set_next_item_width(-1)
    changed, wanted = imgui.slider_float("##strength", strength, 0.0, 30.0, "%.3g m/s²")
    if changed:
        way = [part / strength for part in now] if strength > 1e-6 else [0.0, -1.0, 0.0][: len(now)]
        desk.set(about, tuple(wanted * part for part in way))
    choice = pills(
        [(name, name) for name, _ in GRAVITIES[:3]], next((n for n, g in GRAVITIES if abs(g - strength) < 1e-3), "")
    )
    if choice is not None:
        desk.set(about, (0.0, -dict(GRAVITIES)[choice], 0.0)[: len(now)])
    imgui.end_group()
    imgui.separator()


def _look(desk: Desk) -> None:
    """Views and colours."""
    world, about = desk.world, desk.declared
    title("View")
    view = pills([(name, words(name)) for name in about["views"]], world["view"])
    if view:
        desk.engine.do(SetView, view=view)
    if world["view"] == "slice" and world["dim"] == 3:
        axis, place = world["cut"]
        across = pills([(name, f"across {name}") for name in "xyz"], axis)
        if across:
            desk.engine.do(SetView, axis=across)
        imgui.set_next_item_width(-1)
        changed, share = imgui.slider_float("##slice", 100.0 * place, 0.0, 100.0, "%.0f %% along it")
        if changed:
            desk.engine.do(SetView, place=min(1.0, max(0.0, share / 100.0)))
    title("Colour by")
    color = pills([*((name, words(name)) for name in about["colorings"]), *PAINTS], world["painted"])
    if color:
        desk.engine.do(SetView, color_by=color)
    _legend(world["legend"])
    if world["bodies"]:
        title("Forces on bodies")
        shown = pills([("", "Hidden"), ("shown", "Shown")], "shown" if world["forces"] else "")
        if shown is not None:
            desk.engine.do(SetView, forces=bool(shown))
    if world["dim"] == 3:
        _light(desk)
    title("Picture")
    detail = pills(DETAILS, desk.engine.detail)
    if detail:
        desk.engine.detail = detail
        desk.engine.call(lambda: setattr(desk.engine.session, "changes", desk.engine.session.changes + 1))
    width, height = desk.engine.painter.last_size
    imgui.text_colored(rgba(SOFT), f"{width} × {height} pixels in {desk.status['picture_ms']:.0f} ms")


def _light(desk: Desk) -> None:
    """Environments by name, and a sun that can be turned."""
    light, about = desk.world["light"], desk.declared
    title("Light")
    name = pills([(name, words(name)) for name in about["environments"]], light["environment"])
    if name:
        desk.engine.do(SetLight, environment=name)
    limits = about["sun"]
    for key, text, low, high in (
        ("azimuth", "Sun from %.0f°", 0.0, 360.0),
        ("elevation", "Sun at %.0f°", limits["lowest"], limits["highest"]),
    ):
        imgui.set_next_item_width(-1)
        changed, value = imgui.slider_float(f"##{key}", light[key], low, high, text)
        low_corner, high_corner = imgui.get_item_rect_min(), imgui.get_item_rect_max()
        desk.places[f"sun.{key}"] = (low_corner.x, low_corner.y, high_corner.x, high_corner.y)
        if changed:
            desk.engine.do(SetLight, **{key: min(high, max(low, value))})


def _legend(legend: dict[str, Any] | None) -> None:
    """Show what the colours mean."""
    if legend is None:
        return
    draw, at, em = imgui.get_window_draw_list(), imgui.get_cursor_screen_pos(), imgui.get_font_size()
    if "names" in legend:
        for name, color in legend["names"]:
            at = imgui.get_cursor_screen_pos()
            draw.add_rect_filled(at, ImVec2(at.x + em, at.y + em), ink(color), 3.0)
            imgui.dummy(ImVec2(1.4 * em, em))
            imgui.same_line()
            imgui.text(name)
        return
    wide, colors = imgui.get_content_region_avail().x, legend["colors"]
    for k, color in enumerate(colors):
        left = at.x + wide * k / len(colors)
        draw.add_rect_filled(ImVec2(left, at.y), ImVec2(left + wide / len(colors) + 1.0, at.y + 0.7 * em), ink(color))
    imgui.dummy(ImVec2(wide, 0.8 * em))
    low, _, high = legend["ticks"]
    imgui.text_colored(rgba(SOFT), f"{low:g} to {high:g}   {legend['title']}")


def _curves(desk: Desk) -> None:
    """Density error, energies and timings over time."""
    times = np.array(desk.curves.get("time", ()), float)
    tall = max(8.0 * imgui.get_font_size(), (imgui.get_content_region_avail().y - 10.0 * imgui.get_font_size()) / 3.0)
    for heading, key, lines in CURVES:
        title(heading)
        flags = (
            implot.Flags_.no_title | implot.Flags_.no_mouse_text | implot.Flags_.no_menus | implot.Flags_.no_box_select
        )
        if not implot.begin_plot(f"##{key}", ImVec2(-1, tall), int(flags)):
            continue
        fit = implot.AxisFlags_.auto_fit | implot.AxisFlags_.no_highlight
        implot.setup_axes(
            "", "", int(fit | implot.AxisFlags_.no_tick_marks), int(fit | implot.AxisFlags_.no_tick_marks)
        )
        implot.setup_legend(
            implot.Location_.north_east, int(implot.LegendFlags_.horizontal | implot.LegendFlags_.outside)
        )
        for (name, label, factor), tint in zip(lines, TINTS, strict=True):
            values = factor * np.array(desk.curves.get(name, ()), float)
            spec = implot.Spec()
            spec.line_color, spec.line_weight = rgba(tint), 1.6
            n = min(len(times), len(values))
            if n:
                implot.plot_line(label, times[-n:], values[-n:], spec)
        implot.end_plot()
    imgui.text_colored(rgba(SOFT), "over seconds of water")


def _keep(desk: Desk) -> None:
    """Files: the session to be replayed, the water as a scene, the picture."""
    files: tuple[tuple[str, str, str, Callable[[Desk, Path], None]], ...] = (
        ("Save this session", "session.toml", "All that was done, for `wavetank replay`.", _session),
        ("Save what is there as a scene", "scene.toml", "The water as points, and the solids.", _scene),
        ("Save this picture", "wavetank.png", "Sharp, whatever it costs.", _picture),
    )
    for text, name, sentence, write in files:
        if button(text, wide=-1):
            path = free_name(Path.cwd() / name)
            job = functools.partial(write, desk, path)
            desk.say(_written(desk.engine.call(job), path))
        low, high = imgui.get_item_rect_min(), imgui.get_item_rect_max()
        desk.places[f"keep.{name}"] = (low.x, low.y, high.x, high.y)
        imgui.text_colored(rgba(SOFT), sentence)
        imgui.dummy(ImVec2(0, 4))
    imgui.push_text_wrap_pos(0.0)
    imgui.text_disabled(f"Files go to {Path.cwd()}.")
    imgui.pop_text_wrap_pos()


def free_name(path: Path) -> Path:
    """Return the path, or one with a number where a file of that name is there: nothing is overwritten."""
    number = 1
    result = path
    while result.exists():
        number += 1
        result = path.with_name(f"{path.stem}-{number}{path.suffix}")
    return result


def _written(future: Any, path: Path) -> str:
    try:
        future.result(20.0)
    except Exception as error:  # a full disk, a folder that may not be written: said, not raised
        return f"{path.name} could not be written: {error}"
    return f"{path.name} is written."


def _session(desk: Desk, path: Path) -> None:
    Recording.of(desk.engine.session, desk.start_scene).save(path)


def _scene(desk: Desk, path: Path) -> None:
    desk.engine.session.current_scene().save(path)


def _picture(desk: Desk, path: Path) -> None:
    exporter_for(path, "picture").write(path, desk.engine.painter.paint(sharp=True), {})
