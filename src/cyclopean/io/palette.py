"""Colours of stones in files of other programs: how much friction is used, or which group a stone is of."""

from colorsys import hsv_to_rgb

from cyclopean.assembly import Assembly
from cyclopean.io.findings import Findings

__all__ = ["linear", "stone_colours"]

Colour = tuple[float, float, float]  # sRGB, 0 to 1

_STONE: Colour = (0.72, 0.70, 0.66)
_RAMP: tuple[Colour, ...] = ((0.27, 0.48, 0.66), (0.93, 0.86, 0.62), (0.75, 0.20, 0.16))  # none, half, all of it
_STEPS = 32  # colours of the ramp, so that a large model has few materials
_GOLDEN = 0.618033988749895  # steps of the hue that keep neighbours apart however many groups there are


def stone_colours(assembly: Assembly, findings: Findings) -> list[Colour]:
    """Colour each block: by utilisation where any is known, else by group; supports darker.

    Returns
    -------
    list of (red, green, blue)
        sRGB between 0 and 1, one a block.
    """
    used = {name: row["utilisation"] for name, row in findings.block.items() if "utilisation" in row}
    groups = dict.fromkeys(block.group for block in assembly.blocks if block.group is not None)
    hues = {name: hsv_to_rgb((0.08 + k * _GOLDEN) % 1.0, 0.32, 0.82) for k, name in enumerate(groups)}
    colours = []
    for block in assembly.blocks:
        if used:
            colour = _ramp(float(used[block.id])) if block.id in used else _STONE
        else:
            colour = _STONE if block.group is None else hues[block.group]
        dim = 0.75 if block.fixed else 1.0
        colours.append((colour[0] * dim, colour[1] * dim, colour[2] * dim))
    return colours


def _ramp(share: float) -> Colour:
    at = 2.0 * round(_STEPS * min(max(share, 0.0), 1.0)) / _STEPS
    k = min(int(at), 1)
    low, high = _RAMP[k], _RAMP[k + 1]
    r, g, b = (x + (y - x) * (at - k) for x, y in zip(low, high, strict=True))
    return r, g, b


def linear(colour: Colour) -> list[float]:
    """Convert sRGB to linear light, as glTF wants it (IEC 61966-2-1)."""
    return [x / 12.92 if x <= 0.04045 else ((x + 0.055) / 1.055) ** 2.4 for x in colour]
