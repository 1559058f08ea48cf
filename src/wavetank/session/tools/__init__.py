"""Tools: one file each, listed here in the order of their buttons."""

from wavetank.session.tools.blow import Blow
from wavetank.session.tools.cut import Cut
from wavetank.session.tools.drain import Drain
from wavetank.session.tools.drop import Drop
from wavetank.session.tools.dye import Dye
from wavetank.session.tools.explode import Explode
from wavetank.session.tools.freeze import Freeze
from wavetank.session.tools.grab import Grab
from wavetank.session.tools.hand import Hand
from wavetank.session.tools.magnet import Magnet
from wavetank.session.tools.paddle import Paddle
from wavetank.session.tools.place import Place
from wavetank.session.tools.pour import Pour
from wavetank.session.tools.push import Push
from wavetank.session.tools.remove import Remove
from wavetank.session.tools.shake import Shake
from wavetank.session.tools.shove import Shove
from wavetank.session.tools.stir import Stir
from wavetank.session.tools.tilt import Tilt
from wavetank.session.tools.tool import Tool, describe
from wavetank.session.tools.waves import Waves

TOOLS: tuple[type[Tool], ...] = (
    Push,
    Stir,
    Magnet,
    Pour,
    Drain,
    Blow,
    Explode,
    Freeze,
    Dye,
    Cut,
    Grab,
    Shove,
    Drop,
    Place,
    Remove,
    Paddle,
    Waves,
    Tilt,
    Shake,
)
TOOL_NAMES: dict[str, type[Tool]] = {tool.name: tool for tool in TOOLS}

__all__ = ["TOOLS", "TOOL_NAMES", "Hand", "Tool", "describe"]
