"""One control for one number, choice, colour or switch: parameters and tool options look alike."""

from typing import Any

from imgui_bundle import imgui

from wavetank.page.theme import ACCENT, DYE, SOFT, TEXT, WARM
from wavetank.page.units import digits
from wavetank.page.window.desk import Desk
from wavetank.page.window.look import hint, rgba

LABEL = 0.44  # share of the width


def words(name: str) -> str:
    """Return a name in words."""
    return name[:1].upper() + name[1:].replace("_", " ")


def control(desk: Desk, about: dict[str, Any], value: Any, *, group: str = "") -> Any:
    """Draw a control from a declaration; return the value that was chosen now, or None."""
    key = f"{group}{about['name']}"
    full = imgui.get_content_region_avail().x
    default = about["default"]
    changed = isinstance(value, int | float) and default is not None and abs(value - default) > 1e-6 * abs(default)
    imgui.align_text_to_frame_padding()
    start = imgui.get_cursor_pos_x()
    waits = about.get("live") is False
    imgui.text_colored(
        rgba(WARM if waits and about["name"] in desk.pending else ACCENT if changed else TEXT), words(about["name"])
    )
    hint(about["sentence"] + (" Takes a reset." if waits else ""))
    imgui.same_line(start + LABEL * full)
    imgui.set_next_item_width(-1)
    factor, unit = desk.world["units"].get(about["unit"], (1.0, about["unit"]))
    result = _draw(f"##{key}", {**about, "factor": factor, "shown_unit": unit}, value)
    low, high = imgui.get_item_rect_min(), imgui.get_item_rect_max()
    desk.places[key] = (low.x, low.y, high.x, high.y)
    if default is not None and imgui.is_item_hovered() and imgui.is_mouse_double_clicked(0):
        return default
    hint(about["sentence"])
    return result


def _draw(label: str, about: dict[str, Any], value: Any) -> Any:
    if about["choices"]:
        choices = about["choices"]
        changed, number = imgui.combo(label, choices.index(value) if value in choices else 0, choices)
        return choices[number] if changed else None
    if about["unit"] == "color":
        return _color(label, value)
    if isinstance(value, bool):
        changed, on = imgui.checkbox(label, value)
        return on if changed else None
    return _slider(label, about, value)


def _slider(label: str, about: dict[str, Any], value: Any) -> Any:
    low = 0.0 if about["low"] is None else about["low"]
    high = about["high"] if about["high"] is not None else max(1.0, 4.0 * abs(value))
    # Where the range spans decades, a straight slider would jump over most of them.
    bent = high - low >= 100 or (low > 0 and high / low > 200)
    flags = imgui.SliderFlags_.always_clamp | (imgui.SliderFlags_.logarithmic if bent else imgui.SliderFlags_.none)
    factor, unit = about["factor"], f" {about['shown_unit']}" if about["shown_unit"] else ""
    if about.get("whole", isinstance(about["default"], int)):
        changed, number = imgui.slider_int(label, int(value), int(low), int(high), f"%d{unit}", int(flags))
        return number if changed else None
    shown = factor * float(value)
    text = f"{digits(shown)}{unit.replace('%', '%%')}"
    changed, real = imgui.slider_float(label, shown, factor * low, factor * high, text, int(flags))
    return min(high, max(low, float(f"{real / factor:.4g}"))) if changed else None


def _color(label: str, value: str) -> str | None:
    """A switch and, where it is on, a colour; an empty text is none."""
    changed, on = imgui.checkbox(label, bool(value))
    if changed:
        return DYE if on else ""
    if not value:
        imgui.same_line()
        imgui.text_colored(rgba(SOFT), "none")
        return None
    imgui.same_line()
    rgb = [int(value[k : k + 2], 16) / 255.0 for k in (1, 3, 5)]
    changed, rgb = imgui.color_edit3(
        f"{label} colour", rgb, int(imgui.ColorEditFlags_.no_inputs | imgui.ColorEditFlags_.no_label)
    )
    return "#" + "".join(f"{round(255 * part):02x}" for part in rgb) if changed else None
