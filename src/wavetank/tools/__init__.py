"""Tools: one file each, listed here in the order of their buttons."""

from wavetank.tools.blow import Blow
from wavetank.tools.cut import Cut
from wavetank.tools.drain import Drain
from wavetank.tools.dye import Dye
from wavetank.tools.explode import Explode
from wavetank.tools.freeze import Freeze
from wavetank.tools.grab import Grab
from wavetank.tools.hand import Hand
from wavetank.tools.magnet import Magnet
from wavetank.tools.paddle import Paddle
from wavetank.tools.place import Place
from wavetank.tools.pour import Pour
from wavetank.tools.push import Push
from wavetank.tools.remove import Remove
from wavetank.tools.shake import Shake
from wavetank.tools.stir import Stir
from wavetank.tools.tilt import Tilt
from wavetank.tools.tool import Tool, describe
from wavetank.tools.waves import Waves

TOOLS: tuple[type[Tool], ...] = (
    Push, Stir, Magnet, Pour, Drain, Blow, Explode, Freeze, Dye, Cut, Grab, Place, Remove, Paddle, Waves, Tilt, Shake,
)  # fmt: skip
TOOL_NAMES: dict[str, type[Tool]] = {tool.name: tool for tool in TOOLS}

__all__ = ["TOOLS", "TOOL_NAMES", "Hand", "Tool", "describe"]
