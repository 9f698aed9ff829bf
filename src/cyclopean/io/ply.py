"""PLY, ASCII and binary of either byte order: polygons, and a face property `block` that tells the stones apart."""

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from cyclopean.arrays import Floats, Ints
from cyclopean.assembly import Assembly
from cyclopean.errors import InputError
from cyclopean.io.bodies import Body, part_of
from cyclopean.io.fields import face_fault
from cyclopean.io.files import one_line

__all__ = ["ply_bytes", "read_ply"]

_TYPES = {
    **dict.fromkeys(("char", "int8"), "i1"),
    **dict.fromkeys(("uchar", "uint8"), "u1"),
    **dict.fromkeys(("short", "int16"), "i2"),
    **dict.fromkeys(("ushort", "uint16"), "u2"),
    **dict.fromkeys(("int", "int32"), "i4"),
    **dict.fromkeys(("uint", "uint32"), "u4"),
    **dict.fromkeys(("float", "float32"), "f4"),
    **dict.fromkeys(("double", "float64"), "f8"),
}
_ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
_NAME = "block "  # our comment: "comment block 3 keystone"


@dataclass(frozen=True, slots=True)
class _Property:
    name: str
    type: str
    count: str = ""  # type of the length, for a list


@dataclass(slots=True)
class _Element:
    name: str
    count: int
    properties: list[_Property]


_Header = tuple[str, list[_Element], dict[int, str], int]  # order of bytes, elements, names of blocks, where data begin


def read_ply(path: str, data: bytes) -> list[Body]:
    """Read one body for each value of the face property `block`, or one that is not said to be whole.

    Raises
    ------
    InputError
        The header cannot be read, or the data end early.
    """
    header = _header(path, data)
    columns = (_binary if header[0] else _ascii)(path, data, header)
    vertex, face = columns.get("vertex", {}), columns.get("face", {})
    if not {"x", "y", "z"} <= vertex.keys():
        raise InputError(f"{path}: PLY without an element 'vertex' that has x, y and z")
    corners = face.get("vertex_indices", face.get("vertex_index"))
    if not isinstance(corners, list):
        raise InputError(f"{path}: PLY without faces (a list 'vertex_indices'); a point cloud makes no blocks")
    points = np.stack([_column(vertex[axis]) for axis in "xyz"], 1)
    faces = [tuple(int(i) for i in row) for row in corners]
    block = face.get("block")
    if block is None or isinstance(block, list) or not (np.abs(block) < 2**31).all():
        return [Body(None, points, faces, whole=False)]
    return _by_block(path, points, faces, block.astype(np.int64), header[2])


def _column(values: Any) -> Floats:
    with np.errstate(invalid="ignore"):  # a signalling NaN is refused later, by name
        return np.asarray(values, np.float64)


def _by_block(
    path: str, points: Floats, faces: list[tuple[int, ...]], block: Ints, names: dict[int, str]
) -> list[Body]:
    parts: dict[int, list[tuple[int, ...]]] = {}
    for number, face in zip(block.tolist(), faces, strict=True):
        if fault := face_fault(face, len(points)):
            raise InputError(f"{path}: a face of block {number} {fault}")
        parts.setdefault(number, []).append(face)
    return [part_of(names.get(number), points, part) for number, part in parts.items()]


def _header(path: str, data: bytes) -> _Header:
    order: str | None = None
    elements: list[_Element] = []
    names: dict[int, str] = {}
    for number, (line, end) in enumerate(_header_lines(data), 1):
        words = line.split()
        try:
            match words:
                case ["ply"] if number == 1:
                    pass
                case _ if number == 1:
                    raise InputError(f"{path}: is not a PLY file: its first line is not 'ply'")
                case ["format", kind, _] if kind in _ORDERS:
                    order = _ORDERS[kind]
                case ["comment", "block", which, *_] if which.isdecimal():
                    names[int(which)] = line.partition(f"block {which}")[2].removeprefix(" ")  # an id may end in blanks
                case ["comment" | "obj_info", *_] | []:
                    pass
                case ["element", name, count]:
                    elements.append(_Element(name, _count(count), []))
                case ["property", "list", count_type, item_type, name] if elements:
                    kind = _TYPES[count_type]
                    if kind[0] == "f":
                        raise ValueError
                    elements[-1].properties.append(_Property(name, _TYPES[item_type], kind))
                case ["property", type_, name] if elements:
                    elements[-1].properties.append(_Property(name, _TYPES[type_]))
                case ["end_header"] if order is not None:
                    return order, elements, names, end
                case _:
                    raise ValueError
        except (KeyError, ValueError):
            raise InputError(
                f"{path}: line {number} of the PLY header cannot be read: '{one_line(line, 60)}'"
            ) from None
    raise InputError(f"{path}: the PLY header has no 'end_header'; is the file cut off?")


def _header_lines(data: bytes) -> Iterator[tuple[str, int]]:
    start = 0
    while (stop := data.find(b"\n", start)) >= 0:
        yield data[start:stop].decode("utf-8", "replace").strip("\r"), stop + 1
        start = stop + 1


def _count(word: str) -> int:
    if not word.isdecimal() or len(word) > 12:
        raise ValueError
    return int(word)


_Columns = dict[str, dict[str, Any]]


def _ascii(path: str, data: bytes, header: _Header) -> _Columns:
    """One line a row, as every writer does it."""
    try:
        lines = [line for line in data[header[3] :].decode("ascii").split("\n") if line.strip()]
    except UnicodeDecodeError:
        raise InputError(f"{path}: an ASCII PLY with bytes that are not ASCII; is it a binary one?") from None
    columns: _Columns = {}
    position = 0
    for element in header[1]:
        if element.count > len(lines) - position:
            raise _cut_off(path, element, len(lines) - position)
        rows = lines[position : position + element.count] if element.properties else []
        position += len(rows)
        columns[element.name] = _ascii_rows(path, element, rows)
    return columns


def _ascii_rows(path: str, element: _Element, rows: list[str]) -> dict[str, Any]:
    lists: dict[str, list[Any]] = {p.name: [] for p in element.properties}
    for k, row in enumerate(rows):
        words, position = row.split(), 0
        try:
            for p in element.properties:
                kind = float if p.type[0] == "f" else int
                size = int(words[position]) if p.count else 1
                position += bool(p.count)
                if not 0 <= size <= len(words) - position:
                    raise ValueError
                values = [kind(word) for word in words[position : position + size]]
                lists[p.name].append(values if p.count else values[0])
                position += size
        except (ValueError, IndexError):
            raise InputError(
                f"{path}: {one_line(element.name, 20)} {k} cannot be read: '{one_line(row, 60)}'"
            ) from None
    return _arrays(path, element, lists)


def _arrays(path: str, element: _Element, lists: dict[str, list[Any]]) -> dict[str, Any]:
    """The columns of an element, those of numbers as arrays."""
    try:
        return {p.name: lists[p.name] if p.count else np.array(lists[p.name], np.float64) for p in element.properties}
    except OverflowError:
        raise InputError(f"{path}: a number in '{one_line(element.name, 20)}' is too large") from None


def _cut_off(path: str, element: _Element, room: int) -> InputError:
    return InputError(
        f"{path}: PLY that says it holds {element.count} of '{one_line(element.name, 20)}',"
        f" but there is room for {room}; is it cut off?"
    )


def _binary(path: str, data: bytes, header: _Header) -> _Columns:
    columns: _Columns = {}
    position = header[3]
    for element in header[1]:
        if not element.properties:
            continue
        least = sum(np.dtype(p.count or p.type).itemsize for p in element.properties)
        if element.count > (len(data) - position) // least:  # before anything of that size is made
            raise _cut_off(path, element, (len(data) - position) // least)
        read = _binary_lists if any(p.count for p in element.properties) else _binary_scalars
        columns[element.name], position = read(path, data, position, element, header[0])
    return columns


def _binary_scalars(path: str, data: bytes, position: int, element: _Element, order: str) -> tuple[dict[str, Any], int]:
    kind = np.dtype([(f"p{k}", order + p.type) for k, p in enumerate(element.properties)])
    rows = np.frombuffer(data, kind, element.count, position)
    found = {p.name: _column(rows[f"p{k}"]) for k, p in enumerate(element.properties)}
    return found, position + element.count * kind.itemsize


def _binary_lists(path: str, data: bytes, position: int, element: _Element, order: str) -> tuple[dict[str, Any], int]:
    """Rows of differing length, one after the other."""
    lists: dict[str, list[Any]] = {p.name: [] for p in element.properties}
    kinds = [(p, np.dtype(p.type), np.dtype(p.count) if p.count else None) for p in element.properties]
    for k in range(element.count):
        for p, kind, count in kinds:
            size = 1
            try:
                if count is not None:
                    size = struct.unpack_from(order + count.char, data, position)[0]
                    position += count.itemsize
                if not 0 <= size * kind.itemsize <= len(data) - position:  # before anything of that size is made
                    raise _cut_off(path, element, k)
                values = list(struct.unpack_from(f"{order}{size}{kind.char}", data, position))
            except struct.error:
                raise _cut_off(path, element, k) from None
            lists[p.name].append(values if p.count else values[0])
            position += size * kind.itemsize
    return _arrays(path, element, lists), position


def ply_bytes(assembly: Assembly) -> bytes:
    """Return the assembly as binary PLY: polygons as they are, double precision, metres.

    Every face carries the number of its block, and a comment gives the block's id; other readers pass over both.
    """
    mesh = assembly.mesh
    names = [f"comment {_NAME}{i} {block.id}" for i, block in enumerate(assembly.blocks)]
    header = "\n".join(
        [
            "ply",
            "format binary_little_endian 1.0",
            "comment cyclopean: metres, z up",
            *names,
            f"element vertex {len(mesh.vertex)}",
            *(f"property double {axis}" for axis in "xyz"),
            f"element face {len(mesh.corner_start) - 1}",
            "property list uint int vertex_indices",
            "property int block",
            "end_header\n",
        ]
    ).encode()
    sizes = np.diff(mesh.corner_start)
    # each face is its size, its corners, its block: 32-bit words, laid out at once
    words = np.zeros(int(sizes.sum()) + 2 * len(sizes), "<i4")
    start = mesh.corner_start[:-1] + 2 * np.arange(len(sizes))
    words[start] = sizes
    words[np.arange(len(mesh.corner)) + 2 * mesh.corner_face + 1] = mesh.corner
    words[start + sizes + 1] = mesh.face_body
    return header + mesh.vertex.astype("<f8").tobytes() + words.tobytes()
