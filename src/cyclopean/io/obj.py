"""Wavefront OBJ: vertices, polygons and the `o` and `g` lines that tell the stones apart.

Read here and not by a library so that polygons stay polygons and trouble is named by its line.
"""

import numpy as np

from cyclopean.assembly import Assembly
from cyclopean.errors import InputError
from cyclopean.io.bodies import Body, part_of
from cyclopean.io.fields import REACH, fail
from cyclopean.io.files import decoded, one_line

__all__ = ["obj_text", "read_obj"]


def read_obj(path: str, data: bytes) -> list[Body]:
    """Read one body for each pair of object (`o`) and group (`g`) that has faces.

    Texture and normal indices, materials, lines and points are passed over. In a file that we wrote, an object is a
    block, whose name counts to the last blank, and `g` is its group.

    Raises
    ------
    InputError
        Names the line that cannot be read.
    """
    vertices: list[list[float]] = []
    parts: dict[tuple[str, str], list[tuple[int, ...]]] = {}
    owner, group = "", ""
    here: list[tuple[int, ...]] | None = None
    number = 0
    content = decoded(path, data)
    ours = content.startswith(_HEADER)
    for number, line in _lines(content):
        words = line.split()
        if not words:
            continue
        word = words[0]
        if word == "v":
            vertices.append(_vertex(path, number, words))
        elif word == "f":
            if here is None:
                here = parts.setdefault((owner, group), [])
            here.append(_face(path, number, words, len(vertices)))
        elif word == "o":
            owner, here = _name(line, ours), None
            group = "" if ours else group
        elif word == "g":
            group, here = _name(line, ours), None
        elif word not in _PASSED_OVER and not word.startswith("#"):
            fail(path, number, f"'{one_line(word, 20)}' is not an OBJ statement")
    if not vertices:
        raise InputError(f"{path}: has no vertices (lines 'v x y z'); is it an OBJ file?")
    points = np.array(vertices)
    bodies = []
    for (owner, group), faces in parts.items():
        name = owner if ours else f"{owner}/{group}" if owner and group and owner != group else owner or group
        fields = {"group": group} if ours and group and group.isprintable() else {}
        bodies.append(part_of(name or None, points, faces, whole=bool(name), fields=fields))
    return bodies


_HEADER = "# cyclopean: metres, z up"

_PASSED_OVER = frozenset(
    "vt vn vp s usemtl mtllib usemap maplib l p cstype deg bmat step curv curv2 surf parm trim hole scrv sp end con mg"
    " bevel c_interp d_interp lod shadow_obj trace_obj ctech stech call csh".split()
)


def _lines(content: str) -> list[tuple[int, str]]:
    """Number the lines, those that end in a backslash joined to the next; a name may end in one, a comment too."""
    if "\\" not in content:
        return list(enumerate(content.split("\n"), 1))
    joined: list[tuple[int, str]] = []
    start, text = 1, ""
    for number, line in enumerate(content.split("\n"), 1):
        if line.rstrip().endswith("\\") and not line.lstrip().startswith(("#", "o ", "g ")):
            text += line.rstrip()[:-1] + " "
            continue
        joined.append((start, text + line))
        start, text = number + 1, ""
    return [*joined, (start, text)]


def _name(line: str, exact: bool) -> str:
    return line.rstrip("\r")[2:] if exact else line.strip()[1:].strip()


def _vertex(path: str, number: int, words: list[str]) -> list[float]:
    try:
        point = [float(word) for word in words[1:4]]
    except ValueError:
        point = []
    if len(point) < 3:
        fail(path, number, "a vertex needs three numbers, 'v x y z'")
    if not (abs(point[0]) <= REACH and abs(point[1]) <= REACH and abs(point[2]) <= REACH):
        fail(path, number, "a coordinate is not a finite number below 1e12")
    return point


def _face(path: str, number: int, words: list[str], count: int) -> tuple[int, ...]:
    """Corners from 0; a negative index counts back from the latest vertex."""
    corners = []
    for word in words[1:]:
        if word.startswith("#"):
            break
        try:
            index = int(word.partition("/")[0])
        except ValueError:
            fail(path, number, f"'{one_line(word, 20)}' is not a vertex index")
        corner = index - 1 if index > 0 else count + index
        if index == 0 or not 0 <= corner < count:
            fail(path, number, f"the face names vertex {one_line(word, 20)}, but {count} vertices stand above it")
        corners.append(corner)
    if len(corners) < 3:
        fail(path, number, f"a face needs at least 3 corners, found {len(corners)}")
    kept = [i for k, i in enumerate(corners) if i != corners[k - 1]]  # no closing corner, and of two merged ones one
    if len(kept) >= 3 and len(set(kept)) < len(kept):
        fail(path, number, "a face names one vertex twice; list every corner once")
    return tuple(kept if len(kept) >= 3 else corners)


def obj_text(assembly: Assembly) -> str:
    """Return the assembly as OBJ: one object a block, its group, polygons as they are, every digit kept, metres."""
    lines = [_HEADER]
    before = 1
    for block in assembly.blocks:
        lines.append(f"o {block.id}")
        lines.extend([] if block.group is None else [f"g {block.group}"])
        lines.extend(f"v {x!r} {y!r} {z!r}" for x, y, z in block.vertices.tolist())
        lines.extend("f " + " ".join([str(i + before) for i in face]) for face in block.faces)
        before += len(block.vertices)
    return "\n".join(lines) + "\n"
