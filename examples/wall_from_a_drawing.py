"""A wall with an arched door, drawn by hand: the joints as lines, as DXF and as SVG; its stones and its verdict.

The joints are typed as somebody would draw them, to the nearest millimetre, so that hardly one ends exactly on another.
Beds run from jamb to jamb, some stones hook into each other, the ring of the arch is drawn with arcs, and the ground
rises to the right. In the DXF (left out where ezdxf is not installed) the outline of the door is on the layer `opening`
and the ground on the layer `ground`; in the SVG they are groups of these names.

    python examples/wall_from_a_drawing.py [FOLDER]
"""

import importlib.util
import math
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import cyclopean

Way = list[tuple[int, int]]

GROUND: Way = [(-200, 0), (2300, 0), (2500, 80), (3400, 80)]
EDGE: Way = [(0, 0), (0, 2000), (3200, 2000), (3200, 80)]
LEFT, RIGHT, SPRING = 1000, 1900, 900  # of the door (mm)
CENTRE, INNER, OUTER, VOUSSOIRS = (1450, 900), 450, 650, 9
BEDS: list[Way] = [
    [(0, 320), (240, 320), (240, 260), (390, 260), (740, 330), (1000, 300)],
    [(0, 610), (330, 590), (620, 640), (1000, 600)],
    [(0, 920), (420, 880), (800, 900), (1000, 900)],
    [(0, 1230), (400, 1190), (700, 1240), (887, 1225)],
    [(0, 1540), (420, 1570), (880, 1530), (1032, 1398)],
    [(1900, 290), (2250, 330), (2620, 300), (2620, 370), (2850, 370), (3200, 350)],
    [(1900, 600), (2400, 640), (2900, 600), (3200, 640)],
    [(1900, 900), (2100, 900), (2500, 930), (3200, 900)],
    [(2013, 1225), (2350, 1260), (2800, 1220), (3200, 1250)],
    [(1868, 1398), (2200, 1540), (2650, 1570), (3200, 1530)],
]
HEADS: list[Way] = [
    [(430, 0), (390, 260)], [(760, 0), (740, 330)],
    [(310, 260), (330, 590)], [(660, 314), (620, 640)],
    [(180, 599), (230, 899)], [(480, 615), (520, 885)],
    [(310, 891), (380, 1192)],
    [(180, 1212), (220, 1556)], [(620, 1227), (640, 1551)],
    [(330, 1563), (300, 2000)], [(760, 1541), (800, 2000)], [(1228, 1511), (1200, 2000)],
    [(1672, 1511), (1720, 2000)], [(2000, 1454), (2040, 2000)], [(2450, 1557), (2420, 2000)],
    [(2900, 1552), (2850, 2000)],
    [(2210, 0), (2250, 330)], [(2700, 80), (2700, 370)],
    [(2080, 311), (2100, 616)], [(2480, 311), (2450, 636)], [(2950, 364), (2900, 600)],
    [(2260, 629), (2300, 915)], [(2700, 616), (2680, 922)],
    [(2500, 930), (2560, 1241)], [(2950, 911), (2980, 1234)],
    [(2250, 1250), (2280, 1545)], [(2700, 1229), (2760, 1562)],
]  # fmt: skip


def radial_joints() -> list[Way]:
    """Between the voussoirs, to the nearest millimetre."""
    found = []
    for k in range(1, VOUSSOIRS):
        turn = math.pi * k / VOUSSOIRS
        way = math.cos(turn), math.sin(turn)
        found.append([(round(CENTRE[0] + r * way[0]), round(CENTRE[1] + r * way[1])) for r in (INNER, OUTER)])
    return found


def write_dxf(path: Path) -> None:
    """Lines, polylines with bulges and an arc on three layers, in millimetres."""
    import ezdxf

    drawing = ezdxf.new("R2010", units=4)
    for layer in ("joints", "opening", "ground"):
        drawing.layers.add(layer)
    space = drawing.modelspace()
    for way in (EDGE, *BEDS, *HEADS, *radial_joints()):
        space.add_lwpolyline(way, dxfattribs={"layer": "joints"})
    space.add_arc(CENTRE, OUTER, 0, 180, dxfattribs={"layer": "joints"})
    door = [(LEFT, 0, 0), (RIGHT, 0, 0), (RIGHT, SPRING, 1), (LEFT, SPRING, 0)]  # x, y, bulge: 1 is half a circle
    space.add_lwpolyline(door, format="xyb", close=True, dxfattribs={"layer": "opening"})
    space.add_lwpolyline(GROUND, dxfattribs={"layer": "ground"})
    drawing.saveas(path)


def write_svg(path: Path) -> None:
    """The same as paths in three groups; a unit is a millimetre, and the sheet runs down."""

    def way(points: Way) -> str:
        return f'<path d="M {" L ".join(f"{x},{-y}" for x, y in points)}"/>'

    (x, y), r = CENTRE, OUTER
    joints = "\n".join(map(way, [EDGE, *BEDS, *HEADS, *radial_joints()]))
    ring = f'<path d="M {x + r},{-y} A {r},{r} 0 0 0 {x - r},{-y}"/>'
    arch = f"A {INNER},{INNER} 0 0 0 {LEFT},{-SPRING}"
    door = f'<path d="M {LEFT},0 H {RIGHT} V {-SPRING} {arch} Z"/>'
    path.write_text(
        '<svg xmlns="http://www.w3.org/2000/svg" width="3700mm" height="2200mm" viewBox="-250 -2050 3700 2200" '
        'fill="none" stroke="black" stroke-width="4">\n'
        f'<g id="joints">\n{joints}\n{ring}\n</g>\n'
        f'<g id="opening">{door}</g>\n<g id="ground">{way(GROUND)}</g>\n</svg>\n'
    )


def main(folder: Path) -> None:
    """Draw, read, lay and check."""
    names = ["door.svg"]
    write_svg(folder / "door.svg")
    if importlib.util.find_spec("ezdxf") is not None:
        write_dxf(folder / "door.dxf")
        names.append("door.dxf")
    for name in names:
        made = cyclopean.polygonal_wall(drawing=folder / name, depth=0.4)
        pattern = made.pattern
        print("\n".join(line.replace(str(folder), "").lstrip("/") for line in pattern.notes))
        print(f"{name}: {pattern.readout.cells} stones, {made.joints.joints} joints")
        result = cyclopean.check(made)
        print(f"{name}: {result.verdict}")
        assert (pattern.readout.cells, result.verdict) == (47, "stable")
        # the wall less the ground that rises and half a round-headed door
        assert abs(pattern.subdivision.areas().sum() - (3.2 * 2.0 - 0.064 - 0.81 - math.pi * 0.45**2 / 2)) < 0.005


if __name__ == "__main__":
    if len(sys.argv) == 2 and Path(sys.argv[1]).is_dir():
        main(Path(sys.argv[1]))
    else:
        with TemporaryDirectory() as place:
            main(Path(place))
