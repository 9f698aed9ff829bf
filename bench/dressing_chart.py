"""The chart of dressing: void of a wall and Lambda of its stones over the share that a stone may lose."""

from collections.abc import Sequence

import numpy as np

from cyclopean.arrays import Floats
from cyclopean.view.colours import FORCE, INK, SOFT
from cyclopean.view.curves import LEFT, WIDE
from cyclopean.view.svg import PAPER, grid, open_path, sheet, text

BASE, STEP = 274.0, 0.2  # foot of the chart, and the share from one line to the next


def dressing_svg(rows: Sequence[tuple[float, float, float]]) -> str:
    """Draw void and Lambda over the share of its volume that a stone may lose; nothing where there are no walls.

    Each row is a wall: share, void, Lambda. Lines go through the means of walls of one share, pale dots are walls.
    """
    if not rows:
        return ""
    share, *value = np.array(sorted(rows), float).T
    most = 1.15 * max(float(np.max(value)), STEP)
    x = LEFT + 30.0 + (WIDE - LEFT - 170.0) * share / max(float(share[-1]), 1e-300)
    levels = [(_up(level, most), f"{100.0 * level:.0f} %") for level in np.arange(0.0, most, STEP)]
    ticks = [(float(at), f"{100.0 * s:g} %") for at, s in sorted({*zip(x.tolist(), share.tolist(), strict=True)})]
    parts = [
        grid(LEFT, WIDE - LEFT - 110.0, levels, ticks, BASE + 20.0),
        text(
            (x[0] + x[-1]) / 2.0,
            BASE + 42.0,
            "share of its volume that a stone may lose",
            f'text-anchor="middle" fill="{SOFT}"',
        ),
    ]
    for of, values, colour in zip(("void of the wall", "Lambda of the stone"), value, (INK, FORCE), strict=True):
        parts += _means(of, x, values, most, colour)
    return sheet((WIDE, BASE + 56.0), "Void and Lambda by dressing", parts, letters=13.0)


def _up(value: float, most: float) -> float:
    """Drawing units, down."""
    return float(BASE - (BASE - 14.0) * value / most)


def _means(name: str, x: Floats, value: Floats, most: float, colour: str) -> list[str]:
    """A line through the means (%) of what has one place, over all of it in pale, and its name in two lines."""
    every = np.unique(x).tolist()
    mean = [float(value[x == at].mean()) for at in every]
    way = open_path(np.array([[at, _up(m, most)] for at, m in zip(every, mean, strict=True)]))
    parts = [f'<path d="{way}" fill="none" stroke="{colour}" stroke-width="2.5"/>']
    if len(every) < len(x):
        parts += [
            f'<circle cx="{at:.1f}" cy="{_up(v, most):.1f}" r="3" fill="{colour}" opacity="0.4"/>'
            for at, v in zip(x.tolist(), value.tolist(), strict=True)
        ]
    halo = f'text-anchor="middle" fill="{colour}" stroke="{PAPER}" stroke-width="3" paint-order="stroke"'
    for at, m in zip(every, mean, strict=True):
        parts.append(f'<circle cx="{at:.1f}" cy="{_up(m, most):.1f}" r="4" fill="{colour}"/>')
        parts.append(text(at, _up(float(value[x == at].max()), most) - 9.0, f"{100.0 * m:.1f}", halo))
    what, _, more = name.partition(" ")
    right, up = every[-1] + 34.0, _up(mean[-1], most)
    parts.append(text(right, up - 2.0, what, f'font-weight="600" fill="{colour}"'))
    return [*parts, text(right, up + 14.0, more, f'fill="{SOFT}"')]
