"""The reference of parameters, written from their declarations.

python -m wavetank.lab.reference > docs/parameters.md
"""

from wavetank.foundation.params import PARAMETERS, PRESETS, QUALITIES


def parameters_page() -> str:
    """Return the page in Markdown."""
    lines = [
        "# Parameters",
        "",
        "Keys of a scene file, options of `wavetank run --set NAME=VALUE`, and attributes of `Scene` and, where live,",
        "of a running `Simulation`. Written from `src/wavetank/foundation/params.py`; do not edit.",
        "",
        "| name | symbol | default | range | unit | live | meaning |",
        "|---|---|---|---|---|---|---|",
    ]
    for p in PARAMETERS:
        default = (
            "required"
            if p.default is None
            else f"`{p.default:g}`"
            if isinstance(p.default, float)
            else f"`{p.default}`"
        )
        low_high = "" if p.low is None else f"{p.low:g} to {p.high:g}"
        symbol = f"`{p.symbol}`" if p.symbol else ""
        live = "yes" if p.live else "reset"
        lines.append(f"| `{p.name}` | {symbol} | {default} | {low_high} | {p.unit} | {live} | {p.sentence} |")
    for key, title, choices in (("preset", "Presets", PRESETS), ("quality", "Qualities", QUALITIES)):
        lines += ["", f"## {title}", ""]
        for name, values in choices.items():
            settings = ", ".join(
                f"`{k} = {v:.4g}`" if isinstance(v, float) else f"`{k} = {v}`" for k, v in values.items()
            )
            lines.append(f'- `{key} = "{name}"`: {settings or "the defaults above"}.')
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    print(parameters_page(), end="")
