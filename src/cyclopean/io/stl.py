"""STL, ASCII and binary: a soup of triangles, in solids where the file is ASCII."""

import struct

import numpy as np

from cyclopean.arrays import Floats
from cyclopean.assembly import Assembly
from cyclopean.errors import InputError
from cyclopean.geometry import triangles
from cyclopean.geometry.frames import unit
from cyclopean.io.bodies import Body
from cyclopean.io.fields import fail
from cyclopean.io.files import decoded, one_line

__all__ = ["read_stl", "stl_text"]

_HEADER = 84  # 80 bytes of anything, then the number of triangles
_TRIANGLE = np.dtype([("normal", "<f4", 3), ("corner", "<f4", (3, 3)), ("attribute", "<u2")])


def read_stl(path: str, data: bytes) -> list[Body]:
    """Read one body for each solid of an ASCII file, one for a binary file; none of them is said to be whole.

    The normals that the file gives are not used: the order of the corners says what is outside.

    Raises
    ------
    InputError
        The file ends early or a line cannot be read.
    """
    if len(data) >= _HEADER:
        count = struct.unpack_from("<I", data, 80)[0]
        if len(data) == _HEADER + count * _TRIANGLE.itemsize or not data.lstrip()[:5].lower() == b"solid":
            return _binary(path, data, count)
    if data.lstrip()[:5].lower() == b"solid":
        return _ascii(path, decoded(path, data))
    raise InputError(
        f"{path}: is neither ASCII STL (it does not begin with 'solid') nor binary STL (shorter than 84 bytes)"
    )


def _binary(path: str, data: bytes, count: int) -> list[Body]:
    room = (len(data) - _HEADER) // _TRIANGLE.itemsize
    if count > room:
        raise InputError(
            f"{path}: binary STL that says it holds {count} triangles, but there is room for {room}; is it cut off?"
        )
    rows = np.frombuffer(data, _TRIANGLE, count, _HEADER)
    with np.errstate(invalid="ignore"):  # a signalling NaN is refused later, by name
        return [_soup(None, rows["corner"].astype(np.float64))]


def _soup(name: str | None, corner: Floats) -> Body:
    order = np.arange(3 * len(corner)).reshape(-1, 3).tolist()
    return Body(name, corner.reshape(-1, 3), [tuple(face) for face in order], whole=False)


def _ascii(path: str, content: str) -> list[Body]:
    bodies: list[Body] = []
    name: str | None = None
    corners: list[list[float]] = []
    expected = "solid"
    number = 0
    for number, line in enumerate(content.split("\n"), 1):
        words = line.split()
        if not words:
            continue
        word = words[0].lower()
        if expected == "facet" and word == "endsolid":
            bodies.append(_soup(name, np.array(corners, np.float64).reshape(-1, 3, 3)))
            expected, corners = "solid", []
        elif word != expected.partition(" ")[0]:
            fail(path, number, f"expected '{expected.partition(' ')[0]}', found '{one_line(words[0], 20)}'")
        elif word == "vertex":
            corners.append(_vertex(path, number, words))
            expected = "vertex" if len(corners) % 3 else "endloop"
        elif word == "solid":
            name, expected = line.strip()[5:].strip() or None, "facet"
        else:
            expected = {"facet": "outer", "outer": "vertex", "endloop": "endfacet", "endfacet": "facet"}[word]
    if expected != "solid":
        fail(path, number, "the file ends early: 'endsolid' is missing")
    return bodies


def _vertex(path: str, number: int, words: list[str]) -> list[float]:
    try:
        point = [float(word) for word in words[1:]]
    except ValueError:
        point = []
    if len(point) != 3 or not np.isfinite(point).all():
        fail(path, number, "a vertex needs three finite numbers, 'vertex x y z'")
    return point


def stl_text(assembly: Assembly) -> str:
    """Return the assembly as ASCII STL: one solid a block, faces as fans of triangles, every digit kept, metres.

    Binary STL has no names and merges stones that touch, so it is read but not written.
    """
    tri, face = triangles(assembly.mesh)
    corner = assembly.mesh.vertex[tri]
    normal = unit(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]))
    body = assembly.mesh.face_body[face]
    start = np.searchsorted(body, np.arange(len(assembly) + 1))
    lines: list[str] = []
    for i, block in enumerate(assembly.blocks):
        lines.append(f"solid {block.id}")
        here = slice(start[i], start[i + 1])
        for (nx, ny, nz), points in zip(normal[here].tolist(), corner[here].tolist(), strict=True):
            lines.append(f" facet normal {nx:.7g} {ny:.7g} {nz:.7g}\n  outer loop")
            lines.extend(f"   vertex {x!r} {y!r} {z!r}" for x, y, z in points)
            lines.append("  endloop\n endfacet")
        lines.append(f"endsolid {block.id}")
    return "\n".join(lines) + "\n"
