"""Independent checker of certificates: it reads one file, trusts nothing but the model in it, and recomputes the proof.

Standard library only, one file, nothing of the program that wrote the certificate. Three ways to run it:

    python checker.py CERT.json        python -m cyclopean.proof CERT.json        verify(json.load(file))

**What is proved.** A certificate `cyclopean.certificate/1` holds blocks (closed polygon meshes, metres), contacts
(planar polygons, whose area normal N points from block `a` into block `b`), loads, gravity, and one of four proofs.

*rbe-state*, "stable under rigid-block equilibrium": a force F on `b` (and -F on `a`) at every vertex of every contact
polygon. No force pulls, F.N >= 0; none leaves its friction cone, |F|^2 |N|^2 <= (1 + mu^2) (F.N)^2; and on every
free block forces and moments balance weight and loads. The first two hold exactly, the balance to `BALANCE`.

*rbe-mechanism*, "unstable": a velocity v and a spin w for every free block. With dd the velocity of `b` relative to
`a` at a contact point, virtual work gives for *every* set of forces f that balances the loads p

    p.y = sum f.(-dd) <= sum f.P(-dd) <= ||f|| ||P(-dd)||        (P projects onto the friction cone, which holds f)

so with p.y > 0 every balancing f is at least p.y / ||P(-dd)|| large. From `BOUND` total weights on, we call that
unstable. The claim is about the contacts listed, with Coulomb cones and associated (dilatant) flow, and nothing else.

*cra-state*, "stable under coupled rigid-block analysis": forces as in an rbe-state, and a virtual displacement of every
free block that they are coupled with. With dd = dn n + dd_t the displacement of `b` relative to `a` at a contact point:
no point overlaps by more than eps, dn >= -eps, or moves by more than eta; only points that overlap by eps press,
fn (dn + eps) = 0; and friction opposes sliding, F_t = -alpha dd_t with alpha >= 0, of at least beta_min. To `COUPLING`.

*cra-tree*, "unstable under coupled rigid-block analysis": a tree that splits all such states into cells (a point is
engaged, dn = -eps, or unloaded, F = 0; it slides in one sector or another, by less or by more than some amount), and at
each leaf multipliers that prove the cell empty: see `_margin`. The claim is about the contacts listed, eta / eps and
beta_min / eps.

*limit-bounds*, bounds of a multiplier: loads p0 + t p1, p1 the `live` ones. At t = `lower` forces, as in an rbe-state.
At t = `upper` a motion y, as in an rbe-mechanism, in which the live loads do not work backwards, p1.y >= 0: what drives
it at `upper` then drives it at every larger t, and forces below `BOUND` weights (of the loads at `upper`) hold none of
them. Either side may be absent.

**Partial supports.** A block may be `held` in some directions: displacements of its centre of mass along the world's
axes, rotations about them. There supports bear whatever comes, so that nothing has to balance, and every motion must
be zero, exactly: then what a support bears does no work, and all that is said above holds as it stands.

**Joints that pull.** A contact may have a `tension`, in Pa: rigid-block equilibrium only. An even pull s on its area
comes to t_k = s x share of the area at each corner (see `_pulls`), and forces may be such that F + t n is inside the
cone: fn + t >= 0 and |F_t| <= mu (fn + t). With f' = f + t n a mechanism has to work against the pull as well,

    p.y - sum t dn = sum f'.(-dd) <= ||f'|| ||P(-dd)||

and W then counts all pulls beside the loads. The claim says how strong the joints are.

**Settlement.** *rbe-settled*, "comes to rest after an infinitesimal settlement": the ground moves some fixed blocks, a
displacement and a rotation each. A displacement of every free block, and forces as in an rbe-state, go with it: with dd
of `b` relative to `a` no point closes or slides without opening, dn >= mu |dd_t| (associated flow), no force works,
F.dd = 0, and what has opened carries nothing, |F| dn = 0. All to `SETTLING` of the largest displacement of a contact
point on a block that the ground moves. The first two make it the least of -p.y over all such displacements, so that
nothing moves further; with the third no force is due to sliding that opens, which dry stone does not do.

**What is checked first.** Meshes closed and turned outward (exact volume > 0); every contact point within `tolerance`
of a face of `a` that looks along N and of a face of `b` that looks against N. (N itself may lean from the face by what
the tolerance is of the contact's width, 18 degrees at most: tiny contacts are as good as the tolerance.)
Not checked: whether blocks overlap, or whether all contacts that exist are
listed. (Fewer contacts make a state harder, a mechanism easier.)

**Arithmetic.** A float is the exact fraction it is. Each kind of quantity (lengths, forces, densities, gravity,
velocities, displacements) is multiplied by one power of two that turns all of it into integers; every decision compares
integers. Roots are integer roots, rounded in the direction that never helps the claim. Floats appear in printed figures
only.
"""

import hashlib
import json
import math
import os
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from itertools import chain, pairwise
from typing import Any, NamedTuple, NoReturn, TypeVar

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
"""The largest number of each kind but lengths becomes an integer of at least so many bits, so that integer roots and
divisions lose less than 1e-28 even where the file holds small whole numbers."""

COUPLING = Fraction(1, 10**9)
"""How far a coupled state may miss its conditions at a point: displacements relative to eps, eta and beta_min, work
relative to eps times the point's force (or the mean weight of a free block, where that is larger)."""

SETTLING = Fraction(1, 10**7)
"""How far a settled state may miss its conditions: displacements relative to the settlement, work relative to that
times the point's force (or the mean weight of a free block, where that is larger)."""

ROOT_BITS = 64
"""Bits after the point of roots of integers that may be small."""

MAX_DEPTH, MAX_NODES = 250, 1_000_000
"""Of a tree. Each split settles something about one point, so that honest trees are far from both."""

CLAIMS = {
    "rbe-state": "stable under rigid-block equilibrium",
    "rbe-mechanism": "unstable under rigid-block equilibrium (listed contacts, associated flow)",
    "cra-state": "stable under coupled rigid-block analysis",
    "cra-tree": "unstable under coupled rigid-block analysis",
    "limit-bounds": "bounds of the live loads' multiplier under rigid-block equilibrium",
    "rbe-settled": "comes to rest after an infinitesimal settlement, under rigid-block equilibrium"
    " (listed contacts, associated flow)",
}
BOUND_FIELDS = {"eps", "eta", "beta_min"}
PROOF_FIELDS = {
    "rbe-state": {"forces"},
    "rbe-mechanism": {"mechanism"},
    "cra-state": {"forces", "mechanism"} | BOUND_FIELDS,
    "cra-tree": {"tree"} | BOUND_FIELDS,
    "limit-bounds": {"live"},
    "rbe-settled": {"forces", "mechanism", "settlements"},
}
LIMIT_SIDES = ({"lower", "forces"}, {"upper", "mechanism"})
STONE_FIELDS = {"id", "vertices", "faces", "density", "fixed"}
JOINT_FIELDS = {"a", "b", "polygon", "mu"}
DIRECTIONS = ("x", "y", "z", "rx", "ry", "rz")
PULLING_KINDS = {"rbe-state", "rbe-mechanism", "limit-bounds"}
COMMON_FIELDS = {"schema", "kind", "gravity", "tolerance", "blocks", "contacts", "loads", "seal"}

Number = float
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
        For a coupled state also `gap`, `complementarity`, `alignment` (relative, must not exceed 1e-9) and
        `sliding_least` (eps; eta where there is no friction); for a tree `nodes`, `leaves`, `depth` and `least_margin`
        (what the tightest leaf has to spare, relative to the work that it compares).
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
    claim = CLAIMS.get(kind, "")
    figures: dict[str, float] = {}
    try:
        sheet = _read(certificate)
        claim += _conditions(sheet)
        figures = _counts(sheet)
        result, reason = PROOFS[kind](sheet, _weigh(sheet))
        figures |= result
    except _RefusedError as refusal:
        return Report(False, kind, claim, str(refusal), figures | refusal.figures)
    return Report(True, kind, claim, reason, figures)


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
class _Surface:
    """How the vertices of a block make its faces; shared by all blocks that are built alike."""

    faces: Sequence[Sequence[int]]
    used: frozenset[int]
    closed: bool


class _Stone(NamedTuple):
    """A block as the file gives it."""

    name: str
    vertices: Sequence[Sequence[Number]]
    surface: _Surface
    density: Number
    fixed: bool
    held: tuple[bool, ...] = (False,) * 6  # in the order of DIRECTIONS


class _Joint(NamedTuple):
    """A contact as the file gives it, with block numbers for names."""

    a: int
    b: int
    polygon: Sequence[Sequence[Number]]
    mu: Number
    tension: Number = 0.0


@dataclass(frozen=True, slots=True)
class _Push:
    """A load as the file gives it."""

    block: int
    force: Sequence[Number]
    point: Sequence[Number]


@dataclass(frozen=True, slots=True)
class _Live:
    """Loads that grow with a multiplier, and the multipliers of which something is claimed."""

    gravity: Sequence[Number]
    pushes: list[_Push]
    lower: Number | None
    upper: Number | None


@dataclass(frozen=True, slots=True)
class _Bounds:
    """Bounds of the virtual displacement of coupled analysis, in one unit: 0 < eps, 0 < beta < eta."""

    eps: Number
    eta: Number
    beta: Number


@dataclass(frozen=True, slots=True)
class _Leaf:
    """An end of a tree: six numbers a block (zero where fixed), or a vector a contact point, or both."""

    motion: list[Sequence[Number]] | None
    forces: list[Sequence[Number]] | None


@dataclass(frozen=True, slots=True)
class _Split:
    """A fork of a tree at a contact point: by load (engaged | unloaded) where it has neither rays nor a speed, by the
    direction of sliding where it has rays, by the amount of it (slower | faster) where it has a speed.
    """

    point: int
    branches: int
    rays: list[Sequence[Number]]
    speed: Number | None


@dataclass(frozen=True, slots=True)
class _Sheet:
    """A whole certificate, form checked, nothing computed. Of the last four each kind has its own, the rest is empty.

    `forces` go point by point, `motion` block by block (zero for fixed blocks), `tree` holds the nodes in preorder.
    """

    gravity: Sequence[Number]
    tolerance: Number
    stones: list[_Stone]
    joints: list[_Joint]
    pushes: list[_Push]
    forces: list[Sequence[Number]]
    motion: list[Sequence[Number]]
    bounds: _Bounds | None
    tree: list[_Leaf | _Split]
    live: _Live | None = None


def _short(value: object, limit: int = 60) -> str:
    """Describe any value on one line of plain ASCII, however large or deep it is."""
    if isinstance(value, str):
        plain = ascii(value[: limit + 1])[1:-1]
        return plain if len(plain) <= limit else plain[: limit - 3] + "..."
    return repr(value) if value is None or isinstance(value, bool | float) else f"of type {type(value).__name__}"


def _refuse(reason: str, figures: dict[str, float] | None = None) -> NoReturn:
    raise _RefusedError(reason, figures)


def _fields(value: object, names: set[str], where: str, optional: str = "") -> Mapping[str, object]:
    """Require an object with exactly these fields, and perhaps the optional one."""
    if type(value) is dict and value.keys() == names:
        return value
    if not isinstance(value, Mapping):
        _refuse(f"{where} is not an object")
    if optional and optional in value:
        names = names | {optional}
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
        if not (value == 0 or TINY <= abs(value) <= HUGE):
            _refuse(f"{where}: a number is not finite or of absurd magnitude")
        if float(value) != value:
            _refuse(f"{where}: a whole number has more digits than a double holds")
        return float(value)
    _refuse(f"{where}: {_short(value)} is not a number")


def _row(value: object, length: int, where: str) -> Sequence[Number]:
    row = _items(value, where)
    if len(row) != length:
        _refuse(f"{where} has {len(row)} numbers instead of {length}")
    return [_number(x, where) for x in row]


def _triples(value: object, whole: str, one: str) -> list[Sequence[Number]]:
    """Require a list of rows of three numbers: each row of three ordinary floats as it is, by the short way."""
    rows: list[Sequence[Number]] = []
    for i, row in enumerate(_items(value, whole)):
        if type(row) is list and len(row) == 3:
            x, y, z = row
            if (
                type(x) is type(y) is type(z) is float
                and (TINY <= x <= HUGE or -HUGE <= x <= -TINY or x == 0)
                and (TINY <= y <= HUGE or -HUGE <= y <= -TINY or y == 0)
                and (TINY <= z <= HUGE or -HUGE <= z <= -TINY or z == 0)
            ):
                rows.append(row)
                continue
        rows.append(_row(row, 3, f"{one} {i}"))
    return rows


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
    top = _fields(certificate, COMMON_FIELDS | PROOF_FIELDS[kind] | _limit_sides(certificate, kind), "")

    known: dict[tuple[tuple[int, ...], ...], _Surface] = {}
    stones = [_read_stone(value, i, known) for i, value in enumerate(_items(top["blocks"], "blocks"))]
    numbers = {stone.name: i for i, stone in enumerate(stones)}
    if len(numbers) != len(stones):
        _refuse("two blocks have the same id")
    if "forces" not in top and all(stone.fixed for stone in stones):
        _refuse("no block is free, so none can move")
    if not stones:
        _refuse("there are no blocks")
    joints = [_read_joint(value, i, numbers, stones) for i, value in enumerate(_items(top["contacts"], "contacts"))]
    if kind not in PULLING_KINDS and any(joint.tension for joint in joints):
        _refuse(f"joints that pull are no part of a {kind}")
    pushes = [_read_push(value, i, numbers) for i, value in enumerate(_items(top["loads"], "loads"))]
    points = sum(len(joint.polygon) for joint in joints)
    forces = _read_forces(top["forces"], points, "") if "forces" in top else []
    motion = _read_motion(top["mechanism"], stones, "") if "mechanism" in top else []
    if "settlements" in top:
        motion = _read_settlements(top["settlements"], stones, motion)
    bounds = _read_bounds(top) if "eps" in top else None
    tree = _read_tree(top["tree"], stones, points) if "tree" in top else []
    live = _read_live(top, numbers) if "live" in top else None
    gravity = _row(top["gravity"], 3, "gravity")
    tolerance = _number(top["tolerance"], "tolerance")
    if tolerance < 0:
        _refuse("tolerance is negative")
    if top["seal"] != _seal_of(top):
        _refuse("the seal does not match: the file was damaged or edited")
    return _Sheet(gravity, tolerance, stones, joints, pushes, forces, motion, bounds, tree, live)


def _limit_sides(certificate: Mapping[str, object], kind: str) -> set[str]:
    """Fields of the sides that bounds of a multiplier have: one is enough."""
    if kind != "limit-bounds":
        return set()
    return set().union(*(side for side in LIMIT_SIDES if side & certificate.keys())) or LIMIT_SIDES[0]


def _read_live(top: Mapping[str, object], numbers: Mapping[str, int]) -> _Live:
    entry = _fields(top["live"], {"gravity", "loads"}, "live: ")
    pushes = [_read_push(value, i, numbers) for i, value in enumerate(_items(entry["loads"], "live: loads"))]
    lower, upper = (_number(top[key], key) if key in top else None for key in ("lower", "upper"))
    if lower is not None and upper is not None and not lower <= upper:
        _refuse("lower is above upper")
    return _Live(_row(entry["gravity"], 3, "live: gravity"), pushes, lower, upper)


def _seal_of(top: Mapping[str, object]) -> str:
    """Seal of a certificate of which all else has been read: nothing can be wrong but how much Python's stack holds."""
    try:
        return seal(top)
    except RecursionError:
        _refuse("the tree is too deep")


def _read_stone(value: object, i: int, known: dict[tuple[tuple[int, ...], ...], _Surface]) -> _Stone:
    entry = _fields(value, STONE_FIELDS, f"block {i}: ", "held")
    name, fixed = entry["id"], entry["fixed"]
    if not isinstance(name, str):
        _refuse(f"block {i}: id is not a string")
    where = f"block {_short(name)}"
    if not isinstance(fixed, bool):
        _refuse(f"{where}: fixed is not true or false")
    density = _number(entry["density"], where)
    if density < 0 or (density == 0 and not fixed):
        _refuse(f"{where}: density is not positive")
    vertices = _triples(entry["vertices"], f"{where}: vertices", f"{where}: vertex")
    surface = _read_surface(entry["faces"], where, known)
    if not max(surface.used, default=-1) < len(vertices):
        _refuse(f"{where}: a face is not three or more different vertex numbers")
    held = _read_held(entry["held"], fixed, where) if "held" in entry else _Stone._field_defaults["held"]
    return _Stone(name, vertices, surface, density, fixed, held)


def _read_held(value: object, fixed: bool, where: str) -> tuple[bool, ...]:
    """Read what a partial support holds: some of DIRECTIONS, in their order, each once."""
    names = _items(value, f"{where}: held")
    if not all(isinstance(name, str) and name in DIRECTIONS for name in names):
        _refuse(f"{where}: held is not a list of {', '.join(DIRECTIONS)}")
    held = tuple(name in names for name in DIRECTIONS)
    if list(names) != [name for name in DIRECTIONS if name in names]:
        _refuse(f"{where}: held names a direction twice, or not in their order")
    if fixed or not any(held) or all(held):
        _refuse(f"{where}: held is for blocks that are neither free nor fixed")
    return held


def _read_surface(value: object, where: str, known: dict[tuple[tuple[int, ...], ...], _Surface]) -> _Surface:
    """Read faces; the same faces once only. True and 1.0 are as good a key as 1, but no vertex numbers."""
    key: Any = tuple([tuple(_items(face, f"{where}: a face")) for face in _items(value, f"{where}: faces")])
    if not set(map(type, chain.from_iterable(key))) <= {int}:
        _refuse(f"{where}: a face is not three or more different vertex numbers")
    if key not in known:
        if any(len(face) < 3 or len(set(face)) != len(face) or min(face) < 0 for face in key):
            _refuse(f"{where}: a face is not three or more different vertex numbers")
        known[key] = _Surface(key, frozenset().union(*key), _is_closed(key))
    return known[key]


def _is_closed(faces: Sequence[Sequence[int]]) -> bool:
    """Whether every directed edge occurs once, and so does its reverse: closed, and consistently turned."""
    edges = [pair for face in faces for pair in zip(face, [*face[1:], face[0]], strict=True)]
    once = set(edges)
    return bool(edges) and len(once) == len(edges) and all((j, i) in once for i, j in edges)


def _read_joint(value: object, i: int, numbers: Mapping[str, int], stones: Sequence[_Stone]) -> _Joint:
    where = f"contact {i}"
    entry = _fields(value, JOINT_FIELDS, f"{where}: ", "tension")
    a, b = _name(entry["a"], numbers, where), _name(entry["b"], numbers, where)
    if a == b:
        _refuse(f"{where} joins block {_short(stones[a].name)} to itself")
    if stones[a].fixed and stones[b].fixed:
        _refuse(f"{where} joins two fixed blocks: it bears on no proof, leave it out")
    mu = _number(entry["mu"], where)
    if mu < 0:
        _refuse(f"{where}: mu is negative")
    tension = _number(entry["tension"], f"{where}: tension") if "tension" in entry else 0.0
    if "tension" in entry and not tension > 0:
        _refuse(f"{where}: tension is not positive")
    polygon = _triples(entry["polygon"], f"{where}: polygon", f"{where}: point")
    if len(polygon) < 3:
        _refuse(f"{where}: polygon has fewer than three points")
    return _Joint(a, b, polygon, mu, tension)


def _label(sheet: _Sheet, i: int) -> str:
    """Name a contact, for a refusal."""
    joint = sheet.joints[i]
    return f"contact {i} ({_short(sheet.stones[joint.a].name)} - {_short(sheet.stones[joint.b].name)})"


def _read_push(value: object, i: int, numbers: Mapping[str, int]) -> _Push:
    entry = _fields(value, {"block", "force", "point"}, f"load {i}: ")
    block = _name(entry["block"], numbers, f"load {i}")
    force, point = (_row(entry[key], 3, f"load {i}: {key}") for key in ("force", "point"))
    return _Push(block, force, point)


def _read_forces(value: object, points: int, where: str) -> list[Sequence[Number]]:
    rows = _triples(value, f"{where}forces", f"{where}force")
    if len(rows) != points:
        _refuse(f"{where}{len(rows)} forces for {points} contact points")
    return rows


def _read_motion(value: object, stones: Sequence[_Stone], where: str) -> list[Sequence[Number]]:
    motion = _fields(value, {stone.name for stone in stones if not stone.fixed}, f"{where}mechanism: ")
    still = [0.0] * 6
    rows = [still if s.fixed else _row(motion[s.name], 6, f"{where}mechanism of {_short(s.name)}") for s in stones]
    for stone, row in zip(stones, rows, strict=True):
        if any(held and x != 0 for held, x in zip(stone.held, row, strict=True)):
            _refuse(f"{where}mechanism of {_short(stone.name)}: it moves where a support holds it")
    return rows


def _read_settlements(
    value: object, stones: Sequence[_Stone], motion: list[Sequence[Number]]
) -> list[Sequence[Number]]:
    """The motion of free blocks, with that of the fixed ones that the ground moves."""
    if not isinstance(value, Mapping) or not value:
        _refuse("settlements is not an object that names a block")
    fixed = {stone.name for stone in stones if stone.fixed}
    if strange := value.keys() - fixed:
        _refuse(f"settlements: {_short(min(map(str, strange)))} is no fixed block")
    given = {name: _row(row, 6, f"settlement of {_short(name)}") for name, row in value.items()}
    return [given.get(stone.name, row) for stone, row in zip(stones, motion, strict=True)]


def _read_bounds(top: Mapping[str, object]) -> _Bounds:
    eps, eta, beta = (_number(top[key], key) for key in ("eps", "eta", "beta_min"))
    if not (eps > 0 and 0 < beta < eta):
        _refuse("eps, eta and beta_min are not positive, or beta_min is not below eta")
    return _Bounds(eps, eta, beta)


def _read_tree(value: object, stones: Sequence[_Stone], points: int) -> list[_Leaf | _Split]:
    """Read the nodes of a tree in preorder, each before its branches, the branches in their order."""
    nodes: list[_Leaf | _Split] = []
    pending = [(value, 0)]
    while pending:
        raw, depth = pending.pop()
        if depth > MAX_DEPTH or len(nodes) == MAX_NODES:
            _refuse(f"the tree is deeper than {MAX_DEPTH} splits, or has more than {MAX_NODES} nodes")
        node, branches = _read_node(raw, stones, points, f"tree node {len(nodes)}: ")
        nodes.append(node)
        pending.extend((branch, depth + 1) for branch in reversed(branches))
    return nodes


def _read_node(
    value: object, stones: Sequence[_Stone], points: int, where: str
) -> tuple[_Leaf | _Split, Sequence[object]]:
    """Read one node; its branches are returned as they are."""
    keys = value.keys() if isinstance(value, Mapping) else set()
    if "point" not in keys:
        proof = _fields(value, {"mechanism", "forces"} & keys or {"mechanism or forces"}, where)
        motion = _read_motion(proof["mechanism"], stones, where) if "mechanism" in proof else None
        forces = _read_forces(proof["forces"], points, where) if "forces" in proof else None
        return _Leaf(motion, forces), ()
    if "rays" in keys:
        node = _fields(value, {"point", "rays", "sectors"}, where)
        branches = _items(node["sectors"], f"{where}sectors")
        rays = [_row(ray, 3, f"{where}a ray") for ray in _items(node["rays"], f"{where}rays")]
        if not rays:
            _refuse(f"{where}there are no rays")
        split = _Split(_read_index(node["point"], points, where), len(branches), rays, None)
    elif "speed" in keys:
        node = _fields(value, {"point", "speed", "slower", "faster"}, where)
        branches = (node["slower"], node["faster"])
        speed = _number(node["speed"], f"{where}speed")
        split = _Split(_read_index(node["point"], points, where), 2, [], speed)
    else:
        node = _fields(value, {"point", "engaged", "unloaded"}, where)
        branches = (node["engaged"], node["unloaded"])
        split = _Split(_read_index(node["point"], points, where), 2, [], None)
    return split, branches


def _read_index(value: object, points: int, where: str) -> int:
    if type(value) is not int or not 0 <= value < points:
        _refuse(f"{where}point is not the number of a contact point")
    return value


def _conditions(sheet: _Sheet) -> str:
    """What a claim depends on beside its kind, to be printed behind it."""
    partly = sum(any(stone.held) for stone in sheet.stones)
    more = f" ({partly} of {len(sheet.stones)} blocks partly held)" if partly else ""
    pulling = [joint.tension for joint in sheet.joints if joint.tension]
    if pulling:
        more += f", COUNTING ON JOINTS THAT PULL: {len(pulling)} of {len(sheet.joints)}, up to {max(pulling):.6g} Pa"
    return (_coupled_conditions(sheet) if sheet.live is None else _claimed(sheet.live)) + more


def _coupled_conditions(sheet: _Sheet) -> str:
    """Bounds that a claim about coupled analysis depends on."""
    if sheet.bounds is None:
        return ""
    eta, beta = (float(Fraction(x) / Fraction(sheet.bounds.eps)) for x in (sheet.bounds.eta, sheet.bounds.beta))
    listed = ", listed contacts" if sheet.tree else ""
    return f" (eta = {eta:.15g} eps, beta_min = {beta:.15g} eps{listed})"


def _claimed(live: _Live) -> str:
    """What is claimed of which multipliers."""
    stands = "" if live.lower is None else f"forces hold it at {live.lower:.15g}"
    falls = "" if live.upper is None else f"none hold it from {live.upper:.15g} on (listed contacts, associated flow)"
    return f": {', '.join(part for part in (stands, falls) if part)}"


def _counts(sheet: _Sheet) -> dict[str, float]:
    return {
        "blocks": len(sheet.stones),
        "free": sum(not stone.fixed for stone in sheet.stones),
        "contacts": len(sheet.joints),
        "points": sum(len(joint.polygon) for joint in sheet.joints),
    }


# ---------------------------------------------------------------------------------------------------------------------
# Integers and vectors of integers.


def _exponent(numbers: Iterable[Number], guard: int = GUARD_BITS) -> int:
    """Find a k for which every number times 2**k is an integer, and the largest has at least `guard` bits.

    A double x of at least 2**(e - 1) is a multiple of 2**(e - 53).

    >>> _exponent([0.75, 5.0]), _exponent([0.75, 5.0], guard=1), _exponent([])
    (93, 53, 0)
    """
    sizes = set(map(abs, numbers))
    sizes.discard(0.0)
    if not sizes:
        return 0
    return max(53 - math.frexp(min(sizes))[1], guard - math.frexp(max(sizes))[1], 0)


def _integer(x: Number, k: int) -> int:
    """Scale to the integer x * 2**k, for a k from `_exponent`: exact, as only the exponent of a double changes."""
    return int(math.ldexp(x, k))


def _vectors(rows: Iterable[Sequence[Number]], k: int) -> list[Vec]:
    """Scale rows of three, as `_integer` does: `_number` sees to it that 2**k is a double, and the products are."""
    s = 2.0**k
    return [(int(x * s), int(y * s), int(z * s)) for x, y, z in rows]


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


class _Facet(NamedTuple):
    """A flat piece of a block's surface: its corners and its area vector (twice the area, outward), with its square."""

    ring: Sequence[Vec]
    normal: Vec
    normal2: int


class _Patch(NamedTuple):
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
    finer: int = 0  # bits by which motions are counted finer, so that partly held blocks move exactly; see `_motion`


def _weigh(sheet: _Sheet) -> _Model:
    """Check the geometry and turn the model into integers."""
    k = _exponent(_lengths(sheet), guard=1)
    tolerance = _integer(sheet.tolerance, k)
    _require_modest_tolerance(sheet, tolerance, k)
    patches = [_patch(sheet, i, tolerance, k) for i in range(len(sheet.joints))]
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
    finer = per_force - per_weight, per_force - per_load
    below, above = _totals6(sheet, masses6, gravity, loads, *finer)
    grid = _finer(sheet, solids)
    return _Model(solids, patches, masses6, gravity, loads, below, above, k, per_load, per_weight, per_force, grid)


def _totals6(
    sheet: _Sheet, masses6: list[int], gravity: Vec, loads: list[tuple[int, Vec, Vec]], by_weight: int, by_load: int
) -> tuple[int, int]:
    """6 times the total weight W, bounded from both sides; from below without what partial supports bear."""

    def total6(root: Callable[[int], int]) -> int:
        weight6 = sum(masses6) * root(_dot(gravity, gravity)) << by_weight
        return weight6 + (6 * sum(root(_dot(f, f)) for _, f, _ in loads) << by_load)

    borne = _borne6(sheet, masses6, gravity, loads, by_weight, by_load)
    return total6(math.isqrt) - borne, total6(_root_above)


def _borne6(
    sheet: _Sheet, masses6: list[int], gravity: Vec, loads: list[tuple[int, Vec, Vec]], by_weight: int, by_load: int
) -> int:
    """6 times what partial supports bear of W, rounded up: it must not make room for forces that do not balance.

    A weight counts only along directions that are free; so does a load, unless its block may turn.
    """
    borne = 0
    for mass6, stone in zip(masses6, sheet.stones, strict=True):
        if any(stone.held):
            left = _freed(gravity, stone.held[:3])
            borne += mass6 * (math.isqrt(_dot(gravity, gravity)) - math.isqrt(_dot(left, left))) << by_weight
    for block, force, _ in loads:
        held = sheet.stones[block].held
        if all(held[3:]):
            left = _freed(force, held[:3])
            borne += 6 * (math.isqrt(_dot(force, force)) - math.isqrt(_dot(left, left))) << by_load
    return borne


def _freed(vector: Vec, held: Sequence[bool]) -> Vec:
    """The components along directions that nothing holds."""
    x, y, z = (0 if still else part for part, still in zip(vector, held, strict=True))
    return x, y, z


def _finer(sheet: _Sheet, solids: Sequence[_Solid]) -> int:
    """Bits that let spins be multiples of 24 V, see `_motion`; 0 where no block is partly held."""
    if not any(any(stone.held) for stone in sheet.stones):
        return 0
    return (4 * max(solid.volume6 for solid in solids)).bit_length() + GUARD_BITS


def _lengths(sheet: _Sheet) -> Iterator[Number]:
    """Every length and coordinate in the file."""
    yield sheet.tolerance
    for stone in sheet.stones:
        yield from chain.from_iterable(stone.vertices)
    for joint in sheet.joints:
        yield from chain.from_iterable(joint.polygon)
    for push in (*sheet.pushes, *(sheet.live.pushes if sheet.live else ())):
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
        corners = [stone.vertices[i] for stone in stones for i in stone.surface.used]
        if not corners:
            _refuse("a free block has no faces")
        low, high = _box(corners)
        diagonal = _minus(_vector(high, k), _vector(low, k))
        if not (tolerance * share.denominator) ** 2 <= share.numerator**2 * _dot(diagonal, diagonal):
            _refuse(f"tolerance is more than {float(share):.1%} of the size of the {what}")


T = TypeVar("T", int, float)


def _box(points: Iterable[Sequence[T]]) -> tuple[tuple[T, T, T], tuple[T, T, T]]:
    xs, ys, zs = zip(*points, strict=True)
    return (min(xs), min(ys), min(zs)), (max(xs), max(ys), max(zs))


def _area_vector(ring: Sequence[Vec]) -> Vec:
    """Newell's normal: twice the vector area of a polygon, summed over the triangles that fan from its first corner.

    Of a quadrilateral it is the cross product of the diagonals.
    """
    if len(ring) == 4:
        (ax, ay, az), (bx, by, bz), (cx, cy, cz), (dx, dy, dz) = ring
        ux, uy, uz, vx, vy, vz = cx - ax, cy - ay, cz - az, dx - bx, dy - by, dz - bz
        return uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    x, y, z = 0, 0, 0
    first = ring[0]
    before = _minus(ring[1], first)
    for corner in ring[2:]:
        edge = _minus(corner, first)
        dx, dy, dz = _cross(before, edge)
        x, y, z = x + dx, y + dy, z + dz
        before = edge
    return x, y, z


def _is_flat(ring: Sequence[Vec], normal: Vec, normal2: int, tolerance: int) -> bool:
    """Whether every corner lies within tolerance of the plane through their mean.

    |(r - mean).n| <= t |n|, times the number of corners and squared. Of a quadrilateral n is at right angles to both
    diagonals, so that opposite corners are equally high: by half of what one diagonal is above the other.
    """
    if len(ring) == 3:
        return True
    if len(ring) == 4:
        (ax, ay, az), (bx, by, bz), _, _ = ring
        x, y, z = normal
        rise = (bx - ax) * x + (by - ay) * y + (bz - az) * z
        return rise == 0 or rise * rise <= 4 * tolerance * tolerance * normal2
    heights = [_dot(r, normal) for r in ring]
    count, total = len(ring), sum(heights)
    limit = (count * tolerance) ** 2 * normal2
    return all((count * h - total) ** 2 <= limit for h in heights)


def _patch(sheet: _Sheet, i: int, tolerance: int, k: int) -> _Patch:
    """Turn a contact polygon into integers; it must have an area, and be flat."""
    points = _vectors(sheet.joints[i].polygon, k)
    normal = _area_vector(points)
    normal2 = _dot(normal, normal)
    if normal2 == 0:
        _refuse(f"{_label(sheet, i)}: polygon has no area")
    if not _is_flat(points, normal, normal2, tolerance):
        _refuse(f"{_label(sheet, i)}: polygon is not flat within the tolerance")
    return _Patch(points, normal, normal2)


def _solids_under_contacts(sheet: _Sheet, patches: Sequence[_Patch], tolerance: int, k: int) -> list[_Solid]:
    """Check every block, and on it the contacts it takes part in; block by block, to keep the memory small."""
    sides: list[list[tuple[int, int]]] = [[] for _ in sheet.stones]
    for i, joint in enumerate(sheet.joints):
        sides[joint.a].append((i, 1))
        sides[joint.b].append((i, -1))
    solids = []
    for stone, touching in zip(sheet.stones, sides, strict=True):
        vertices = _vectors(stone.vertices, k)
        if not stone.surface.closed:
            _refuse(f"block {_short(stone.name)}: its faces do not close, or are not turned the same way")
        solids.append(_solid(stone, vertices))
        if touching:
            facets = _facets(stone, vertices, tolerance)
            for i, sign in touching:
                off = _off_surface(facets, patches[i], sign, tolerance)
                if off is not None:
                    side = "a" if sign == 1 else "b"
                    _refuse(f"{_label(sheet, i)}: point {off} is not on a face of its block {side} that looks along it")
    return solids


def _solid(stone: _Stone, vertices: Sequence[Vec]) -> _Solid:
    """Volume and first moment: signed tetrahedra from a local origin o to the fan triangles (a, b, c) of the faces.

    6 V = sum det(a, b, c), and 24 V (c - o) = sum det (a + b + c), with a, b, c measured from o. The origin is a
    vertex, so that the tetrahedra of the faces at it vanish.
    """
    faces = stone.surface.faces
    ox, oy, oz = vertices[faces[0][0]]
    local = [(x - ox, y - oy, z - oz) for x, y, z in vertices]
    volume6, mx, my, mz = 0, 0, 0, 0
    for face in faces:
        ax, ay, az = local[face[0]]
        if ax or ay or az:
            bx, by, bz = local[face[1]]
            for i in face[2:]:
                cx, cy, cz = local[i]
                det = ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)
                if det:
                    volume6 += det
                    mx += det * (ax + bx + cx)
                    my += det * (ay + by + cy)
                    mz += det * (az + bz + cz)
                bx, by, bz = cx, cy, cz
    if not volume6 > 0:
        _refuse(f"block {_short(stone.name)}: its volume is not positive, its faces look inward")
    v = 4 * volume6
    return _Solid(volume6, (mx + v * ox, my + v * oy, mz + v * oz))


def _facets(stone: _Stone, vertices: Sequence[Vec], tolerance: int) -> list[_Facet]:
    """Cut the surface into flat pieces: each flat face whole, any other as the triangles of its fan."""
    facets = []
    for face in stone.surface.faces:
        ring = [vertices[i] for i in face]
        normal = _area_vector(ring)
        normal2 = _dot(normal, normal)
        if len(ring) == 3 or (normal2 and _is_flat(ring, normal, normal2, tolerance)):
            pieces = [(ring, normal)]
        else:
            fans = ([ring[0], *pair] for pair in pairwise(ring[1:]))
            pieces = [(fan, _area_vector(fan)) for fan in fans]
        facets += [_Facet(piece, n, _dot(n, n)) for piece, n in pieces if any(n)]
    return facets


# A point is on a facet if it is within tolerance of the facet's plane, and inside its outline or within tolerance of an
# edge. Nearly every point of an honest certificate is inside a triangle or quadrilateral, or on its edge; this is found
# out first, with a few products. What is not so found takes the general way. Both are exact.


def _off_surface(facets: Sequence[_Facet], patch: _Patch, sign: int, tolerance: int) -> int | None:
    """Find a point of a contact that is on no facet that looks along `sign` N; None if there is no such point."""
    along = _facets_along(facets, patch, sign)
    left = list(enumerate(patch.points))
    for facet in along:
        if len(facet.ring) <= 4:
            left = _not_within(facet, left, tolerance)
            if not left:
                return None
    outlines = [_outline(facet, tolerance) for facet in along if _is_near(facet, patch, tolerance)]
    for number, point in left:
        if not any(_is_on(outline, point, tolerance) for outline in outlines):
            return number
    return None


def _facets_along(facets: Sequence[_Facet], patch: _Patch, sign: int) -> list[_Facet]:
    """Facets that look along `sign` times a contact's normal: cos >= p/q is n.N > 0, q^2 (n.N)^2 >= p^2 |n|^2 |N|^2."""
    x, y, z = patch.normal
    p2, q2 = FACE_ALIGNMENT.numerator**2 * patch.normal2, FACE_ALIGNMENT.denominator**2
    found = []
    for facet in facets:
        nx, ny, nz = facet.normal
        along = nx * x + ny * y + nz * z
        if (along > 0) == (sign > 0) and q2 * along * along >= p2 * facet.normal2:
            found.append(facet)
    return found


def _not_within(facet: _Facet, points: list[tuple[int, Vec]], tolerance: int) -> list[tuple[int, Vec]]:
    """Points that are off the plane of a triangle or quadrilateral, or to the right of one of its edges.

    A point to the left of all edges is inside: seen from it each edge turns by less than half a turn and never back,
    all four by less than two turns, so by one. (With five edges that would not be true: a pentagram goes round its
    middle twice.) Points on the line of an edge are inside too, or on the edge; they count if the facet is exactly
    flat, for then the edge is as near as the plane is; if it is not, its corners do.
    """
    ring, (nx, ny, nz) = facet.ring, facet.normal
    count = len(ring)
    heights = [x * nx + y * ny + z * nz for x, y, z in ring]
    height, lean = sum(heights), int(min(heights) != max(heights))
    limit = (count * tolerance) ** 2 * facet.normal2
    sides = []
    ax, ay, az = ring[-1]
    for bx, by, bz in ring:
        ux, uy, uz = bx - ax, by - ay, bz - az
        ix, iy, iz = ny * uz - nz * uy, nz * ux - nx * uz, nx * uy - ny * ux
        sides.append((ix, iy, iz, ix * ax + iy * ay + iz * az + lean))
        ax, ay, az = bx, by, bz
    outside = []
    for entry in points:
        x, y, z = entry[1]
        rise = count * (x * nx + y * ny + z * nz) - height
        if rise and not rise * rise <= limit:
            outside.append(entry)
            continue
        if lean and entry[1] in ring:
            continue
        for ix, iy, iz, offset in sides:
            if ix * x + iy * y + iz * z < offset:
                outside.append(entry)
                break
    return outside


def _is_near(facet: _Facet, patch: _Patch, tolerance: int) -> bool:
    """Whether the boxes around a facet and a contact are within tolerance of each other."""
    (ax, ay, az), (bx, by, bz) = _box(facet.ring)
    (lx, ly, lz), (hx, hy, hz) = _box(patch.points)
    x, y, z = max(ax - hx, lx - bx), max(ay - hy, ly - by), max(az - hz, lz - bz)
    return max(x, y, z) <= tolerance


class _Edge(NamedTuple):
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


class _Outline(NamedTuple):
    """A facet made ready for `_is_on`: its plane, a direction in the plane to sweep along, and its edges."""

    normal: Vec
    corners: int
    height: int  # sum over the corners of r.normal: the plane is corners * r.normal = height
    limit: int  # (corners * tolerance * |normal|)^2
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
    limit = (len(ring) * tolerance) ** 2 * facet.normal2
    return _Outline(normal, len(ring), sum(_dot(r, normal) for r in ring), limit, sweep, edges)


def _is_on(outline: _Outline, point: Vec, tolerance: int) -> bool:
    """Whether a point is within tolerance of a facet: of its plane, and inside the outline or near an edge of it."""
    if not (outline.corners * _dot(point, outline.normal) - outline.height) ** 2 <= outline.limit:
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
    """Check forces: inside their cones, and in balance on every free block."""
    per_force = _force_exponent(model, sheet.forces)
    figures = _balance(sheet, model, _vectors(sheet.forces, per_force), per_force)[0]
    worst = max(figures.values())
    return figures, f"every force is inside its friction cone and all blocks balance to {worst:.2g} of the total weight"


def _force_exponent(model: _Model, rows: Iterable[Sequence[Number]]) -> int:
    """Exponent that turns these forces, and the loads, into integers."""
    return max(model.per_load, _exponent(chain.from_iterable(rows)))


Sizes = list[tuple[int, int]]  # F.N and |F|^2, point by point


def _balance(sheet: _Sheet, model: _Model, forces: list[Vec], per_force: int) -> tuple[dict[str, float], Sizes]:
    """Check forces: inside their cones, and in balance on every free block.

    Per free block, with the forces F at r (contacts and loads) and the centre of mass c:

        r_F = sum F + rho V g        r_M = sum r x F - c x sum F        (the weight has no moment about c)

    sqrt(sum |r_F|^2) <= BALANCE W and sqrt(sum |r_M|^2) <= BALANCE W l, with l the cube root of the mean volume.
    """
    sizes = _require_cones(sheet, model, forces, per_force)
    unit = max(per_force, model.per_force)  # r_F is counted in 2**-unit / 6 N
    out6, turned = 0, 0
    for _, residual6, moment in _residuals(sheet, model, _resultants(sheet, model, forces, per_force), per_force):
        out6 += _dot(residual6, residual6)
        turned += _dot(moment, moment)

    total6 = model.total6_below << (unit - model.per_force)
    size = _mean_size_below(sheet, model)  # 2**(model.per_length + ROOT_BITS) l
    turned36 = 36 * turned << 2 * (unit - per_force + ROOT_BITS)
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
    return figures, sizes


def _require_cones(sheet: _Sheet, model: _Model, forces: list[Vec], per_force: int) -> Sizes:
    """F.N >= 0 and |F|^2 |N|^2 <= (1 + mu^2) (F.N)^2, with mu = p/q, so times q^2; the same of F + t n."""
    sizes: Sizes = []
    first = 0
    for i, (joint, patch) in enumerate(zip(sheet.joints, model.patches, strict=True)):
        p, q = max(joint.mu, MU_FLOOR).as_integer_ratio()
        x, y, z = patch.normal
        left, right = q * q * patch.normal2, q * q + p * p
        last = first + len(patch.points)
        if joint.tension:
            pulls = [math.floor(pull) for pull in _pulls(joint, patch, per_force, model.per_length)]
            sizes += _require_pulling(sheet, i, patch, forces[first:last], pulls)
            first = last
            continue
        for fx, fy, fz in forces[first:last]:
            along = fx * x + fy * y + fz * z
            force2 = fx * fx + fy * fy + fz * fz
            if not (along >= 0 and left * force2 <= right * along * along):
                what = "leaves the friction cone" if along >= 0 else "pulls"
                _refuse(f"{_label(sheet, i)}: the force at point {len(sizes) - first} {what}")
            sizes.append((along, force2))
        first = last
    return sizes


def _require_pulling(sheet: _Sheet, i: int, patch: _Patch, forces: Sequence[Vec], pulls: Sequence[int]) -> Sizes:
    """With s = F.N + t |N|, t rounded down: s >= 0 and |F|^2 |N|^2 - (F.N)^2 <= mu^2 s^2 at every point of a joint."""
    p, q = max(sheet.joints[i].mu, MU_FLOOR).as_integer_ratio()
    sizes: Sizes = []
    for force, pull in zip(forces, pulls, strict=True):
        along, force2 = _dot(force, patch.normal), _dot(force, force)
        pressed = along + pull
        if not (pressed >= 0 and q * q * (force2 * patch.normal2 - along * along) <= p * p * pressed * pressed):
            what = "leaves the friction cone" if pressed >= 0 else "pulls more than the joint can"
            _refuse(f"{_label(sheet, i)}: the force at point {len(sizes)} {what}")
        sizes.append((along, force2))
    return sizes


def _pulls(joint: _Joint, patch: _Patch, per_force: int, per_length: int) -> list[Fraction]:
    """T |N| at each corner of a joint that pulls, in 2**-(per_force + 2 per_length) N m2.

    An even stress s on a polygon has the resultant of forces at its corners: triangle by triangle from the centroid g,
    a third goes to each corner, and what comes to g goes on in the same proportions. So with a_j = (r_j - g) x
    (r_j+1 - g) . N, which add up to |N|^2, corner j has the share (a_j-1 + a_j) / (2 |N|^2) of the area |N| / 2, and
    t |N| = s (a_j-1 + a_j) / 4. From the first corner, 3 |N|^2 (g - r_0) = M is an integer.
    """
    first, ring, normal2 = patch.points[0], patch.points, patch.normal2
    arms = [_minus(point, first) for point in ring]
    middle: Vec = (0, 0, 0)
    for one, two in pairwise(arms[1:]):
        middle = _plus(middle, _times(_dot(_cross(one, two), patch.normal), _plus(one, two)))
    around = [_minus(_times(3 * normal2, arm), middle) for arm in arms]
    areas = [_dot(_cross(one, two), patch.normal) for one, two in zip(around, [*around[1:], around[0]], strict=True)]
    unit = Fraction(joint.tension) * Fraction(2) ** (per_force - 2 * per_length) / (36 * normal2 * normal2)
    return [unit * (before + after) for before, after in zip([areas[-1], *areas], areas, strict=False)]


Resultants = tuple[list[Vec], list[Vec]]


def _residuals(
    sheet: _Sheet, model: _Model, resultants: Resultants, per_force: int, weighty: bool = True
) -> Iterator[tuple[int, Vec, Vec]]:
    """What is left on each free block: its number, 6 r_F in 2**-max(per_force, model.per_force) N, and r_M about the
    centre of mass, rounded up. The resultants are in 2**-per_force N; `weighty` adds the weights to them.
    """
    unit = max(per_force, model.per_force)
    for i, (stone, pull, turn) in enumerate(zip(sheet.stones, *resultants, strict=True)):
        if not stone.fixed:
            residual6 = _times(6 << (unit - per_force), pull)
            if weighty:
                residual6 = _plus(residual6, _times(model.masses6[i] << (unit - model.per_weight), model.gravity))
            moment = _moment_above(model.solids[i], pull, turn)
            if any(stone.held):
                residual6, moment = _freed(residual6, stone.held[:3]), _freed(moment, stone.held[3:])
            yield i, residual6, moment


def _resultants(sheet: _Sheet, model: _Model, forces: list[Vec], per_force: int, loaded: bool = True) -> Resultants:
    """Sum of F and of r x F on each block, contacts and loads; on `a` a contact acts with the opposite sign."""
    pulls: list[Vec] = [(0, 0, 0)] * len(sheet.stones)
    turns: list[Vec] = [(0, 0, 0)] * len(sheet.stones)
    first = 0
    for joint, patch in zip(sheet.joints, model.patches, strict=True):
        px = py = pz = tx = ty = tz = 0
        last = first + len(patch.points)
        for (x, y, z), (fx, fy, fz) in zip(patch.points, forces[first:last], strict=True):
            px, py, pz = px + fx, py + fy, pz + fz
            tx, ty, tz = tx + y * fz - z * fy, ty + z * fx - x * fz, tz + x * fy - y * fx
        first = last
        a, b, pull, turn = joint.a, joint.b, (px, py, pz), (tx, ty, tz)
        pulls[b], turns[b] = _plus(pulls[b], pull), _plus(turns[b], turn)
        pulls[a], turns[a] = _minus(pulls[a], pull), _minus(turns[a], turn)
    for block, load, point in model.loads if loaded else ():
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
    """2**(model.per_length + ROOT_BITS) times the cube root of the mean volume of the free blocks, rounded down.

    0 where no block is free.
    """
    volumes = [solid.volume6 for stone, solid in zip(sheet.stones, model.solids, strict=True) if not stone.fixed]
    if not volumes:
        return 0
    return _cube_root_below((sum(volumes) << 3 * ROOT_BITS) // (6 * len(volumes)))


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
    motions = _motions(sheet.motion, model, _exponent(chain.from_iterable(sheet.motion)))
    norm2 = _resistances2(sheet, model, motions)
    figures = _driven(sheet, model, motions, norm2)
    if norm2 == 0:
        return figures, "the blocks can move so that the loads do work and no contact resists"
    return figures, f"to hold this motion the contacts would need forces of {figures['bound']:.2g} total weights"


def _driven(sheet: _Sheet, model: _Model, motions: Sequence[_Motion], norm2: int) -> dict[str, float]:
    """Require (p.y)^2 >= (BOUND W)^2 norm2, with what joints that pull take up taken off p.y."""
    work24, pulls6 = _against_pulls(sheet, model, motions)
    power24 = _power24(sheet, model, motions) - work24
    total24 = 4 * (model.total6_above + pulls6)
    figures = {"bound": _as_float(power24, total24 * _root_above(norm2)) if power24 > 0 else 0.0}
    if not power24 > 0:
        more = " beyond what joints that pull take up" if pulls6 else ""
        _refuse(f"the loads do no work{more} in this motion", figures)
    if not power24**2 >= (BOUND * total24) ** 2 * norm2:
        _refuse(f"contact forces of {figures['bound']:.2g} total weights might hold this motion", figures)
    return figures


def _resistances2(sheet: _Sheet, model: _Model, motions: Sequence[_Motion]) -> int:
    """||P(-dd)||^2 over all contact points, rounded up."""
    return sum(_resistance2(joint, patch, motions) for joint, patch in zip(sheet.joints, model.patches, strict=True))


def _against_pulls(sheet: _Sheet, model: _Model, motions: Sequence[_Motion]) -> tuple[int, int]:
    """24 sum t dn, in the unit of `_power24`, and 6 sum |t|, in that of W: of joints that pull, both rounded up."""
    work, total = 0, 0
    for joint, patch in zip(sheet.joints, model.patches, strict=True):
        if joint.tension:
            a, b = motions[joint.a], motions[joint.b]
            drift, spin = _minus(b.drift, a.drift), _minus(b.spin, a.spin)
            pulls = _pulls(joint, patch, model.per_force, model.per_length)
            opening = [_dot(_plus(drift, _cross(spin, point)), patch.normal) for point in patch.points]
            done = sum((pull * d for pull, d in zip(pulls, opening, strict=True)), Fraction(0))
            work += math.ceil(24 * done / patch.normal2)
            total += math.ceil(6 * sum(map(abs, pulls), Fraction(0)) / math.isqrt(patch.normal2))
    return work, total


def _motions(rows: Iterable[Sequence[Number]], model: _Model, per_velocity: int) -> list[_Motion]:
    """Motions in 2**-(per_velocity + model.per_length + model.finer), spins in 2**-(per_velocity + model.finer)."""
    return [
        _motion(row, solid, per_velocity, model.per_length, model.finer)
        for row, solid in zip(rows, model.solids, strict=True)
    ]


def _motion(row: Sequence[Number], solid: _Solid, per_velocity: int, per_length: int, finer: int = 0) -> _Motion:
    """Motion from the velocity v of the centre of mass c and the spin w: drift = v - w x c.

    c is a fraction, so the drift is rounded to the grid of w x r. That is no approximation of the proof: *any* rigid
    motion may serve as its witness, and the rounded one is rigid, exact, and the only one used from here on.

    Where blocks are partly held no centre of mass may stir where it is held, not even by a rounding: then the grid is
    `finer` by so many bits that all spins are rounded to multiples of 24 V, with which w x c is on the grid, and the
    velocity of the centre of mass stays what the file says.
    """
    vx, vy, vz, *w = (_integer(x, per_velocity) << finer for x in row)
    denominator = 4 * solid.volume6
    if finer:
        w = [x // denominator * denominator for x in w]
    spin: Vec = (w[0], w[1], w[2])
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
# limit-bounds.


def _limit(sheet: _Sheet, model: _Model) -> tuple[dict[str, float], str]:
    """Check forces at the lower multiplier and a motion at the upper one, those that there are."""
    live = sheet.live
    assert live is not None
    figures: dict[str, float] = {}
    if live.lower is not None:
        figures = {"lower": live.lower} | _state(sheet, _multiplied(sheet, model, live, 1, live.lower))[0]
    if live.upper is not None:
        motions = _motions(sheet.motion, model, _exponent(chain.from_iterable(sheet.motion)))
        norm2 = _resistances2(sheet, model, motions)
        found = _driven(sheet, _multiplied(sheet, model, live, 1, live.upper), motions, norm2)
        figures |= {"upper": live.upper} | found
        _require_no_relief(sheet, _multiplied(sheet, model, live, 0, 1.0), motions, norm2, figures)
    balanced = max((figures[key] for key in ("equilibrium_force", "equilibrium_moment") if key in figures), default=0.0)
    stands = f"all blocks balance to {balanced:.2g} of the total weight" if live.lower is not None else ""
    falls = f"to hold the motion needs {figures['bound']:.2g} total weights" if live.upper is not None else ""
    return figures, "; ".join(part for part in (stands, falls) if part)


def _require_no_relief(
    sheet: _Sheet, grown: _Model, motions: Sequence[_Motion], norm2: int, figures: dict[str, float]
) -> None:
    """Require of the live loads alone that p.y >= 0 and (p.y)^2 >= (BOUND W)^2 norm2: then more of them is no help.

    Both p.y and what W is at the most are affine in the multiplier, so the motion proves every larger one too.
    """
    power24 = _power24(sheet, grown, motions)
    if not power24 >= 0:
        _refuse("the live loads work against the motion, so that more of them might hold it", figures)
    if not power24**2 >= (BOUND * 4 * grown.total6_above) ** 2 * norm2:
        _refuse("the live loads do too little work in the motion to prove anything of more of them", figures)


def _multiplied(sheet: _Sheet, model: _Model, live: _Live, dead: int, times: Number) -> _Model:
    """The model under `dead` (0 or 1) times its own gravity and loads plus `times` the live ones, exactly.

    With times = p / 2**k, all of them are counted in units 2**k finer.
    """
    p, q = times.as_integer_ratio()
    finer = q.bit_length() - 1
    per_gravity = _exponent(chain(sheet.gravity, live.gravity))
    per_load = _exponent(x for push in (*sheet.pushes, *live.pushes) for x in push.force)
    own, grown = _vector(sheet.gravity, per_gravity), _vector(live.gravity, per_gravity)
    gravity = _plus(_times(dead * q, own), _times(p, grown))
    loads = [
        (push.block, _times(share, _vector(push.force, per_load)), _vector(push.point, model.per_length))
        for share, pushes in ((dead * q, sheet.pushes), (p, live.pushes))
        for push in pushes
        if share and not sheet.stones[push.block].fixed
    ]
    per_density = _exponent(stone.density for stone in sheet.stones)
    per_weight = per_density + per_gravity + finer + 3 * model.per_length
    per_load += finer
    per_force = max(per_load, per_weight)
    units = per_force - per_weight, per_force - per_load
    below, above = _totals6(sheet, model.masses6, gravity, loads, *units)
    return replace(
        model,
        gravity=gravity,
        loads=loads,
        total6_below=below,
        total6_above=above,
        per_load=per_load,
        per_weight=per_weight,
        per_force=per_force,
    )


# ---------------------------------------------------------------------------------------------------------------------
# rbe-settled.


def _settled(sheet: _Sheet, model: _Model) -> tuple[dict[str, float], str]:
    """Check forces as for an rbe-state, and the displacement that they go with.

    With d = dd.N, x = dd, U the largest displacement of a contact point on a block that the ground moves, t = SETTLING
    and s = max(|F|, mean weight), all roots rounded so that less is allowed:

        d + t U |N| >= mu sqrt(|x|^2 |N|^2 - d^2)        |F.x| <= t U s        |F| d <= t U s |N|
    """
    per_force = _force_exponent(model, sheet.forces)
    forces = _vectors(sheet.forces, per_force)
    figures, sizes = _balance(sheet, model, forces, per_force)
    motions = _motions(sheet.motion, model, _exponent(chain.from_iterable(sheet.motion)))
    largest = math.isqrt(_settlement2(sheet, model, motions))
    if not largest > 0:
        _refuse("no contact point is on a block that the ground moves", figures)
    weight = _mean_weight_below(sheet, model, per_force)
    t = SETTLING
    worst = {"closing": 0.0, "work": 0.0, "hanging": 0.0, "opened": 0.0}
    first = 0
    for i, (joint, patch) in enumerate(zip(sheet.joints, model.patches, strict=True)):
        p, q = joint.mu.as_integer_ratio()
        a, b = motions[joint.a], motions[joint.b]
        drift, spin = _minus(b.drift, a.drift), _minus(b.spin, a.spin)
        size = math.isqrt(patch.normal2)
        room = t.numerator * largest * size // t.denominator
        for number, point in enumerate(patch.points):
            x, force = _plus(drift, _cross(spin, point)), forces[first + number]
            d = _dot(x, patch.normal)
            slid = p * _root_above(_dot(x, x) * patch.normal2 - d * d)
            strength = sizes[first + number][1]
            work, bearing = abs(_dot(force, x)), max(weight, math.isqrt(strength))
            hanging = max(d, 0) * _root_above(strength)
            worst["closing"] = max(worst["closing"], _as_float(slid - q * d, q * size * largest))
            worst["work"] = max(worst["work"], _as_float(work, bearing * largest))
            worst["hanging"] = max(worst["hanging"], _as_float(hanging, bearing * largest * size))
            worst["opened"] = max(worst["opened"], _as_float(d, size * largest))
            if not q * (d + room) >= slid:
                _refuse(f"{_label(sheet, i)}: point {number} closes, or slides without opening", figures | worst)
            if not t.denominator * work <= t.numerator * largest * bearing:
                _refuse(f"{_label(sheet, i)}: the force at point {number} does work", figures | worst)
            if not t.denominator * hanging <= t.numerator * largest * bearing * size:
                _refuse(f"{_label(sheet, i)}: point {number} has opened, but carries a force", figures | worst)
        first += len(patch.points)
    off = max(worst["closing"], worst["work"], worst["hanging"])
    return figures | worst, f"forces balance and go with the displacement, to {off:.2g} of the settlement"


def _settlement2(sheet: _Sheet, model: _Model, motions: Sequence[_Motion]) -> int:
    """The largest square of a displacement of a contact point on a fixed block."""
    most = 0
    for joint, patch in zip(sheet.joints, model.patches, strict=True):
        for block in (joint.a, joint.b):
            if sheet.stones[block].fixed:
                moved = (_plus(motions[block].drift, _cross(motions[block].spin, point)) for point in patch.points)
                most = max(most, *(_dot(x, x) for x in moved))
    return most


# ---------------------------------------------------------------------------------------------------------------------
# cra-state.


def _coupled_state(sheet: _Sheet, model: _Model) -> tuple[dict[str, float], str]:
    """Check forces as for an rbe-state, and the virtual displacement that they are coupled with."""
    per_force = _force_exponent(model, sheet.forces)
    forces = _vectors(sheet.forces, per_force)
    figures, sizes = _balance(sheet, model, forces, per_force)
    figures |= _coupling(sheet, model, forces, sizes, per_force)
    worst = max(figures[key] for key in ("gap", "complementarity", "alignment"))
    return figures, f"forces and displacements are in balance and coupled at every point, to {worst:.2g}"


class _Limits(NamedTuple):
    """Bounds of a virtual displacement at the points of one contact, for d = dd.N and x = dd, all integers.

    `closing`, `opening` bound -d and d; `sliding` and `rubbing` are the most and the least that |x|^2 |N|^2 - d^2 may
    be; `eps_below`, `eps_above`, `eta_above` bound eps |N| and eta |N|; `eps_square` is eps |N|^2; `weight` is the mean
    weight of a block.
    """

    closing: int
    opening: int
    sliding: int
    rubbing: int
    eps_below: int
    eps_above: int
    eps_square: int
    eta_above: int
    weight: int


def _limits(eps: int, eta: int, beta: int, weight: int, normal2: int) -> _Limits:
    """Relative to t = COUPLING: (1 + t)^2 = (q + p)^2 / q^2. What d may be at most is the root of what d^2 may be."""
    p, q = COUPLING.numerator, COUPLING.denominator
    wide, narrow, q2 = (q + p) ** 2 * normal2, (q - p) ** 2 * normal2, q * q
    sliding = eta * eta * wide // q2
    rubbing = _quotient_above(beta * beta * narrow, q2)
    closing, square = math.isqrt(eps * eps * wide // q2), eps * eps * normal2
    below, above = math.isqrt(square), _root_above(square)
    return _Limits(
        closing,
        math.isqrt(sliding),
        sliding,
        rubbing,
        below,
        above,
        eps * normal2,
        _root_above(eta * eta * normal2),
        weight,
    )


def _coupling(sheet: _Sheet, model: _Model, forces: list[Vec], sizes: Sizes, per_force: int) -> dict[str, float]:
    """Check the virtual displacement dd = (dn, dd_t) at every point against the force F = fn n + F_t there.

        -eps <= dn <= eta, |dd_t| <= eta        fn (dn + eps) = 0        F_t = -alpha dd_t, alpha >= 0
        |dd_t| >= beta_min where F_t is not 0

    each to `COUPLING`: lengths relative to the bound, work to eps max(|F|, mean weight).
    """
    assert sheet.bounds is not None
    bounds = sheet.bounds
    given = (bounds.eps, bounds.eta, bounds.beta)
    per_motion = _exponent(chain(given, chain.from_iterable(sheet.motion)))
    motions = _motions(sheet.motion, model, per_motion)
    eps, eta, beta = (_integer(x, per_motion) << model.per_length + model.finer for x in given)
    weight = _mean_weight_below(sheet, model, per_force)
    worst, fault = _Worst(), ""
    first = 0
    for i, (joint, patch) in enumerate(zip(sheet.joints, model.patches, strict=True)):
        limits = _limits(eps, eta, beta, weight, patch.normal2)
        last = first + len(patch.points)
        couples = zip(patch.points, forces[first:last], sizes[first:last], strict=True)
        wrong = _uncoupled(patch, limits, motions[joint.a], motions[joint.b], couples, worst)
        if wrong and not fault:
            fault = f"{_label(sheet, i)}: {wrong}"
        first = last
    figures = worst.figures(bounds)
    if fault:
        _refuse(fault, figures)
    return figures


@dataclass(slots=True)
class _Worst:
    """The worst of all points met so far, for the figures to print; `slide` relative to eta."""

    slide: float = 1.0
    gap: float = 0.0
    complementarity: float = 0.0
    alignment: float = 0.0

    def figures(self, bounds: _Bounds) -> dict[str, float]:
        """As they stand in the report."""
        least = float(Fraction(bounds.eta) / Fraction(bounds.eps)) * self.slide
        return {
            "gap": self.gap,
            "complementarity": self.complementarity,
            "alignment": self.alignment,
            "sliding_least": least,
        }


def _uncoupled(
    patch: _Patch,
    limits: _Limits,
    a: _Motion,
    b: _Motion,
    couples: Iterable[tuple[Vec, Vec, tuple[int, int]]],
    worst: _Worst,
) -> str:
    """What is wrong with the coupling of force and displacement at the points of a contact, or nothing.

    With N = |N| n, along = F.N and d = dd.N:

        |dd_t|^2 |N|^2 = |dd|^2 |N|^2 - d^2        fn (dn + eps) |N|^2 = along (d + eps |N|)
        |F_t|^2 |N|^2 = |F|^2 |N|^2 - along^2      F_t.dd_t |N|^2 = F.dd |N|^2 - along d
        |F_t x dd_t| |N| = |(F x dd).N|
    """
    p, q = COUPLING.numerator, COUPLING.denominator
    closing, opening, sliding, rubbing, below, above, square, eta, weight = limits
    (nx, ny, nz), normal2, fault = patch.normal, patch.normal2, ""
    (vx, vy, vz), (wx, wy, wz) = _minus(b.drift, a.drift), _minus(b.spin, a.spin)
    for number, ((x, y, z), (fx, fy, fz), (along, force2)) in enumerate(couples):
        mx, my, mz = vx + wy * z - wz * y, vy + wz * x - wx * z, vz + wx * y - wy * x
        d = mx * nx + my * ny + mz * nz
        slide2 = (mx * mx + my * my + mz * mz) * normal2 - d * d
        wrong = "" if -closing <= d else "overlaps by more than eps"
        if not (d <= opening and slide2 <= sliding):
            wrong = wrong or "moves by more than eta"
        if -d > below:
            worst.gap = max(worst.gap, _as_float(-d - below, below))
        if force2:
            size = max(weight, math.isqrt(force2))
            room = size * square
            work = along * max(abs(d + below), abs(d + above))
            worst.complementarity = max(worst.complementarity, _as_float(work, room))
            if not q * work <= p * room:
                wrong = wrong or "presses without overlapping by eps"
            rub2 = force2 * normal2 - along * along
            if rub2:
                reach = size * below
                across = abs((fy * mz - fz * my) * nx + (fz * mx - fx * mz) * ny + (fx * my - fy * mx) * nz)
                forward = (fx * mx + fy * my + fz * mz) * normal2 - along * d
                worst.alignment = max(worst.alignment, _as_float(across, reach), _as_float(forward, room))
                if not (q * across <= p * reach and q * forward <= p * room):
                    wrong = wrong or "has friction that does not oppose its sliding"
                if q * q * rub2 > p * p * size * size * normal2:
                    worst.slide = min(worst.slide, _as_float(math.isqrt(slide2), eta))
                    if not (slide2 >= rubbing and forward < 0):
                        wrong = wrong or "has friction but slides by less than beta_min"
        if wrong and not fault:
            fault = f"point {number} {wrong}"
    return fault


def _mean_weight_below(sheet: _Sheet, model: _Model, per_force: int) -> int:
    """Total weight W over the number of free blocks, in 2**-per_force N, rounded down."""
    free = sum(not stone.fixed for stone in sheet.stones)
    return (model.total6_below << per_force) // (6 * max(free, 1) << model.per_force)


# ---------------------------------------------------------------------------------------------------------------------
# cra-tree.


@dataclass(frozen=True, slots=True)
class _Spot:
    """A contact point, ready for the leaves: blocks, place, N with |N|^2, bounds of 2**ROOT_BITS |N|, and mu = p/q."""

    a: int
    b: int
    point: Vec
    normal: Vec
    normal2: int
    below: int
    above: int
    p: int
    q: int


@dataclass(frozen=True, slots=True)
class _Ray:
    """A direction in a contact's plane: any vector, |N|^2 times its projection, and bounds of that one's length."""

    vector: Vec
    flat: Vec
    below: int
    above: int


@dataclass(frozen=True, slots=True)
class _Zone:
    """What a cell says about a contact point.

    Engaged: dn = -eps; unloaded: F = 0. dd_t = s e with a unit vector e in the sector (any without one) and s between
    `slow` and `fast`; friction is -r e with the same e.
    """

    engaged: bool
    unloaded: bool
    sector: tuple[_Ray, _Ray] | None
    slow: int
    fast: int


@dataclass(frozen=True, slots=True)
class _Reach:
    """Bounds that hold for every coupled state, from above.

    Per block 2**`per_shift` times the displacement of its centre of mass and 2**`per_turn` times its rotation (zero
    where fixed), and the sum of all normal forces.
    """

    shifts: list[int]
    turns: list[int]
    per_shift: int
    per_turn: int
    thrust: Fraction


@dataclass(frozen=True, slots=True)
class _Range:
    """The bounds of the displacement as integers, times 2**`per`."""

    eps: int
    eta: int
    beta: int
    per: int


@dataclass(frozen=True, slots=True)
class _Case:
    """What all leaves of a tree share."""

    sheet: _Sheet
    model: _Model
    spots: list[_Spot]
    span: _Range
    reach: _Reach


def _tree(sheet: _Sheet, model: _Model) -> tuple[dict[str, float], str]:
    """Check that the branches of a tree cover all coupled states, and that no leaf holds one."""
    case = _case(sheet, model)
    figures = {"nodes": float(len(sheet.tree)), "leaves": 0.0, "depth": 0.0, "least_margin": 1.0}
    pending = [(0, [_Zone(False, False, None, 0, case.span.eta)] * len(case.spots))]
    for number, node in enumerate(sheet.tree):
        depth, zones = pending.pop()
        if isinstance(node, _Split):
            parts = _parts(node, case.spots[node.point], zones[node.point], case.span, f"tree node {number}: ")
            before, after = zones[: node.point], zones[node.point + 1 :]
            pending.extend((depth + 1, [*before, part, *after]) for part in reversed(parts))
        else:
            figures["leaves"] += 1
            figures["depth"] = max(figures["depth"], depth)
            margin, size = _margin(case, zones, node)
            figures["least_margin"] = min(figures["least_margin"], _ratio(margin, size))
            if not margin > 0:
                _refuse(f"tree node {number}: this leaf does not exclude all of its cell", figures)
    return figures, f"no coupled state exists: {figures['leaves']:.0f} cells cover all of them, and each is empty"


def _case(sheet: _Sheet, model: _Model) -> _Case:
    assert sheet.bounds is not None
    bounds = sheet.bounds
    speeds = [node.speed for node in sheet.tree if isinstance(node, _Split) and node.speed is not None]
    per = _exponent([bounds.eps, bounds.eta, bounds.beta, *speeds])
    span = _Range(_integer(bounds.eps, per), _integer(bounds.eta, per), _integer(bounds.beta, per), per)
    return _Case(sheet, model, _spots(sheet, model), span, _reach(sheet, model))


def _ratio(a: Fraction, b: Fraction) -> float:
    return _as_float(a.numerator * b.denominator, a.denominator * b.numerator)


def _spots(sheet: _Sheet, model: _Model) -> list[_Spot]:
    """All contact points in their order."""
    spots = []
    for joint, patch in zip(sheet.joints, model.patches, strict=True):
        scaled = patch.normal2 << 2 * ROOT_BITS
        p, q = joint.mu.as_integer_ratio()
        size = math.isqrt(scaled), _root_above(scaled)
        spots += [_Spot(joint.a, joint.b, r, patch.normal, patch.normal2, *size, p, q) for r in patch.points]
    return spots


def _parts(node: _Split, spot: _Spot, zone: _Zone, span: _Range, where: str) -> list[_Zone]:
    """Cut what a cell says about a point into the parts that the branches take; together they cover it."""
    if node.rays:
        return [replace(zone, sector=sector) for sector in _sectors(node, spot, zone.sector, where)]
    if node.speed is not None:
        speed = _integer(node.speed, span.per)
        if not zone.slow < speed < zone.fast:
            _refuse(f"{where}speed is not inside the interval that is left")
        return [replace(zone, fast=speed), replace(zone, slow=speed)]
    if zone.engaged or zone.unloaded:
        _refuse(f"{where}the point is already engaged or unloaded")
    return [replace(zone, engaged=True), replace(zone, unloaded=True)]


def _sectors(node: _Split, spot: _Spot, sector: tuple[_Ray, _Ray] | None, where: str) -> list[tuple[_Ray, _Ray]]:
    """Sectors between rays in counter-clockwise order about N: once around, or inside the sector given.

    Ray c is ahead of ray b by less than half a turn iff det(N, b, c) > 0. Rays that are ahead of each other all around
    come round once iff the first is not met again before the end.
    """
    rays = [_ray(row, spot) for row in node.rays]
    ring = [*rays, rays[0]] if sector is None else [sector[0], *rays, sector[1]]
    if node.branches != len(ring) - 1:
        _refuse(f"{where}{node.branches} sectors for {len(node.rays)} rays")
    found = list(pairwise(ring))
    if not all(_turn(spot, one.vector, two.vector) > 0 for one, two in found):
        _refuse(f"{where}a sector is empty, turns the wrong way round or is 180 degrees or wider")
    first, last = ring[0].vector, ring[-1].vector
    if sector is None:
        once = not any(_is_between(spot, one.vector, first, two.vector) for one, two in found[:-1])
    else:
        once = all(_turn(spot, first, ray.vector) > 0 and _turn(spot, ray.vector, last) > 0 for ray in rays)
    if not once:
        _refuse(f"{where}the rays go round more than once, or leave the sector that they split")
    return found


def _ray(row: Sequence[Number], spot: _Spot) -> _Ray:
    vector = _vector(row, _exponent(row))
    flat = _minus(_times(spot.normal2, vector), _times(_dot(vector, spot.normal), spot.normal))
    length2 = _dot(flat, flat)
    return _Ray(vector, flat, math.isqrt(length2), _root_above(length2))


def _turn(spot: _Spot, one: Vec, two: Vec) -> int:
    """det(N, one, two): positive if `two` lies to the left of `one`, seen against N."""
    return _dot(spot.normal, _cross(one, two))


def _is_between(spot: _Spot, start: Vec, x: Vec, end: Vec) -> bool:
    """Whether x points into a sector of less than half a turn, its end included and its start not."""
    return _turn(spot, start, x) > 0 and _turn(spot, x, end) >= 0


def _margin(case: _Case, zones: Sequence[_Zone], leaf: _Leaf) -> tuple[Fraction, Fraction]:
    """By how much a leaf excludes its cell (if positive), rounded down, and the size of what it compares.

    Let (f, dd = A' dq) be a coupled state in the cell, p the weights and loads, y the leaf's motion (or 0), w its
    forces (or 0), l = 1 if it has both, else 0. Virtual work holds for y and for dq:

        p.y = -sum F.dd^y        p.dq = sum (eps fn + |F_t| |dd_t|)        (l p - r).dq = sum w.dd        r = l p - A w

    With v_k fn >= -F.dd^y - l (eps fn + |F_t| |dd_t|) at every point, the sum of the first two equations gives
    p.y - sum v_k fn <= l p.dq, and the third gives l p.dq <= U,

        U = sum sup(w.dd) + sum (|r_F| V + |r_M| Omega)

    with the suprema over the cell. Hence the cell is empty if p.y - max(v) sum fn > U.
    """
    coupled = leaf.motion is not None and leaf.forces is not None
    gained, lost = _gain(case, zones, leaf.motion, coupled), _loss(case, zones, leaf.forces, coupled)
    return gained[0] - lost[0], gained[1] + lost[1]


def _gain(
    case: _Case, zones: Sequence[_Zone], rows: list[Sequence[Number]] | None, coupled: bool
) -> tuple[Fraction, Fraction]:
    """p.y - max(v) sum fn, rounded down; and the sum of both sizes.

    v = max(0, -g, -g - mu (l max(beta_min, slow) - h)) with g = l eps + dn^y and h the largest e.dd_t^y in the sector:
    the most that a unit of fn at a point can take from p.y.
    """
    if rows is None:
        return Fraction(0), Fraction(0)
    per_motion = _exponent(chain.from_iterable(rows))
    span, motions = case.span, _motions(rows, case.model, per_motion)
    per_place = per_motion + case.model.per_length + case.model.finer
    per = max(per_place, span.per)
    up, fine = per - per_place, coupled << (per - span.per + ROOT_BITS)
    most = 0
    for spot, zone in zip(case.spots, zones, strict=True):
        if not zone.unloaded:
            a, b = motions[spot.a], motions[spot.b]
            spin = _minus(b.spin, a.spin)
            move = _plus(_minus(b.drift, a.drift), _cross(spin, spot.point))
            d = _dot(move, spot.normal) << 2 * ROOT_BITS
            held = fine * span.eps + (d // (spot.above if d >= 0 else spot.below) << up)
            slip = (_farthest(move, spot, zone.sector) << up) - fine * max(span.beta, zone.slow)
            most = max(most, -held, -held - (-spot.p * slip // spot.q))
    power = Fraction(_power24(case.sheet, case.model, motions), 24 << case.model.per_force + per_place)
    taken = Fraction(most, 1 << per + ROOT_BITS) * case.reach.thrust
    return power - taken, abs(power) + taken


def _loss(
    case: _Case, zones: Sequence[_Zone], rows: list[Sequence[Number]] | None, coupled: bool
) -> tuple[Fraction, Fraction]:
    """U, rounded up, and the sum of the sizes of its parts."""
    if rows is None:
        return Fraction(0), Fraction(0)
    model, span, reach = case.model, case.span, case.reach
    per_force = _force_exponent(model, rows)
    forces = _vectors(rows, per_force)
    work, gross = 0, 0
    for spot, zone, force in zip(case.spots, zones, forces, strict=True):
        if any(force):
            along = _dot(force, spot.normal) << 2 * ROOT_BITS
            least = -span.eps if zone.engaged or along < 0 else span.eta
            normal = _above(least * along, spot)
            h = _farthest(force, spot, zone.sector)
            tangential = h * (zone.fast if h >= 0 else zone.slow)
            work += normal + tangential
            gross += abs(normal) + abs(tangential)
    opposite = [(-x, -y, -z) for x, y, z in forces]
    resultants = _resultants(case.sheet, model, opposite, per_force, loaded=coupled)
    pushed6, turned = 0, 0
    for i, residual6, moment in _residuals(case.sheet, model, resultants, per_force, weighty=coupled):
        pushed6 += _root_above(_dot(residual6, residual6)) * reach.shifts[i]
        turned += _root_above(_dot(moment, moment)) * reach.turns[i]
    slack = Fraction(pushed6, 6 << max(per_force, model.per_force) + reach.per_shift) + Fraction(
        turned, 1 << per_force + model.per_length + reach.per_turn
    )
    unit = 1 << per_force + span.per + ROOT_BITS
    return Fraction(work, unit) + slack, Fraction(gross, unit) + slack


def _above(numerator: int, spot: _Spot) -> int:
    """Numerator / (2**ROOT_BITS |N|), rounded up."""
    return -(-numerator // (spot.below if numerator >= 0 else spot.above))


def _farthest(x: Vec, spot: _Spot, sector: tuple[_Ray, _Ray] | None) -> int:
    """2**ROOT_BITS times the largest e.x over the unit vectors e of a sector in the contact's plane, rounded up.

    That is |x_t| if x_t lies in the sector, and else at one of its two rays.
    """
    if sector is not None:
        one, two = sector
        if not (_turn(spot, one.vector, x) >= 0 and _turn(spot, x, two.vector) >= 0):
            return max(_component(x, one), _component(x, two))
    along = _dot(x, spot.normal)
    return _above(_root_above(_dot(x, x) * spot.normal2 - along * along) << 2 * ROOT_BITS, spot)


def _component(x: Vec, ray: _Ray) -> int:
    """2**ROOT_BITS times the component of x along a ray, rounded up."""
    product = _dot(x, ray.flat) << ROOT_BITS
    return -(-product // (ray.below if product >= 0 else ray.above))


def _reach(sheet: _Sheet, model: _Model) -> _Reach:
    """Bound displacements, rotations and normal forces of every coupled state.

    No point of a contact moves by more than D = sqrt(2) max(eps, eta) against its neighbour. Three points r0, r1, r2
    that span a triangle (e1, e2, n = e1 x e2) bound the relative rotation w: |w x e1| <= 2 D bounds its part across
    e1, and |w x e2| <= 2 D then that along e1,

        |w| <= 2 D / |e1| + 2 D (|e1| + |e2|) / |n|

    and from support to support: Omega_b = Omega_a + |w|, V_b = V_a + Omega_a |r0 - c_a| + D + Omega_b |c_b - r0|.
    Forces: eps sum fn <= p.dq <= sum |p_F| V + |p_M| Omega.
    """
    assert sheet.bounds is not None
    far = _root_of(2 * Fraction(max(sheet.bounds.eps, sheet.bounds.eta)) ** 2)
    hinges = [
        hinge
        for joint, patch in zip(sheet.joints, model.patches, strict=True)
        for hinge in _hinges(joint, patch, model, far)
        if not sheet.stones[hinge.to].fixed
    ]
    bounds = {i: (Fraction(0), Fraction(0)) for i, stone in enumerate(sheet.stones) if stone.fixed}
    for _ in sheet.stones:  # as often as a chain of contacts can be long
        before = dict(bounds)
        for hinge in hinges:
            if hinge.start in before:
                shift, turn = before[hinge.start]
                turned = _rounded_up(turn + hinge.turn)
                shifted = _rounded_up(shift + turn * hinge.lever_start + far + turned * hinge.lever_to)
                old_shift, old_turn = bounds.get(hinge.to, (shifted, turned))
                bounds[hinge.to] = min(shifted, old_shift), min(turned, old_turn)
        if bounds == before:
            break
    for i, stone in enumerate(sheet.stones):
        if i not in bounds:
            _refuse(f"block {_short(stone.name)} hangs on no support, not even by way of others")
    return _collected(sheet, model, [bounds[i] for i in range(len(sheet.stones))])


@dataclass(frozen=True, slots=True)
class _Hinge:
    """A contact taken from one block to the other: relative rotation, and how far both centres of mass are from r0."""

    start: int
    to: int
    turn: Fraction
    lever_start: Fraction
    lever_to: Fraction


def _hinges(joint: _Joint, patch: _Patch, model: _Model, far: Fraction) -> list[_Hinge]:
    """Both ways across a contact: r0 is its first point, r1 the one furthest from it, r2 the one furthest aside."""
    k = model.per_length
    origin = patch.points[0]
    arms = [_minus(point, origin) for point in patch.points]
    e1 = max(arms, key=lambda arm: _dot(arm, arm))
    e2 = max(arms, key=lambda arm: _dot(_cross(e1, arm), _cross(e1, arm)))
    n = _cross(e1, e2)
    one, two, area2 = _dot(e1, e1), _dot(e2, e2), _dot(n, n)
    turn = (
        2
        * far
        * (1 / _root_of(one, k, up=False) + (_root_of(one, k) + _root_of(two, k)) / _root_of(area2, 2 * k, up=False))
    )
    levers = []
    for block in (joint.a, joint.b):
        solid = model.solids[block]
        arm = _minus(_times(4 * solid.volume6, origin), solid.moment24)
        levers.append(_root_of(_dot(arm, arm), k) / (4 * solid.volume6))
    a, b = levers
    return [_Hinge(joint.a, joint.b, turn, a, b), _Hinge(joint.b, joint.a, turn, b, a)]


def _root_of(x: Fraction | int, k: int = 0, *, up: bool = True) -> Fraction:
    """Root of x, over 2**k, rounded.

    >>> float(_root_of(2)), _root_of(Fraction(9, 4), 1), _root_of(0)
    (1.4142135623730951, Fraction(3, 4), Fraction(0, 1))
    """
    numerator, denominator = x.as_integer_ratio()
    scaled = numerator * denominator << 2 * ROOT_BITS
    return Fraction(_root_above(scaled) if up else math.isqrt(scaled), denominator << ROOT_BITS + k)


def _rounded_up(x: Fraction) -> Fraction:
    """A short fraction that is at least x >= 0, and larger by less than 2**-ROOT_BITS of it.

    >>> float(_rounded_up(Fraction(1, 3))), _rounded_up(Fraction(3, 4))
    (0.3333333333333333, Fraction(3, 4))
    """
    if x == 0:
        return x
    k = ROOT_BITS + 1 + x.denominator.bit_length() - x.numerator.bit_length()
    return Fraction(math.ceil(x * Fraction(2) ** k)) / Fraction(2) ** k


def _collected(sheet: _Sheet, model: _Model, bounds: Sequence[tuple[Fraction, Fraction]]) -> _Reach:
    """Bring the bounds of all blocks to common denominators, and with them the sum of all normal forces."""
    assert sheet.bounds is not None
    work = Fraction(0)
    loads = _resultants(sheet, model, [(0, 0, 0)] * sum(len(p.points) for p in model.patches), model.per_load)
    for i, push6, moment in _residuals(sheet, model, loads, model.per_load):
        shift, turn = bounds[i]
        work += Fraction(_root_above(_dot(push6, push6)), 6 << model.per_force) * shift
        work += Fraction(_root_above(_dot(moment, moment)), 1 << model.per_load + model.per_length) * turn
    per_shift, per_turn = (max(b[j].denominator for b in bounds).bit_length() - 1 for j in (0, 1))
    shifts, turns = ([int(b[j] * (1 << per)) for b in bounds] for j, per in ((0, per_shift), (1, per_turn)))
    return _Reach(shifts, turns, per_shift, per_turn, work / Fraction(sheet.bounds.eps))


PROOFS = {
    "rbe-state": _state,
    "rbe-mechanism": _mechanism,
    "cra-state": _coupled_state,
    "cra-tree": _tree,
    "limit-bounds": _limit,
    "rbe-settled": _settled,
}


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
