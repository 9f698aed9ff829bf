"""Independent checker of certificates: it reads one file, trusts nothing but the model in it, and recomputes the proof.

Standard library only, one file, nothing of the program that wrote the certificate. Three ways to run it:

    python checker.py CERT.json        python -m cyclopean.proof CERT.json        verify(json.load(file))

**What is proved.** A certificate `cyclopean.certificate/1` holds blocks (closed polygon meshes, metres), contacts
(planar polygons, whose area normal N points from block `a` into block `b`), loads, gravity, and one of two proofs.

*rbe-state*, "stable under rigid-block equilibrium": a force F on `b` (and -F on `a`) at every vertex of every contact
polygon. No force pulls, F.N >= 0; none leaves its friction cone, |F|^2 |N|^2 <= (1 + mu^2) (F.N)^2; and on every
free block forces and moments balance weight and loads. The first two hold exactly, the balance to `BALANCE`.

*rbe-mechanism*, "unstable": a velocity v and a spin w for every free block. With dd the velocity of `b` relative to
`a` at a contact point, virtual work gives for *every* set of forces f that balances the loads p

    p.y = sum f.(-dd) <= sum f.P(-dd) <= ||f|| ||P(-dd)||        (P projects onto the friction cone, which holds f)

so with p.y > 0 every balancing f is at least p.y / ||P(-dd)|| large. From `BOUND` total weights on, we call that
unstable. The claim is about the contacts listed, with Coulomb cones and associated (dilatant) flow, and nothing else.

**What is checked first.** Meshes closed and turned outward (exact volume > 0); every contact point within `tolerance`
of a face of `a` that looks along N and of a face of `b` that looks against N. (N itself may lean from the face by what
the tolerance is of the contact's width, 18 degrees at most: tiny contacts are as good as the tolerance.)
Not checked: whether blocks overlap, or whether all contacts that exist are
listed. (Fewer contacts make a state harder, a mechanism easier.)

**Arithmetic.** A float is the exact fraction it is. Each kind of quantity (lengths, forces, densities, gravity,
velocities) is multiplied by one power of two that turns all of it into integers; every decision compares integers.
Roots are integer roots, rounded in the direction that never helps the claim. Floats appear in printed figures only.
"""

import hashlib
import json
import math
import os
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from itertools import pairwise
from typing import NoReturn

__all__ = ["NotACertificateError", "Report", "main", "seal", "verify", "verify_file"]

# ---------------------------------------------------------------------------------------------------------------------
# Thresholds. They live here so that no file can weaken them.

SCHEMA = "cyclopean.certificate/1"

BALANCE = Fraction(1, 10**9)
"""Largest out-of-balance force, relative to the total weight W (moment: to W times the mean block size). Doubles
reach 1e-12 on good models; 1e-9 of a 100-tonne wall is the weight of a pinch of sand."""

BOUND = 10**6
"""Forces a mechanism must demand, in total weights. No masonry bears a million times itself; a solver's mechanism is
exact to about 1e-13, so that a true one passes easily and a nearly stable model does not."""

MU_FLOOR = 1e-12
"""A state may use at least this friction coefficient: a frictionless cone is a ray, and almost no ray holds a triple
of doubles. A thousand times below `BALANCE`, so that it carries nothing."""

FACE_ALIGNMENT = Fraction(19, 20)
"""Least cosine (18 degrees) between a contact's normal and the face it lies on: facets may stand for a curved joint,
cut into ten or more a half circle; the side of a block may not stand for its top."""

TOLERANCE_SHARE = Fraction(5, 1000)
"""Largest stated tolerance, relative to the diagonal of the box around all blocks."""

FREE_SHARE = Fraction(10, 1000)
"""Likewise relative to the box around the **free** blocks alone: a huge or far-away support must not make room for
floating contacts."""

TINY, HUGE = 1e-150, 1e100
"""Magnitudes of non-zero numbers accepted. Rounding noise (1e-17 * 1e-17) fits in; an exponent meant to make the
integers, and so the time and memory taken, explode does not."""

GUARD_BITS = 96
"""The largest number of each kind becomes an integer of at least so many bits, so that integer roots and divisions
lose less than 1e-28 even where the file holds small whole numbers."""

CLAIMS = {
    "rbe-state": "stable under rigid-block equilibrium",
    "rbe-mechanism": "unstable under rigid-block equilibrium (listed contacts, associated flow)",
}
PROOF_FIELD = {"rbe-state": "forces", "rbe-mechanism": "mechanism"}
COMMON_FIELDS = {"schema", "kind", "gravity", "tolerance", "blocks", "contacts", "loads", "seal"}

Number = int | float
Vec = tuple[int, int, int]


# ---------------------------------------------------------------------------------------------------------------------
# What callers see.


class NotACertificateError(ValueError):
    """The file is not JSON, or its JSON is no `cyclopean.certificate/...` object."""


@dataclass(frozen=True, slots=True)
class Report:
    """The checker's answer.

    Attributes
    ----------
    proved : bool
        Whether the certificate proves its claim.
    kind, claim : str
        What it claims; empty when even that cannot be read.
    reason : str
        One line: how well it is proved, or the first thing that is wrong.
    figures : dict of str to float
        Finite numbers to show: `blocks`, `free`, `contacts`, `points`; for a state `equilibrium_force` and
        `equilibrium_moment` (relative, must not exceed 1e-9); for a mechanism `bound` (total weights, must reach 1e6;
        the largest float when no contact resists at all).
    """

    proved: bool
    kind: str
    claim: str
    reason: str
    figures: dict[str, float] = field(default_factory=dict)


def seal(certificate: Mapping[str, object]) -> str:
    """SHA-256 of the canonical JSON of everything but the seal itself, in hexadecimal.

    It guards against damage and careless edits, not against intent: the arithmetic does that.

    Raises
    ------
    ValueError, TypeError
        For values that JSON does not have.

    >>> seal({"kind": "rbe-state", "seal": "any"}) == seal({"kind": "rbe-state"})
    True
    """
    rest = {key: value for key, value in certificate.items() if key != "seal"}
    text = json.dumps(rest, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return hashlib.sha256(text.encode("utf-8")).hexdigest()


def verify(certificate: Mapping[str, object]) -> Report:
    """Check one certificate; whatever is malformed is answered with `proved=False`, never with an exception.

    >>> verify({"schema": "cyclopean.certificate/1", "kind": "rbe-state"}).reason
    'fields missing: blocks, contacts, forces, gravity, loads, seal, tolerance'
    """
    kind = certificate.get("kind") if isinstance(certificate, Mapping) else None
    kind = kind if isinstance(kind, str) and kind in CLAIMS else ""
    figures: dict[str, float] = {}
    try:
        sheet = _read(certificate)
        figures = _counts(sheet)
        model = _weigh(sheet)
        result, reason = _state(sheet, model) if kind == "rbe-state" else _mechanism(sheet, model)
        figures |= result
    except _RefusedError as refusal:
        return Report(False, kind, CLAIMS.get(kind, ""), str(refusal), figures | refusal.figures)
    return Report(True, kind, CLAIMS[kind], reason, figures)


def verify_file(path: str | os.PathLike[str]) -> Report:
    """Check the certificate in a file.

    Raises
    ------
    OSError
        The file cannot be read.
    NotACertificateError
        It is not JSON, or not an object whose `schema` begins with `cyclopean.certificate/`.
    """
    with open(path, "rb") as file:
        data = file.read()
    try:
        content = json.loads(data, object_pairs_hook=_object_without_repeats)
    except NotACertificateError:
        raise
    except (ValueError, RecursionError) as error:
        raise NotACertificateError(f"is not JSON: {_short(str(error), 200)}") from error
    schema = content.get("schema") if isinstance(content, dict) else None
    if not (isinstance(schema, str) and schema.startswith("cyclopean.certificate/")):
        raise NotACertificateError("is JSON, but not a cyclopean.certificate object")
    return verify(content)


def _object_without_repeats(pairs: list[tuple[str, object]]) -> dict[str, object]:
    """Build a JSON object; a key given twice would let two readers see two models."""
    result = dict(pairs)
    if len(result) != len(pairs):
        raise NotACertificateError("is ambiguous: an object in it gives a key twice")
    return result


# ---------------------------------------------------------------------------------------------------------------------
# Reading: after this the numbers are numbers and the names exist.


class _RefusedError(Exception):
    """The certificate does not prove its claim, for the reason given."""

    def __init__(self, reason: str, figures: dict[str, float] | None = None) -> None:
        super().__init__(reason)
        self.figures = figures or {}


@dataclass(frozen=True, slots=True)
class _Stone:
    """A block as the file gives it."""

    name: str
    vertices: Sequence[Sequence[Number]]
    faces: Sequence[Sequence[int]]
    density: Number
    fixed: bool


@dataclass(frozen=True, slots=True)
class _Joint:
    """A contact as the file gives it, with block numbers for names."""

    label: str
    a: int
    b: int
    polygon: Sequence[Sequence[Number]]
    mu: Number


@dataclass(frozen=True, slots=True)
class _Push:
    """A load as the file gives it."""

    block: int
    force: Sequence[Number]
    point: Sequence[Number]


@dataclass(frozen=True, slots=True)
class _Sheet:
    """A whole certificate, form checked, nothing computed. `witness` is a list of rows of 3 or of 6 numbers:
    the forces point by point, or the motion block by block (zero for fixed blocks).
    """

    gravity: Sequence[Number]
    tolerance: Number
    stones: list[_Stone]
    joints: list[_Joint]
    pushes: list[_Push]
    witness: list[Sequence[Number]]


def _short(value: object, limit: int = 60) -> str:
    """Describe any value on one line of plain ASCII, however large or deep it is."""
    if isinstance(value, str):
        plain = ascii(value[: limit + 1])[1:-1]
        return plain if len(plain) <= limit else plain[: limit - 3] + "..."
    return repr(value) if value is None or isinstance(value, bool | float) else f"of type {type(value).__name__}"


def _refuse(reason: str, figures: dict[str, float] | None = None) -> NoReturn:
    raise _RefusedError(reason, figures)


def _fields(value: object, names: set[str], where: str) -> Mapping[str, object]:
    """Require an object with exactly these fields."""
    if not isinstance(value, Mapping):
        _refuse(f"{where} is not an object")
    if missing := names - value.keys():
        _refuse(f"{where}fields missing: {', '.join(sorted(missing))}")
    if extra := value.keys() - names:
        _refuse(f"{where}unknown field: {_short(min(map(str, extra)))}")
    return value


def _items(value: object, where: str) -> Sequence[object]:
    if not isinstance(value, list | tuple):
        _refuse(f"{where} is not a list")
    return value


def _number(value: object, where: str) -> Number:
    """Require a finite number of sane magnitude. True is no number, "1" neither, and NaN fails every comparison."""
    if type(value) is float or type(value) is int:
        if value == 0 or TINY <= abs(value) <= HUGE:
            return value
        _refuse(f"{where}: a number is not finite or of absurd magnitude")
    _refuse(f"{where}: {_short(value)} is not a number")


def _row(value: object, length: int, where: str) -> Sequence[Number]:
    row = _items(value, where)
    if len(row) != length:
        _refuse(f"{where} has {len(row)} numbers instead of {length}")
    return [_number(x, where) for x in row]


def _name(value: object, numbers: Mapping[str, int], where: str) -> int:
    if not isinstance(value, str) or value not in numbers:
        _refuse(f"{where}: there is no block {_short(value)}")
    return numbers[value]


def _read(certificate: object) -> _Sheet:
    """Check schema, kind, keys, types, names, counts and the seal."""
    if not isinstance(certificate, Mapping):
        _refuse("the certificate is not an object")
    if certificate.get("schema") != SCHEMA:
        _refuse(f"schema is not {SCHEMA}")
    kind = certificate.get("kind")
    if not isinstance(kind, str) or kind not in CLAIMS:
        _refuse(f"kind {_short(kind)} is not one this checker knows")
    top = _fields(certificate, COMMON_FIELDS | {PROOF_FIELD[kind]}, "")

    stones = [_read_stone(value, i) for i, value in enumerate(_items(top["blocks"], "blocks"))]
    numbers = {stone.name: i for i, stone in enumerate(stones)}
    if len(numbers) != len(stones):
        _refuse("two blocks have the same id")
    if kind != "rbe-state" and all(stone.fixed for stone in stones):
        _refuse("no block is free, so none can move")
    if not stones:
        _refuse("there are no blocks")
    joints = [_read_joint(value, i, numbers, stones) for i, value in enumerate(_items(top["contacts"], "contacts"))]
    pushes = [_read_push(value, i, numbers) for i, value in enumerate(_items(top["loads"], "loads"))]
    witness = _read_forces(top["forces"], joints) if kind == "rbe-state" else _read_motion(top["mechanism"], stones)
    gravity = _row(top["gravity"], 3, "gravity")
    tolerance = _number(top["tolerance"], "tolerance")
    if tolerance < 0:
        _refuse("tolerance is negative")
    if top["seal"] != seal(top):
        _refuse("the seal does not match: the file was damaged or edited")
    return _Sheet(gravity, tolerance, stones, joints, pushes, witness)


def _read_stone(value: object, i: int) -> _Stone:
    entry = _fields(value, {"id", "vertices", "faces", "density", "fixed"}, f"block {i}: ")
    name, fixed = entry["id"], entry["fixed"]
    if not isinstance(name, str):
        _refuse(f"block {i}: id is not a string")
    where = f"block {_short(name)}"
    if not isinstance(fixed, bool):
        _refuse(f"{where}: fixed is not true or false")
    density = _number(entry["density"], f"{where}: density")
    if density < 0 or (density == 0 and not fixed):
        _refuse(f"{where}: density is not positive")
    vertices = [_row(v, 3, f"{where}: a vertex") for v in _items(entry["vertices"], f"{where}: vertices")]
    faces = [_read_face(f, len(vertices), where) for f in _items(entry["faces"], f"{where}: faces")]
    return _Stone(name, vertices, faces, density, fixed)


def _read_face(value: object, count: int, where: str) -> list[int]:
    face = [i for i in _items(value, f"{where}: a face") if type(i) is int and 0 <= i < count]
    if len(face) < 3 or len(face) != len(_items(value, where)) or len(set(face)) != len(face):
        _refuse(f"{where}: a face is not three or more different vertex numbers")
    return face


def _read_joint(value: object, i: int, numbers: Mapping[str, int], stones: Sequence[_Stone]) -> _Joint:
    entry = _fields(value, {"a", "b", "polygon", "mu"}, f"contact {i}: ")
    a, b = (_name(entry[key], numbers, f"contact {i}") for key in ("a", "b"))
    label = f"contact {i} ({_short(stones[a].name)} - {_short(stones[b].name)})"
    if a == b:
        _refuse(f"{label} joins a block to itself")
    if stones[a].fixed and stones[b].fixed:
        _refuse(f"{label} joins two fixed blocks: it bears on no proof, leave it out")
    mu = _number(entry["mu"], f"{label}: mu")
    if mu < 0:
        _refuse(f"{label}: mu is negative")
    polygon = [_row(p, 3, f"{label}: a point") for p in _items(entry["polygon"], f"{label}: polygon")]
    if len(polygon) < 3:
        _refuse(f"{label}: polygon has fewer than three points")
    return _Joint(label, a, b, polygon, mu)


def _read_push(value: object, i: int, numbers: Mapping[str, int]) -> _Push:
    entry = _fields(value, {"block", "force", "point"}, f"load {i}: ")
    block = _name(entry["block"], numbers, f"load {i}")
    force, point = (_row(entry[key], 3, f"load {i}: {key}") for key in ("force", "point"))
    return _Push(block, force, point)


def _read_forces(value: object, joints: Sequence[_Joint]) -> list[Sequence[Number]]:
    rows = [_row(row, 3, f"force {i}") for i, row in enumerate(_items(value, "forces"))]
    if len(rows) != (points := sum(len(joint.polygon) for joint in joints)):
        _refuse(f"{len(rows)} forces for {points} contact points")
    return rows


def _read_motion(value: object, stones: Sequence[_Stone]) -> list[Sequence[Number]]:
    motion = _fields(value, {stone.name for stone in stones if not stone.fixed}, "mechanism: ")
    still = [0] * 6
    return [still if s.fixed else _row(motion[s.name], 6, f"mechanism of {_short(s.name)}") for s in stones]


def _counts(sheet: _Sheet) -> dict[str, float]:
    return {
        "blocks": len(sheet.stones),
        "free": sum(not stone.fixed for stone in sheet.stones),
        "contacts": len(sheet.joints),
        "points": sum(len(joint.polygon) for joint in sheet.joints),
    }


# ---------------------------------------------------------------------------------------------------------------------
# Integers and vectors of integers.


def _exponent(numbers: Iterable[Number]) -> int:
    """Find the k for which every number times 2**k is an integer, and the largest has at least `GUARD_BITS` bits.

    >>> _exponent([0.75, 5]) == GUARD_BITS - 3
    True
    """
    finest = 1
    top: Number = 0
    for x in numbers:
        denominator = x.as_integer_ratio()[1]
        if denominator > finest:
            finest = denominator
        if abs(x) > top:
            top = abs(x)
    return finest.bit_length() - 1 + max(0, GUARD_BITS - int(Fraction(top) * finest).bit_length())


def _integer(x: Number, k: int) -> int:
    """Scale to the integer x * 2**k, for a k from `_exponent`: exact."""
    numerator, denominator = x.as_integer_ratio()
    return numerator << (k + 1 - denominator.bit_length())


def _vector(row: Sequence[Number], k: int) -> Vec:
    x, y, z = row
    return _integer(x, k), _integer(y, k), _integer(z, k)


def _dot(a: Vec, b: Vec) -> int:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _cross(a: Vec, b: Vec) -> Vec:
    ax, ay, az = a
    bx, by, bz = b
    return ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx


def _plus(a: Vec, b: Vec) -> Vec:
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


def _minus(a: Vec, b: Vec) -> Vec:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def _times(s: int, a: Vec) -> Vec:
    return s * a[0], s * a[1], s * a[2]


def _root_above(n: int) -> int:
    """Smallest integer whose square is at least n.

    >>> [_root_above(n) for n in (0, 1, 2, 4, 5)]
    [0, 1, 2, 2, 3]
    """
    root = math.isqrt(n)
    return root if root * root == n else root + 1


def _cube_root_below(n: int) -> int:
    """Largest integer whose cube is at most n >= 0, by Newton's method from above.

    >>> [_cube_root_below(n) for n in (0, 1, 7, 8, 26, 27, 10**60)]
    [0, 1, 1, 2, 2, 3, 100000000000000000000]
    """
    if n == 0:
        return 0
    root = 1 << -(-n.bit_length() // 3)
    while (lower := (2 * root + n // (root * root)) // 3) < root:
        root = lower
    return root


def _quotient_above(n: int, d: int) -> int:
    """|n| / d rounded up."""
    return -(-abs(n) // d)


def _as_float(numerator: int, denominator: int) -> float:
    """Divide for a figure to print; a ratio beyond the floats becomes the largest one."""
    if denominator == 0:
        return 0.0 if numerator == 0 else sys.float_info.max
    try:
        return numerator / denominator
    except OverflowError:
        return sys.float_info.max


# ---------------------------------------------------------------------------------------------------------------------
# Geometry: solids, faces and the contacts that lie on them.


@dataclass(frozen=True, slots=True)
class _Solid:
    """Mass properties of a block: `volume6` = 6 V and `moment24` = 24 V c, with c the centre of mass.

    Units: 2**-3k and 2**-4k of m3 and m4, with k the exponent of lengths. So c = moment24 / (4 volume6).
    """

    volume6: int
    moment24: Vec


@dataclass(frozen=True, slots=True)
class _Facet:
    """A flat piece of a block's surface: its corners, its area vector (twice the area, outward) and its box."""

    ring: Sequence[Vec]
    normal: Vec
    low: Vec
    high: Vec


@dataclass(frozen=True, slots=True)
class _Patch:
    """A contact in integers: its points and its area vector N, from `a` into `b`."""

    points: list[Vec]
    normal: Vec
    normal2: int


@dataclass(frozen=True, slots=True)
class _Model:
    """The model in integers; the exponents say in what power of two each kind of quantity is counted.

    Forces are counted in 2**-`per_force` / 6 N wherever weights come in (`weight6`, `total6_*`): rho V g is
    rho (6 V) g / 6, and so stays an integer.
    """

    solids: list[_Solid]
    patches: list[_Patch]
    masses6: list[int]  # density times volume6; 0 for a fixed block
    gravity: Vec
    loads: list[tuple[int, Vec, Vec]]  # block, force, point; free blocks only
    total6_below: int  # total weight W, bounded from both sides
    total6_above: int
    per_length: int
    per_load: int
    per_weight: int
    per_force: int  # the finer of the last two


def _weigh(sheet: _Sheet) -> _Model:
    """Check the geometry and turn the model into integers."""
    k = _exponent(_lengths(sheet))
    tolerance = _integer(sheet.tolerance, k)
    _require_modest_tolerance(sheet, tolerance, k)
    patches = [_patch(joint, tolerance, k) for joint in sheet.joints]
    solids = _solids_under_contacts(sheet, patches, tolerance, k)

    per_density = _exponent(stone.density for stone in sheet.stones)
    per_gravity = _exponent(sheet.gravity)
    per_load = _exponent(x for push in sheet.pushes for x in push.force)
    per_weight = per_density + per_gravity + 3 * k
    per_force = max(per_load, per_weight)
    gravity = _vector(sheet.gravity, per_gravity)
    masses6 = [
        0 if stone.fixed else _integer(stone.density, per_density) * solid.volume6
        for stone, solid in zip(sheet.stones, solids, strict=True)
    ]
    loads = [
        (push.block, _vector(push.force, per_load), _vector(push.point, k))
        for push in sheet.pushes
        if not sheet.stones[push.block].fixed
    ]

    def total6(root: Callable[[int], int]) -> int:
        weight6 = sum(masses6) * root(_dot(gravity, gravity)) << (per_force - per_weight)
        return weight6 + (6 * sum(root(_dot(f, f)) for _, f, _ in loads) << (per_force - per_load))

    below, above = total6(math.isqrt), total6(_root_above)
    return _Model(solids, patches, masses6, gravity, loads, below, above, k, per_load, per_weight, per_force)


def _lengths(sheet: _Sheet) -> Iterator[Number]:
    """Every length and coordinate in the file."""
    yield sheet.tolerance
    for stone in sheet.stones:
        for vertex in stone.vertices:
            yield from vertex
    for joint in sheet.joints:
        for point in joint.polygon:
            yield from point
    for push in sheet.pushes:
        yield from push.point


def _require_modest_tolerance(sheet: _Sheet, tolerance: int, k: int) -> None:
    """Require tolerance <= TOLERANCE_SHARE of the model's size and FREE_SHARE of that of its free blocks together.

    Sizes are diagonals of boxes around the vertices that a face uses. Without free blocks there are no contacts to
    place, so any tolerance will do.
    """
    free = [stone for stone in sheet.stones if not stone.fixed]
    if not free:
        return
    for stones, share, what in ((free, FREE_SHARE, "free blocks together"), (sheet.stones, TOLERANCE_SHARE, "model")):
        corners = [_vector(stone.vertices[i], k) for stone in stones for i in set().union(*stone.faces)]
        if not corners:
            _refuse("a free block has no faces")
        low, high = _box(corners)
        diagonal = _minus(high, low)
        if not (tolerance * share.denominator) ** 2 <= share.numerator**2 * _dot(diagonal, diagonal):
            _refuse(f"tolerance is more than {float(share):.1%} of the size of the {what}")


def _box(points: Iterable[Vec]) -> tuple[Vec, Vec]:
    xs, ys, zs = zip(*points, strict=True)
    return (min(xs), min(ys), min(zs)), (max(xs), max(ys), max(zs))


def _area_vector(ring: Sequence[Vec]) -> Vec:
    """Newell's normal: twice the vector area of a polygon, summed over the triangles that fan from its first corner."""
    x, y, z = 0, 0, 0
    first = ring[0]
    before = _minus(ring[1], first)
    for corner in ring[2:]:
        edge = _minus(corner, first)
        dx, dy, dz = _cross(before, edge)
        x, y, z = x + dx, y + dy, z + dz
        before = edge
    return x, y, z


def _is_flat(ring: Sequence[Vec], normal: Vec, tolerance: int) -> bool:
    """Whether every corner lies within tolerance of the plane through their mean.

    |(r - mean).n| <= t |n|, times the number of corners and squared.
    """
    heights = [_dot(r, normal) for r in ring]
    count, total = len(ring), sum(heights)
    limit = (count * tolerance) ** 2 * _dot(normal, normal)
    return all((count * h - total) ** 2 <= limit for h in heights)


def _patch(joint: _Joint, tolerance: int, k: int) -> _Patch:
    """Turn a contact polygon into integers; it must have an area, and be flat."""
    points = [_vector(point, k) for point in joint.polygon]
    normal = _area_vector(points)
    normal2 = _dot(normal, normal)
    if normal2 == 0:
        _refuse(f"{joint.label}: polygon has no area")
    if not _is_flat(points, normal, tolerance):
        _refuse(f"{joint.label}: polygon is not flat within the tolerance")
    return _Patch(points, normal, normal2)


def _solids_under_contacts(sheet: _Sheet, patches: Sequence[_Patch], tolerance: int, k: int) -> list[_Solid]:
    """Check every block, and on it the contacts it takes part in; block by block, to keep the memory small."""
    sides: list[list[tuple[str, _Patch, int]]] = [[] for _ in sheet.stones]
    for joint, patch in zip(sheet.joints, patches, strict=True):
        sides[joint.a].append((joint.label, patch, 1))
        sides[joint.b].append((joint.label, patch, -1))
    solids = []
    for stone, touching in zip(sheet.stones, sides, strict=True):
        vertices = [_vector(v, k) for v in stone.vertices]
        _require_closed(stone)
        solids.append(_solid(stone, vertices))
        if touching:
            _require_on_surface(_facets(stone, vertices, tolerance), touching, tolerance)
    return solids


def _require_closed(stone: _Stone) -> None:
    """Every directed edge occurs once, and so does its reverse: the surface is closed and consistently turned."""
    edges = [pair for face in stone.faces for pair in zip(face, [*face[1:], face[0]], strict=True)]
    once = set(edges)
    if not edges or len(once) != len(edges) or any((j, i) not in once for i, j in edges):
        _refuse(f"block {_short(stone.name)}: its faces do not close, or are not turned the same way")


def _solid(stone: _Stone, vertices: Sequence[Vec]) -> _Solid:
    """Volume and first moment: signed tetrahedra from a local origin o to the fan triangles (a, b, c) of the faces.

    6 V = sum det(a, b, c), and 24 V (c - o) = sum det (a + b + c), with a, b, c measured from o.
    """
    origin = vertices[stone.faces[0][0]]
    local = [_minus(v, origin) for v in vertices]
    volume6, mx, my, mz = 0, 0, 0, 0
    for face in stone.faces:
        a = local[face[0]]
        for i, j in pairwise(face[1:]):
            b, c = local[i], local[j]
            if det := _dot(a, _cross(b, c)):
                volume6 += det
                mx += det * (a[0] + b[0] + c[0])
                my += det * (a[1] + b[1] + c[1])
                mz += det * (a[2] + b[2] + c[2])
    if not volume6 > 0:
        _refuse(f"block {_short(stone.name)}: its volume is not positive, its faces look inward")
    return _Solid(volume6, _plus((mx, my, mz), _times(4 * volume6, origin)))


def _facets(stone: _Stone, vertices: Sequence[Vec], tolerance: int) -> list[_Facet]:
    """Cut the surface into flat pieces: each flat face whole, any other as the triangles of its fan."""
    facets = []
    for face in stone.faces:
        ring = [vertices[i] for i in face]
        normal = _area_vector(ring)
        if len(ring) == 3 or (any(normal) and _is_flat(ring, normal, tolerance)):
            pieces = [(ring, normal)]
        else:
            fans = ([ring[0], *pair] for pair in pairwise(ring[1:]))
            pieces = [(fan, _area_vector(fan)) for fan in fans]
        facets += [_Facet(piece, n, *_box(piece)) for piece, n in pieces if any(n)]
    return facets


def _require_on_surface(facets: Sequence[_Facet], touching: Sequence[tuple[str, _Patch, int]], tolerance: int) -> None:
    """Every point of these contacts lies within tolerance of a facet that looks the right way.

    Facets are chosen once a contact, by box and direction; all of it in exact arithmetic.
    """
    outlines: dict[int, _Outline] = {}
    for label, patch, sign in touching:
        near = _facets_near(facets, patch, sign, tolerance)
        for i in near:
            if i not in outlines:
                outlines[i] = _outline(facets[i], tolerance)
        candidates = [outlines[i] for i in near]
        for number, point in enumerate(patch.points):
            if not any(_is_on(outline, point, tolerance) for outline in candidates):
                side = "a" if sign == 1 else "b"
                _refuse(f"{label}: point {number} is not on a face of its block {side} that looks along it")


def _facets_near(facets: Sequence[_Facet], patch: _Patch, sign: int, tolerance: int) -> list[int]:
    """Numbers of the facets whose box meets the contact's and that look along `sign` times its normal.

    cos >= p/q is n.N > 0 and q^2 (n.N)^2 >= p^2 |n|^2 |N|^2.
    """
    (lx, ly, lz), (hx, hy, hz) = _box(patch.points)
    lx, ly, lz = lx - tolerance, ly - tolerance, lz - tolerance
    hx, hy, hz = hx + tolerance, hy + tolerance, hz + tolerance
    p2, q2 = FACE_ALIGNMENT.numerator**2 * patch.normal2, FACE_ALIGNMENT.denominator**2
    near = []
    for i, facet in enumerate(facets):
        (ax, ay, az), (bx, by, bz) = facet.low, facet.high
        if ax <= hx and ay <= hy and az <= hz and bx >= lx and by >= ly and bz >= lz:
            along = sign * _dot(facet.normal, patch.normal)
            if along > 0 and q2 * along * along >= p2 * _dot(facet.normal, facet.normal):
                near.append(i)
    return near


@dataclass(frozen=True, slots=True)
class _Edge:
    """An edge of a facet from `start` along `run`. `inward`.r - `offset` is positive to its left, seen from outside;
    `start_level` and `end_level` are its ends' coordinates along the facet's sweep direction.
    """

    start: Vec
    run: Vec
    run2: int
    inward: Vec
    offset: int
    start_level: int
    end_level: int


@dataclass(frozen=True, slots=True)
class _Outline:
    """A facet made ready for `_is_on`: its plane, a direction in the plane to sweep along, and its edges."""

    normal: Vec
    count: int
    height: int  # sum over the corners of r.normal: the plane is count * r.normal = height
    limit: int  # (count * tolerance * |normal|)^2
    sweep: Vec
    edges: list[_Edge]


def _outline(facet: _Facet, tolerance: int) -> _Outline:
    normal, ring = facet.normal, facet.ring
    least = min(range(3), key=lambda axis: abs(normal[axis]))
    axis: Vec = (int(least == 0), int(least == 1), int(least == 2))
    sweep = _cross(normal, axis)
    edges = []
    for start, end in zip(ring, [*ring[1:], ring[0]], strict=True):
        run = _minus(end, start)
        inward = _cross(normal, run)
        levels = _dot(start, sweep), _dot(end, sweep)
        edges.append(_Edge(start, run, _dot(run, run), inward, _dot(inward, start), *levels))
    limit = (len(ring) * tolerance) ** 2 * _dot(normal, normal)
    return _Outline(normal, len(ring), sum(_dot(r, normal) for r in ring), limit, sweep, edges)


def _is_on(outline: _Outline, point: Vec, tolerance: int) -> bool:
    """Whether a point is within tolerance of a facet: of its plane, and inside the outline or near an edge of it."""
    if not (outline.count * _dot(point, outline.normal) - outline.height) ** 2 <= outline.limit:
        return False
    return _is_inside(outline, point) or any(_is_near_edge(e, point, tolerance) for e in outline.edges)


def _is_inside(outline: _Outline, point: Vec) -> bool:
    """Even-odd rule, along the facet's normal: count the edges that a ray in the plane from the point crosses.

    An edge is crossed where its ends lie on either side in the sweep direction and the point to its proper side.
    """
    level = _dot(point, outline.sweep)
    inside = False
    for edge in outline.edges:
        rises = edge.end_level > level
        if rises != (edge.start_level > level) and (_dot(edge.inward, point) > edge.offset) == rises:
            inside = not inside
    return inside


def _is_near_edge(edge: _Edge, point: Vec, tolerance: int) -> bool:
    """Whether the point is within tolerance of the segment: of its nearer end, or between them of its line."""
    away = _minus(point, edge.start)
    along = _dot(away, edge.run)
    if along > 0:
        if along < edge.run2:
            aside = _cross(away, edge.run)
            return _dot(aside, aside) <= tolerance * tolerance * edge.run2
        away = _minus(away, edge.run)
    return _dot(away, away) <= tolerance * tolerance


# ---------------------------------------------------------------------------------------------------------------------
# rbe-state.


def _state(sheet: _Sheet, model: _Model) -> tuple[dict[str, float], str]:
    """Check forces: inside their cones, and in balance on every free block.

    Per free block, with the forces F at r (contacts and loads) and the centre of mass c:

        r_F = sum F + rho V g        r_M = sum r x F - c x sum F        (the weight has no moment about c)

    sqrt(sum |r_F|^2) <= BALANCE W and sqrt(sum |r_M|^2) <= BALANCE W l, with l the cube root of the mean volume.
    """
    per_force = max(model.per_load, _exponent(x for row in sheet.witness for x in row))
    forces = [_vector(row, per_force) for row in sheet.witness]
    _require_cones(sheet, model, forces)
    pulls, turns = _resultants(sheet, model, forces, per_force)

    unit = max(per_force, model.per_force)  # r_F is counted in 2**-unit / 6 N
    out6, turned = 0, 0
    for i, stone in enumerate(sheet.stones):
        if not stone.fixed:
            weight6 = _times(model.masses6[i] << (unit - model.per_weight), model.gravity)
            residual6 = _plus(_times(6 << (unit - per_force), pulls[i]), weight6)
            out6 += _dot(residual6, residual6)
            moment = _moment_above(model.solids[i], pulls[i], turns[i])
            turned += _dot(moment, moment)

    total6 = model.total6_below << (unit - model.per_force)
    size = _mean_size_below(sheet, model)
    turned36 = 36 * turned << 2 * (unit - per_force)
    figures = {
        "equilibrium_force": _as_float(_root_above(out6), total6),
        "equilibrium_moment": _as_float(_root_above(turned36), total6 * size),
    }
    p2, q2 = BALANCE.numerator**2, BALANCE.denominator**2
    if not q2 * out6 <= p2 * total6**2:
        _refuse(f"forces do not balance: {figures['equilibrium_force']:.2g} of the total weight is left", figures)
    if not q2 * turned36 <= p2 * (total6 * size) ** 2:
        left = figures["equilibrium_moment"]
        _refuse(f"moments do not balance: {left:.2g} of the total weight times block size is left", figures)
    worst = max(figures.values())
    return figures, f"every force is inside its friction cone and all blocks balance to {worst:.2g} of the total weight"


def _require_cones(sheet: _Sheet, model: _Model, forces: Sequence[Vec]) -> None:
    """F.N >= 0 and |F|^2 |N|^2 <= (1 + mu^2) (F.N)^2, with mu = p/q, so times q^2."""
    rows = iter(forces)
    for joint, patch in zip(sheet.joints, model.patches, strict=True):
        p, q = max(joint.mu, MU_FLOOR).as_integer_ratio()
        left, right, normal = q * q * patch.normal2, q * q + p * p, patch.normal
        for number in range(len(patch.points)):
            force = next(rows)
            along = _dot(force, normal)
            if not along >= 0:
                _refuse(f"{joint.label}: the force at point {number} pulls")
            if not left * _dot(force, force) <= right * along * along:
                _refuse(f"{joint.label}: the force at point {number} leaves the friction cone")


def _resultants(sheet: _Sheet, model: _Model, forces: Sequence[Vec], per_force: int) -> tuple[list[Vec], list[Vec]]:
    """Sum of F and of r x F on each block, contacts and loads; on `a` a contact acts with the opposite sign."""
    pulls: list[Vec] = [(0, 0, 0)] * len(sheet.stones)
    turns: list[Vec] = [(0, 0, 0)] * len(sheet.stones)
    rows = iter(forces)
    for joint, patch in zip(sheet.joints, model.patches, strict=True):
        pull: Vec = (0, 0, 0)
        turn: Vec = (0, 0, 0)
        for point in patch.points:
            force = next(rows)
            pull = _plus(pull, force)
            turn = _plus(turn, _cross(point, force))
        a, b = joint.a, joint.b
        pulls[b], turns[b] = _plus(pulls[b], pull), _plus(turns[b], turn)
        pulls[a], turns[a] = _minus(pulls[a], pull), _minus(turns[a], turn)
    for block, load, point in model.loads:
        force = _times(1 << (per_force - model.per_load), load)
        pulls[block] = _plus(pulls[block], force)
        turns[block] = _plus(turns[block], _cross(point, force))
    return pulls, turns


def _moment_above(solid: _Solid, pull: Vec, turn: Vec) -> Vec:
    """|turn - c x pull| in each component, rounded up, with c = moment24 / (4 volume6)."""
    denominator = 4 * solid.volume6
    x, y, z = _minus(_times(denominator, turn), _cross(solid.moment24, pull))
    return _quotient_above(x, denominator), _quotient_above(y, denominator), _quotient_above(z, denominator)


def _mean_size_below(sheet: _Sheet, model: _Model) -> int:
    """Cube root of the mean volume of the free blocks, rounded down; 0 where no block is free."""
    volumes = [solid.volume6 for stone, solid in zip(sheet.stones, model.solids, strict=True) if not stone.fixed]
    if not volumes:
        return 0
    return _cube_root_below(sum(volumes) // (6 * len(volumes)))


# ---------------------------------------------------------------------------------------------------------------------
# rbe-mechanism.


@dataclass(frozen=True, slots=True)
class _Motion:
    """A rigid motion: the velocity at r is `drift` + `spin` x r (so `drift` belongs to the world's origin)."""

    drift: Vec
    spin: Vec


def _mechanism(sheet: _Sheet, model: _Model) -> tuple[dict[str, float], str]:
    """Check a motion: the loads do work p.y > 0 against contacts that resist with no more than ||P(-dd)||.

    Shown is (p.y)^2 >= (BOUND W)^2 ||P(-dd)||^2, with W and the norm bounded from above.
    """
    per_velocity = _exponent(x for row in sheet.witness for x in row)
    motions = [
        _motion(row, solid, per_velocity, model.per_length)
        for row, solid in zip(sheet.witness, model.solids, strict=True)
    ]
    power24 = _power24(sheet, model, motions)
    total24 = 4 * model.total6_above
    norm2 = sum(_resistance2(joint, patch, motions) for joint, patch in zip(sheet.joints, model.patches, strict=True))
    figures = {"bound": _as_float(power24, total24 * _root_above(norm2)) if power24 > 0 else 0.0}
    if not power24 > 0:
        _refuse("the loads do no work in this motion", figures)
    if not power24**2 >= (BOUND * total24) ** 2 * norm2:
        _refuse(f"contact forces of {figures['bound']:.2g} total weights might hold this motion", figures)
    if norm2 == 0:
        return figures, "the blocks can move so that the loads do work and no contact resists"
    return figures, f"to hold this motion the contacts would need forces of {figures['bound']:.2g} total weights"


def _motion(row: Sequence[Number], solid: _Solid, per_velocity: int, per_length: int) -> _Motion:
    """Motion from the velocity v of the centre of mass c and the spin w: drift = v - w x c.

    c is a fraction, so the drift is rounded to the grid of w x r. That is no approximation of the proof: *any* rigid
    motion may serve as its witness, and the rounded one is rigid, exact, and the only one used from here on.
    """
    vx, vy, vz, *w = (_integer(x, per_velocity) for x in row)
    spin: Vec = (w[0], w[1], w[2])
    denominator = 4 * solid.volume6
    x, y, z = _minus(_times(denominator << per_length, (vx, vy, vz)), _cross(spin, solid.moment24))
    return _Motion((x // denominator, y // denominator, z // denominator), spin)


def _power24(sheet: _Sheet, model: _Model, motions: Sequence[_Motion]) -> int:
    """24 p.y: weights at the centres of mass, loads at their points.

    A weight's share is rho V g.(drift + w x c) = rho g.(4 (6V) drift + w x (24 V c)) / 24: integers.
    """
    weights24, loads = 0, 0
    for i, (stone, solid, motion) in enumerate(zip(sheet.stones, model.solids, motions, strict=True)):
        if not stone.fixed:
            flow = _plus(_times(4 * solid.volume6, motion.drift), _cross(motion.spin, solid.moment24))
            density = model.masses6[i] // solid.volume6  # exact: masses6 = density * volume6
            weights24 += density * _dot(model.gravity, flow)
    for block, force, point in model.loads:
        loads += _dot(force, _plus(motions[block].drift, _cross(motions[block].spin, point)))
    return (weights24 << (model.per_force - model.per_weight)) + (24 * loads << (model.per_force - model.per_load))


def _resistance2(joint: _Joint, patch: _Patch, motions: Sequence[_Motion]) -> int:
    """||P(x)||^2 over the points of a contact, x = -dd, rounded up.

    With d = x.N and C = |x|^2 |N|^2 - d^2 (the normal part of x is d/|N|, the tangential one sqrt(C)/|N|), mu = p/q:

    - polar to the cone, d <= 0 and p^2 C <= q^2 d^2: nothing resists;
    - inside the cone, d >= 0 and q^2 C <= p^2 d^2: all of x does, |x|^2;
    - otherwise (q d + p sqrt C)^2 / ((p^2 + q^2) |N|^2), with the root rounded up.
    """
    p, q = joint.mu.as_integer_ratio()
    p2, q2 = p * p, q * q
    a, b = motions[joint.a], motions[joint.b]
    drift, spin = _minus(a.drift, b.drift), _minus(a.spin, b.spin)
    whole, scaled = 0, 0
    for point in patch.points:
        x = _plus(drift, _cross(spin, point))
        x2, d = _dot(x, x), _dot(x, patch.normal)
        d2 = d * d
        c = x2 * patch.normal2 - d2
        if d <= 0 and p2 * c <= q2 * d2:
            continue
        if d >= 0 and q2 * c <= p2 * d2:
            whole += x2
        else:
            scaled += (q * d + p * _root_above(c)) ** 2
    return whole + _quotient_above(scaled, (p2 + q2) * patch.normal2)


# ---------------------------------------------------------------------------------------------------------------------
# Command line.


def main(argv: Sequence[str] | None = None) -> int:
    """Check one file and say so: 0 proved, 1 not proved, 2 no certificate to check.

    Parameters
    ----------
    argv : sequence of str, optional
        The arguments without the program's name; those of the process by default.
    """
    arguments = list(sys.argv[1:] if argv is None else argv)
    if len(arguments) != 1 or arguments[0].startswith("-"):
        print(
            "usage: checker CERTIFICATE.json (one file; exit status 0 proved, 1 not proved, 2 unreadable)",
            file=sys.stderr,
        )
        return 2
    path = _short(arguments[0], 4096)
    try:
        report = verify_file(arguments[0])
    except OSError as error:
        print(f"{path}: cannot be read: {error.strerror or error}", file=sys.stderr)
        return 2
    except ValueError as error:
        print(f"{path}: {_short(str(error), 240)}", file=sys.stderr)
        return 2
    print(f"{'PROVED' if report.proved else 'NOT PROVED'}: {report.claim or 'no claim that can be read'}")
    print(f"  {report.reason}")
    return 0 if report.proved else 1


if __name__ == "__main__":
    sys.exit(main())
