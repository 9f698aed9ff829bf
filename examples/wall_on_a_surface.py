"""Walls on a designer's surfaces: a saddle as a NURBS face, a patch of a dome as a mesh, a wavy wall with a door.

The saddle is a face of a 3DM (left out where rhino3dm is not installed), the dome an OBJ of triangles, the wavy wall,
which bends in plan and leans to and fro, a PLY. Each is laid flat, drawn in metres, and checked.

    python examples/wall_on_a_surface.py [FOLDER]
"""

import importlib.util
import math
import sys
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import cyclopean
from cyclopean.design.walls.openings import Opening

Point = tuple[float, float, float]
Grid = tuple[list[Point], list[tuple[int, int, int]]]

ALONG, UP = 60, 36  # cells of a mesh


def grid(point: Callable[[float, float], Point]) -> Grid:
    """Points and triangles of a surface, both parameters from 0 to 1; counter-clockwise seen from the front."""
    points = [point(i / ALONG, j / UP) for j in range(UP + 1) for i in range(ALONG + 1)]
    cells = [j * (ALONG + 1) + i for j in range(UP) for i in range(ALONG)]
    below = [(k, k + 1, k + ALONG + 2) for k in cells]
    return points, below + [(k, k + ALONG + 2, k + ALONG + 1) for k in cells]


def dome(s: float, t: float) -> Point:
    """Part of a sphere of 4 m, a radian wide, from its equator up to 30 degrees."""
    east, north = s - 0.5, t * math.radians(30)
    return 4 * math.cos(north) * math.sin(east), -4 * math.cos(north) * math.cos(east), 4 * math.sin(north)


def wavy(s: float, t: float) -> Point:
    """5 m long and 2.4 m high, in an S in plan that straightens upwards."""
    x, z = 5 * s, 2.4 * t
    return x, 0.25 * math.sin(2 * math.pi * s) * (1 - 0.5 * t * t), z


def write_obj(path: Path, made: Grid) -> None:
    """As text; lengths are millimetres."""
    lines = [f"v {1000 * x:.6f} {1000 * y:.6f} {1000 * z:.6f}" for x, y, z in made[0]]
    path.write_text("\n".join([*lines, *(f"f {a + 1} {b + 1} {c + 1}" for a, b, c in made[1]), ""]))


def write_ply(path: Path, made: Grid) -> None:
    """As text; lengths are metres."""
    head = ["ply", "format ascii 1.0", f"element vertex {len(made[0])}"]
    head += [f"property double {axis}" for axis in "xyz"]
    head += [f"element face {len(made[1])}", "property list uchar int vertex_indices", "end_header"]
    rows = [f"{x!r} {y!r} {z!r}" for x, y, z in made[0]] + [f"3 {a} {b} {c}" for a, b, c in made[1]]
    path.write_text("\n".join([*head, *rows, ""]))


def write_3dm(path: Path) -> None:
    """A saddle of 4 x 4 poles over 3.6 x 2.4 m, 0.3 m deep either way."""
    import rhino3dm

    rhino: Any = rhino3dm  # its stubs leave out half of it
    saddle = rhino.NurbsSurface.Create(3, False, 4, 4, 4, 4)
    saddle.KnotsU.CreateUniformKnots(1.0)
    saddle.KnotsV.CreateUniformKnots(1.0)
    for i in range(4):
        for j in range(4):
            bulge = 0.3 * ((i - 1.5) ** 2 - (j - 1.5) ** 2) / 1.5**2
            saddle.Points[i, j] = rhino.Point4d(1.2 * i, bulge, 0.8 * j, 1.0)
    file = rhino.File3dm()
    file.Settings.ModelUnitSystem = rhino.UnitSystem.Meters
    file.Objects.AddSurface(saddle)
    file.Write(str(path), 7)


def every_joint_is_shared(wall: Any) -> bool:
    """Whether all corners of every joint are corners of both its stones; of a joint laid into a plane, nearly."""
    blocks, contacts = wall.assembly.blocks, wall.assembly.contacts
    near = wall.joints.deviation + 1e-9
    for k in range(len(contacts)):
        for number in (contacts.a[k], contacts.b[k]):
            corner = blocks[number].vertices
            far = [min(math.dist(p, q) for q in corner.tolist()) for p in contacts.polygon(k).tolist()]
            if max(far) > near:
                return False
    return True


def surfaces(folder: Path) -> list[tuple[str, dict[str, Any]]]:
    """Write the surfaces: the name of each file, and the options of the wall on it."""
    write_obj(folder / "dome.obj", grid(dome))
    write_ply(folder / "wavy.ply", grid(wavy))
    door = (Opening(2.1, 0.9, 1.7, head="arch"),)
    walls: list[tuple[str, dict[str, Any]]] = [
        ("dome.obj", {"units": "mm", "columns": 9, "rows": 5, "depth": 0.4}),
        ("wavy.ply", {"units": "m", "columns": 11, "rows": 6, "depth": 0.35, "openings": door}),
    ]
    if importlib.util.find_spec("rhino3dm") is not None:
        write_3dm(folder / "saddle.3dm")
        walls.insert(0, ("saddle.3dm", {"columns": 8, "rows": 6, "depth": 0.3}))
    return walls


def main(folder: Path) -> None:
    """Make the surfaces, lay walls on them, and check those."""
    for name, options in surfaces(folder):
        made = cyclopean.polygonal_wall(surface=folder / name, **options)
        print(made.pattern.notes[0].replace(str(folder), "").lstrip("/"))
        result = cyclopean.check(made)
        readout = made.pattern.readout
        print(f"{name}: {readout.cells} stones, {made.joints.joints} joints, coverage {readout.coverage:.9f}")
        print(f"{name}: {result.verdict}")
        assert result.verdict == "stable"
        assert abs(readout.coverage - 1.0) < 1e-9
        assert every_joint_is_shared(made)


if __name__ == "__main__":
    if len(sys.argv) == 2 and Path(sys.argv[1]).is_dir():
        main(Path(sys.argv[1]))
    else:
        with TemporaryDirectory() as place:
            main(Path(place))
