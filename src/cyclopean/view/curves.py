"""Shares that change together, as lines: Lambda and what stays empty, over the rounds of a match."""

from collections.abc import Mapping, Sequence

import numpy as np

from cyclopean.view.colours import FORCE, GHOST, INK
from cyclopean.view.svg import open_path, sheet, text

WIDE, HIGH, LEFT, FOOT = 700.0, 260.0, 60.0, 40.0  # of the sheet, and what its axes take


def curves_svg(title: str, across: Sequence[float], ticks: Sequence[str], curves: Mapping[str, Sequence[float]]) -> str:
    """Draw up to two lines over common places; nothing where there are none.

    Parameters
    ----------
    title : str
        For readers that do not see it.
    across : sequence of float
        Where the values stand, in ascending order, in any unit.
    ticks : sequence of str
        What is written below each of them.
    curves : mapping of str to sequence of float
        Values of each line, at least 0; the first is coloured.
    """
    if not len(across):
        return ""
    place, value = np.asarray(across, float), np.array(list(curves.values()), float)
    x = LEFT + (WIDE - LEFT - 110.0) * (place - place[0]) / max(float(np.ptp(place)), 1e-300)
    y = HIGH - FOOT - (HIGH - FOOT - 14.0) * value / max(float(value.max()) * 1.15, 1e-3)
    parts = [f'<path d="M{LEFT} {HIGH - FOOT}H{WIDE - 100}" stroke="{GHOST}"/>']
    for label, values, up, colour in zip(curves, value, y, (FORCE, INK), strict=False):
        parts.append(f'<path d="{open_path(np.stack([x, up], -1))}" fill="none" stroke="{colour}" stroke-width="2.5"/>')
        for a, b, v in zip(x, up, values, strict=True):
            parts.append(f'<circle cx="{a:.1f}" cy="{b:.1f}" r="4" fill="{colour}"/>')
            parts.append(text(a, b - 8.0, f"{v:.3f}", f'text-anchor="middle" fill="{colour}"'))
        parts.append(text(x[-1] + 34.0, up[-1] + 5.0, label, f'fill="{colour}"'))
    parts += [text(a, HIGH - FOOT + 22.0, tick, 'text-anchor="middle"') for a, tick in zip(x, ticks, strict=True)]
    return sheet((WIDE, HIGH), title, parts, letters=14.0, white=False)
