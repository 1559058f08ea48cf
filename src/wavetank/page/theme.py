"""Colours of page, notebook and window; the page gets them as a style sheet."""

GROUND, PANEL, RAISED, HOVER, LINE = "#0c1115", "#131a20", "#1b242c", "#25313b", "#24303a"
CARD, NOTE, GROOVE, GRIP = "#10171d", "#0d1419", "#2a3742", "#33424e"  # over the picture; of bars and their handles
TEXT, SOFT = "#e3ebf0", "#8fa3b0"
ACCENT, ACCENT_BRIGHT, ACCENT_GROUND = "#59c8ff", "#86d8ff", "#123447"
WARM, WARM_GROUND = "#ffb866", "#3a2a14"
GOOD, GOLD, UNLIT = "#3fcf7f", "#ffd257", "#4a5a66"  # what is done; stars
BUOYANCY, DRAG, POWER = "#2f7de1", "#e0702a", "#6a4bc4"  # arrows and numbers over the picture
WANTED, MET, FORBIDDEN = "#e0930f", "#1f9d57", "#d8434e"  # regions of a level
WATER_FRONT, WATER_TOP, WATER_SIDE = "#2a92d4", "#6cc7f6", "#1d70a8"  # of the drawings of scenes
SOLID_FRONT, SOLID_TOP, SOLID_SIDE, EDGE = "#c99a73", "#e6c19f", "#a27852", "#7d93a1"
DYE = "#2f9fe8"  # offered first where a tool colours water

#: all of these by their names in style sheets, as in accent-ground
COLORS = {name.lower().replace("_", "-"): value for name, value in list(globals().items()) if name.isupper()}

#: colours of forces, by their marks
FORCES = {"buoyancy": BUOYANCY, "drag": DRAG, "power": POWER}

#: uniform colours of particles, next to those by a quantity
PAINTS = (("#3f99da", "Blue"), ("#e8eef2", "Milk"))


def style_sheet() -> str:
    """Return the colours as CSS properties, as in ``--accent``."""
    return f":root {{ {' '.join(f'--{name}: {value};' for name, value in COLORS.items())} }}\n"
