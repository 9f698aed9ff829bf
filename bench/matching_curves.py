"""Curves of Lambda against the total gap, and of J against Lambda with two of the walls, as plain SVG."""

import re
from dataclasses import dataclass

from cyclopean.design.matching.tradeoff import Tradeoff
from cyclopean.view.tradeoff_page import alternative_svg, tradeoff_svg

__all__ = ["Panel", "svg", "walls_svg"]

WIDTH, HEIGHT = 420.0, 360.0  # of a panel
LEFT, RIGHT, TOP, FOOT = 58.0, 14.0, 40.0, 96.0  # about its axes
INK, FAINT = "#333", "#ddd"
COLOURS = ("#b35806", "#e08214", "#5e8ab4", "#1a4a7a")


@dataclass(frozen=True)
class Panel:
    """Points (gap, Lambda) of several methods; one that has a single point is drawn as a mark."""

    title: str
    series: dict[str, list[tuple[float, float]]]


def svg(panels: list[Panel]) -> str:
    """Panels side by side, on the same scales, with one legend below."""
    every = [point for panel in panels for points in panel.series.values() for point in points]
    most = tuple(0.1 * (int(10.0 * max(p[k] for p in every)) + 1) for k in range(2))
    names = list(panels[0].series)
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH * len(panels):g} {HEIGHT:g}"'
        f' font-family="sans-serif" font-size="12" fill="{INK}">',
        "<title>Lambda against the total gap</title>",
        '<rect width="100%" height="100%" fill="white"/>',
    ]
    for k, panel in enumerate(panels):
        parts += [
            f'<g transform="translate({k * WIDTH:g} 0)">',
            *_axes(panel.title, most),
            *_curves(panel, most),
            "</g>",
        ]
    for k, name in enumerate(names):
        x = LEFT + k * (WIDTH * len(panels) - LEFT) / len(names)
        parts.append(_mark(x, HEIGHT - 20.0, COLOURS[k]))
        parts.append(f'<text x="{x + 12:g}" y="{HEIGHT - 16:g}">{name}</text>')
    return "\n".join([*parts, "</svg>"]) + "\n"


def _place(point: tuple[float, float], most: tuple[float, float]) -> tuple[float, float]:
    across, up = WIDTH - LEFT - RIGHT, HEIGHT - TOP - FOOT
    return LEFT + across * point[0] / most[0], TOP + up * (1.0 - point[1] / most[1])


def _axes(title: str, most: tuple[float, float]) -> list[str]:
    """Grid lines at every tenth, with numbers, and what they mean."""
    x0, y0 = _place((0.0, 0.0), most)
    x1, y1 = _place(most, most)
    parts = [f'<text x="{(x0 + x1) / 2:g}" y="22" text-anchor="middle" font-weight="bold">{title}</text>']
    for k in range(round(10 * most[0]) + 1):
        x, _ = _place((k / 10, 0.0), most)
        parts.append(f'<path d="M{x:.1f} {y0:.1f}V{y1:.1f}" stroke="{FAINT}"/>')
        parts.append(f'<text x="{x:.1f}" y="{y0 + 16:.1f}" text-anchor="middle">{k / 10:g}</text>')
    for k in range(round(10 * most[1]) + 1):
        _, y = _place((0.0, k / 10), most)
        parts.append(f'<path d="M{x0:.1f} {y:.1f}H{x1:.1f}" stroke="{FAINT}"/>')
        parts.append(f'<text x="{x0 - 8:.1f}" y="{y + 4:.1f}" text-anchor="end">{k / 10:g}</text>')
    middle = (y0 + y1) / 2
    parts.append(f'<path d="M{x0:.1f} {y1:.1f}V{y0:.1f}H{x1:.1f}" fill="none" stroke="{INK}"/>')
    parts.append(f'<text x="{(x0 + x1) / 2:g}" y="{y0 + 36:.1f}" text-anchor="middle">total gap: void / wall</text>')
    parts.append(
        f'<text x="18" y="{middle:.1f}" text-anchor="middle" transform="rotate(-90 18 {middle:.1f})">'
        "Lambda: carved / stone</text>"
    )
    return parts


def _curves(panel: Panel, most: tuple[float, float]) -> list[str]:
    parts = []
    for colour, points in zip(COLOURS, panel.series.values(), strict=True):
        placed = [_place(point, most) for point in points]
        if len(placed) > 1:
            path = "L".join(f"{x:.1f} {y:.1f}" for x, y in placed)
            parts.append(f'<path d="M{path}" fill="none" stroke="{colour}" stroke-width="2"/>')
        parts += [_mark(x, y, colour) for x, y in placed]
    return parts


def _mark(x: float, y: float, colour: str) -> str:
    return f'<circle cx="{x:.1f}" cy="{y:.1f}" r="3.5" fill="{colour}"/>'


def walls_svg(found: Tradeoff) -> str:
    """The curve of a trade-off; below it, of the walls that none beats, the least carved and the best interlocked."""
    ends = dict.fromkeys((found.non_dominated[0], found.non_dominated[-1]))
    drawn = [tradeoff_svg(found), *(alternative_svg(found.alternatives[k], f"wall {k + 1}") for k in ends)]
    wide, parts, left, down = 1000.0, [], 0.0, 0.0
    for k, one in enumerate(drawn):
        across, high = map(float, re.search(r'viewBox="0 0 (\d+) (\d+)"', one).groups())
        width = wide if k == 0 else wide / 2.0
        place = f'x="{left:g}" y="{down:g}" width="{width:g}" height="{high * width / across:g}"'
        parts.append(one.replace("<svg ", f"<svg {place} ", 1))
        left, down = (0.0, down + high * width / across + 30.0) if k == 0 else (left + width, down)
        high *= width / across
    names = [f'<text x="{24 + 500 * k}" y="{down - 8:g}">wall {k_ + 1}</text>' for k, k_ in enumerate(ends)]
    head = f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {wide:g} {down + high:g}" font-family="sans-serif">'
    return "\n".join([head, '<rect width="100%" height="100%" fill="white"/>', *parts, *names, "</svg>"]) + "\n"
