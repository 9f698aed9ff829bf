"""A contact sheet of stones as SVG: each seen on its largest face, all at one scale, with id, volume and class.

>>> from cyclopean.design.stones.quarry import quarry
>>> stone_sheet_svg(quarry(3, detail=1)).count("<g transform")
3
"""

from collections.abc import Sequence
from html import escape

import numpy as np

from cyclopean.design.stones.inventory import CLASSES, shape_of
from cyclopean.design.stones.stone import Stone, in_body_frame
from cyclopean.errors import InputError
from cyclopean.view.figures import number
from cyclopean.view.stone_faces import stone_faces, stone_svg
from cyclopean.view.svg import WIDTH, round_length, scale_bar, sheet, text

MARGIN, GAP = 16.0, 14.0  # drawing units
LABEL, LINE = 11.5, 14.0  # size of the letters of a label, and height of its lines
HEAD = 34.0  # height above the stones: how many, and the scale
BAR = 220.0  # that the scale may be long
TINTS = dict(zip(CLASSES, ("#d8cdb9", "#bfc8c9", "#d9bfa3", "#c9cdb2"), strict=True))
LETTER = 0.58 * LABEL  # width


def stone_sheet_svg(stones: Sequence[Stone], columns: int = 8, most: int = 48) -> str:
    """Draw stones of one inventory side by side, as one static `<svg>` element that loads nothing.

    There are so many `columns`; of more than `most` stones, as many are taken at equal steps through the order given.

    Raises
    ------
    InputError
        There are no stones, or no columns or stones are asked for.
    """
    if not stones:
        raise InputError("contact sheet: there are no stones to draw")
    if columns < 1 or most < 1:
        raise InputError(f"contact sheet: {columns} columns, {most} stones; ask for at least 1 of each")
    steps = np.linspace(0, len(stones) - 1, min(most, len(stones))).round()  # the first and the last among them
    shown = [stones[k] for k in np.unique(steps.astype(np.int64))]
    columns = min(columns, len(shown))
    bodies = [in_body_frame(stone) for stone in shown]
    extent = np.array([np.ptp(body[:, :2], axis=0) for body in bodies]).max(axis=0)  # m
    pitch = (WIDTH - 2.0 * MARGIN) / columns
    scale = float(min((pitch - GAP) / extent[0], 2.0 * pitch / extent[1]))  # units a metre
    high = float(extent[1]) * scale
    row = high + 2.0 * LINE + GAP
    room = min(pitch, BAR)
    bar = WIDTH - MARGIN - 5.0 * LABEL - round_length(room / scale)[0] * scale
    parts = [
        _heading(len(stones), len(shown), sum(stone.volume for stone in stones)),
        scale_bar(bar, MARGIN + 8.0, scale, room),
    ]
    for k, (stone, body) in enumerate(zip(shown, bodies, strict=True)):
        x, y = MARGIN + (k % columns + 0.5) * pitch, MARGIN + HEAD + (k // columns) * row
        middle = np.append((body[:, :2].min(axis=0) + body[:, :2].max(axis=0)) / 2.0, 0.0)
        faces = stone_faces((body - middle) * [scale, -scale, scale], stone.triangles, stone.id)
        parts.append(stone_svg(stone.id, *faces, TINTS[shape_of(stone).aspect], (x, y + high / 2.0)))
        parts.append(_label(stone, x, y + high + LINE, pitch))
    height = 2.0 * MARGIN + HEAD + row * -(-len(shown) // columns)
    return sheet((WIDTH, height), f"Contact sheet of {len(shown)} stones", parts, letters=LABEL)


def _label(stone: Stone, x: float, y: float, pitch: float) -> str:
    """Id, volume and class below a stone."""
    letters = max(int((pitch - GAP / 2.0) / LETTER), 2)
    name = stone.id if len(stone.id) <= letters else stone.id[: letters - 1] + "\u2026"
    about = f'<tspan x="{x:.1f}" dy="{LINE}">{_volume(stone.volume)}, {shape_of(stone).aspect}</tspan>'
    return text(x, y, f'<tspan font-weight="600">{escape(name)}</tspan>{about}', 'text-anchor="middle"')


def _volume(volume: float) -> str:
    """Volume (m3) in the unit that is read most easily."""
    return f"{number(volume)} m\u00b3" if volume >= 1.0 else f"{number(1000.0 * volume)} L"


def _heading(count: int, shown: int, volume: float) -> str:
    which = f"{count:,} stone{'' if count == 1 else 's'}" + ("" if shown == count else f", {shown} of them drawn")
    rest = f"<tspan>; {_volume(volume)} in all, seen on the largest face</tspan>"
    return text(MARGIN, MARGIN + 12.0, f'<tspan font-weight="600">{which}</tspan>{rest}', 'font-size="15"')
