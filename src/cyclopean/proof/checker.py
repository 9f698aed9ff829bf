"""Independent checker of certificates: it reads one file, trusts nothing but the model in it, and recomputes the proof.

Standard library only, one file, nothing of the program that wrote the certificate. Three ways to run it:

    python checker.py CERT.json        python -m cyclopean.proof CERT.json        verify(json.load(file))

**What is proved.** A certificate `cyclopean.certificate/2` holds blocks (closed polygon meshes, metres), contacts
(planar polygons, whose area normal N points from block `a` into block `b`, or single points with a normal N), loads,
gravity, and one of eight proofs. A tolerance belongs to the block, the point or the component (free blocks that
contacts join) that it is about.

*rbe-state*, "stable under rigid-block equilibrium": a force F on `b` (and -F on `a`) at every vertex of every contact
polygon. No force pulls, F.N >= 0; none leaves its friction cone, |F|^2 |N|^2 <= (1 + mu^2) (F.N)^2; together they are
no larger than `BOUND` times what the component weighs and bears. All that exactly. And on every free block forces and
moments balance weight and loads: to `BALANCE` of the block's own weight (moments: times the diagonal of its box), and
exactly, where what is left can be sent down to the supports without leaving a cone; where it cannot, to `BALANCE` of
the lightest block of the component. The claim says which.

*rbe-mechanism*, "unstable": a velocity v and a spin w for every free block. With dd the velocity of `b` relative to
`a` at a contact point, virtual work gives for every state of a component, with f its forces and r what they leave,

    p.y = sum f.(-dd) + sum r.y <= ||f|| ||P(-dd)|| + sum |r| |y|        (P projects onto the friction cone)

so that no state exists where p.y is more than the bounds of ||f|| and |r| allow. One component is enough. The claim is
about the contacts listed, with Coulomb cones and associated (dilatant) flow, and nothing else.

*cra-state*, "stable under coupled rigid-block analysis": forces as in an rbe-state, and a virtual displacement of every
free block that they are coupled with. With dd = dn n + dd_t the displacement of `b` relative to `a` at a contact point:
no point overlaps by more than eps, dn >= -eps, or moves by more than eta; only points that overlap by eps press,
fn (dn + eps) = 0; and friction opposes sliding, F_t = -alpha dd_t with alpha >= 0, of at least beta_min. To `COUPLING`.

*cra-tree*, "unstable under coupled rigid-block analysis": a tree that splits all such states into cells (a point is
engaged, dn = -eps, or unloaded, F = 0; it slides in one sector or another, by less or by more than some amount; and
so do all points that move alike because blocks are held), and at each leaf multipliers that prove the cell empty: see
`_margin`. The claim is about the contacts listed, eta / eps and
beta_min / eps.

*limit-bounds*, bounds of a multiplier: loads p0 + t p1, p1 the `live` ones. At t = `lower` forces, as in an rbe-state.
At t = `upper` a motion y, as in an rbe-mechanism, in which the live loads do not work backwards, p1.y >= 0: what drives
it at `upper` then drives it at every larger t. Either side may be absent. Instead of `upper` there may be a
`recession`, forces that balance p1 alone: any multiple of them, added to those at `lower`, holds a larger multiplier.

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
point of the component on a block that the ground moves. The first two make it the least of -p.y over all such, so that
nothing moves further; with the third no force is due to sliding that opens, which dry stone does not do.

**Other drawings.** *rbe-state-within*, *rbe-mechanism-within*: that every drawing of a family stands, or falls. In the
family vertices and the points of loads are within a length L of where they are here, and so are contacts, whose normals
lean by no more than an angle. A state lists points inside the contacts, which have points of every drawing above or
below them, and forces there: these and small ones beside them, of which only sizes are known, balance every drawing.
A motion is one that no drawing resists. See `_state_within` and `_mechanism_within`.

**Pyramids.** A contact may have `edges`, K directions e_k: rigid-block equilibrium only, to compare with programs that
have no round cones. At every point it then bears along these, F = sum l_k e_k with l_k >= 0, and is for a motion what K
contacts without friction are whose normals are the e_k; `mu` has no say. The claim tells how much friction they reach.

**What is checked first.** Meshes closed, turned outward (exact volume > 0) and bounding solids (no shell without volume
or inside out, no two faces that lie on each other: see `_require_solid`); every contact point within `tolerance`
of a face of `a` that looks along N and of a face of `b` that looks against N, to a thousandth; where the file says that
surfaces are rough or curved, to 18 degrees, and forces are inside the cones about the faces' normals as well. Where it
says that they touch at points, a corner or an edge of one of the blocks may be on a face of the other, or an edge of
each across the other: what of the block is near is then behind the plane, see `_top`. At a contact no more of the
tolerance counts than a share of the smaller block, and none but such is as narrow as a few tolerances.
The claim tells how far contacts are off, and how deep blocks overlap. Not checked: whether all contacts that exist are
listed. (By rigid-block equilibrium fewer contacts make a state harder, a mechanism easier.)

**Arithmetic.** A float is the exact fraction it is. Each kind of quantity (lengths, forces, densities, gravity,
velocities, displacements) is multiplied by one power of two that turns all of it into integers; every decision compares
integers. Roots are integer roots, rounded in the direction that never helps the claim. Floats appear in printed figures
only.
"""

import gc
import hashlib
import heapq
import json
import math
import os
import sys
from bisect import bisect_left
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from fractions import Fraction
from itertools import chain, combinations, pairwise, product
from typing import Any, NamedTuple, NoReturn, TypeVar

__all__ = ["Memory", "NotACertificateError", "Report", "main", "read_file", "seal", "verify", "verify_file"]

# ---------------------------------------------------------------------------------------------------------------------
# Thresholds. They live here so that no file can weaken them.

SCHEMA = "cyclopean.certificate/2"
FIRST_SCHEMA = "cyclopean.certificate/1"

BALANCE = Fraction(1, 10**9)
"""Largest out-of-balance force on a block, relative to that block's own weight (moment: to that times the diagonal of
its box). Doubles reach 1e-12; 1e-9 of a stone of a tonne is the weight of a grain of sand."""

BOUND = 10**6
"""Forces in total weights of a component (free blocks joined by contacts) that a state may not exceed, and that a
mechanism must demand: so no model has both. No masonry bears a million times itself; a solver's mechanism is exact to
about 1e-13, so that a true one passes easily and a nearly stable model does not."""

FACE_ALIGNMENT = Fraction(19, 20)
"""Least cosine (18 degrees) between a contact's normal and its faces where the file says that the surface is rough or
curved: facets may stand for a curved joint, cut into ten or more a half circle; the side of a block may not stand for
its top. Forces are then inside the cones about the faces' normals as well."""

TOLERANCE_SHARE, ROUGH_SHARE = Fraction(5, 1000), Fraction(25, 1000)
"""Largest tolerance that counts at a contact, relative to the diagonal of the box around the smaller of its blocks: a
huge neighbour must not make room for floating contacts. The second where a surface is rough or curved."""

COUPLING = Fraction(1, 10**9)
"""How far a coupled state may miss its conditions at a point: displacements relative to eps, eta and beta_min, work
relative to eps times the point's force (or the weight of the lighter free block there, where that is larger)."""

SETTLING = Fraction(1, 10**7)
"""How far a settled state may miss its conditions: displacements relative to the settlement of the component, work
relative to that times the point's force (or the weight of the lighter free block there, where that is larger)."""

SHORT = 1000
"""By which a sliding of less than eps / 1000 is multiplied to measure whether friction opposes it, instead of by eps:
else the direction of a very short one would mean nothing."""

TINY, HUGE = 1e-150, 1e100
"""Magnitudes of non-zero numbers accepted. Rounding noise (1e-17 * 1e-17) fits in; an exponent meant to make the
integers, and so the time and memory taken, explode does not."""

GUARD_BITS = 96
"""The largest number of each kind but lengths becomes an integer of at least so many bits, so that integer roots and
divisions lose less than 1e-28 even where the file holds small whole numbers."""

VISITS, VISITS_PER_BYTE = 600_000, 50
"""Contact points and blocks that all leaves of a tree may look at together: so many, and so many more for each byte of
the certificate beyond `SMALL`. Each takes some microseconds. An honest leaf says something of every free block."""

STANDARD_GRAVITY = 9.80665  # by which a block's own weight is counted in a model without gravity
STEEP = 5  # friction above which forces are not corrected, see `_require_modest`
LEAN = 10**6  # 1 / sin^2 of the angle, a thousandth, by which a contact's normal may lean from the faces it lies on
NARROW = 4  # tolerances: a contact no wider (area over half its perimeter) carries nothing: it may not be there
TWICE = Fraction(1, 1000)  # share of a joint's area that may pull twice
CROSSING = 100  # 1 / sin^2 of the least angle, a tenth, of two edges that touch across each other

TOLD_LEAN, TOLD_SHARE = 1e-4, 1e-5  # lean, and misfit by the smaller block's size, from which the claim tells them
ROOT_BITS = 64  # after the point of roots of integers that may be small
MAX_DEPTH, MAX_NODES = 250, 1_000_000  # of a tree: each split settles something of one point, honest ones are far off
LONG = 256  # bits of lengths and motions from which on a visit counts double, from twice as many threefold, and so on
SMALL = 1_000_000  # bytes of a certificate that must cost next to nothing whatever is in it
LARGEST = 1 << 30  # bytes of the largest certificate that is read at all
ROUNDED_MU = 1e-9  # friction of a pyramid below which the claim says 0: edges along the normal, but for rounding
EQUALLY_DEEP = 1 - 1e-9  # share of the deepest overlap from which one counts as deep as it: the first of them is named
SLIPPERY = 2  # a friction coefficient above which the claim says it: no dry stone has one

CLAIMS = {
    "rbe-state": "stable under rigid-block equilibrium",
    "rbe-mechanism": "unstable under rigid-block equilibrium (listed contacts, associated flow)",
    "cra-state": "stable under coupled rigid-block analysis",
    "cra-tree": "unstable under coupled rigid-block analysis",
    "limit-bounds": "bounds of the live loads' multiplier under rigid-block equilibrium",
    "rbe-settled": "comes to rest after an infinitesimal settlement, under rigid-block equilibrium"
    " (listed contacts, associated flow)",
    "rbe-state-within": "stable under rigid-block equilibrium in every drawing",
    "rbe-mechanism-within": "unstable under rigid-block equilibrium in every drawing",
}
BOUND_FIELDS = {"eps", "eta", "beta_min"}
PROOF_FIELDS = {
    "rbe-state": {"forces"},
    "rbe-mechanism": {"mechanism"},
    "cra-state": {"forces", "mechanism"} | BOUND_FIELDS,
    "cra-tree": {"tree"} | BOUND_FIELDS,
    "limit-bounds": {"live"},
    "rbe-settled": {"forces", "mechanism", "settlements"},
    "rbe-state-within": {"within", "points", "forces", "ways"},
    "rbe-mechanism-within": {"within", "motions"},
}
LIMIT_SIDES = ({"lower", "forces"}, {"upper", "mechanism"})
UNBOUNDED_FIELDS = {"lower", "forces", "recession"}
SURFACES = ("rough", "curved", "point")
STONE_FIELDS = {"id", "vertices", "faces", "density", "fixed"}
JOINT_FIELDS = {"a", "b", "polygon", "mu"}
DIRECTIONS = ("x", "y", "z", "rx", "ry", "rz")
EDGED_KINDS = {"rbe-state", "rbe-mechanism"}
MAX_EDGES = 360  # of a pyramid: each stands for a contact at every point, so that their number must not run away
PULLING_KINDS = {"rbe-state", "rbe-mechanism", "limit-bounds"}
COMMON_FIELDS = {"schema", "kind", "gravity", "tolerance", "blocks", "contacts", "loads", "seal"}

Number = float
Vec = tuple[int, int, int]
Item = TypeVar("Item")


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
        `equilibrium_moment` (in the block's own weight, must not exceed 1e-9) and `exact` (share of the components that
        balance exactly); for a mechanism `bound` (weights and loads of its component, must reach 1e6;
        the largest float when no contact resists at all).
        For a coupled state also `gap`, `complementarity`, `alignment` (relative, must not exceed 1e-9) and
        `sliding_least` (eps; eta where there is no friction); for a tree `nodes`, `leaves`, `depth` and `least_margin`
        (what the tightest leaf has to spare, relative to the work that it compares).
    assumed : tuple of str
        What the proof takes as given: blocks, supports, contacts, friction, density, gravity, loads, tolerance; one
        line each. Empty when that cannot be read.
    """

    proved: bool
    kind: str
    claim: str
    reason: str
    figures: dict[str, float] = field(default_factory=dict)
    assumed: tuple[str, ...] = ()


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
    return hashlib.sha256(_canonical(certificate)).hexdigest()


def _canonical(certificate: Mapping[str, object]) -> bytes:
    """The text that a seal covers."""
    rest = {key: value for key, value in certificate.items() if key != "seal"}
    return json.dumps(rest, sort_keys=True, separators=(",", ":"), allow_nan=False).encode("utf-8")


class Memory:
    """What certificates of one structure, as it grows, have in common: what follows from shapes alone, found once.

    Every entry is kept by all the integers that it was computed from, so that the answers are those of a checker
    without a memory. Forces, displacements and balance are looked at anew each time.

    Parameters
    ----------
    most : int
        Shapes of the same faces, and outlines of contacts, that are kept.
    """

    def __init__(self, most: int = 1 << 16) -> None:
        self.most = most
        self.surfaces: dict[tuple[tuple[int, ...], ...], _Surface] = {}
        self.outlines: dict[object, tuple[Vec, int]] = {}


def verify(certificate: Mapping[str, object], memory: Memory | None = None) -> Report:
    """Check one certificate; whatever is malformed is answered with `proved=False`, never with an exception.

    Parameters
    ----------
    certificate : mapping
        As read from its file.
    memory : Memory, optional
        Of certificates before; it spares work, and changes no answer.

    Examples
    --------
    >>> verify({"schema": "cyclopean.certificate/2", "kind": "rbe-state"}).reason
    'fields missing: blocks, contacts, forces, gravity, loads, seal, tolerance'
    """
    with _uncollected():
        return _checked(certificate, b"", memory)


def _checked(certificate: Mapping[str, object], data: bytes, memory: Memory | None = None) -> Report:
    """Check a certificate; `data` is the file that it comes from, if any."""
    kind = certificate.get("kind") if isinstance(certificate, Mapping) else None
    kind = kind if isinstance(kind, str) and kind in CLAIMS else ""
    claim = CLAIMS.get(kind, "")
    figures: dict[str, float] = {}
    assumed: tuple[str, ...] = ()
    memory = Memory(MAX_KEPT) if memory is None else memory
    try:
        sheet = _read(certificate, data, memory)
        claim += _conditions(sheet)
        figures = _counts(sheet)
        assumed = _assumptions(sheet)
        model = _weigh(sheet, memory)
        told, measured, unseen = _geometry_told(model)
        assumed = (*assumed, *unseen)
        claim, figures = claim + model.misfit.claimed() + told, figures | model.misfit.figures() | measured
        result, reason, grade = PROOFS[kind](model)
        claim, figures = claim + grade, figures | result
    except _RefusedError as refusal:
        return Report(False, kind, claim, str(refusal), figures | refusal.figures, assumed)
    return Report(True, kind, claim, reason, figures, assumed)


def verify_file(path: str | os.PathLike[str]) -> Report:
    """Check the certificate in a file; raises what `read_file` does."""
    with _uncollected():
        data = _bytes_of(path)
        return _checked(_parsed(data), data)


def read_file(path: str | os.PathLike[str]) -> dict[str, object]:
    """Read a file that says that it is a certificate; nothing more is checked.

    Raises
    ------
    OSError
        The file cannot be read.
    NotACertificateError
        It is not JSON, or not an object whose `schema` begins with `cyclopean.certificate/`; or it is too large.
    """
    with _uncollected():
        return _parsed(_bytes_of(path))


@contextmanager
def _uncollected() -> Iterator[None]:
    """Spare the search for garbage in cycles: there is none, and it would go through all numbers many times."""
    was = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was:
            gc.enable()


def _bytes_of(path: str | os.PathLike[str]) -> bytes:
    with open(path, "rb") as file:
        data = file.read(LARGEST + 1)
    if len(data) > LARGEST:
        raise NotACertificateError(f"holds more than {LARGEST >> 20} MB, more than any certificate")
    return data


def _parsed(data: bytes) -> dict[str, object]:
    try:
        content: Any = json.loads(data, object_pairs_hook=_object_without_repeats)
    except NotACertificateError:
        raise
    except (ValueError, RecursionError) as error:
        raise NotACertificateError(f"is not JSON: {_short(str(error), 200)}") from error
    schema = content.get("schema") if isinstance(content, dict) else None
    if not (isinstance(schema, str) and schema.startswith("cyclopean.certificate/")):
        raise NotACertificateError("is JSON, but not a cyclopean.certificate object")
    return dict(content)


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
    shells: Sequence[Sequence[int]] = ()  # numbers of faces that hang together by edges
    # by the fineness of lengths, the square of the tolerance, and the vertices from the block's origin
    shapes: dict[tuple[int, tuple[int, int], tuple[Vec, ...]], "_Shape"] = field(default_factory=dict)


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
    tension: Number
    bent: bool = False  # whether the file says that the surface is rough or curved
    facing: tuple[Number, ...] = ()  # normal of a point, where a corner of a block touches, or an edge
    edges: tuple[tuple[Number, ...], ...] = ()  # of the pyramid that stands for the cone, where one does

    @property
    def pointlike(self) -> bool:
        """Whether it is a single point."""
        return bool(self.facing)


class _Push(NamedTuple):
    """A load as the file gives it."""

    block: int
    force: Sequence[Number]
    point: Sequence[Number]


class _Live(NamedTuple):
    """Loads that grow with a multiplier, and the multipliers of which something is claimed."""

    gravity: Sequence[Number]
    pushes: list[_Push]
    lower: Number | None
    upper: Number | None


class _Bounds(NamedTuple):
    """Bounds of the virtual displacement of coupled analysis, in one unit: 0 < eps, 0 < beta < eta."""

    eps: Number
    eta: Number
    beta: Number


class _Within(NamedTuple):
    """What a family of drawings may differ by, m and the tangent of an angle (None = what the length allows); for a
    state the contacts with points inside them for their polygons, and the contact by which each free block passes on.
    """

    length: Number
    slope: Number | None
    joints: list[_Joint]
    ways: dict[int, int]


class _Leaf(NamedTuple):
    """An end of a tree: six numbers a block (zero where fixed), or a vector a contact point, or both."""

    motion: list[Sequence[Number]] | None
    forces: list[Sequence[Number]] | None


class _Split(NamedTuple):
    """A fork of a tree at a contact point: by load (engaged | unloaded) where it has neither rays nor a speed, by the
    direction of sliding where it has rays, by the amount of it (slower | faster) where it has a speed.
    """

    point: int
    branches: int
    rays: list[Sequence[Number]]
    speed: Number | None


@dataclass(frozen=True, slots=True)
class _Sheet:
    """A whole certificate, form checked, nothing computed. Of the last ones each kind has its own, the rest is empty.

    `forces` and `recession` go point by point: three numbers, or six whose halves add up; where there is no friction
    one or two, times the contact's area vector. `motion` goes block by block (zero for fixed blocks), `tree` holds the
    nodes in preorder, of the part of the model that `part` is, if it is not of all.
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
    recession: list[Sequence[Number]] = field(default_factory=list)
    part: "_Sheet | None" = None
    within: _Within | None = None


def _short(value: object, limit: int = 60) -> str:
    """Describe any value on one line of plain ASCII, however large or deep it is."""
    if isinstance(value, str):
        plain = ascii(value[: limit + 1])[1:-1]
        return plain if len(plain) <= limit else plain[: limit - 3] + "..."
    return repr(value) if value is None or isinstance(value, bool | float) else f"of type {type(value).__name__}"


def _refuse(reason: str, figures: dict[str, float] | None = None) -> NoReturn:
    raise _RefusedError(reason, figures)


def _fields(value: object, names: set[str], where: str, *optional: str) -> Mapping[str, object]:
    """Require an object with exactly these fields, and perhaps some of the optional ones."""
    if type(value) is dict and value.keys() == names:
        return value
    if not isinstance(value, Mapping):
        _refuse(f"{where} is not an object")
    names = names | (set(optional) & value.keys())
    if missing := names - value.keys():
        _refuse(f"{where}fields missing: {_some(sorted(missing), 12)}")
    if extra := value.keys() - names:
        _refuse(f"{where}unknown field: {_short(min(map(str, extra)))}")
    return value


def _some(names: Sequence[str], most: int = 3) -> str:
    """The first few names, and how many more there are.

    >>> _some(["a", "b", "c"]), _some(["a", "b", "c", "d", "e"])
    ('a, b, c', 'a, b, c and 2 more')
    """
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return ", ".join(map(_short, names[:most])) + more


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
    rows = _items(value, whole)
    return [row if _is_plain(row) else _row(row, 3, f"{one} {i}") for i, row in enumerate(rows)]  # type: ignore[misc]


def _is_plain(row: object) -> bool:
    """Whether this is a list of three floats that `_number` would take."""
    if type(row) is not list or len(row) != 3:
        return False
    x, y, z = row
    return (
        type(x) is type(y) is type(z) is float
        and (TINY <= x <= HUGE or -HUGE <= x <= -TINY or x == 0)
        and (TINY <= y <= HUGE or -HUGE <= y <= -TINY or y == 0)
        and (TINY <= z <= HUGE or -HUGE <= z <= -TINY or z == 0)
    )


def _name(value: object, numbers: Mapping[str, int], where: str) -> int:
    if not isinstance(value, str) or value not in numbers:
        _refuse(f"{where}: there is no block {_short(value)}")
    return numbers[value]


def _read(certificate: object, data: bytes = b"", memory: Memory | None = None) -> _Sheet:
    """Check schema, kind, keys, types, names, counts and the seal."""
    memory = Memory() if memory is None else memory
    if not isinstance(certificate, Mapping):
        _refuse("the certificate is not an object")
    schema, kind = certificate.get("schema"), certificate.get("kind")
    if schema == FIRST_SCHEMA:
        _refuse(
            "certificate of version 1: its tolerances were those of the whole model;"
            " check the model again to get one of version 2"
        )
    if schema != SCHEMA:
        _refuse(f"schema is not {SCHEMA}")
    if not isinstance(kind, str) or kind not in CLAIMS:
        _refuse(f"kind {_short(kind)} is not one this checker knows")
    optional = ("component",) if kind == "cra-tree" else ()
    top = _fields(certificate, COMMON_FIELDS | PROOF_FIELDS[kind] | _limit_sides(certificate, kind), "", *optional)

    stones = [_read_stone(value, i, memory.surfaces) for i, value in enumerate(_items(top["blocks"], "blocks"))]
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
    if kind not in EDGED_KINDS and any(joint.edges for joint in joints):
        _refuse(f"pyramids are no part of a {kind}")
    pushes = [_read_push(value, i, numbers) for i, value in enumerate(_items(top["loads"], "loads"))]
    within = _read_within(top, stones, joints, numbers) if "within" in top else None
    forced = within.joints if within else joints
    forces = _read_forces(top["forces"], forced, "force") if "forces" in top else []
    recession = _read_forces(top["recession"], joints, "recession") if "recession" in top else []
    motion = next((_read_motion(top[key], stones, "") for key in ("mechanism", "motions") if key in top), [])
    if "settlements" in top:
        motion = _read_settlements(top["settlements"], stones, motion)
    bounds = _read_bounds(top) if "eps" in top else None
    text = _sealed_text(top, data) or _text_of(top)
    live = _read_live(top, numbers) if "live" in top else None
    gravity = _row(top["gravity"], 3, "gravity")
    tolerance = _number(top["tolerance"], "tolerance")
    if tolerance < 0:
        _refuse("tolerance is negative")
    sheet = _Sheet(
        gravity, tolerance, stones, joints, pushes, forces, motion, bounds, [], live, recession, None, within
    )
    if "tree" in top:
        part = _part_with(sheet, _name(top["component"], numbers, "component")) if "component" in top else None
        tree = _read_tree(top["tree"], part or sheet, len(text))
        sheet = replace(sheet, tree=tree, part=part and replace(part, tree=tree))
    if not text:
        _refuse("the tree is too deep")
    if top["seal"] != hashlib.sha256(text).hexdigest():
        _refuse("the seal does not match: the file was damaged or edited")
    return sheet


def _part_with(sheet: _Sheet, block: int) -> _Sheet:
    """The component that holds a free block, with the supports that it touches, as a model of its own."""
    component = _components(sheet)
    if component[block] < 0:
        _refuse(f"component: {_short(sheet.stones[block].name)} is a support, not a free block")
    joints = [joint for joint in sheet.joints if component[block] in (component[joint.a], component[joint.b])]
    kept = {i for i, c in enumerate(component) if c == component[block]}
    kept |= {i for joint in joints for i in (joint.a, joint.b)}
    number = {i: k for k, i in enumerate(sorted(kept))}
    return replace(
        sheet,
        stones=[sheet.stones[i] for i in number],
        joints=[joint._replace(a=number[joint.a], b=number[joint.b]) for joint in joints],
        pushes=[push._replace(block=number[push.block]) for push in sheet.pushes if push.block in number],
    )


def _components(sheet: _Sheet) -> list[int]:
    """Component of every block, -1 for supports: free blocks that contacts join."""
    beside: list[list[int]] = [[] for _ in sheet.stones]
    for joint in sheet.joints:
        beside[joint.a].append(joint.b)
        beside[joint.b].append(joint.a)
    return _groups(beside, [stone.fixed for stone in sheet.stones])


def _groups(beside: Sequence[Sequence[int]], apart: Sequence[bool]) -> list[int]:
    """Number of the group of every node that neighbours join, way by way; -1 for those apart, which join nothing."""
    group, count = [-1] * len(beside), 0
    for first in range(len(beside)):
        if group[first] < 0 and not apart[first]:
            group[first], pending = count, [first]
            while pending:
                for other in beside[pending.pop()]:
                    if group[other] < 0 and not apart[other]:
                        group[other] = count
                        pending.append(other)
            count += 1
    return group


def _limit_sides(certificate: Mapping[str, object], kind: str) -> set[str]:
    """Fields of the sides that bounds of a multiplier have: one is enough; with a recession there is no upper one."""
    if kind != "limit-bounds":
        return set()
    if "recession" in certificate:
        return UNBOUNDED_FIELDS
    return set().union(*(side for side in LIMIT_SIDES if side & certificate.keys())) or LIMIT_SIDES[0]


def _read_live(top: Mapping[str, object], numbers: Mapping[str, int]) -> _Live:
    entry = _fields(top["live"], {"gravity", "loads"}, "live: ")
    pushes = [_read_push(value, i, numbers) for i, value in enumerate(_items(entry["loads"], "live: loads"))]
    lower, upper = (_number(top[key], key) if key in top else None for key in ("lower", "upper"))
    if lower is not None and upper is not None and not lower <= upper:
        _refuse("lower is above upper")
    return _Live(_row(entry["gravity"], 3, "live: gravity"), pushes, lower, upper)


def _sealed_text(top: Mapping[str, object], data: bytes) -> bytes:
    """The text of a file that is canonical as it stands, but for line breaks and the seal; nothing if it is not.

    That it has the hash that the seal says is enough: the text was not damaged.
    """
    given = top["seal"]
    if not isinstance(given, str):
        return b""
    text = data.replace(b"\n", b"").replace(f',"seal":"{given}"'.encode(errors="replace"), b"", 1)
    return text if hashlib.sha256(text).hexdigest() == given else b""


def _text_of(top: Mapping[str, object]) -> bytes:
    """What the seal of a certificate covers; nothing where JSON has no such values, or Python's stack is too small.

    Reading it tells what is wrong: all but a tree that is just too deep.
    """
    try:
        return _canonical(top)
    except (RecursionError, TypeError, ValueError):
        return b""


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
    surface = _read_surface(entry["faces"], len(vertices), where, known)
    held = _read_held(entry["held"], fixed, where) if "held" in entry else _Stone._field_defaults["held"]
    return _Stone(name, vertices, surface, density, fixed, held)


def _read_held(value: object, fixed: bool, where: str) -> tuple[bool, ...]:
    """Read what a partial support holds: some of DIRECTIONS, in their order, each once."""
    names = _items(value, f"{where}: held")
    held = tuple(name in names for name in DIRECTIONS)
    if list(names) != [name for name in DIRECTIONS if name in names]:
        _refuse(f"{where}: held is not a list of {', '.join(DIRECTIONS)}, each once and in their order")
    if fixed or not any(held) or all(held):
        _refuse(f"{where}: held is for blocks that are neither free nor fixed")
    return held


def _read_surface(
    value: object, count: int, where: str, known: dict[tuple[tuple[int, ...], ...], _Surface]
) -> _Surface:
    """Read faces; the same faces once only. True and 1.0 are as good a key as 1, but no vertex numbers.

    Numbers are bounded before they are hashed: multiples of 2**61 - 1 all have the hash 0.
    """
    key: Any = tuple([tuple(_items(face, f"{where}: a face")) for face in _items(value, f"{where}: faces")])
    corners = list(chain.from_iterable(key))
    if not (set(map(type, corners)) <= {int} and min(corners, default=0) >= 0 and max(corners, default=-1) < count):
        _refuse(f"{where}: a face is not three or more different vertex numbers")
    if key not in known:
        if any(len(face) < 3 or len(set(face)) != len(face) for face in key):
            _refuse(f"{where}: a face is not three or more different vertex numbers")
        known[key] = _Surface(key, frozenset().union(*key), _is_closed(key), _shells(key))
    return known[key]


def _is_closed(faces: Sequence[Sequence[int]]) -> bool:
    """Whether every directed edge occurs once, and so does its reverse: closed, and consistently turned."""
    edges = [pair for face in faces for pair in _around(face)]
    once = set(edges)
    return len(once) == len(edges) and all((j, i) in once for i, j in edges)


def _read_joint(value: object, i: int, numbers: Mapping[str, int], stones: Sequence[_Stone]) -> _Joint:
    where = f"contact {i}"
    entry = _fields(value, JOINT_FIELDS, f"{where}: ", "tension", "surface", "normal", "edges")
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
    if "surface" in entry and entry["surface"] not in SURFACES:
        _refuse(f"{where}: surface is neither rough nor curved, nor a point")
    edges = tuple(map(tuple, _triples(entry["edges"], f"{where}: edges", f"{where}: edge"))) if "edges" in entry else ()
    if "edges" in entry and (tension or entry.get("surface", "point") != "point"):
        _refuse(f"{where}: it has a pyramid, and pulls or is rough or curved")
    if "edges" in entry and not 3 <= len(edges) <= MAX_EDGES:
        _refuse(f"{where}: its pyramid has {len(edges)} edges")
    if entry.get("surface") != "point":
        if len(polygon) < 3:
            _refuse(f"{where}: polygon has fewer than three points")
        if "normal" in entry:
            _refuse(f"{where}: only a point has a normal")
        return _Joint(a, b, polygon, mu, tension, "surface" in entry, (), edges)
    if len(polygon) != 1 or tension:
        _refuse(f"{where}: polygon has more points than one, or a point pulls")
    facing = tuple(_row(entry["normal"], 3, f"{where}: normal")) if "normal" in entry else ()
    if not any(facing):
        _refuse(f"{where}: normal is missing or zero")
    return _Joint(a, b, polygon, mu, tension, False, facing, edges)


def _label(sheet: _Sheet, i: int) -> str:
    """Name a contact, for a refusal."""
    joint = sheet.joints[i]
    return f"contact {i} ({_short(sheet.stones[joint.a].name)} - {_short(sheet.stones[joint.b].name)})"


def _read_push(value: object, i: int, numbers: Mapping[str, int]) -> _Push:
    entry = _fields(value, {"block", "force", "point"}, f"load {i}: ")
    block = _name(entry["block"], numbers, f"load {i}")
    force, point = (_row(entry[key], 3, f"load {i}: {key}") for key in ("force", "point"))
    return _Push(block, force, point)


def _read_forces(value: object, joints: Sequence[_Joint], what: str) -> list[Sequence[Number]]:
    """Read the force at every contact point: three numbers, or six whose halves add up to it.

    A cone without friction is a ray that almost no three doubles lie on: there the file gives one number, or two that
    add up, and the force is that times the contact's area vector. Where a pyramid stands for the cone there is one
    number, or two, for each of its edges; what comes back has one row for each edge and, in these, each point.
    """
    rows = _items(value, f"{what}s")
    if len(rows) != sum(len(joint.polygon) for joint in joints):
        _refuse(f"{len(rows)} {what}s for {sum(len(joint.polygon) for joint in joints)} contact points")
    found: list[Sequence[Number]] = []
    number = 0
    for joint in joints:
        single, own = len(joint.edges) or (3 if joint.mu else 1), list[Sequence[Number]]()
        for row in rows[number : number + len(joint.polygon)]:
            if single == 3 and not joint.edges and _is_plain(row):
                own.append(row)  # type: ignore[arg-type]
                continue
            count = len(_items(row, f"{what} {number + len(own)}"))
            if count not in (single, 2 * single):
                _refuse(f"{what} {number + len(own)} has {count} numbers instead of {single} or {2 * single}")
            own.append(_row(row, count, f"{what} {number + len(own)}"))
        number += len(own)
        found += [row[k::single] for k in range(single) for row in own] if joint.edges else own
    return found


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


def _read_within(
    top: Mapping[str, object], stones: Sequence[_Stone], joints: Sequence[_Joint], numbers: Mapping[str, int]
) -> _Within:
    """Read by how much drawings may differ, and what a state says of its contacts in all of them."""
    entry = _fields(top["within"], {"length"}, "within: ", "slope")
    length = _number(entry["length"], "within: length")
    slope = _number(entry["slope"], "within: slope") if "slope" in entry else None
    if not (length > 0 and (slope is None or slope >= 0)):
        _refuse("within: length is not positive, or slope is negative")
    if any(joint.bent or joint.pointlike for joint in joints) or any(any(stone.held) for stone in stones):
        _refuse("within: neither rough or curved contacts, nor points, nor blocks that are partly held are known here")
    if "points" not in top:
        return _Within(length, slope, [], {})
    lists = _items(top["points"], "points")
    if len(lists) != len(joints):
        _refuse(f"points: {len(lists)} lists for {len(joints)} contacts")
    inside = [
        joint._replace(polygon=_triples(rows, f"points of contact {i}", f"points of contact {i}: point"))
        for i, (joint, rows) in enumerate(zip(joints, lists, strict=True))
    ]
    ways = _fields(top["ways"], {stone.name for stone in stones if not stone.fixed}, "ways: ")
    for name, number in ways.items():
        if type(number) is not int or not 0 <= number < len(joints):
            _refuse(f"ways: that of {_short(name)} is not the number of a contact")
    return _Within(length, slope, inside, {numbers[name]: number for name, number in ways.items()})  # type: ignore[misc]


def _read_bounds(top: Mapping[str, object]) -> _Bounds:
    eps, eta, beta = (_number(top[key], key) for key in ("eps", "eta", "beta_min"))
    if not (eps > 0 and 0 < beta < eta):
        _refuse("eps, eta and beta_min are not positive, or beta_min is not below eta")
    return _Bounds(eps, eta, beta)


def _read_tree(value: object, sheet: _Sheet, size: int) -> list[_Leaf | _Split]:
    """Read the nodes of a tree in preorder, each before its branches, the branches in their order.

    Every leaf will look at all points and blocks; of that there may be no more than the certificate's bytes allow.
    """
    stones, points = sheet.stones, sum(len(joint.polygon) for joint in sheet.joints)
    visits = VISITS + VISITS_PER_BYTE * max(0, size - SMALL)
    shapes = chain((stone.vertices for stone in stones), (joint.polygon for joint in sheet.joints))
    finest = _exponent(chain.from_iterable(chain.from_iterable(shapes)))
    nodes: list[_Leaf | _Split] = []
    pending = [(value, 0)]
    while pending:
        raw, depth = pending.pop()
        if depth > MAX_DEPTH or len(nodes) == MAX_NODES:
            _refuse(f"the tree is deeper than {MAX_DEPTH} splits, or has more than {MAX_NODES} nodes")
        node, branches = _read_node(raw, stones, points, f"tree node {len(nodes)}: ")
        nodes.append(node)
        if isinstance(node, _Leaf):
            bits = finest + _exponent(chain.from_iterable(node.motion or ()))
            visits -= (points + len(stones)) * (1 + bits // LONG)
        if visits < 0:
            _refuse(f"the tree has too many leaves for {points} contact points, {len(stones)} blocks and its own size")
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
        forces = _triples(proof["forces"], f"{where}forces", f"{where}force") if "forces" in proof else None
        if forces is not None and len(forces) != points:
            _refuse(f"{where}{len(forces)} forces for {points} contact points")
        return _Leaf(motion, forces), ()
    if "rays" in keys:
        node = _fields(value, {"point", "rays", "sectors"}, where)
        branches = _items(node["sectors"], f"{where}sectors")
    else:
        named = ("slower", "faster") if "speed" in keys else ("engaged", "unloaded")
        node = _fields(value, {"point", *named, *({"speed"} & keys)}, where)
        branches = [node[key] for key in named]
    rays = [_row(ray, 3, f"{where}a ray") for ray in _items(node.get("rays", ()), f"{where}rays")]
    if "rays" in node and not rays:
        _refuse(f"{where}there are no rays")
    speed = _number(node["speed"], f"{where}speed") if "speed" in node else None
    point = node["point"]
    if type(point) is not int or not 0 <= point < points:
        _refuse(f"{where}point is not the number of a contact point")
    return _Split(point, len(branches), rays, speed), branches


def _conditions(sheet: _Sheet) -> str:
    """What a claim depends on beside its kind, to be printed behind it."""
    partly = sum(any(stone.held) for stone in sheet.stones)
    more = f" ({partly} of {len(sheet.stones)} blocks partly held)" if partly else ""
    more += _caveats(sheet)
    pulling = [joint.tension for joint in sheet.joints if joint.tension]
    if pulling:
        more += f", COUNTING ON JOINTS THAT PULL: {len(pulling)} of {len(sheet.joints)}, up to {max(pulling):.6g} Pa"
    if sheet.within is not None:
        return _family(sheet.within) + more
    if sheet.live is not None:
        return _claimed(sheet.live, bool(sheet.recession)) + more
    if sheet.bounds is None:
        return more
    eta, beta = (float(Fraction(x) / Fraction(sheet.bounds.eps)) for x in (sheet.bounds.eta, sheet.bounds.beta))
    return f" (eta = {eta:.15g} eps, beta_min = {beta:.15g} eps, listed contacts)" + more


def _family(within: _Within) -> str:
    """Which drawings a claim is about."""
    lean = "what that allows" if within.slope is None else f"{math.degrees(math.atan(within.slope)):.6g} degrees"
    return f" within {within.length:.15g} m of this one, normals within {lean} (listed contacts)"


def _caveats(sheet: _Sheet) -> str:
    """What would let a person expect more of a claim than it says."""
    said = []
    if not any(sheet.gravity) and not (sheet.live and any(sheet.live.gravity)):
        said.append("with zero gravity")
    if all(stone.fixed for stone in sheet.stones):
        said.append("no block is free")
    if (most := max((joint.mu for joint in sheet.joints), default=0)) > SLIPPERY:
        said.append(f"mu up to {most:.6g}")
    if pyramids := _pyramids([joint for joint in sheet.joints if joint.edges]):
        said.append(f"COUNTING ON {pyramids}")
    return "".join(f", {what}" for what in said)


def _claimed(live: _Live, unbounded: bool) -> str:
    """What is claimed of which multipliers."""
    stands = (
        "" if live.lower is None else f"forces hold it at {live.lower:.15g}" + " and at every larger one" * unbounded
    )
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
# What a proof takes as given.


def _assumptions(sheet: _Sheet) -> tuple[str, ...]:
    """What the proof assumes, for a person to hold against the structure: one aligned line each."""
    free = [stone for stone in sheet.stones if not stone.fixed]
    fixed = [stone.name for stone in sheet.stones if stone.fixed]
    held = [stone.name for stone in free if any(stone.held)]
    pulls = [joint.tension for joint in sheet.joints if joint.tension]
    points, live = sum(len(joint.polygon) for joint in sheet.joints), sheet.live
    lines = {
        "blocks": f"{len(sheet.stones)}, {len(free)} of them free",
        "supports": _some(fixed) or "none",
        "held": f"partly: {_some(held)}" if held else "",
        "contacts": f"{len(sheet.joints)} listed, {points} points; nothing else touches",
        "friction": f"mu {_span([joint.mu for joint in sheet.joints])}",
        "pyramids": _pyramids([joint for joint in sheet.joints if joint.edges]),
        "tension": f"{len(pulls)} of {len(sheet.joints)} joints pull, {_span(pulls)} Pa" if pulls else "",
        "density": f"{_span([stone.density for stone in free])} kg/m3",
        "gravity": f"{_triple(sheet.gravity)} m/s2, in size {math.hypot(*sheet.gravity):.6g}",
        "loads": _summed([push for push in sheet.pushes if not sheet.stones[push.block].fixed]),
        "live": live and f"times the multiplier: gravity {_triple(live.gravity)} m/s2; loads {_summed(live.pushes)}",
        "tolerance": f"contacts lie within {sheet.tolerance:.3g} m of faces",
    }
    return tuple(f"{name:<10} {said}" for name, said in lines.items() if said)


def _pyramids(joints: Sequence[_Joint]) -> str:
    """Which pyramids stand for friction cones, and what friction they reach along their edges; "" where none does."""
    slopes = []
    for joint in joints:
        normal = joint.facing or _area_vector(joint.polygon)  # type: ignore[arg-type]
        for edge in joint.edges:
            along, across = _dot(edge, normal), math.hypot(*_cross(edge, normal))  # type: ignore[arg-type]
            slopes.append(across / along if along > 0 else math.inf)
    count = _span([len(joint.edges) for joint in joints])
    most = max(slopes, default=0.0)
    mu = most if most > ROUNDED_MU else 0.0
    return f"PYRAMIDS OF {count} EDGES for friction cones, up to mu {mu:.6g}" if slopes else ""


def _span(values: Sequence[Number]) -> str:
    """One number, or from where to where several run.

    >>> _span([0.5, 0.5]), _span([0.5, 0.84]), _span([])
    ('0.5', '0.5 to 0.84', 'none')
    """
    if not values:
        return "none"
    low, high = f"{min(values):.6g}", f"{max(values):.6g}"
    return low if min(values) == max(values) else f"{low} to {high}"


def _triple(vector: Sequence[Number]) -> str:
    return "(" + ", ".join(f"{x + 0.0:.6g}" for x in vector) + ")"


def _summed(pushes: Sequence[_Push]) -> str:
    """How many loads there are, and their resultant."""
    if not pushes:
        return "none beside the weight"
    total = [math.fsum(push.force[axis] for push in pushes) for axis in range(3)]
    return f"{len(pushes)}, together {_triple(total)} N"


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


FINEST = 600
"""Every number that `_number` accepts is an integer times 2**-551 and below 2**333: times 2**600 still a double."""


def _fineness(numbers: Iterable[Number]) -> int:
    """Find the least k for which every number times 2**k is an integer: short integers where coordinates are round.

    >>> _fineness([0.75, 5.0]), _fineness([0.1]), _fineness([])
    (2, 55, 0)
    """
    return max((x.as_integer_ratio()[1] for x in set(numbers)), default=1).bit_length() - 1


def _integer(x: Number, k: int) -> int:
    """Scale to the integer x * 2**k, for a k from `_exponent`: exact, as only the exponent of a double changes."""
    return int(math.ldexp(x, k)) if k <= FINEST else int(math.ldexp(x, FINEST)) << k - FINEST


def _vectors(rows: Iterable[Sequence[Number]], k: int) -> list[Vec]:
    """Scale rows of three, as `_integer` does."""
    if k > FINEST:
        return [_vector(row, k) for row in rows]
    s = 2.0**k
    return [(int(x * s), int(y * s), int(z * s)) for x, y, z in rows]


def _vector(row: Sequence[Number], k: int) -> Vec:
    x, y, z = row
    return _integer(x, k), _integer(y, k), _integer(z, k)


def _dot(a: Vec, b: Vec) -> int:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _length2(a: Vec) -> int:
    x, y, z = a
    return x * x + y * y + z * z


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


def _around(ring: Sequence[Item]) -> Iterator[tuple[Item, Item]]:
    """Each item with the next one, the last with the first."""
    return zip(ring, (*ring[1:], ring[0]), strict=True)


def _fan(ring: Sequence[Vec]) -> Iterator[tuple[Vec, Vec, Vec]]:
    """The triangles of a polygon that have its first corner."""
    for one, two in pairwise(ring[1:]):
        yield ring[0], one, two


def _root_above(n: int) -> int:
    """Smallest integer whose square is at least n.

    >>> [_root_above(n) for n in (0, 1, 2, 4, 5)]
    [0, 1, 2, 2, 3]
    """
    root = math.isqrt(n)
    return root if root * root == n else root + 1


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

Ratio2 = tuple[int, int]  # a squared length as numerator and denominator, in units 2**-2k
Point = tuple[float, float, float]


@dataclass(slots=True)
class _Shape:
    """What blocks of one shape share; lengths are from the origin of the block, its first face's first corner.

    `volume6` = 6 V and `moment24` = 24 V c, with c the centre of mass; `box2` = D^2 of the box around it; `pieces` are
    the outer shells of its mesh, see `_require_solid`. `seats` holds how contacts lie on it, by tolerance and place.
    """

    corners: Sequence[Vec]
    pieces: int
    convex: bool
    volume6: int
    moment24: Vec
    low: Vec
    high: Vec
    box2: int
    facets: list["_Facet"]
    contacts: int = 0
    index: "_Index | None" = None
    seats: dict[tuple[object, ...], "_Seat"] = field(default_factory=dict)
    axes: dict[bool, list[Point]] = field(default_factory=dict)  # see `_axes`

    def near(self, patch: "_Patch") -> tuple[Sequence["_Facet"], int]:
        """Facets that may be near a contact, and how many were looked at to find them."""
        self.contacts += 1
        if len(self.facets) <= FEW or self.contacts <= FEW:
            return self.facets, len(self.facets)
        if self.index is None:
            boxes = [facet.prepared() for facet in self.facets]
            self.index = _Index([facet.low for facet in boxes], [facet.high for facet in boxes])
        found = self.index.near(*_box(patch.points), _root_above(_quotient_above(*patch.tolerance2)))
        return [self.facets[number] for number in found], len(found) + 1


class _Solid(NamedTuple):
    """A block: where the origin of its shape is, and what `_Shape` says of it, about the world's origin.

    Units: 2**-3k, 2**-4k and 2**-2k of m3, m4 and m2, with k the exponent of lengths. So c = moment24 / (4 volume6).
    """

    origin: Vec
    shape: _Shape
    volume6: int
    moment24: Vec
    box2: int


class _Patch(NamedTuple):
    """A contact in integers: its points and its area vector N, or normal, from `a` into `b`; mu = p/q.

    `part` is its component, `rows` are its points among those of all contacts. `tolerance2` is what counts at it;
    `grip` is the friction that forces may count on, as p and q, see `_gripping`;
    `normals` holds, where the surface is rough or curved, the area vectors of the faces that each point lies on: those
    of `a`, and those of `b` turned round.
    """

    number: int
    joint: _Joint
    part: int
    rows: slice
    a: int
    b: int
    p: int
    q: int
    grip: tuple[int, int]
    points: list[Vec]
    normal: Vec
    normal2: int
    tolerance2: Ratio2
    normals: list[tuple[list[Vec], list[Vec]]]


@dataclass(slots=True)
class _Misfit:
    """What was let pass of how contacts lie on faces, the most of each; floats, for the claim only.

    `off` is how far a point is from a face, `gap` and `overlap` the distance of the two faces, all in metres; `lean`
    the angle between a contact's normal and a face's; `share` the largest of the lengths by the smaller block's size.
    """

    off: float = 0.0
    gap: float = 0.0
    overlap: float = 0.0
    lean: float = 0.0
    share: float = 0.0
    bent: int = 0
    pointlike: int = 0

    def note(self, one: "_Seat", two: "_Seat", size: float) -> None:
        """Keep the most of what a contact's two sides were let pass; `size` is that of the smaller block, m."""
        self.lean = max(self.lean, one.lean, two.lean)
        if one.heights or two.heights or one.aside or two.aside:
            off, gap, overlap = max(one.aside, two.aside), 0.0, 0.0
            for number in one.heights.keys() | two.heights.keys():
                above, below = one.heights.get(number, 0.0), two.heights.get(number, 0.0)
                off, gap, overlap = (
                    max(off, abs(above), abs(below)),
                    max(gap, above + below),
                    max(overlap, -above - below),
                )
            self.off, self.gap, self.overlap = max(self.off, off), max(self.gap, gap), max(self.overlap, overlap)
            self.share = max(self.share, max(off, gap, overlap) / size if size else 0.0)

    def figures(self) -> dict[str, float]:
        """As they stand in the report."""
        return {"misfit": self.off, "contact_gap": self.gap, "contact_overlap": self.overlap, "lean": self.lean}

    def claimed(self) -> str:
        """What a claim says of it, where a person should know."""
        if not self.bent and not self.pointlike and self.lean <= TOLD_LEAN and self.share <= TOLD_SHARE:
            return ""
        said = f", contacts up to {self.off:.2g} m off the faces"
        said += f" (gaps up to {self.gap:.2g} m)" if self.gap > 0.0 else ""
        said += f" (faces up to {self.overlap:.2g} m into each other)" if self.overlap > 0.0 else ""
        said += f", leaning by up to {math.degrees(self.lean):.2g} degrees" if self.lean > TOLD_LEAN else ""
        said += f", {self.pointlike} of them at corners and edges" if self.pointlike else ""
        return said + (f", {self.bent} of them on surfaces said to be rough or curved" if self.bent else "")


@dataclass(frozen=True, slots=True)
class _Model:
    """The model in integers; lengths are counted in 2**-`per_length` m, forces in 2**-`per_force` N.

    Weights are counted sixfold: rho V g is rho (6 V) g / 6, so that 6 times it is an integer. A block's own weight is
    its mass times the size of gravity, whatever loads there are: `own_below` and `own_above` bound what a `masses6` of
    1 weighs, sixfold.
    """

    sheet: _Sheet
    solids: list[_Solid]
    patches: list[_Patch]
    misfit: _Misfit
    masses6: list[int]  # density times volume6; 0 for a fixed block
    lightest6: list[int]  # of every block the least of `masses6` in its component
    component: list[int]  # of every block; -1 = a support
    per_length: int
    finer: int  # bits by which motions are counted finer, so that partly held blocks move exactly; see `_motion`
    per_force: int = 0
    gravity: Vec = (0, 0, 0)  # what density times volume is to be multiplied by
    loads: list[tuple[int, Vec, Vec]] = field(default_factory=list)  # block, force, point; free blocks only
    own_below: int = 0
    own_above: int = 0
    total6_below: list[int] = field(default_factory=list)  # weight W of every component, bounded from both sides
    total6_above: list[int] = field(default_factory=list)

    @property
    def parts(self) -> int:
        """How many components there are."""
        return max(self.component, default=-1) + 1

    def free(self) -> Iterator[tuple[int, _Stone, _Solid]]:
        """The blocks that are not fixed, with their numbers."""
        for i, (stone, solid) in enumerate(zip(self.sheet.stones, self.solids, strict=True)):
            if not stone.fixed:
                yield i, stone, solid


def _weigh(sheet: _Sheet, memory: Memory | None = None) -> _Model:
    """Check the geometry and turn the model into integers."""
    memory = Memory() if memory is None else memory
    directions = chain.from_iterable((joint.facing, *joint.edges) for joint in sheet.joints)
    k = max(_fineness(_lengths(sheet)), (_fineness(chain.from_iterable(directions)) + 1) // 2)
    component = _components(sheet)
    solids, patches, misfit = _fitted(sheet, component, k, memory)
    per_density = _fineness(stone.density for stone in sheet.stones)
    masses6 = [
        0 if stone.fixed else _integer(stone.density, per_density) * solid.volume6
        for stone, solid in zip(sheet.stones, solids, strict=True)
    ]
    least: dict[int, int] = {}
    for mass6, c in zip(masses6, component, strict=True):
        least[c] = min(mass6, least.get(c, mass6))
    finer = 0
    if any(any(stone.held) for stone in sheet.stones):
        finer = (4 * max(solid.volume6 for solid in solids)).bit_length() + GUARD_BITS
    lightest6 = [least[c] for c in component]
    return _loaded(_Model(sheet, solids, patches, misfit, masses6, lightest6, component, k, finer), 1, 0.0)


def _loaded(model: _Model, dead: int, times: Number) -> _Model:
    """The model under `dead` (0 or 1) times its own gravity and loads plus `times` the live ones, exactly.

    With times = p / 2**j all of them are multiples of units 2**j finer than their own.
    """
    sheet, k = model.sheet, model.per_length
    live = sheet.live or _Live((0.0, 0.0, 0.0), [], None, None)
    own = sheet.gravity if any(sheet.gravity) else (STANDARD_GRAVITY, 0.0, 0.0)
    p, q = times.as_integer_ratio()
    finer = q.bit_length() - 1
    per_mass = _fineness(stone.density for stone in sheet.stones) + 3 * k
    per_load = _exponent(x for push in (*sheet.pushes, *live.pushes) for x in push.force)
    per_force = max(per_load, per_mass + _exponent(chain(own, live.gravity))) + finer
    per_gravity = per_force - per_mass
    dead_pull, live_pull = (_vector(gravity, per_gravity - finer) for gravity in (sheet.gravity, live.gravity))
    gravity = _plus(_times(dead * q, dead_pull), _times(p, live_pull))
    loads = [
        (push.block, _times(share, _vector(push.force, per_force - finer)), _vector(push.point, k))
        for share, pushes in ((dead * q, sheet.pushes), (p, live.pushes))
        for push in pushes
        if share and not sheet.stones[push.block].fixed
    ]
    own2 = _length2(_vector(own, per_gravity))
    below, above = _totals6(model, gravity, loads)
    return replace(
        model,
        per_force=per_force,
        gravity=gravity,
        loads=loads,
        own_below=math.isqrt(own2),
        own_above=_root_above(own2),
        total6_below=below,
        total6_above=above,
    )


def _totals6(model: _Model, gravity: Vec, loads: Iterable[tuple[int, Vec, Vec]]) -> tuple[list[int], list[int]]:
    """6 times the weight W of every component, bounded from both sides.

    From below without what partial supports bear: it must not make room for forces that do not balance. Of a block
    that is partly held a weight counts only along directions that are free; so does a load, unless the block may turn.
    """
    below, above = [0] * model.parts, [0] * model.parts
    least, most = math.isqrt(_length2(gravity)), _root_above(_length2(gravity))
    for i, stone, _ in model.free():
        left = math.isqrt(_length2(_freed(gravity, stone.held[:3]))) if any(stone.held) else least
        below[model.component[i]] += model.masses6[i] * left
        above[model.component[i]] += model.masses6[i] * most
    for block, force, _ in loads:
        held = model.sheet.stones[block].held
        below[model.component[block]] += 6 * math.isqrt(_length2(_freed(force, held[:3]) if all(held[3:]) else force))
        above[model.component[block]] += 6 * _root_above(_length2(force))
    return below, above


def _least_loads6(model: _Model) -> list[int]:
    """6 times the least, on every block, of its weight and the loads of its component that are not zero; else 0."""
    least: dict[int, int] = {}
    for block, force, _ in model.loads:
        c, size6 = model.component[block], 6 * math.isqrt(_length2(force))
        least[c] = min(filter(None, (size6, least.get(c, 0))), default=0)
    pull = math.isqrt(_length2(model.gravity))
    weights = [mass6 * pull for mass6 in model.masses6]
    return [
        min(filter(None, (least.get(c, 0), weight)), default=0)
        for c, weight in zip(model.component, weights, strict=True)
    ]


def _lighter_weight(model: _Model, patch: _Patch, per_force: int) -> int:
    """The own weight of the lighter free block at a contact, in 2**-per_force N, rounded down."""
    mass6 = min(model.masses6[i] for i in (patch.a, patch.b) if model.component[i] >= 0)
    return (mass6 * model.own_below << per_force) // (6 << model.per_force)


def _freed(vector: Vec, held: Sequence[bool]) -> Vec:
    """The components along directions that nothing holds."""
    x, y, z = (0 if still else part for part, still in zip(vector, held, strict=True))
    return x, y, z


def _lengths(sheet: _Sheet) -> Iterator[Number]:
    """Every coordinate in the file. (The tolerance is compared apart: it would make all integers long.)"""
    for stone in sheet.stones:
        yield from chain.from_iterable(stone.vertices)
    for joint in (*sheet.joints, *(sheet.within.joints if sheet.within else ())):
        yield from chain.from_iterable(joint.polygon)
    for push in (*sheet.pushes, *(sheet.live.pushes if sheet.live else ())):
        yield from push.point


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


def _is_flat(ring: Sequence[Vec], normal: Vec, normal2: int, tolerance2: Ratio2) -> bool:
    """Whether every corner lies within tolerance of the plane through their mean.

    |(r - mean).n| <= t |n|, times the number of corners and squared. Of a quadrilateral n is at right angles to both
    diagonals, so that opposite corners are equally high: by half of what one diagonal is above the other.
    """
    if len(ring) == 3:
        return True
    t, u = tolerance2
    if len(ring) == 4:
        rise = _dot(_minus(ring[1], ring[0]), normal)
        return rise == 0 or rise * rise * u <= 4 * t * normal2
    heights = [_dot(r, normal) for r in ring]
    count, total = len(ring), sum(heights)
    limit = count * count * t * normal2
    return all((count * h - total) ** 2 * u <= limit for h in heights)


def _fitted(
    sheet: _Sheet, component: Sequence[int], k: int, memory: Memory
) -> tuple[list[_Solid], list[_Patch], _Misfit]:
    """Check every block, and that every contact lies on faces of both of its blocks."""
    tn, td = sheet.tolerance.as_integer_ratio()
    stated2: Ratio2 = (tn << k) ** 2, td * td
    solids = [_solid(stone, k, stated2, memory.most) for stone in sheet.stones]
    misfit = _Misfit(
        bent=sum(joint.bent for joint in sheet.joints), pointlike=sum(joint.pointlike for joint in sheet.joints)
    )
    faces = sum(len(stone.surface.faces) for stone in sheet.stones)
    looks = _Budget(
        MAX_LOOKS,
        faces + sum(len(joint.polygon) for joint in sheet.joints),
        "too many faces under its contacts to look at",
    )
    patches: list[_Patch] = []
    ridged: list[int] = []
    first = 0
    for i, joint in enumerate(sheet.joints):
        a, b = solids[joint.a], solids[joint.b]
        box2 = min(a.box2, b.box2)
        tolerance2 = _capped(stated2, box2, ROUGH_SHARE if joint.bent else TOLERANCE_SHARE)
        patch = _patch(sheet, i, max(component[joint.a], component[joint.b]), first, tolerance2, memory, k)
        one, two = _on_solid(sheet, a, patch, 1, k, looks), _on_solid(sheet, b, patch, -1, k, looks)
        patch.normals.extend(zip(one.normals, two.normals, strict=True))
        if joint.pointlike and _require_plane(sheet, patch, one, two):
            ridged.append(len(patches))
        if joint.tension and not joint.bent:
            _require_on_faces(sheet, a, patch, 1, looks)
            _require_on_faces(sheet, b, patch, -1, looks)
        misfit.note(one, two, math.sqrt(_as_float(box2, 1 << 2 * k)))
        patches += _edged(sheet, patch, k) if joint.edges else [patch]
        first = patches[-1].rows.stop
    _require_single_pulls(sheet, patches, looks)
    return solids, _gripping(patches, ridged, looks), misfit


def _solid(stone: _Stone, k: int, stated2: Ratio2, most: int) -> _Solid:
    """Check that a block bounds a solid, and measure it: once for all blocks of the same shape."""
    surface, vertices = stone.surface, _vectors(stone.vertices, k)
    if not surface.faces:
        _refuse(f"block {_short(stone.name)} has no faces")
    ox, oy, oz = origin = vertices[surface.faces[0][0]]
    local = tuple([(x - ox, y - oy, z - oz) for x, y, z in vertices])
    place = k, stated2, local
    shape = surface.shapes.get(place)
    if shape is None:
        shape = _shape(stone, local, stated2)
        if len(local) <= MAX_KEPT and len(surface.shapes) < most:
            surface.shapes[place] = shape
    moment24 = _plus(shape.moment24, _times(4 * shape.volume6, origin))
    return _Solid(origin, shape, shape.volume6, moment24, shape.box2)


def _shape(stone: _Stone, local: Sequence[Vec], stated2: Ratio2) -> _Shape:
    surface, where = stone.surface, f"block {_short(stone.name)}"
    if not surface.closed:
        _refuse(f"{where}: its faces do not close, or are not turned the same way")
    corners = [local[i] for i in surface.used]
    low, high = _box(corners)
    box2 = _length2(_minus(high, low))
    volume6, moment24 = _moments(surface.faces, local)
    if not volume6 > 0:
        _refuse(f"{where}: its volume is not positive, its faces look inward")
    pieces, convex = _require_solid(where, surface, local)
    facets = _facets(surface, local, _capped(stated2, box2, TOLERANCE_SHARE))
    return _Shape(corners, pieces, convex, volume6, moment24, low, high, box2, facets)


def _on_solid(sheet: _Sheet, solid: _Solid, patch: _Patch, sign: int, k: int, looks: "_Budget") -> "_Seat":
    """How a contact lies on a block: once for all that lie alike on blocks of the same shape."""
    (ox, oy, oz), shape = solid.origin, solid.shape
    points = [(x - ox, y - oy, z - oz) for x, y, z in patch.points]
    place = (sign, patch.joint.bent, patch.joint.facing, patch.tolerance2, *points)
    seat = shape.seats.get(place)
    if seat is None:
        local = patch._replace(points=points)
        facets, count = shape.near(_widened(local) if patch.joint.pointlike else local)
        looks.spend(count)
        seat = _seat(sheet, facets, local, sign, k, looks)
        if len(points) <= MAX_KEPT and len(shape.seats) < MAX_KEPT:
            shape.seats[place] = seat
    return seat


class _Budget:
    """Counts work that honest files need little of, and hostile ones would make hours of; `fault` is said at its end.

    `most` are so many steps, and so many more for each thing in the file that they are about.
    """

    def __init__(self, most: tuple[int, int], count: int, fault: str) -> None:
        self.left, self.fault = most[0] + most[1] * count, fault

    def spend(self, count: int) -> None:
        """Take some off; no more may be spent than there are."""
        self.left -= count
        if self.left < 0:
            _refuse(self.fault)


class _Index:
    """Boxes sorted into rows, or squares of the two axes along which they spread most, to find those near a place."""

    __slots__ = ("axes", "count", "low", "per", "squares", "steps", "wide")

    def __init__(self, lows: Sequence[Sequence[int]], highs: Sequence[Sequence[int]]) -> None:
        least, most = [min(x) for x in zip(*lows, strict=True)], [max(x) for x in zip(*highs, strict=True)]
        self.axes = sorted(range(len(least)), key=lambda axis: least[axis] - most[axis])[:2]
        self.count, self.low = len(lows), [least[axis] for axis in self.axes]
        self.per = self.count if len(self.axes) == 1 else math.isqrt(self.count)
        self.steps = [(most[axis] - least[axis]) // self.per + 1 for axis in self.axes]
        self.squares: dict[tuple[int, ...], list[int]] = {}
        self.wide: list[int] = []  # what is in too many squares
        for number, (low, high) in enumerate(zip(lows, highs, strict=True)):
            ranges = self._ranges(low, high, 0)
            if math.prod(map(len, ranges)) > FEW:
                self.wide.append(number)
                continue
            for square in product(*ranges):
                self.squares.setdefault(square, []).append(number)

    def _ranges(self, low: Sequence[int], high: Sequence[int], room: int) -> list[range]:
        return [
            range(max((low[axis] - room - start) // step, 0), min((high[axis] + room - start) // step, self.per) + 1)
            for axis, start, step in zip(self.axes, self.low, self.steps, strict=True)
        ]

    def near(self, low: Sequence[int], high: Sequence[int], room: int = 0) -> Sequence[int]:
        """Numbers, in order, of all boxes that are within `room` of another one, and of some that are not."""
        ranges = self._ranges(low, high, room)
        if math.prod(map(len, ranges)) > self.count:
            return range(self.count)
        return sorted(set(self.wide).union(*[self.squares.get(square, ()) for square in product(*ranges)]))


def _capped(tolerance2: Ratio2, box2: int, share: Fraction) -> Ratio2:
    """The square of the tolerance, or of the share of a block's size if that is less."""
    cap: Ratio2 = share.numerator**2 * box2, share.denominator**2
    return tolerance2 if tolerance2[0] * cap[1] <= cap[0] * tolerance2[1] else cap


def _patch(sheet: _Sheet, i: int, part: int, first: int, tolerance2: Ratio2, memory: Memory, k: int) -> _Patch:
    """Turn a contact polygon into integers; it must have an area, be flat, and wider than a few tolerances.

    That is looked at once for all that are alike.
    """
    joint = sheet.joints[i]
    points = _vectors(joint.polygon, k)
    ox, oy, oz = points[0]
    local = [(x - ox, y - oy, z - oz) for x, y, z in points]
    outline = (joint.bent, joint.facing, k if joint.facing else 0, tolerance2, *local)
    normal, normal2 = memory.outlines.get(outline) or _area_checked(sheet, i, points, tolerance2, k)
    if len(points) <= MAX_KEPT and len(memory.outlines) < memory.most:
        memory.outlines[outline] = normal, normal2
    rows, (p, q) = slice(first, first + len(points)), joint.mu.as_integer_ratio()
    return _Patch(i, joint, part, rows, joint.a, joint.b, p, q, (p, q), points, normal, normal2, tolerance2, [])


def _edged(sheet: _Sheet, patch: _Patch, k: int) -> list[_Patch]:
    """A contact with a pyramid for its cone: for each of the edges one without friction that has it for a normal.

    All sums of forces along the edges are in the pyramid, and no others; and x is against none of these where it is
    against none of the edges.
    """
    found = []
    first, count = patch.rows.start, len(patch.points)
    for number, row in enumerate(patch.joint.edges):
        edge = _vector(row, 2 * k)
        if not _dot(edge, patch.normal) > 0:
            _refuse(f"{_label(sheet, patch.number)}: edge {number} of its pyramid does not look along it")
        rows = slice(first + number * count, first + (number + 1) * count)
        found.append(patch._replace(rows=rows, p=0, q=1, grip=(0, 1), normal=edge, normal2=_length2(edge)))
    return found


def _area_checked(sheet: _Sheet, i: int, points: Sequence[Vec], tolerance2: Ratio2, k: int) -> tuple[Vec, int]:
    if facing := sheet.joints[i].facing:
        normal = _vector(facing, 2 * k)  # as large as if twice the area were 1 m2
        return normal, _length2(normal)
    normal = _area_vector(points)
    normal2 = _length2(normal)
    if normal2 == 0:
        _refuse(f"{_label(sheet, i)}: polygon has no area")
    if not _is_flat(points, normal, normal2, tolerance2):
        _refuse(f"{_label(sheet, i)}: polygon is not flat within the tolerance")
    if not sheet.joints[i].bent and not _is_wide(points, normal2, tolerance2):
        _refuse(f"{_label(sheet, i)}: polygon is no wider than {NARROW} tolerances; it carries nothing, leave it out")
    return normal, normal2


def _require_single_pulls(sheet: _Sheet, patches: Sequence[_Patch], looks: "_Budget") -> None:
    """Require that no area pulls twice: that no polygon of a joint that pulls goes round a part of itself twice, and no
    two of the same blocks lie on each other, by more than `TWICE` of the smaller.
    """
    beside: dict[tuple[int, ...], list[_Patch]] = {}
    for patch in patches:
        if not patch.joint.tension:
            continue
        ring, where = _seen_along(patch, patch.points), _label(sheet, patch.number)
        looks.spend(8 * len(ring) ** 2)
        if not _in_common(ring, ring) <= (1 + TWICE) * _twice_area(ring):
            _refuse(f"{where}: its polygon goes round some of its area twice, and would pull there twice")
        others = beside.setdefault(tuple(sorted((patch.a, patch.b))), [])
        for other in others:
            if _is_beside(patch, other):
                looks.spend(8 * len(ring) * len(other.points))
                there = _seen_along(patch, other.points)
                if not _in_common(ring, there) <= TWICE * min(_twice_area(ring), _twice_area(there)):
                    _refuse(f"{_label(sheet, other.number)} and {where} lie on each other, and would pull there twice")
        others.append(patch)


def _require_on_faces(sheet: _Sheet, solid: _Solid, patch: _Patch, sign: int, looks: "_Budget") -> None:
    """Require that at least half of a flat joint that pulls lies on faces of a block that look along `sign` N."""
    local = patch._replace(points=[_minus(point, solid.origin) for point in patch.points])
    facets, _ = _facets_along(solid.shape.near(local)[0], local, sign)
    ring = _seen_along(local, local.points)
    looks.spend(8 * len(ring) * sum(len(facet.ring) for facet in facets))
    shared = sum((_in_common(ring, _seen_along(local, facet.ring)) for facet in facets), Fraction(0))
    if not 2 * shared >= _twice_area(ring):
        side = "a" if sign == 1 else "b"
        _refuse(
            f"{_label(sheet, patch.number)}: less than half of it is on faces of its block {side}, and all would pull"
        )


def _is_beside(patch: _Patch, other: _Patch) -> bool:
    """Whether another contact of the same blocks looks along this one, within 36 degrees, and comes near its plane."""
    along = _dot(patch.normal, other.normal) * (1 if patch.a == other.a else -1)
    if not (along > 0 and 25 * along * along >= 16 * patch.normal2 * other.normal2):
        return False
    rise = min(abs(_dot(_minus(point, patch.points[0]), patch.normal)) for point in other.points)
    return any(rise * rise * u <= NARROW**2 * t * patch.normal2 for t, u in (patch.tolerance2, other.tolerance2))


def _seen_along(patch: _Patch, points: Sequence[Vec]) -> list[tuple[int, int]]:
    """Points as they are seen along a contact's normal, in the axes of the world but the one next to it."""
    drop = max(range(3), key=lambda axis: abs(patch.normal[axis]))
    seen = [_minus(_times(patch.normal2, r), _times(_dot(r, patch.normal), patch.normal)) for r in points]
    return [(point[drop - 2], point[drop - 1]) for point in seen]


def _twice_area(ring: Sequence[tuple[int, int]]) -> int:
    return abs(sum(ax * by - ay * bx for (ax, ay), (bx, by) in _around(ring)))


def _in_common(one: Sequence[tuple[int, int]], two: Sequence[tuple[int, int]]) -> Fraction:
    """Twice the area that two polygons have in common, each part as often as one goes round it times the other.

    A polygon is the signed sum of the areas below its sides, down to a line below both: so what they have in common is
    that of the areas below the lower of two sides, one of each.
    """
    base, total = min(y for _, y in (*one, *two)), Fraction(0)
    for ((ax, ay), (bx, by)), ((cx, cy), (dx, dy)) in product(_around(one), list(_around(two))):
        left, right = max(min(ax, bx), min(cx, dx)), min(max(ax, bx), max(cx, dx))
        if left < right:
            here = [ay - base + Fraction((by - ay) * (x - ax), bx - ax) for x in (left, right)]
            there = [cy - base + Fraction((dy - cy) * (x - cx), dx - cx) for x in (left, right)]
            first, last = (p - q for p, q in zip(here, there, strict=True))
            below = min(here[0], there[0]) + min(here[1], there[1])
            if first * last < 0:  # they cross, and the lower of them rises to there
                below -= first * last / (abs(first) + abs(last))
            total += (right - left) * (below if (ax < bx) == (cx < dx) else -below)
    return abs(total)


def _is_wide(points: Sequence[Vec], normal2: int, tolerance2: Ratio2) -> bool:
    """Whether |N| / perimeter exceeds `NARROW` tolerances; |dx| + |dy| + |dz| is at least an edge's length."""
    t, u = tolerance2
    edges = [_minus(b, a) for a, b in _around(points)]
    around = sum(abs(x) + abs(y) + abs(z) for x, y, z in edges)
    if normal2 * u > NARROW**2 * t * around**2:
        return True
    return normal2 * u > NARROW**2 * t * sum(_root_above(_length2(edge)) for edge in edges) ** 2


def _moments(faces: Sequence[Sequence[int]], local: Sequence[Vec]) -> tuple[int, Vec]:
    """Volume and first moment: signed tetrahedra from the origin to the fan triangles (a, b, c) of the faces.

    6 V = sum det(a, b, c), and 24 V c = sum det (a + b + c). The origin is a vertex, so that the tetrahedra of the
    faces at it vanish.
    """
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
    return volume6, (mx, my, mz)


# Does a mesh bound a solid? Its faces close and are turned alike (`_is_closed`), yet there may be shells without volume
# or turned inside out, one shell inside another, and faces that lie on each other. A convex block can have none of
# that, which a few products tell; all others are looked at shell by shell and plane by plane.

FLAT_BITS = 20  # a convex block's corner may stand out of a face's plane by 2**-20 of how far the block reaches below
THIN_BITS = 30  # a shell thinner than 2**-30 of its own size has no volume: that is rounding, as of a turned sheet
MAX_CONVEX = 4000  # faces times vertices up to which a block is tried for being convex
MAX_NAMED = 30  # faces among which those that lie on each other are looked for, to be named
SAMPLES = 8  # places of a shell that are looked up in the others
MAX_KEPT = 256  # points up to which a shape or a contact is kept, to be known again, and how many are
FEW = 16  # facets, edges and contacts up to which there is no use in sorting them by place

# Steps of work: so many, and so many more for each thing in the file that they are about.
MAX_ARMS = 400_000, 200  # blocks above each other, along the ways of a state of many drawings; for each block
MAX_NESTING = 4_000, 100  # neighbours and triangles that tell which shells lie inside which; for each face
MAX_SWEEP = 10_000, 100  # edges that a line in a plane sweeps over; for each edge
MAX_LOOKS = 1_000_000, 50  # facets, and edges of large ones, that contacts look at; for each point and each face


def _shells(faces: Sequence[Sequence[int]]) -> list[list[int]]:
    """Group the faces of a mesh that hang together by edges.

    >>> _shells([(0, 1, 2), (3, 4, 5), (2, 1, 6), (5, 4, 3)])
    [[0, 2], [1, 3]]
    """
    beside: list[list[int]] = [[] for _ in faces]
    last: dict[tuple[int, int], int] = {}  # the face seen last at an edge
    for number, face in enumerate(faces):
        for i, j in _around(face):
            edge = (i, j) if i < j else (j, i)
            other = last.setdefault(edge, number)
            if other != number:
                beside[number].append(other)
                beside[other].append(number)
                last[edge] = number
    shells: dict[int, list[int]] = {}
    for number, shell in enumerate(_groups(beside, [False] * len(faces))):
        shells.setdefault(shell, []).append(number)
    return list(shells.values())


def _require_solid(where: str, surface: _Surface, vertices: Sequence[Vec]) -> tuple[int, bool]:
    """Require that a closed mesh of positive volume bounds a solid; count its outer shells, and tell if it is convex.

    No shell may be without volume; shells turned inward are holes, inside exactly one more outward shell than inward
    ones; outward shells are outside of all that is stone. No two faces may lie on each other, neither back to back
    (a sheet without thickness, or a cut without width) nor facing the same way. A surface that crosses itself
    otherwise is not looked for.

    A convex shell lies on its convex hull, and goes round it a whole number of times. Once, if the corners in one plane
    are four or fewer: around them, on the side of the hull where no corner stands between two others, there can be one
    edge only, and each directed edge occurs once.
    """
    alone = len(surface.shells) == 1
    fewest = _fewest_in_a_plane(surface, vertices) if alone else 0
    if 0 < fewest <= 4:
        return 1, True
    pieces = 1 if alone else _outer_shells(where, surface, vertices)
    _require_single_faces(where, surface.faces, vertices)
    return pieces, fewest > 0


def _fewest_in_a_plane(surface: _Surface, vertices: Sequence[Vec]) -> int:
    """How many corners of a convex shell are in the plane of a face, at least, or four; 0 if it is not convex.

    Convex is, all but 2**-FLAT_BITS, that no corner is in front of the plane of a face.
    """
    faces, fewest = surface.faces, len(vertices)
    if len(faces) * len(vertices) > MAX_CONVEX:
        return 0
    for face in faces:
        nx, ny, nz = _area_vector([vertices[i] for i in face])
        heights = [nx * x + ny * y + nz * z for x, y, z in vertices]
        base = heights[face[0]] if len(face) == 3 else min([heights[i] for i in face])
        depth = base - min(heights)
        if not (depth > 0 and max(heights) - base << FLAT_BITS <= depth):
            return 0
        if fewest > 4:
            level = base - (depth >> FLAT_BITS - 1)
            fewest = min(fewest, sum([height >= level for height in heights]))
    return fewest


class _Triangle(NamedTuple):
    """A triangle of a shell, with its area vector (twice the area, outward) and its box, wider by rounding.

    A point is on the triangle if its height times the area vector's length is at most `limit`.
    """

    a: Vec
    b: Vec
    c: Vec
    normal: Vec
    low: Vec
    high: Vec
    limit: int


class _Shell(NamedTuple):
    """A connected part of a mesh: its faces' numbers, the triangles of their fans, 6 V, and its box."""

    numbers: Sequence[int]
    triangles: list[_Triangle]
    volume6: int
    low: Vec
    high: Vec


def _outer_shells(where: str, surface: _Surface, vertices: Sequence[Vec]) -> int:
    """Count the shells that are no holes; refuse those without volume, turned inside out, or inside another's stone.

    A shell is where its corners are that lie on no other shell, or, where all do, the middles of its triangles; some of
    each are looked up. All is counted in thirds, so that these are integers.
    """
    thirds = [_times(3, vertex) for vertex in vertices]
    low, high = _box(thirds)
    slack = sum(_minus(high, low)) >> THIN_BITS
    shells = [_shell(where, surface, numbers, thirds, slack) for numbers in surface.shells]
    index = _Index([shell.low for shell in shells], [shell.high for shell in shells])
    budget = _Budget(MAX_NESTING, len(surface.faces), f"{where}: too many shells of its mesh are beside each other")
    for number, shell in enumerate(shells):
        near = [shells[other] for other in index.near(shell.low, shell.high) if other != number]
        budget.spend(len(near))
        near = [other for other in near if _do_meet(shell.low, shell.high, other)]
        found: set[int] = set()
        some = shell.triangles[:: -(-len(shell.triangles) // SAMPLES)]
        corners = [t.a for t in some]
        middles = [_plus(_plus(t.a, t.b), t.c) for t in some]
        for point in (*corners, *((x // 3, y // 3, z // 3) for x, y, z in middles)):
            around = [other for other in near if _do_meet(point, point, other)]
            budget.spend(sum(len(other.triangles) for other in around))
            turns = [_winding(other.triangles, point) for other in around]
            if None not in turns:
                found.add(sum(turn or 0 for turn in turns))
            if found and point == corners[-1]:
                break
        _require_place(where, shell, found)
    return sum(shell.volume6 > 0 for shell in shells)


def _require_place(where: str, shell: _Shell, found: set[int]) -> None:
    """Require that the other shells go round a hole once, and not round stone: `found` is how often they do."""
    hole = int(shell.volume6 < 0)
    if found == {hole}:
        return
    fault = "lies on another"
    if found:
        fault = "lies inside another: stone that would count twice" if max(found) > hole else "is turned inside out"
    _refuse(f"{where}: a shell of its mesh {fault} ({_numbered(shell.numbers)})")


def _numbered(numbers: Sequence[int]) -> str:
    """Name faces by their numbers.

    >>> _numbered([3]), _numbered([3, 4]), _numbered(range(9))
    ('face 3', 'faces 3 and 4', 'faces 0, 1 and 7 more')
    """
    if len(numbers) == 1:
        return f"face {numbers[0]}"
    if len(numbers) == 2:
        return f"faces {numbers[0]} and {numbers[1]}"
    return f"faces {numbers[0]}, {numbers[1]} and {len(numbers) - 2} more"


def _shell(where: str, surface: _Surface, numbers: Sequence[int], vertices: Sequence[Vec], slack: int) -> _Shell:
    """Cut a shell into triangles and measure it; it must be thicker than rounding: 6 V > 2**-THIN_BITS size x area."""
    wide = slack, slack, slack
    triangles = []
    origin = vertices[surface.faces[numbers[0]][0]]
    volume6, area = 0, 0
    for a, b, c in chain.from_iterable(_fan([vertices[i] for i in surface.faces[number]]) for number in numbers):
        normal = _cross(_minus(b, a), _minus(c, a))
        low, high = _box((a, b, c))
        around = sum(map(abs, normal))
        triangles.append(_Triangle(a, b, c, normal, _minus(low, wide), _plus(high, wide), slack * around))
        volume6 += _dot(_minus(a, origin), normal)
        area += around
    low, high = _box(vertices[i] for number in numbers for i in surface.faces[number])
    if not abs(volume6) << THIN_BITS > sum(_minus(high, low)) * area:
        _refuse(f"{where}: a shell of its mesh has no volume ({_numbered(numbers)})")
    return _Shell(numbers, triangles, volume6, low, high)


def _do_meet(low: Vec, high: Vec, shell: _Shell) -> bool:
    """Whether the box around a shell meets another one, or a point."""
    (ax, ay, az), (bx, by, bz) = shell.low, shell.high
    return ax <= high[0] and low[0] <= bx and ay <= high[1] and low[1] <= by and az <= high[2] and low[2] <= bz


def _winding(triangles: Iterable[_Triangle], point: Vec) -> int | None:
    """How often a closed surface goes round a point (1 inside, 0 outside, -1 inside of one turned inward), or None if
    the point is on it, as near as rounding lets be said.

    Faces are counted that a ray up along z leaves by, less those that it enters by. The ray is thought to stand aside
    of the point by (e, e^2, 0) with an e as small as need be, so that it meets no edge and runs along no face.
    """
    px, py, pz = point
    turns = 0
    for a, b, c, normal, low, high, limit in triangles:
        if px < low[0] or px > high[0] or py < low[1] or py > high[1] or pz > high[2]:
            continue
        rise = _dot(normal, _minus(point, a))
        if -limit <= rise <= limit and pz >= low[2] and _is_in_triangle(a, b, c, normal, point):
            return None
        up = normal[2]
        if up and (rise < 0) == (up > 0) and rise:
            side = up > 0
            for (sx, sy, _), (ex, ey, _) in ((a, b), (b, c), (c, a)):
                dx, dy = ex - sx, ey - sy
                if ((dx * (py - sy) - dy * (px - sx) or -dy or dx) > 0) != side:
                    break
            else:
                turns += 1 if side else -1
    return turns


def _is_in_triangle(a: Vec, b: Vec, c: Vec, normal: Vec, point: Vec) -> bool:
    """Whether a point is on a triangle, its edges counted, or straight above or below; none is if it has no area."""
    if not any(normal):
        return False
    return all(
        _dot(normal, _cross(_minus(end, start), _minus(point, start))) >= 0 for start, end in ((a, b), (b, c), (c, a))
    )


class _Piece(NamedTuple):
    """A flat piece of a face in its plane: corners in two coordinates, counter-clockwise, and which way it looks."""

    number: int
    ring: Sequence[tuple[int, int]]
    back: bool


def _require_single_faces(where: str, faces: Sequence[Sequence[int]], vertices: Sequence[Vec]) -> None:
    """Require that no two faces lie on each other: that the pieces of faces in each plane have no area in common.

    Faces that are flat are taken whole, others as the triangles of their fans, as for the volume. Where some of these
    look backward the face is flat but for rounding, and which of them share a plane is chance: it is left out. Two
    faces with the same corners lie on each other whether they are flat or not.
    """
    planes: dict[tuple[Vec, int], list[_Piece]] = {}
    known: dict[frozenset[Vec], int] = {}
    for number, face in enumerate(faces):
        ring = [vertices[i] for i in face]
        twin = known.setdefault(frozenset(ring), number)
        if twin != number:
            _refuse(f"{where}: {_numbered([twin, number])} lie on each other, and bound no stone between them")
        normal = _area_vector(ring)
        height = _dot(normal, ring[0])
        if any(normal) and all([_dot(normal, corner) == height for corner in ring[1:]]):
            pieces: list[tuple[Sequence[Vec], Vec]] = [(ring, normal)]
        else:
            pieces = [(fan, _area_vector(fan)) for fan in _fan(ring)]
            if any(_dot(n, normal) < 0 for _, n in pieces):
                continue
            size2 = _length2(normal)  # a sliver between corners on a line lies in any plane: 60 degrees are enough
            pieces = [(fan, n) for fan, n in pieces if 4 * _dot(n, normal) ** 2 >= size2 * _length2(n)]
        for corners, n in pieces:
            if any(n):
                key, outline = _in_plane(number, corners, n)
                planes.setdefault(key, []).append(outline)
    for outlines in planes.values():
        if len(outlines) > 1 or not _turns_left(outlines[0].ring):
            _require_apart(where, outlines)


def _in_plane(number: int, ring: Sequence[Vec], normal: Vec) -> tuple[tuple[Vec, int], _Piece]:
    """Find the plane of a flat piece of a face, the same for both sides of it, and the piece's outline in it.

    The coordinate along which the plane leans least is left out.
    """
    x, y, z = map(abs, normal)
    axis = 0 if x >= y and x >= z else 1 if y >= z else 2
    back = normal[axis] < 0
    share = math.gcd(*normal)
    direction: Vec = (normal[0] // share, normal[1] // share, normal[2] // share)
    if back:
        direction, ring = _times(-1, direction), ring[::-1]
    u, v = (axis + 1) % 3, (axis + 2) % 3
    flat = [(corner[u], corner[v]) for corner in ring]
    return (direction, _dot(direction, ring[0])), _Piece(number, flat, back)


def _turns_left(ring: Sequence[tuple[int, int]]) -> bool:
    """Whether a polygon of four corners at most turns left, or not, at each of them: then it does not cross itself."""
    (ax, ay), (bx, by) = ring[-2:]
    for cx, cy in ring:
        if (bx - ax) * (cy - by) - (by - ay) * (cx - bx) < 0:
            return False
        ax, ay, bx, by = bx, by, cx, cy
    return len(ring) <= 4


class _Rim(NamedTuple):
    """An edge of flat pieces, from left to right: start, run, end; how many pieces are above it less those below."""

    x: int
    y: int
    dx: int
    dy: int
    end_x: int
    end_y: int
    turn: int

    def above(self, x: int, y: int) -> int:
        """Positive if a point is above the edge's line, negative if below."""
        return self.dx * (y - self.y) - self.dy * (x - self.x)

    def is_under(self, other: "_Rim") -> bool:
        """Whether another edge starts above the line of this one, or on it and rises more."""
        return (self.above(other.x, other.y) or self.dx * other.dy - other.dx * self.dy) > 0

    def is_along(self, other: "_Rim") -> bool:
        """Whether both are parts of one line."""
        return self.dx * other.dy == self.dy * other.dx and self.above(other.x, other.y) == 0

    def does_cross(self, above: "_Rim") -> bool:
        """Whether this one, the lower of two neighbours, is the upper one where the first of them ends."""
        if self.end_x <= above.end_x:
            return above.above(self.end_x, self.end_y) > 0
        return self.above(above.end_x, above.end_y) < 0


def _require_apart(where: str, outlines: Sequence[_Piece]) -> None:
    """Require that pieces in one plane have no area in common; name those that have."""
    if not _do_overlap(where, outlines):
        return
    some = outlines[:MAX_NAMED]
    for piece in some:
        if _do_overlap(where, [piece]):
            _refuse(f"{where}: face {piece.number} crosses itself")
    for one, two in combinations(some, 2):
        if _do_overlap(where, [one, two]):
            how = ", facing the same way" if one.back == two.back else " back to back: no thickness is between them"
            _refuse(f"{where}: {_numbered([one.number, two.number])} lie on each other{how}")
    _refuse(f"{where}: {_numbered([outline.number for outline in outlines])}, in one plane, lie on each other")


def _do_overlap(where: str, outlines: Sequence[_Piece]) -> bool:
    """Whether pieces in one plane have any area in common, found by a line that sweeps along x (Shamos and Hoey 1976).

    Edges in which two pieces adjoin cancel. Of those left, none may cross, and from each to the next one above it there
    is one piece or none. Those that cross do so first as neighbours on the line, or one that starts where another
    passes is out of turn.
    """
    loose: Counter[tuple[tuple[int, int], tuple[int, int]]] = Counter()
    for outline in outlines:
        for tail, head in _around(outline.ring):
            if tail[0] < head[0]:
                loose[tail, head] += 1
            elif tail[0] > head[0]:
                loose[head, tail] -= 1
    starts: dict[int, list[_Rim]] = {}
    ends: dict[int, list[_Rim]] = {}
    for ((ax, ay), (bx, by)), count in loose.items():
        if count:
            rim = _Rim(ax, ay, bx - ax, by - ay, bx, by, count)
            starts.setdefault(ax, []).append(rim)
            ends.setdefault(bx, []).append(rim)
    budget = _Budget(MAX_SWEEP, sum(map(len, ends.values())), f"{where}: too many faces in one plane")
    line: list[_Rim] = []  # the edges that the line crosses, from below
    turns: list[int] = []
    for x in sorted(starts.keys() | ends.keys()):
        first, last = len(line), -1  # where something changes
        for rim in ends.get(x, ()):
            place = line.index(rim)
            del line[place], turns[place]
            first, last = min(first, place), max(last - (last > place), place)
        for rim in starts.get(x, ()):
            place = bisect_left(line, True, key=lambda other: not other.is_under(rim))
            line.insert(place, rim)
            turns.insert(place, rim.turn)
            first, last = min(first, place), max(last + (last >= place), place)
        first, last = max(first - 1, 0), min(last + 1, len(line) - 1)
        budget.spend(1 + max(last - first, 0) + len(line) // 64)
        covered = sum(turns[:first])
        for below, above in pairwise(line[first : last + 1]):
            covered += below.turn
            if below.does_cross(above) or (covered not in (0, 1) and not below.is_along(above)):
                return True
    return False


# A point is on a facet if it is within tolerance of the facet's plane, and inside its outline or within tolerance of an
# edge. Nearly every point of an honest certificate is inside a triangle or quadrilateral, or on its edge; this is found
# out first, with a few products. What is not so found takes the general way. Both are exact.


class _Edge(NamedTuple):
    """An edge of a facet from `start` along `run`. `inward`.r - `offset` is positive to its left, seen from outside."""

    start: Vec
    run: Vec
    run2: int
    inward: Vec
    offset: int

    def distance2(self, point: Vec) -> Ratio2:
        """The square of the distance of a point: from the nearer end, or between them from the line."""
        away = _minus(point, self.start)
        along = _dot(away, self.run)
        if along > 0:
            if along < self.run2:
                return _length2(_cross(away, self.run)), self.run2
            away = _minus(away, self.run)
        return _length2(away), 1


@dataclass(slots=True)
class _Facet:
    """A flat piece of a block's surface: corners and area vector (twice the area, outward); the rest once needed.

    The plane through the mean of its m corners is m r.normal = `height`. The box from `low` to `high` holds the corners
    and what is straight above or below them in that plane.
    """

    ring: Sequence[Vec]
    normal: Vec
    normal2: int
    height: int = 0
    lean: int = 0  # 1 where the corners are not all in that plane
    low: Vec = (0, 0, 0)
    high: Vec = (0, 0, 0)
    edges: list[_Edge] = field(default_factory=list)
    sweep: Vec = (0, 0, 0)  # in the plane
    index: "_Index | None" = None  # of many edges, along the sweep

    def prepared(self) -> "_Facet":
        """Itself, with its plane and its box."""
        if self.low == self.high:
            heights = [_dot(r, self.normal) for r in self.ring]
            self.height, self.lean = sum(heights), int(min(heights) != max(heights))
            self.low, self.high = _box(self.ring)
            if self.lean:
                count, off = len(self.ring), max(abs(len(self.ring) * h - self.height) for h in heights)
                wide = _root_above(_quotient_above(off * off, count * count * self.normal2))
                self.low, self.high = _minus(self.low, (wide,) * 3), _plus(self.high, (wide,) * 3)
        return self

    def edged(self) -> "_Facet":
        """Itself, with its edges too."""
        if not self.edges:
            for start, end in _around(self.ring):
                run = _minus(end, start)
                inward = _cross(self.normal, run)
                self.edges.append(_Edge(start, run, _length2(run), inward, _dot(inward, start)))
            least = min(range(3), key=lambda axis: abs(self.normal[axis]))
            self.sweep = _cross(self.normal, (int(least == 0), int(least == 1), int(least == 2)))
            if len(self.ring) > FEW:
                ends = list(_around([_dot(r, self.sweep) for r in self.ring]))
                self.index = _Index([(min(pair),) for pair in ends], [(max(pair),) for pair in ends])
        return self

    def is_near(self, low: Vec, high: Vec, tolerance2: Ratio2) -> bool:
        """Whether its box is within tolerance of another one."""
        (ax, ay, az), (bx, by, bz), (lx, ly, lz), (hx, hy, hz) = self.low, self.high, low, high
        t, u = tolerance2
        apart = max(ax - hx, lx - bx, ay - hy, ly - by, az - hz, lz - bz, 0)
        return apart * apart * u <= t

    def reaches(self, point: Vec, tolerance2: Ratio2) -> bool:
        """Whether a point is within tolerance of the plane."""
        t, u = tolerance2
        (x, y, z), (nx, ny, nz), count = point, self.normal, len(self.ring)
        rise = count * (x * nx + y * ny + z * nz) - self.height
        return not rise or rise * rise * u <= count * count * t * self.normal2

    def covers(self, point: Vec) -> bool:
        """Whether a point that the facet reaches is plainly inside, or on an edge.

        A point to the left of all edges of a triangle or quadrilateral is inside: seen from it each edge turns by less
        than half a turn and never back, all four by less than two turns, so by one. (With five edges that would not be
        true: a pentagram goes round its middle twice.) Points on the line of an edge are inside too, or on the edge;
        they count if the facet is exactly flat, for then the edge is as near as the plane is; if not, its corners do.
        """
        if len(self.ring) > 4:
            return False
        x, y, z = point
        for _, _, _, (ix, iy, iz), offset in self.edges:
            if ix * x + iy * y + iz * z < offset + self.lean:
                return self.lean == 1 and point in self.ring
        return True

    def beside2(self, point: Vec, tolerance2: Ratio2, looks: "_Budget") -> Ratio2 | None:
        """How far a point is beside the facet that reaches it, squared; None where that is more than the tolerance."""
        t, u = tolerance2
        edges = self.edges_near(point, tolerance2)
        looks.spend(4 * len(edges))
        if self.is_inside(edges, point):
            return 0, 1
        found = [d for edge in edges if (d := edge.distance2(point))[0] * u <= t * d[1]]
        return min(found, key=lambda d: _as_float(*d), default=None)

    def edges_near(self, point: Vec, tolerance2: Ratio2) -> list[_Edge]:
        """Edges that are as high as a point along the sweep, but for the tolerance."""
        if self.index is None:
            return self.edges
        room = _root_above(_quotient_above(tolerance2[0] * _length2(self.sweep), tolerance2[1]))
        level = (_dot(point, self.sweep),)
        return [self.edges[number] for number in self.index.near(level, level, room)]

    def is_inside(self, edges: Sequence[_Edge], point: Vec) -> bool:
        """Even-odd rule, along the normal: count the edges that a ray in the plane from the point crosses.

        An edge is crossed where its ends lie on either side in the sweep direction and the point to its proper side.
        """
        level = _dot(point, self.sweep)
        inside = False
        for edge in edges:
            start = _dot(edge.start, self.sweep)
            rises = start + _dot(edge.run, self.sweep) > level
            if rises != (start > level) and (_dot(edge.inward, point) > edge.offset) == rises:
                inside = not inside
        return inside

    def height_of(self, point: Vec, k: int) -> float:
        """How far a point is above the facet's plane, outside the block, in m: for the claim only."""
        count = len(self.ring)
        rise = count * _dot(point, self.normal) - self.height
        if not rise:
            return 0.0
        size = math.sqrt(_as_float(rise * rise, count * count * self.normal2 << 2 * k))
        return size if rise >= 0 else -size


class _Seat(NamedTuple):
    """How a contact lies on the faces of one of its blocks.

    `heights` holds how far points are above their facet (outside the block), where that is not zero, and `aside` the
    most that one is beside it, in m; `lean` is the largest angle; `normals` are, for every point of a contact of
    rough or curved surfaces, area vectors of facets that it lies on, turned to look along the contact's. Of a contact
    at points `tops` says of each whether it is on such a face, along which edge the block touches, see `_top`, and
    whether there is an edge of the block there from which another face falls.
    """

    heights: dict[int, float]
    aside: float
    lean: float
    normals: list[list[Vec]]
    tops: list[tuple[bool, Vec | None, bool]]


def _facets(surface: _Surface, vertices: Sequence[Vec], tolerance2: Ratio2) -> list[_Facet]:
    """Cut a surface into flat pieces: each flat face whole, any other as the triangles of its fan."""
    facets = []
    for face in surface.faces:
        ring = [vertices[i] for i in face]
        normal = _area_vector(ring)
        normal2 = _length2(normal)
        if normal2 and _is_flat(ring, normal, normal2, tolerance2):
            facets.append(_Facet(ring, normal, normal2))
            continue
        for fan in _fan(ring):
            if any(normal := _area_vector(fan)):
                facets.append(_Facet(fan, normal, _length2(normal)))
    return facets


def _seat(sheet: _Sheet, facets: Sequence[_Facet], patch: _Patch, sign: int, k: int, looks: _Budget) -> _Seat:
    """Find facets that look along `sign` N under every point of a contact."""
    bent, pointlike, aside2 = patch.joint.bent, patch.joint.pointlike, 0.0
    near, lean = _facets_along(facets, patch, sign)
    heights: dict[int, float] = {}
    normals: list[list[Vec]] = []
    tops: list[tuple[bool, Vec | None, bool]] = []
    wide = _widened(patch)
    beside = _facets_beside(facets, wide) if pointlike else []
    looks.spend((len(near) + len(beside)) * len(patch.points))
    for number, point in enumerate(patch.points):
        reaching = [facet for facet in near if facet.reaches(point, patch.tolerance2)]
        plain = [] if bent or pointlike else [facet.height_of(point, k) for facet in reaching if facet.covers(point)]
        if plain:
            heights[number] = min(plain, key=abs)
            continue
        found: list[tuple[float, float]] = []
        normals.append([])
        for facet in reaching:
            beside2 = facet.beside2(point, patch.tolerance2, looks)
            if beside2 is not None:
                found.append((_as_float(beside2[0], beside2[1] << 2 * k), facet.height_of(point, k)))
                normals[-1].append(_times(sign, facet.normal))
        if pointlike:
            there, around = (_facets_at(beside, point, one.tolerance2, looks) for one in (patch, wide))
            tops.append((bool(found), _top(there, patch, point, sign), _is_ridge(around, wide, point, sign)))
            if not found and tops[-1][1] is not None:
                continue
        if not found:
            side = "a" if sign == 1 else "b"
            where = f"{_label(sheet, patch.number)}: point {number}"
            _refuse(f"{where} is not on a face of its block {side} that looks along it")
        nearest2, heights[number] = min(found, key=lambda one: (one[0], abs(one[1])))
        aside2 = max(aside2, nearest2)
    heights = {number: h for number, h in heights.items() if h}
    return _Seat(heights, math.sqrt(aside2), lean, normals if bent else [], tops)


def _facets_beside(facets: Sequence[_Facet], patch: _Patch) -> list[_Facet]:
    """Facets near a contact, whichever way they look."""
    low, high = _box(patch.points)
    return [facet.edged() for facet in facets if facet.prepared().is_near(low, high, patch.tolerance2)]


def _facets_at(facets: Sequence[_Facet], point: Vec, tolerance2: Ratio2, looks: _Budget) -> list[_Facet]:
    """Facets within tolerance of a point."""
    reached = [facet for facet in facets if facet.reaches(point, tolerance2)]
    return [facet for facet in reached if facet.beside2(point, tolerance2, looks)]


def _widened(patch: _Patch) -> _Patch:
    """The same contact with `NARROW` times its tolerance."""
    t, u = patch.tolerance2
    return patch._replace(tolerance2=(NARROW**2 * t, u))


def _is_ridge(facets: Sequence[_Facet], patch: _Patch, point: Vec, sign: int) -> bool:
    """Whether some facet within tolerance of a point does not look along `sign` N, and is nowhere before the plane."""
    up, (t, u) = _times(sign, patch.normal), patch.tolerance2
    for facet in facets:
        along = _dot(facet.normal, up)
        if not (along > 0 and LEAN * along * along >= (LEAN - 1) * facet.normal2 * patch.normal2):
            rise = max(_dot(_minus(corner, point), up) for corner in facet.ring)
            if rise <= 0 or rise * rise * u <= t * patch.normal2:
                return True
    return False


def _top(some: Sequence[_Facet], patch: _Patch, point: Vec, sign: int) -> Vec | None:
    """What of a block touches a plane at a point: along which edge, nothing (0, 0, 0) of a corner; None where nothing.

    Of all facets within tolerance of the point, which are given, the highest edge is within tolerance of it, and level;
    or the highest corner is, along `sign` N. So near the point the block is behind the plane, or all before it but for
    a hole: which, is said by that edge from the highest corner which falls least. What is above it, towards the plane,
    is outside where both of its facets look that way, or where one does and the edge is convex.
    """
    up, (t, u) = _times(sign, patch.normal), patch.tolerance2
    if not some:
        return None
    corners = {corner for facet in some for corner in facet.ring}
    top = max(corners, key=lambda corner: (_dot(corner, up), -_length2(_minus(corner, point)), corner))
    ahead, back = ({(e.start, _plus(e.start, e.run))[::way]: f for f in some for e in f.edges} for way in (1, -1))
    falls = {
        end: Fraction(_dot(_minus(top, end), up) ** 2, _length2(_minus(top, end)))
        for start, end in ahead
        if start == top and (top, end) in back
    }
    if not falls:
        return None
    end = min(falls, key=lambda corner: falls[corner])
    one, two, run = ahead[top, end].normal, back[top, end].normal, _minus(end, top)
    looking = [_dot(one, up) > 0, _dot(two, up) > 0]
    if not (all(looking) or (any(looking) and _dot(_cross(one, two), run) > 0)):
        return None
    away2, per = _Edge(top, run, _length2(run), run, 0).distance2(point)
    if away2 * u <= t * per and falls[end] * LEAN <= _length2(up):
        return run
    return (0, 0, 0) if _length2(_minus(point, top)) * u <= t else None


def _require_plane(sheet: _Sheet, patch: _Patch, one: _Seat, two: _Seat) -> bool:
    """Require that at each point of a contact a block touches with a corner or an edge, and that its plane is that of a
    face of the other, or of an edge of the other that crosses. Tell whether that face ends there.
    """
    ridged = False
    for number, ((face_a, a, ends_a), (face_b, b, ends_b)) in enumerate(zip(one.tops, two.tops, strict=True)):
        if (face_a and b is not None) or (face_b and a is not None):
            ridged |= (face_a and ends_a) or (face_b and ends_b)
            continue
        where = f"{_label(sheet, patch.number)}: point {number}"
        if a is None or b is None:
            _refuse(f"{where} is at no corner or edge of its blocks")
        across = _cross(a, b)
        size2 = _length2(across)
        if not size2 or CROSSING * size2 < _length2(a) * _length2(b):
            _refuse(f"{where} is on no face that looks along it, nor on edges that cross")
        if LEAN * _dot(across, patch.normal) ** 2 < (LEAN - 1) * size2 * patch.normal2:
            _refuse(f"{where}: the contact leans from the plane of the edges that cross there")
    return ridged


def _gripping(patches: Sequence[_Patch], ridged: Sequence[int], looks: _Budget) -> list[_Patch]:
    """The same contacts, of which those where an edge or a corner lies on an edge or a corner grip less for a state.

    There the faces of either block may give the normal, or any direction between; but a point has one of them, with
    friction about that. Listed with two normals at an angle 2 a it would bear more than any one of them along the edge:
    up to mu / cos a of what presses. Forces in the cones of mu', with

        mu'^2 = mu^2 cos^2 a / (1 + mu^2 sin^2 a)

    add up to one that is inside the cone of mu about some direction between. Of all such normals of two blocks the
    largest angle counts: what an edge bears in one place must not depend on how many places of it are listed.
    """
    beside: dict[tuple[int, ...], list[int]] = {}
    for number in ridged:
        beside.setdefault(tuple(sorted((patches[number].a, patches[number].b))), []).append(number)
    found = list(patches)
    for numbers in beside.values():
        looks.spend(len(numbers) ** 2)
        least = min([_cosine_below(patches[i], patches[j]) for i, j in combinations(numbers, 2)], default=Fraction(1))
        for number in numbers if least < 1 else ():
            mu2 = Fraction(patches[number].p, patches[number].q) ** 2
            grip = _root_of(mu2 * (1 + least) / (2 + mu2 * (1 - least)), up=False)
            found[number] = patches[number]._replace(grip=grip.as_integer_ratio())
    return found


def _cosine_below(one: _Patch, two: _Patch) -> Fraction:
    """Of the angle between the normals, from the same block, of two contacts of the same blocks; rounded down."""
    along, square = _dot(one.normal, two.normal) * (1 if one.a == two.a else -1), one.normal2 * two.normal2
    if along > 0 and along * along == square:
        return Fraction(1)
    return max(Fraction(along) / _root_of(square, up=along > 0), Fraction(-1))


def _facets_along(facets: Sequence[_Facet], patch: _Patch, sign: int) -> tuple[list[_Facet], float]:
    """Facets near a contact that look along `sign` times its normal, and the largest angle.

    cos >= p/q is n.N > 0, q^2 (n.N)^2 >= p^2 |n|^2 |N|^2; of flat surfaces sin^2 <= 1 / LEAN.
    """
    x, y, z = patch.normal
    p2, q2 = FACE_ALIGNMENT.numerator**2, FACE_ALIGNMENT.denominator**2
    if not patch.joint.bent:
        p2, q2 = LEAN - 1, LEAN
    found, most = [], 0.0
    low, high = _box(patch.points)
    for facet in facets:
        nx, ny, nz = facet.normal
        along = nx * x + ny * y + nz * z
        if (along > 0) == (sign > 0):
            both, square = facet.normal2 * patch.normal2, along * along
            if q2 * square >= p2 * both and facet.prepared().is_near(low, high, patch.tolerance2):
                found.append(facet.edged())
                if square != both:
                    most = max(most, _as_float(both - square, both))
    return found, math.asin(math.sqrt(most))


# ---------------------------------------------------------------------------------------------------------------------
# Do blocks run into each other? It is told, and proves nothing, so that lengths along axes are floats, in m.

MAX_BOXES = 1_000_000, 100_000  # comparisons of boxes, and pairs that overlap, after which nothing is looked at
MAX_PROJECTED = 4_000_000  # corners projected onto axes, after which the pairs left are not looked at
ROUNDING_BITS = 40  # depths below 2**-40 of the model's size are none


def _geometry_told(model: _Model) -> tuple[str, dict[str, float], tuple[str, ...]]:
    """What a reader of the claim should know of the blocks: detached pieces, and blocks that run into each other.

    For the claim, for the figures, and for what is assumed: pairs of blocks that were not looked at.
    """
    told, figures = "", {}
    if several := sum(solid.shape.pieces > 1 for solid in model.solids):
        told += f", {several} block{'s' * (several > 1)} of several detached pieces"
        figures["pieces"] = float(several)
    found, unseen = _overlaps(model)
    if found:
        least = max(depth for depth, _, _ in found) * EQUALLY_DEEP
        depth, *worst = next(pair for pair in found if pair[0] >= least)
        one, two = (_short(model.sheet.stones[i].name) for i in worst)
        more = f" (and {len(found) - 1} more pair{'s' * (len(found) > 2)})" if len(found) > 1 else ""
        told += f", blocks '{one}' and '{two}' run into each other by {depth:.3g} m{more}"
        figures["overlap"] = depth
    if unseen is None:
        return told, figures, ("overlaps   of blocks were not looked at: none are assumed",)
    pairs = "1 pair of blocks" if unseen == 1 else f"{unseen} pairs of blocks"
    said = f"overlaps   none of {pairs}, not convex or of many faces, that were not looked at"
    return told, figures, (said,) if unseen else ()


def _overlaps(model: _Model) -> tuple[list[tuple[float, int, int]], int | None]:
    """How deep blocks run into each other (m) by more than the tolerance, and which two; fixed ones may. And how many
    pairs were not looked at, or None if none was.

    For two convex blocks that is the least way along a face normal of one, or a normal to an edge of each, that takes
    them apart. Other blocks count as apart if the plane of a contact or of a face is between them.
    """
    solids, unit, left = model.solids, 1 << model.per_length, MAX_PROJECTED
    lows = [_plus(solid.origin, solid.shape.low) for solid in solids]
    highs = [_plus(solid.origin, solid.shape.high) for solid in solids]
    size = max(_minus(_box(highs)[1], _box(lows)[0]))
    room = int(Fraction(model.sheet.tolerance) * unit) + (size >> ROUNDING_BITS)
    between = _box_pairs(model, lows, highs, room)
    if between is None:
        return [], None
    for patch in model.patches:
        pair = (patch.a, patch.b) if patch.a < patch.b else (patch.b, patch.a)
        if pair in between:
            between[pair].append(patch.normal)
    corners: dict[int, list[Point]] = {}
    for i in set(chain.from_iterable(between)):
        ox, oy, oz = _minus(solids[i].origin, lows[0])
        corners[i] = [((x + ox) / unit, (y + oy) / unit, (z + oz) / unit) for x, y, z in solids[i].shape.corners]
    found, unseen = [], 0
    for (i, j), normals in between.items():
        one, two = solids[i].shape, solids[j].shape
        axes = _axes_between(one, two, normals)
        depth = min(map(min, _minus(highs[i], lows[j]), _minus(highs[j], lows[i]))) / unit
        while depth * unit > room and left > 0 and (axis := next(axes, None)):
            left -= len(corners[i]) + len(corners[j])
            depth = min(depth, _overlap_along(axis, corners[i], corners[j]))
        if depth * unit > room:
            if left > 0 and _is_measured(one, two):
                found.append((depth, i, j))
            else:
                unseen += 1
    return found, unseen


def _box_pairs(
    model: _Model, lows: Sequence[Vec], highs: Sequence[Vec], room: int
) -> dict[tuple[int, int], list[Vec]] | None:
    """Pairs i < j of blocks, not both fixed, whose boxes overlap by more than `room` along all axes, with an empty list
    for each; None if that takes too long.
    """
    index, steps = _Index(lows, highs), 0
    stones = model.sheet.stones
    pairs: dict[tuple[int, int], list[Vec]] = {}
    for j, ((lx, ly, lz), (hx, hy, hz)) in enumerate(zip(lows, highs, strict=True)):
        near = index.near(lows[j], highs[j])
        steps += len(near)
        if steps > MAX_BOXES[0] or len(pairs) > MAX_BOXES[1]:
            return None
        for i in near[: bisect_left(near, j)]:
            (ax, ay, az), (bx, by, bz) = lows[i], highs[i]
            if min(bx - lx, hx - ax, by - ly, hy - ay, bz - lz, hz - az) > room:
                if not (stones[i].fixed and stones[j].fixed):
                    pairs[i, j] = []
    return pairs


def _is_measured(one: _Shape, two: _Shape) -> bool:
    """Whether the axes between two blocks, see `_axes_between`, tell how deep they run into each other."""
    if not (one.convex and two.convex):
        return False
    each = len(one.corners) + len(two.corners)
    return len(_axes(one, True)) * len(_axes(two, True)) * each <= MAX_PROJECTED // 10


def _axes_between(one: _Shape, two: _Shape, normals: Iterable[Vec]) -> Iterator[Point]:
    """Normals of contacts and faces, and of an edge of each where that tells how deep blocks run into each other."""
    yield from filter(None, map(_unit, normals))
    yield from _axes(one, False)
    yield from _axes(two, False)
    if _is_measured(one, two):
        for (ax, ay, az), (bx, by, bz) in product(_axes(one, True), _axes(two, True)):
            if axis := _unit((ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx)):
                yield axis


def _axes(shape: _Shape, edges: bool) -> list[Point]:
    """Directions of a convex block's edges, or of the normals of any (a few where faces are many), each once."""
    if edges not in shape.axes:
        facets = shape.facets if shape.convex else shape.facets[:: len(shape.facets) // 64 + 1]
        runs = (_minus(b, a) for facet in facets for a, b in _around(facet.ring))
        shape.axes[edges] = _directions(runs if edges else (facet.normal for facet in facets))
    return shape.axes[edges]


def _directions(vectors: Iterable[Vec]) -> list[Point]:
    """The directions of these vectors, each once, whichever way they point, but for rounding."""
    found: dict[tuple[int, ...], Point] = {}
    for unit in filter(None, map(_unit, vectors)):
        sign = 1e9 if unit > (0.0, 0.0, 0.0) else -1e9
        found.setdefault(tuple(round(sign * x) for x in unit), unit)
    return list(found.values())


def _unit(vector: tuple[T, T, T]) -> Point | None:
    """A vector of length one; None where it has no direction."""
    x, y, z = vector
    most = max(abs(x), abs(y), abs(z))
    if not most > 1e-30:
        return None
    u, v, w = x / most, y / most, z / most
    length = math.hypot(u, v, w)
    return u / length, v / length, w / length


def _overlap_along(axis: Point, a: Sequence[Point], b: Sequence[Point]) -> float:
    """How far two sets of points overlap along an axis; the less of both ways to part them."""
    x, y, z = axis
    one, two = ([x * p + y * q + z * r for p, q, r in points] for points in (a, b))
    return min(max(one) - min(two), max(two) - min(one))


# ---------------------------------------------------------------------------------------------------------------------
# rbe-state.


def _state(model: _Model) -> tuple[dict[str, float], str, str]:
    """Check forces: inside their cones, and in balance on every free block."""
    balance = _balance(model, *_forces(model, model.sheet.forces))
    return balance.figures, f"every force is inside its friction cone; {balance.reason}", balance.grade


def _forces(model: _Model, rows: Sequence[Sequence[Number]]) -> tuple[list[Vec], int]:
    """The force at every contact point in 2**-per_force N, and per_force: what the file splits is added up."""
    smooth = [not patch.p for patch in model.patches for _ in patch.points]
    per_factor = _exponent(x for row, single in zip(rows, smooth, strict=True) if single for x in row)
    per_force = _exponent(x for row, single in zip(rows, smooth, strict=True) if not single for x in row)
    if any(smooth):
        per_force = max(per_force, per_factor + 2 * model.per_length)
    up = per_force - per_factor - 2 * model.per_length
    forces: list[Vec] = []
    for patch in model.patches:
        own = rows[patch.rows]
        if not patch.p:
            forces += [_times(sum(_integer(x, per_factor) for x in row) << up, patch.normal) for row in own]
        elif all(len(row) == 3 for row in own):
            forces += _vectors(own, per_force)
        else:
            split = ((*row, 0.0, 0.0, 0.0)[:6] for row in own)
            forces += [_plus(_vector(row[:3], per_force), _vector(row[3:], per_force)) for row in split]
    return forces, per_force


Sizes = list[tuple[int, int]]  # F.N and |F|^2, point by point


@dataclass(frozen=True, slots=True)
class _Balance:
    """How well forces balance: figures, a sentence, the grade for the claim, and the size of every force."""

    figures: dict[str, float]
    reason: str
    grade: str
    sizes: Sizes


EXACT = "; every block balances exactly"
NEARLY = "; balancing loads that differ, on each block, by at most 1e-9 of its own weight"  # the lightest's, in fact


def _balance(model: _Model, forces: list[Vec], per_force: int, what: str = "force") -> _Balance:
    """Check forces: inside their cones, of a size that masonry bears, and in balance on every free block.

    Per free block, with the forces F at r (contacts and loads), the centre of mass c, the own weight w and the diagonal
    D of the box:

        r_F = sum F + rho V g        r_M = sum r x F - c x sum F        (the weight has no moment about c)

    |r_F| <= BALANCE w and |r_M| <= BALANCE w D for every block. If r_F and r_M can be sent down a forest of contacts to
    the supports, by forces that leave all of them in their cones, then there are forces that balance exactly. If not, w
    is that of the lightest block of the component: what a boulder may miss must not be what holds a pebble.

    Nothing is corrected where forces go with a displacement: what holds of those in the file need not hold of others.
    What joints pull does not grow with the loads, so that a recession may not count on it; and the least of a block's
    live weight and its component's live loads stands for w where it is less, as any multiple is to be balanced.
    """
    recession = what == "recession"
    sizes, inner = _require_cones(model, forces, per_force, not recession, what)
    large = _require_modest(model, sizes, per_force)
    wrenches, unit = _wrenches(model, forces, per_force)
    most6 = _least_loads6(model) if recession else None
    worst, off = _misses(model, wrenches, unit, most6, model.masses6)
    figures = {"equilibrium_force": worst[0], "equilibrium_moment": worst[1]}
    for i, fault in off.items():
        _refuse(f"block {_short(model.sheet.stones[i].name)}: its {fault}", figures)
    missed = _misses(model, wrenches, unit, most6, model.lightest6)[1]
    inexact: set[int] = set()
    if model.sheet.motion and not model.sheet.live:
        inexact = {model.component[i] for i, wrench in wrenches.items() if wrench != NOTHING}
    elif any(wrench != NOTHING for wrench in wrenches.values()):
        inexact = large | _inexact(model, forces, per_force, wrenches, unit, (sizes, inner), not recession)
    for i, fault in missed.items():
        if model.component[i] in inexact:
            _refuse(f"block {_short(model.sheet.stones[i].name)}: its {fault}", figures | {"exact": 0.0})
    figures["exact"] = 1.0 - len(inexact) / max(model.parts, 1)
    size = f"{max(worst):.2g} of its own weight"
    if inexact:
        return _Balance(figures, f"every block balances to {size}", NEARLY, sizes)
    return _Balance(figures, f"every block balances exactly (the file's numbers to {size})", EXACT, sizes)


def _require_modest(model: _Model, sizes: Sizes, per_force: int) -> set[int]:
    """Require sum |F|^2 <= (BOUND W)^2 in every component; those where it is more than a hundredth of that.

    There nothing is corrected, nor where friction is above STEEP: what is added stays in the cones, so it is no more
    than sqrt(3 (1 + mu^2)) < 10 times as large as the forces, and does not come near what a mechanism demands.
    """
    sums = [0] * model.parts
    for patch in model.patches:
        sums[patch.part] += sum(force2 for _, force2 in sizes[patch.rows])
    unit = max(per_force, model.per_force)
    large = {patch.part for patch in model.patches if patch.joint.mu > STEEP}
    for c, (force2, total6) in enumerate(zip(sums, model.total6_below, strict=True)):
        mine, most = 36 * force2 << 2 * (unit - per_force), (BOUND * total6 << unit - model.per_force) ** 2
        if not mine <= most:
            _refuse(f"the forces of a component are larger than {BOUND:.0e} times its weight and loads")
        if not 100 * mine <= most:
            large.add(c)
    return large


Wrench = tuple[Vec, Vec]  # a force, and its moment about the centre of mass c, times 4 (6 V)
NOTHING: Wrench = (0, 0, 0), (0, 0, 0)


def _wrenches(model: _Model, forces: list[Vec], per_force: int, loaded: bool = True) -> tuple[dict[int, Wrench], int]:
    """24 times what is left on every free block, and unit: forces are in 2**-unit N, moments in 2**-(unit + per_length)
    N m, each times 4 (6 V).

    With the weights and loads if `loaded`; on `a` a contact acts with the opposite sign. Where a partial support holds
    a block nothing is left.
    """
    pulls: list[Vec] = [(0, 0, 0)] * len(model.solids)
    turns: list[Vec] = [(0, 0, 0)] * len(model.solids)
    for patch in model.patches:
        px = py = pz = tx = ty = tz = 0
        for (x, y, z), (fx, fy, fz) in zip(patch.points, forces[patch.rows], strict=True):
            px, py, pz = px + fx, py + fy, pz + fz
            tx, ty, tz = tx + y * fz - z * fy, ty + z * fx - x * fz, tz + x * fy - y * fx
        a, b, pull, turn = patch.a, patch.b, (px, py, pz), (tx, ty, tz)
        pulls[b], turns[b] = _plus(pulls[b], pull), _plus(turns[b], turn)
        pulls[a], turns[a] = _minus(pulls[a], pull), _minus(turns[a], turn)
    unit = max(per_force, model.per_force)
    scale, up = 24 << unit - per_force, unit - model.per_force
    pushed = {i: (_times(scale, pulls[i]), _times(scale, turns[i])) for i, _, _ in model.free()}
    for block, load, point in model.loads if loaded else ():
        force, (pull, turn) = _times(24 << up, load), pushed[block]
        pushed[block] = _plus(pull, force), _plus(turn, _cross(point, force))
    found = {}
    for i, stone, solid in model.free():
        pull, turn = pushed[i]
        turn = _about_centre(solid, pull, turn)  # the weight has no moment about c
        if loaded:
            pull = _plus(pull, _times(4 * model.masses6[i] << up, model.gravity))
        found[i] = (_freed(pull, stone.held[:3]), _freed(turn, stone.held[3:])) if any(stone.held) else (pull, turn)
    return found, unit


def _about_centre(solid: _Solid, pull: Vec, turn: Vec) -> Vec:
    """The moment about c times d = 4 (6 V): d T_c = d T - d c x F, with T that about the world's origin."""
    return _minus(_times(4 * solid.volume6, turn), _cross(solid.moment24, pull))


def _about_origin(solid: _Solid, pull: Vec, turn: Vec) -> Vec:
    """And back: T = (d T_c + d c x F) / d, a fraction only where a support has taken part of it."""
    d = 4 * solid.volume6
    x, y, z = _plus(turn, _cross(solid.moment24, pull))
    if x % d or y % d or z % d:
        return Fraction(x, d), Fraction(y, d), Fraction(z, d)  # type: ignore[return-value]
    return x // d, y // d, z // d


def _misses(
    model: _Model, wrenches: dict[int, Wrench], unit: int, most6: list[int] | None, masses6: Sequence[int]
) -> tuple[tuple[float, float], dict[int, str]]:
    """The largest |r_F| / w and |r_M| / (w D) of all blocks, and what is wrong where either exceeds `BALANCE`.

    The weights w are those of `masses6`; where `most6` is given, 6 w is no more than that.
    """
    p2, q2 = BALANCE.numerator**2, BALANCE.denominator**2
    worst = [0.0, 0.0]
    off: dict[int, str] = {}
    for i, wrench in wrenches.items():
        if wrench != NOTHING:
            solid, weight6 = model.solids[i], masses6[i] * model.own_below
            if most6 is not None:
                weight6 = min(weight6, most6[i])
            weight2 = (4 * weight6 << unit - model.per_force) ** 2
            for k, size2 in enumerate((weight2, weight2 * solid.box2 * (4 * solid.volume6) ** 2)):
                square = _length2(wrench[k])
                share = math.sqrt(_as_float(square, size2))
                worst[k] = max(worst[k], share)
                if not q2 * square <= p2 * size2:
                    what, of = (("forces", ""), ("moments", " times its size"))[k]
                    whose = "its own weight" if masses6 is model.masses6 else "the lightest block's weight"
                    off.setdefault(i, f"{what} do not balance: {share:.2g} of {whose}{of} is left")
    return (worst[0], worst[1]), off


def _require_cones(
    model: _Model, forces: list[Vec], per_force: int, pulling: bool, what: str
) -> tuple[Sizes, list[bool]]:
    """F.N >= 0 and |F|^2 |N|^2 <= (1 + mu^2) (F.N)^2, with mu = p/q, so times q^2; and where that is not an equation.

    Where joints pull (and `pulling` says so), or surfaces are rough or curved, as `_slack` has it.
    """
    sizes: Sizes = []
    inner: list[bool] = []
    for patch in model.patches:
        (p, q), (x, y, z), bent = patch.grip, patch.normal, patch.joint.bent
        left, right = q * q * patch.normal2, q * q + p * p
        pulls = _whole_pulls(patch, per_force, model.per_length, pulling)
        for number, force in enumerate(forces[patch.rows]):
            fx, fy, fz = force
            along = fx * x + fy * y + fz * z
            force2 = fx * fx + fy * fy + fz * fz
            if pulls or bent:
                slack = _slack(patch, number, force, pulls[number] if pulls else 0)
            else:
                slack = right * along * along - left * force2 if along >= 0 else -1
            if slack < 0:
                beyond = " more than the joint can" if pulls else ""
                pressed = along + (pulls[number] if pulls else 0) >= 0
                fault = "leaves the friction cone" if pressed else f"pulls{beyond}"
                _refuse(f"{_label(model.sheet, patch.number)}: the {what} at point {number} {fault}")
            sizes.append((along, force2))
            inner.append(slack > 0)
    return sizes, inner


def _slack(patch: _Patch, number: int, force: Vec, pull: int = 0) -> int:
    """Positive inside the cone at a point of a contact, negative outside, 0 on its edge.

    With s = F.N + t |N|, t |N| rounded down: s >= 0 and |F|^2 |N|^2 - (F.N)^2 <= mu^2 s^2. On a rough or curved surface
    F has to be in the cones about the normals of a face of either block, too.
    """
    p, q = patch.grip
    force2 = _length2(force)

    def within(normal: Vec, normal2: int, more: int) -> int:
        along = _dot(force, normal)
        pressed = along + more
        return p * p * pressed * pressed - q * q * (force2 * normal2 - along * along) if pressed >= 0 else -1

    slack = within(patch.normal, patch.normal2, pull)
    if patch.joint.bent and slack >= 0 and force2:
        for normals in patch.normals[number]:
            slack = min(slack, max(within(normal, _length2(normal), 0) for normal in normals))
    return slack


def _whole_pulls(patch: _Patch, per_force: int, per_length: int, pulling: bool) -> list[int]:
    """What each corner of a joint that pulls may pull, rounded down; nothing of one that does not, or may not."""
    if not (pulling and patch.joint.tension):
        return []
    unit, shares = _pulls(patch, per_force, per_length)
    return [unit.numerator * share // unit.denominator for share in shares]


def _inexact(
    model: _Model,
    forces: list[Vec],
    per_force: int,
    wrenches: dict[int, Wrench],
    unit: int,
    state: tuple[Sizes, list[bool]],
    pulling: bool,
) -> set[int]:
    """Components whose forces cannot be corrected to balance exactly.

    A forest of contacts grows from the supports, the strongest first; each needs three points, in no line, strictly
    inside their cones. From its leaves on, what is left on a block goes to its parent through that contact, and what
    that adds to the three forces has to leave them in their cones. Nothing is added twice, for no contact is the way of
    two blocks.
    """
    stones, solids = model.sheet.stones, model.solids
    ways, order = _forest(model, state)
    failed = {model.component[i] for i, wrench in wrenches.items() if i not in ways and wrench != NOTHING}
    carried = {i: (pull, _about_origin(solids[i], pull, turn)) for i, (pull, turn) in wrenches.items()}
    for block in reversed(order):
        c, (pull, turn), held = model.component[block], carried[block], stones[block].held
        if c in failed:
            continue
        if any(held):
            about = _freed(_about_centre(solids[block], pull, turn), held[3:])
            pull = _freed(pull, held[:3])
            turn = _about_origin(solids[block], pull, about)
        if (pull, turn) == NOTHING:
            continue
        patch, points = ways[block]
        parent = patch.a if patch.b == block else patch.b
        if not stones[parent].fixed:
            carried[parent] = _plus(carried[parent][0], pull), _plus(carried[parent][1], turn)
        way = -1 if patch.b == block else 1  # the force in the file acts on b
        pulls = _whole_pulls(patch, per_force, model.per_length, pulling)
        three, whole = _corrections([patch.points[k] for k in points], _times(way, pull), _times(way, turn))
        scale = 24 * whole << unit - per_force
        for k, d in zip(points, three, strict=True):
            force = _plus(d, _times(scale, forces[patch.rows.start + k]))
            if _slack(patch, k, force, pulls[k] * scale if pulls else 0) < 0:
                failed.add(c)
    return failed


Ways = dict[int, tuple[_Patch, list[int]]]  # block: contact to its parent, three points of it


def _forest(model: _Model, state: tuple[Sizes, list[bool]]) -> tuple[Ways, list[int]]:
    """The forest, and its blocks from the supports on."""
    stones, patches, (sizes, inner) = model.sheet.stones, model.patches, state
    beside: list[list[tuple[int, int, int]]] = [[] for _ in stones]
    for number, patch in enumerate(patches):  # not that of the contact, which may stand for several
        inside = [size[1] for size, strictly in zip(sizes[patch.rows], inner[patch.rows], strict=True) if strictly]
        if len(inside) >= 3:
            strength = sorted(inside)[-3]
            beside[patch.a].append((-strength, number, patch.b))
            beside[patch.b].append((-strength, number, patch.a))
    ways: Ways = {}
    order: list[int] = []
    heap = [entry for stone, near in zip(stones, beside, strict=True) if stone.fixed for entry in near]
    heapq.heapify(heap)
    while heap:
        _, i, block = heapq.heappop(heap)
        if block not in ways and not stones[block].fixed:
            patch = patches[i]
            if three := _spread(patch.points, [k for k, strictly in enumerate(inner[patch.rows]) if strictly]):
                ways[block] = patch, three
                order.append(block)
                for entry in beside[block]:
                    if entry[2] not in ways:
                        heapq.heappush(heap, entry)
    return ways, order


def _spread(at: Sequence[Vec], points: Sequence[int]) -> list[int]:
    """Three of these points that span a large triangle: the first, the one furthest from it, the one furthest aside."""
    origin = at[points[0]]
    arms = [_minus(at[k], origin) for k in points]
    sizes = [_length2(arm) for arm in arms]
    one = sizes.index(max(sizes))
    areas = [_length2(_cross(arms[one], arm)) for arm in arms]
    two = areas.index(max(areas))
    return [points[0], points[one], points[two]] if areas[two] else []


def _corrections(r: Sequence[Vec], w: Vec, t: Vec) -> tuple[list[Vec], int]:
    """Forces at three points in no line that add up to a wrench (w, and t about the world's origin), and what they
    are to be divided by.

    About the points' mean m, with t' = t - m x w, rho_j = r_j - m, e2, e3 the edges from r_1, M = e2 x e3 and
    S = sum |rho_j|^2,

        d_j = w / 3 + (t'.M) M x rho_j / (|M|^2 S) + c_j M
        c_2 = -t'.e3 / |M|^2, c_3 = t'.e2 / |M|^2, c_1 = -c_2 - c_3

    Here all of it is times 3 |M|^2 S, with 3 rho_j and 3 t' for rho_j and t', and r_j from r_1.
    """
    e2, e3 = _minus(r[1], r[0]), _minus(r[2], r[0])
    m, total = _cross(e2, e3), _plus(e2, e3)
    middle = _plus(_times(3, r[0]), total)
    t3 = _minus(_times(3, t), _cross(middle, w))
    rho = _times(-1, total), _minus(_times(3, e2), total), _minus(_times(3, e3), total)
    s, m2, turn = sum([_length2(x) for x in rho]), _length2(m), 3 * _dot(t3, m)
    c2, c3, even = -_dot(t3, e3), _dot(t3, e2), _times(m2 * s, w)
    turned = [_plus(even, _cross(_times(turn, m), x)) for x in rho] if turn else [even] * 3
    return [_plus(d, _times(s * c, m)) for d, c in zip(turned, (-c2 - c3, c2, c3), strict=True)], 3 * m2 * s


def _pulls(patch: _Patch, per_force: int, per_length: int) -> tuple[Fraction, list[int]]:
    """T |N| at each corner of a joint that pulls, in 2**-(per_force + 2 per_length) N m2: a unit, and how many of it.

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
    areas = [_dot(_cross(one, two), patch.normal) for one, two in _around(around)]
    unit = Fraction(patch.joint.tension) * Fraction(2) ** (per_force - 2 * per_length) / (36 * normal2 * normal2)
    return unit, [before + after for before, after in zip([areas[-1], *areas], areas, strict=False)]


# ---------------------------------------------------------------------------------------------------------------------
# rbe-mechanism.


class _Motion(NamedTuple):
    """A rigid motion: the velocity at r is `drift` + `spin` x r (so `drift` belongs to the world's origin)."""

    drift: Vec
    spin: Vec

    def at(self, point: Vec) -> Vec:
        """The velocity of a point."""
        return _plus(self.drift, _cross(self.spin, point))

    def flow(self, solid: _Solid) -> Vec:
        """The velocity of a block's centre of mass, times 4 (6 V)."""
        return _plus(_times(4 * solid.volume6, self.drift), _cross(self.spin, solid.moment24))


Motions = Sequence[_Motion]


def _mechanism(model: _Model) -> tuple[dict[str, float], str, str]:
    """Check a motion: in some component C the loads do more work than any state of it can take up.

    A state's forces are at most BOUND W in size, and leave at most BALANCE w, BALANCE w D on a block, so that its
    p.y = sum f.(-dd) + sum r.y is at most

        BOUND W ||P(-dd)|| + BALANCE sum w (|v| + D |omega|)

    over C, with v the velocity of the centre of mass and w the least weight of a block in C. Shown is that p.y is more,
    with all roots rounded up.
    """
    motions = _motions(model, model.sheet.motion)
    figures, _ = _driven(model, motions, _resistances(model, motions))
    return figures, _demand(figures), ""


def _demand(figures: dict[str, float]) -> str:
    """What a motion asks of the contacts, in words."""
    if figures["bound"] == sys.float_info.max:
        return "the blocks can move so that the loads do work and no contact resists"
    return f"to hold this motion the contacts would need forces of {figures['bound']:.2g} times the weight and loads"


def _driven(model: _Model, motions: Motions, norms: Sequence[int]) -> tuple[dict[str, float], list[int]]:
    """Require p.y to exceed what a state can take up, in some component; return those, the best one's figures first.

    What joints that pull take up is taken off p.y, and added to W.
    """
    works, pulls6 = _against_pulls(model, motions)
    powers24, slacks24 = _powers24(model, motions), _slacks24(model, motions)
    falling: list[int] = []
    best = 0.0
    for c, norm in enumerate(norms):
        left = powers24[c] - works[c] - slacks24[c]
        total24 = 4 * (model.total6_above[c] + pulls6[c])
        if left > 0:
            best = max(best, _as_float(left.numerator, left.denominator * total24 * norm))
            if left > BOUND * total24 * norm:
                falling.append(c)
    figures = {"bound": best}
    if not best > 0.0:
        more = " beyond what joints that pull take up" if any(pulls6) else ""
        _refuse(f"the loads do no work{more} in this motion", figures)
    if not falling:
        _refuse(f"contact forces of {best:.2g} times the weight and loads might hold this motion", figures)
    return figures, falling


def _slacks24(model: _Model, motions: Motions) -> list[Fraction]:
    """24 BALANCE sum w (|v| + D |omega|) of each component, in the unit of `_powers24`, rounded up; w is the least."""
    sums = [0] * model.parts
    for i, _, solid in model.free():
        flow, spin = motions[i].flow(solid), motions[i].spin
        speed = _quotient_above(_root_above(_length2(flow)), 4 * solid.volume6)
        turn = _root_above(solid.box2 * _length2(spin))
        sums[model.component[i]] += 4 * model.lightest6[i] * model.own_above * (speed + turn)
    return [BALANCE * total for total in sums]


def _against_pulls(model: _Model, motions: Motions) -> tuple[list[int], list[int]]:
    """24 sum t dn, in the unit of `_powers24`, and 6 sum |t|, in that of W: of joints that pull, both rounded up."""
    work, total = [0] * model.parts, [0] * model.parts
    for patch in model.patches:
        if patch.joint.tension:
            unit, shares = _pulls(patch, model.per_force, model.per_length)
            done = sum(share * _dot(x, patch.normal) for share, x in zip(shares, _moves(patch, motions), strict=True))
            work[patch.part] += math.ceil(24 * unit * done / patch.normal2)
            total[patch.part] += math.ceil(6 * unit * sum(map(abs, shares)) / math.isqrt(patch.normal2))
    return work, total


def _motions(model: _Model, rows: Sequence[Sequence[Number]], per_velocity: int | None = None) -> list[_Motion]:
    """Motions in 2**-(per_velocity + model.per_length + model.finer), spins in 2**-(per_velocity + model.finer)."""
    per = _exponent(chain.from_iterable(rows)) if per_velocity is None else per_velocity
    return [
        _motion(row, solid, per, model.per_length, model.finer) for row, solid in zip(rows, model.solids, strict=True)
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


def _moves(patch: _Patch, motions: Motions) -> list[Vec]:
    """dd, the displacement of `b` relative to `a`, at every point of a contact."""
    a, b = motions[patch.a], motions[patch.b]
    (vx, vy, vz), (wx, wy, wz) = _minus(b.drift, a.drift), _minus(b.spin, a.spin)
    return [(vx + wy * z - wz * y, vy + wz * x - wx * z, vz + wx * y - wy * x) for x, y, z in patch.points]


def _powers24(model: _Model, motions: Motions) -> list[int]:
    """24 p.y of every component: weights at the centres of mass, loads at their points.

    A weight's share is rho V g.(drift + w x c) = rho g.(4 (6V) drift + w x (24 V c)) / 24: integers.
    """
    found = [0] * model.parts
    for i, _, solid in model.free():
        density = model.masses6[i] // solid.volume6  # exact: masses6 = density * volume6
        found[model.component[i]] += density * _dot(model.gravity, motions[i].flow(solid))
    for block, force, point in model.loads:
        found[model.component[block]] += 24 * _dot(force, motions[block].at(point))
    return found


def _resistances(model: _Model, motions: Motions) -> list[int]:
    """||P(x)|| over the contact points of each component, x = -dd, rounded up.

    With d = x.N and C = |x|^2 |N|^2 - d^2 (the normal part of x is d/|N|, the tangential one sqrt(C)/|N|), mu = p/q:

    - polar to the cone, d <= 0 and p^2 C <= q^2 d^2: nothing resists;
    - inside the cone, d >= 0 and q^2 C <= p^2 d^2: all of x does, |x|^2;
    - otherwise (q d + p sqrt C)^2 / ((p^2 + q^2) |N|^2), with the root rounded up.
    """
    found = [0] * model.parts
    for patch in model.patches:
        p, q = patch.p, patch.q
        p2, q2 = p * p, q * q
        whole, scaled = 0, 0
        for move in _moves(patch, motions):
            x2, d = _length2(move), -_dot(move, patch.normal)
            d2 = d * d
            c = x2 * patch.normal2 - d2
            if d <= 0 and p2 * c <= q2 * d2:
                continue
            if d >= 0 and q2 * c <= p2 * d2:
                whole += x2
            else:
                scaled += (q * d + p * _root_above(c)) ** 2
        found[patch.part] += whole + _quotient_above(scaled, (p2 + q2) * patch.normal2)
    return [_root_above(norm2) for norm2 in found]


# ---------------------------------------------------------------------------------------------------------------------
# limit-bounds.


def _limit(model: _Model) -> tuple[dict[str, float], str, str]:
    """Check forces at the lower multiplier and a motion at the upper one, those that there are.

    Instead of a motion there may be a recession: forces in the cones that balance the live loads alone. Any multiple
    of them, added to the forces at the lower multiplier, balances the loads at a larger one.
    """
    sheet, live = model.sheet, model.sheet.live
    assert live is not None
    figures: dict[str, float] = {}
    said, grade = [], ""
    alone = _loaded(model, 0, 1.0)
    if live.lower is not None:
        found, reason, grade = _state(_loaded(model, 1, live.lower))
        figures = {"lower": live.lower} | found
        said.append(reason)
    if sheet.recession:
        balance = _balance(alone, *_forces(alone, sheet.recession), "recession")
        for key, value in balance.figures.items():
            figures[key] = (min if key == "exact" else max)(figures[key], value)
        said.append("so do forces that balance the live loads alone")
        grade = grade if balance.grade == EXACT else NEARLY + " (of the live loads, for each unit of their multiplier)"
    if live.upper is not None:
        motions = _motions(model, sheet.motion)
        norms = _resistances(model, motions)
        driven, falling = _driven(_loaded(model, 1, live.upper), motions, norms)
        figures |= {"upper": live.upper} | driven
        _require_no_relief(alone, motions, norms, falling, figures)
        said.append(_demand(driven))
    return figures, "; ".join(said), grade


def _require_no_relief(
    alone: _Model, motions: Motions, norms: Sequence[int], falling: Sequence[int], figures: dict[str, float]
) -> None:
    """Require of the live loads alone that p.y >= BOUND W ||P(-dd)|| in a component that falls: more is no help then.

    Both p.y and what W is at the most are affine in the multiplier, so the motion proves every larger one too.
    """
    powers24 = _powers24(alone, motions)
    if not any(powers24[c] >= 0 for c in falling):
        _refuse("the live loads work against the motion, so that more of them might hold it", figures)
    if not any(powers24[c] >= BOUND * 4 * alone.total6_above[c] * norms[c] for c in falling):
        _refuse("the live loads do too little work in the motion to prove anything of more of them", figures)


# ---------------------------------------------------------------------------------------------------------------------
# rbe-settled.


def _settled(model: _Model) -> tuple[dict[str, float], str, str]:
    """Check forces as for an rbe-state, and the displacement that they go with.

    With d = dd.N, x = dd, U the largest displacement of a contact point of the component on a block that the ground
    moves, t = SETTLING and s = max(|F|, weight of the lighter block), all roots rounded so that less is allowed:

        d + t U |N| >= mu sqrt(|x|^2 |N|^2 - d^2)        |F.x| <= t U s        |F| d <= t U s |N|
    """
    forces, per_force = _forces(model, model.sheet.forces)
    balance = _balance(model, forces, per_force)
    motions = _motions(model, model.sheet.motion)
    largest = _settlements(model, motions)
    worst = {"closing": 0.0, "work": 0.0, "hanging": 0.0, "opened": 0.0}
    if not any(largest):
        _refuse("no contact point is on a block that the ground moves", balance.figures)
    for patch in model.patches:
        weight = _lighter_weight(model, patch, per_force)
        points = zip(_moves(patch, motions), forces[patch.rows], balance.sizes[patch.rows], strict=True)
        if wrong := _unsettled(patch, largest[patch.part], weight, points, worst):
            _refuse(f"{_label(model.sheet, patch.number)}: {wrong}", balance.figures | worst)
    off = max(worst["closing"], worst["work"], worst["hanging"])
    reason = f"forces go with the displacement, to {off:.2g} of the settlement; {balance.reason}"
    return balance.figures | worst, reason, balance.grade


Couples = Iterable[tuple[Vec, Vec, tuple[int, int]]]  # dd, F, and (F.N, |F|^2), point by point


def _unsettled(patch: _Patch, largest: int, weight: int, points: Couples, worst: dict[str, float]) -> str:
    """What is wrong with the points of a contact, or nothing; `worst` is kept up."""
    t, p, q = SETTLING, patch.p, patch.q
    size = math.isqrt(patch.normal2)
    room = t.numerator * largest * size // t.denominator
    for number, (x, force, (_, strength)) in enumerate(points):
        d = _dot(x, patch.normal)
        slid = p * _root_above(_length2(x) * patch.normal2 - d * d)
        work, bearing = abs(_dot(force, x)), max(weight, math.isqrt(strength))
        hanging = max(d, 0) * _root_above(strength)
        _note(worst, "closing", slid - q * d, q * size * largest)
        _note(worst, "work", work, bearing * largest)
        _note(worst, "hanging", hanging, bearing * largest * size)
        _note(worst, "opened", d, size * largest)
        if not q * (d + room) >= slid:
            return f"point {number} closes, or slides without opening"
        if not t.denominator * work <= t.numerator * largest * bearing:
            return f"the force at point {number} does work"
        if not t.denominator * hanging <= t.numerator * largest * bearing * size:
            return f"point {number} has opened, but carries a force"
    return ""


def _note(worst: dict[str, float], key: str, numerator: int, denominator: int) -> None:
    """Keep the largest ratio met so far, for the figures to print."""
    worst[key] = max(worst[key], _as_float(numerator, denominator))


def _settlements(model: _Model, motions: Motions) -> list[int]:
    """The largest displacement of a contact point on a support, of every component, rounded down."""
    most = [0] * model.parts
    for patch in model.patches:
        for block in (patch.a, patch.b):
            if model.sheet.stones[block].fixed:
                moved = (_length2(motions[block].at(point)) for point in patch.points)
                most[patch.part] = max(most[patch.part], *moved)
    return [math.isqrt(square) for square in most]


# ---------------------------------------------------------------------------------------------------------------------
# cra-state.


def _coupled_state(model: _Model) -> tuple[dict[str, float], str, str]:
    """Check forces as for an rbe-state, and the virtual displacement that they are coupled with."""
    forces, per_force = _forces(model, model.sheet.forces)
    balance = _balance(model, forces, per_force)
    figures = balance.figures | _coupling(model, forces, balance.sizes, per_force)
    worst = max(figures[key] for key in ("gap", "complementarity", "alignment"))
    reason = f"forces and displacements are coupled at every point, to {worst:.2g}; {balance.reason}"
    return figures, reason, balance.grade


def _coupling(model: _Model, forces: list[Vec], sizes: Sizes, per_force: int) -> dict[str, float]:
    """Check the virtual displacement dd = (dn, dd_t) at every point against the force F = fn n + F_t there.

        -eps <= dn <= eta, |dd_t| <= eta        fn (dn + eps) = 0        F_t = -alpha dd_t, alpha >= 0
        |dd_t| >= beta_min where F_t is not 0

    each to `COUPLING`: lengths relative to the bound, work to eps max(|F|, weight of the lighter free block), and
    |F_t x dd_t| also to SHORT |dd_t| times that.
    """
    bounds, motion = model.sheet.bounds, model.sheet.motion
    assert bounds is not None
    given = (bounds.eps, bounds.eta, bounds.beta)
    per_motion = _exponent(chain(given, chain.from_iterable(motion)))
    motions = _motions(model, motion, per_motion)
    scaled = [_integer(x, per_motion) << model.per_length + model.finer for x in given]
    worst, fault = {"gap": 0.0, "complementarity": 0.0, "alignment": 0.0, "slide": -1.0}, ""
    for patch in model.patches:
        weight = _lighter_weight(model, patch, per_force)
        couples = zip(_moves(patch, motions), forces[patch.rows], sizes[patch.rows], strict=True)
        if (wrong := _uncoupled(patch, scaled, weight, couples, worst)) and not fault:
            fault = f"{_label(model.sheet, patch.number)}: {wrong}"
    slide = -worst.pop("slide")
    figures = worst | {"sliding_least": float(Fraction(bounds.eta) / Fraction(bounds.eps)) * slide}
    if fault:
        _refuse(fault, figures)
    return figures


def _uncoupled(patch: _Patch, bounds: Sequence[int], weight: int, couples: Couples, worst: dict[str, float]) -> str:
    """What is wrong with the coupling of force and displacement at the points of a contact, or nothing.

    With N = |N| n, along = F.N and d = dd.N:

        |dd_t|^2 |N|^2 = |dd|^2 |N|^2 - d^2        fn (dn + eps) |N|^2 = along (d + eps |N|)
        |F_t|^2 |N|^2 = |F|^2 |N|^2 - along^2      F_t.dd_t |N|^2 = F.dd |N|^2 - along d
        |F_t x dd_t| |N| = |(F x dd).N|

    Relative to t = COUPLING: (1 + t)^2 = (q + p)^2 / q^2. What d may be at most is the root of what d^2 may be.
    """
    p, q, (nx, ny, nz), normal2, fault = COUPLING.numerator, COUPLING.denominator, patch.normal, patch.normal2, ""
    eps, eta, beta = bounds
    wide, narrow = (q + p) ** 2 * normal2, (q - p) ** 2 * normal2
    closing, sliding = math.isqrt(eps * eps * wide // (q * q)), eta * eta * wide // (q * q)
    opening, rubbing = math.isqrt(sliding), _quotient_above(beta * beta * narrow, q * q)
    below, above = math.isqrt(eps * eps * normal2), _root_above(eps * eps * normal2)  # of eps |N|
    most = _root_above(eta * eta * normal2)
    for number, ((mx, my, mz), (fx, fy, fz), (along, force2)) in enumerate(couples):
        d = mx * nx + my * ny + mz * nz
        slide2 = (mx * mx + my * my + mz * mz) * normal2 - d * d
        wrong = "" if -closing <= d else "overlaps by more than eps"
        if not (d <= opening and slide2 <= sliding):
            wrong = wrong or "moves by more than eta"
        _note(worst, "gap", -d - below, below)
        if force2:
            size = max(weight, math.isqrt(force2))
            room = size * eps * normal2
            work = along * max(abs(d + below), abs(d + above))
            _note(worst, "complementarity", work, room)
            if not q * work <= p * room:
                wrong = wrong or "presses without overlapping by eps"
            rub2 = force2 * normal2 - along * along
            if rub2:
                reach = size * min(below, SHORT * math.isqrt(slide2))
                across = abs((fy * mz - fz * my) * nx + (fz * mx - fx * mz) * ny + (fx * my - fy * mx) * nz)
                forward = (fx * mx + fy * my + fz * mz) * normal2 - along * d
                _note(worst, "alignment", across, reach)
                _note(worst, "alignment", forward, room)
                if not (q * across <= p * reach and q * forward <= p * room):
                    wrong = wrong or "has friction that does not oppose its sliding"
                if q * q * rub2 > p * p * size * size * normal2:
                    _note(worst, "slide", -math.isqrt(slide2), most)
                    if not (slide2 >= rubbing and forward < 0):
                        wrong = wrong or "has friction but slides by less than beta_min"
        if wrong and not fault:
            fault = f"point {number} {wrong}"
    return fault


# ---------------------------------------------------------------------------------------------------------------------
# cra-tree.


class _Spot(NamedTuple):
    """A contact point, ready for the leaves: its contact, and bounds of 2**ROOT_BITS |N|."""

    patch: _Patch
    below: int
    above: int


class _Ray(NamedTuple):
    """A direction in a contact's plane: any vector, |N|^2 times its projection, and bounds of that one's length."""

    vector: Vec
    flat: Vec
    below: int
    above: int


@dataclass(frozen=True, slots=True)
class _Zone:
    """What a cell says about a contact point.

    Engaged: dn = -eps; unloaded: F = 0. dd_t = s e with a unit vector e in the sector (any without one) and s between
    `slow` and `fast`; friction is -r e with the same e, and none where `fast` is less than beta_min.
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
class _Case:
    """What all leaves of a tree share; eps, eta and beta_min are integers, times 2**`per`.

    `alike` lists for each point those that move as it does.
    """

    model: _Model
    spots: list[_Spot]
    alike: list[list[int]]
    eps: int
    eta: int
    beta: int
    per: int
    reach: _Reach


def _tree(model: _Model) -> tuple[dict[str, float], str, str]:
    """Check that the branches of a tree cover all coupled states of the model or a component, and no leaf holds one."""
    if model.sheet.part is not None:
        model = _weigh(model.sheet.part, Memory(MAX_KEPT))
    case, tree = _case(model), model.sheet.tree
    figures = {"nodes": float(len(tree)), "leaves": 0.0, "depth": 0.0, "least_margin": 1.0}
    whole = _Zone(False, False, None, 0, case.eta)
    zones, before = [whole] * len(case.spots), list[tuple[int, _Zone]]()  # of this node, and what splits have changed
    pending = [(0, 0, whole)]
    for number, node in enumerate(tree):
        depth, point, part = pending.pop()
        while len(before) > max(depth - 1, 0):
            k, zone = before.pop()
            for twin in case.alike[k]:
                zones[twin] = zone
        if depth:
            before.append((point, zones[point]))
            for twin in case.alike[point]:
                zones[twin] = part
        if isinstance(node, _Split):
            parts = _parts(case, node, zones[node.point], f"tree node {number}: ")
            pending.extend((depth + 1, node.point, part) for part in reversed(parts))
        else:
            figures["leaves"] += 1
            figures["depth"] = max(figures["depth"], depth)
            margin, size = _margin(case, zones, node)
            ratio = _as_float(margin.numerator * size.denominator, margin.denominator * size.numerator)
            figures["least_margin"] = min(figures["least_margin"], ratio)
            if not margin > 0:
                _refuse(f"tree node {number}: this leaf does not exclude all of its cell", figures)
    reason = f"no coupled state exists: {figures['leaves']:.0f} cells cover all of them, and each is empty"
    return figures, reason, ""


def _case(model: _Model) -> _Case:
    bounds, spots, alike = model.sheet.bounds, list[_Spot](), list[list[int]]()
    assert bounds is not None
    for patch in model.patches:
        scaled = patch.normal2 << 2 * ROOT_BITS
        alike += _alike(model, patch, len(spots))
        spots += [_Spot(patch, math.isqrt(scaled), _root_above(scaled))] * len(patch.points)
    speeds = [node.speed for node in model.sheet.tree if isinstance(node, _Split) and node.speed is not None]
    given = (bounds.eps, bounds.eta, bounds.beta)
    per = _exponent([*given, *speeds])
    eps, eta, beta = (_integer(x, per) for x in given)
    return _Case(model, spots, alike, eps, eta, beta, per, _reach(model))


def _alike(model: _Model, patch: _Patch, first: int) -> list[list[int]]:
    """For each point of a contact the numbers, from `first` on, of those whose dd is the same in every motion.

    Two points' dd differ by w x (r - r'), w the relative spin: not at all if both blocks may turn about no axis, and if
    about one only, where the points differ along it alone.
    """
    stones = [stone for stone in (model.sheet.stones[i] for i in (patch.a, patch.b)) if not stone.fixed]
    turning = [axis for axis in range(3) if not all(stone.held[3 + axis] for stone in stones)]
    if len(turning) > 1:
        return [[first + i] for i in range(len(patch.points))]
    places = [[x for axis, x in enumerate(r) if turning and axis not in turning] for r in patch.points]
    return [[first + i for i, other in enumerate(places) if other == place] for place in places]


def _parts(case: _Case, node: _Split, zone: _Zone, where: str) -> list[_Zone]:
    """Cut what a cell says about a point into the parts that the branches take; together they cover it."""
    if node.rays:
        normal = case.spots[node.point].patch.normal
        return [replace(zone, sector=sector) for sector in _sectors(node, normal, zone.sector, where)]
    if node.speed is not None:
        speed = _integer(node.speed, case.per)
        if not zone.slow < speed < zone.fast:
            _refuse(f"{where}speed is not inside the interval that is left")
        return [replace(zone, fast=speed), replace(zone, slow=speed)]
    if zone.engaged or zone.unloaded:
        _refuse(f"{where}the point is already engaged or unloaded")
    return [replace(zone, engaged=True), replace(zone, unloaded=True)]


def _sectors(node: _Split, normal: Vec, sector: tuple[_Ray, _Ray] | None, where: str) -> list[tuple[_Ray, _Ray]]:
    """Sectors between rays in counter-clockwise order about N: once around, or inside the sector given.

    Ray c is ahead of ray b by less than half a turn iff det(N, b, c) > 0. Rays that are ahead of each other all around
    come round once iff the first is not met again before the end.
    """
    rays = [_ray(row, normal) for row in node.rays]
    ring = [*rays, rays[0]] if sector is None else [sector[0], *rays, sector[1]]
    if node.branches != len(ring) - 1:
        _refuse(f"{where}{node.branches} sectors for {len(node.rays)} rays")
    found = list(pairwise(ring))
    if not all(_turn(normal, one.vector, two.vector) > 0 for one, two in found):
        _refuse(f"{where}a sector is empty, turns the wrong way round or is 180 degrees or wider")
    first, last = ring[0].vector, ring[-1].vector
    if sector is None:
        turns = ((_turn(normal, one.vector, first), _turn(normal, first, two.vector)) for one, two in found[:-1])
        once = not any(ahead > 0 and behind >= 0 for ahead, behind in turns)
    else:
        once = all(_turn(normal, first, ray.vector) > 0 and _turn(normal, ray.vector, last) > 0 for ray in rays)
    if not once:
        _refuse(f"{where}the rays go round more than once, or leave the sector that they split")
    return found


def _ray(row: Sequence[Number], normal: Vec) -> _Ray:
    vector = _vector(row, _exponent(row))
    flat = _minus(_times(_length2(normal), vector), _times(_dot(vector, normal), normal))
    length2 = _length2(flat)
    return _Ray(vector, flat, math.isqrt(length2), _root_above(length2))


def _turn(normal: Vec, one: Vec, two: Vec) -> int:
    """det(N, one, two): positive if `two` lies to the left of `one`, seen against N."""
    return _dot(normal, _cross(one, two))


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
    gained = (Fraction(0), Fraction(0)) if leaf.motion is None else _gain(case, zones, leaf.motion, coupled)
    lost = (Fraction(0), Fraction(0)) if leaf.forces is None else _loss(case, zones, leaf.forces, coupled)
    return gained[0] - lost[0], gained[1] + lost[1]


def _gain(
    case: _Case, zones: Sequence[_Zone], rows: list[Sequence[Number]], coupled: bool
) -> tuple[Fraction, Fraction]:
    """p.y - max(v) sum fn, rounded down; and the sum of both sizes.

    v = max(0, -g, -g - mu (l max(beta_min, slow) - h)) with g = l eps + dn^y and h the largest e.dd_t^y in the sector:
    the most that a unit of fn at a point can take from p.y. Without the last where a point slides by less than
    beta_min, and so has no friction.
    """
    model, per_motion = case.model, _exponent(chain.from_iterable(rows))
    motions = _motions(model, rows, per_motion)
    per_place = per_motion + model.per_length + model.finer
    per = max(per_place, case.per)
    up, fine = per - per_place, coupled << (per - case.per + ROOT_BITS)
    most = 0
    moves = chain.from_iterable(_moves(patch, motions) for patch in model.patches)
    for spot, zone, move in zip(case.spots, zones, moves, strict=True):
        if not zone.unloaded:
            patch = spot.patch
            d = _dot(move, patch.normal) << 2 * ROOT_BITS
            held = fine * case.eps + (d // (spot.above if d >= 0 else spot.below) << up)
            most = max(most, -held)
            if zone.fast >= case.beta:
                slip = (_farthest(move, spot, zone.sector) << up) - fine * max(case.beta, zone.slow)
                most = max(most, -held - (-patch.p * slip // patch.q))
    power = Fraction(sum(_powers24(model, motions)), 24 << model.per_force + per_place)
    taken = Fraction(most, 1 << per + ROOT_BITS) * case.reach.thrust
    return power - taken, abs(power) + taken


def _loss(
    case: _Case, zones: Sequence[_Zone], rows: list[Sequence[Number]], coupled: bool
) -> tuple[Fraction, Fraction]:
    """U, rounded up, and the sum of the sizes of its parts."""
    model, per_force = case.model, _exponent(chain.from_iterable(rows))
    forces = _vectors(rows, per_force)
    work, gross = 0, 0
    for spot, zone, force in zip(case.spots, zones, forces, strict=True):
        if any(force):
            along = _dot(force, spot.patch.normal) << 2 * ROOT_BITS
            least = -case.eps if zone.engaged or along < 0 else case.eta
            normal = _above(least * along, spot)
            h = _farthest(force, spot, zone.sector)
            tangential = h * (zone.fast if h >= 0 else zone.slow)
            work += normal + tangential
            gross += abs(normal) + abs(tangential)
    opposite = [(-x, -y, -z) for x, y, z in forces]
    slack = _work_above(model, opposite, per_force, coupled, case.reach)
    unit = 1 << per_force + case.per + ROOT_BITS
    return Fraction(work, unit) + slack, Fraction(gross, unit) + slack


def _above(numerator: int, spot: _Spot) -> int:
    """Numerator / (2**ROOT_BITS |N|), rounded up."""
    return -(-numerator // (spot.below if numerator >= 0 else spot.above))


def _farthest(x: Vec, spot: _Spot, sector: tuple[_Ray, _Ray] | None) -> int:
    """2**ROOT_BITS times the largest e.x over the unit vectors e of a sector in the contact's plane, rounded up.

    That is |x_t| if x_t lies in the sector, and else at one of its two rays.
    """
    normal = spot.patch.normal
    if sector is not None:
        one, two = sector
        if not (_turn(normal, one.vector, x) >= 0 and _turn(normal, x, two.vector) >= 0):
            return max(_component(x, one), _component(x, two))
    along = _dot(x, normal)
    return _above(_root_above(_length2(x) * spot.patch.normal2 - along * along) << 2 * ROOT_BITS, spot)


def _component(x: Vec, ray: _Ray) -> int:
    """2**ROOT_BITS times the component of x along a ray, rounded up."""
    product = _dot(x, ray.flat) << ROOT_BITS
    return -(-product // (ray.below if product >= 0 else ray.above))


def _reach(model: _Model) -> _Reach:
    """Bound displacements, rotations and normal forces of every coupled state.

    No point of a contact moves by more than D = sqrt(2) max(eps, eta) against its neighbour. Three points r0, r1, r2
    that span a triangle (e1, e2, n = e1 x e2) bound the relative rotation w: |w x e1| <= 2 D bounds its part across
    e1, and |w x e2| <= 2 D then that along e1,

        |w| <= 2 D / |e1| + 2 D (|e1| + |e2|) / |n|

    and from support to support: Omega_b = Omega_a + |w|, V_b = V_a + Omega_a |r0 - c_a| + D + Omega_b |c_b - r0|. Any
    chain of contacts gives bounds; the least Omega of all chains are found first, then with them the least V. Forces:
     eps sum fn <= p.dq <= sum |p_F| V + |p_M| Omega.
    """
    stones, bounds = model.sheet.stones, model.sheet.bounds
    assert bounds is not None
    far = _root_of(2 * Fraction(max(bounds.eps, bounds.eta)) ** 2)
    across: list[list[_Hinge]] = [[] for _ in stones]
    for patch in model.patches:
        for hinge in _hinges(patch, model, far):
            across[hinge.start].append(hinge)
    fixed = [i for i, stone in enumerate(stones) if stone.fixed]
    turns = _least(across, fixed, lambda hinge: hinge.turn)
    for i, stone in enumerate(stones):
        if i not in turns:
            _refuse(f"block {_short(stone.name)} hangs on no support, not even by way of others")
    shifts = _least(
        across,
        fixed,
        lambda hinge: turns[hinge.start] * hinge.lever_start + far + turns[hinge.to] * hinge.lever_to,
    )
    per_shift, per_turn = (max(x.denominator for x in found.values()).bit_length() - 1 for found in (shifts, turns))
    whole = [int(shifts[i] * (1 << per_shift)) for i in range(len(stones))]
    turned = [int(turns[i] * (1 << per_turn)) for i in range(len(stones))]
    reach = _Reach(whole, turned, per_shift, per_turn, Fraction(0))
    still: list[Vec] = [(0, 0, 0)] * sum(len(patch.points) for patch in model.patches)
    return replace(reach, thrust=_work_above(model, still, 0, True, reach) / Fraction(bounds.eps))


def _work_above(model: _Model, forces: list[Vec], per_force: int, loaded: bool, reach: _Reach) -> Fraction:
    """The sum of |r_F| V + |r_M| Omega of what forces leave on the free blocks, rounded up."""
    wrenches, unit = _wrenches(model, forces, per_force, loaded)
    shifted, turned = 0, 0
    for i, (pull, turn) in wrenches.items():
        shifted += _root_above(_length2(pull)) * reach.shifts[i]
        turned += _quotient_above(_root_above(_length2(turn)) * reach.turns[i], 4 * model.solids[i].volume6)
    place = 24 << unit + model.per_length + reach.per_turn
    return Fraction(shifted, 24 << unit + reach.per_shift) + Fraction(turned, place)


class _Hinge(NamedTuple):
    """A contact taken from one block to the other: relative rotation, and how far both centres of mass are from r0."""

    start: int
    to: int
    turn: Fraction
    lever_start: Fraction
    lever_to: Fraction


def _hinges(patch: _Patch, model: _Model, far: Fraction) -> list[_Hinge]:
    """Both ways across a contact: r0 is its first point, r1 the one furthest from it, r2 the one furthest aside."""
    k = model.per_length
    if not (three := _spread(patch.points, range(len(patch.points)))):
        return []  # about a point blocks turn as they like
    r0, r1, r2 = (patch.points[i] for i in three)
    e1, e2 = _minus(r1, r0), _minus(r2, r0)
    one, two, area2 = _length2(e1), _length2(e2), _length2(_cross(e1, e2))
    both = (_root_of(one, k) + _root_of(two, k)) / _root_of(area2, 2 * k, up=False)
    turn = _rounded_up(2 * far * (1 / _root_of(one, k, up=False) + both))
    levers = []
    for block in (patch.a, patch.b):
        d, moment24 = 4 * model.solids[block].volume6, model.solids[block].moment24
        levers.append(_rounded_up(_root_of(_length2(_minus(_times(d, r0), moment24)), k) / d))
    a, b = levers
    return [_Hinge(patch.a, patch.b, turn, a, b), _Hinge(patch.b, patch.a, turn, b, a)]


def _least(
    across: Sequence[Sequence[_Hinge]], fixed: Iterable[int], cost: Callable[[_Hinge], Fraction]
) -> dict[int, Fraction]:
    """Bound each block by the cheapest chain of hinges from a support (Dijkstra's way), sums rounded up on the way."""
    found: dict[int, Fraction] = {}
    waiting = [(Fraction(0), i) for i in fixed]
    while waiting:
        total, i = heapq.heappop(waiting)
        if i not in found:
            found[i] = total
            for hinge in across[i]:
                if hinge.to not in found:
                    heapq.heappush(waiting, (_rounded_up(total + cost(hinge)), hinge.to))
    return found


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


# ---------------------------------------------------------------------------------------------------------------------
# rbe-state-within, rbe-mechanism-within: of every drawing that differs by no more than a length and an angle.


class _Swing(NamedTuple):
    """By how much what a block passes on may differ in any drawing; moments about its centre of mass here."""

    mass: Fraction  # kg: of its weight, so that forces differ along gravity
    left: Fraction  # N: of forces in any direction
    turn: Fraction  # N m: of moments of the weight, about axes across gravity
    twist: Fraction  # N m: of moments about any axis
    centre: Vec  # rounded down to 2**-(per_length + ROOT_BITS) m


class _Seating(NamedTuple):
    """A contact in every drawing: what is left of mu where normals lean, and how far its points are off its plane."""

    mu: Fraction
    off: Fraction  # m


class _Borne(NamedTuple):
    """Forces of the file, at its points; `steep` is |F_t| / F.n of each."""

    model: _Model
    forces: list[Vec]
    per_force: int
    sizes: Sizes
    steep: list[Fraction]
    seatings: list[_Seating]


def _state_within(model: _Model) -> tuple[dict[str, float], str, str]:
    """Check forces of which every drawing of the family has others near by, inside its cones, that balance exactly.

    The forces F of the file are kept in every drawing. What they leave on a block there goes down a tree of contacts to
    the supports, as sizes: `_Swing`. A contact that passes on a force (wn, wt) and a moment t about its centre of
    pressure m, of which tn about n, takes it up in proportion to its pressures a_k = F_k.n / sum F.n. With rho_k from m
    in its plane,

        C = sum a rho rho'    S = sum a |rho|^2
        |dn_k| <= a_k (wn + |C^-1 rho_k| t')    |dt_k| <= a_k (wt + |rho_k| tn / S)

    where t' = t + off (wt + tn / sqrt S), for points may be `off` the plane. All of it stays in the cones where

        P (mu - |F_t| / F.n) >= mu (wn + |C^-1 rho_k| t') + wt + |rho_k| tn / S        P = sum F.n

    with the mu that is left when the normal leans as far as it may.
    """
    within = model.sheet.within
    assert within is not None
    inside, seatings = _inside(model)
    forces, per_force = _forces(inside, model.sheet.forces)
    sizes, _ = _require_cones(inside, forces, per_force, False, "force")
    if _require_modest(inside, sizes, per_force):
        _refuse(f"friction above {STEEP}, or forces larger than a tenth of {BOUND:.0e} times weight and loads")
    borne = _Borne(inside, forces, per_force, sizes, _steepness(inside, sizes, seatings), seatings)
    looks = _Budget(MAX_ARMS, len(model.solids), "too many blocks above each other")
    carried = {i: [swing] for i, swing in _swings(borne).items()}
    used = Fraction(0)
    for block in _leaves_first(model, within.ways):
        patch, swings = inside.patches[within.ways[block]], carried.pop(block)
        looks.spend(len(swings))
        share = _room_used(borne, patch, swings)
        if not share <= 1:
            _refuse(f"{_label(model.sheet, patch.number)}: {float(share):.3g} times the room of its forces is needed")
        used = max(used, share)
        carried.get(patch.a if patch.b == block else patch.b, []).extend(swings)
    figures = {"within": float(within.length), "room_used": float(used)}
    return figures, f"of the room of forces at a contact at most {float(used):.3g} is needed in any drawing", ""


def _inside(model: _Model) -> tuple[_Model, list[_Seating]]:
    """The model with the points of the file for those of its contacts: each at least L inside the outline.

    Of both the projections on the contact's plane count, the one through the mean of its corners across N. With z the
    heights above it, a point that is e from an edge is at least sqrt(e^2 - z^2) inside.
    """
    within, k = model.sheet.within, model.per_length
    assert within is not None
    length = Fraction(within.length)
    count = sum(len(joint.polygon) for joint in (*model.sheet.joints, *within.joints))
    looks = _Budget(MAX_LOOKS, count, "too many points inside too many edges")
    patches, seatings, first = [], [], 0
    for patch, joint in zip(model.patches, within.joints, strict=True):
        points = _vectors(joint.polygon, k)
        facet = _Facet(patch.points, patch.normal, patch.normal2).prepared().edged()
        corners, highest = len(facet.ring), max(abs(_rise(facet, r)) for r in facet.ring)
        far = 0
        for number, point in enumerate(points):
            looks.spend(len(facet.edges))
            off = abs(_rise(facet, point)) + highest
            far = max(far, off)
            least2 = (length * (1 << k)) ** 2 + Fraction(off * off, corners * corners * patch.normal2)
            p, q = least2.as_integer_ratio()
            beside = (edge.distance2(point) for edge in facet.edges)
            if not facet.is_inside(facet.edges, point) or any(d * q < p * e for d, e in beside):
                _refuse(f"{_label(model.sheet, patch.number)}: point {number} is not {within.length:g} m inside it")
        mu, lean = Fraction(joint.mu), _lean(patch, within, k)
        left = Fraction(-1) if lean is None else (mu - lean) / (1 + mu * lean)
        off2 = Fraction(far * far, corners * corners * patch.normal2)
        seatings.append(_Seating(left, length + _root_of(off2, k)))
        rows = slice(first, first + len(points))
        patches.append(patch._replace(points=points, rows=rows))
        first = rows.stop
    return replace(model, sheet=replace(model.sheet, joints=within.joints), patches=patches), seatings


def _rise(facet: _Facet, point: Vec) -> int:
    """Height above the plane through the mean of the corners, times |N| and their number."""
    return len(facet.ring) * _dot(point, facet.normal) - facet.height


def _lean(patch: _Patch, within: _Within, k: int) -> Fraction | None:
    """The tangent of the angle by which the normal may lean: as stated, or what the length allows, rounded up.

    None where it may stand upright.

    A plane that is nowhere further than L from a convex outline leans by no more than sin = L / r, with r the radius of
    a circle inside it, and r is at least area / perimeter.
    """
    if within.slope is not None:
        return Fraction(within.slope)
    around = sum(_root_of(_length2(_minus(b, a)), k) for a, b in _around(patch.points))
    sine2 = (2 * Fraction(within.length) * around) ** 2 * (1 << 4 * k) / patch.normal2
    return _rounded_up(_root_of(sine2 / (1 - sine2))) if sine2 < 1 else None


def _steepness(model: _Model, sizes: Sizes, seatings: Sequence[_Seating]) -> list[Fraction]:
    """|F_t| / F.n at every point, rounded up; it has to be no more than what is left of mu."""
    found = []
    for patch, seating in zip(model.patches, seatings, strict=True):
        for number, (along, force2) in enumerate(sizes[patch.rows]):
            across2 = force2 * patch.normal2 - along * along
            steep = _rounded_up(_root_of(Fraction(across2, along * along))) if along else Fraction(0)
            if force2 and not steep <= seating.mu:
                _refuse(
                    f"{_label(model.sheet, patch.number)}: the force at point {number} leaves the cone of a normal that"
                    " leans as far as it may"
                )
            found.append(steep)
    return found


def _swings(borne: _Borne) -> dict[int, _Swing]:
    """What forces may leave on every free block in any drawing, of which only the sizes are known.

    Beside what they leave here: points of contacts move along n by no more than `off`, those of loads by L, and volume
    and first moment of the block as `_swelling` says.
    """
    model, forces, per_force = borne.model, borne.forces, borne.per_force
    within, k = model.sheet.within, model.per_length
    assert within is not None
    turns = [Fraction(0)] * len(model.solids)
    for patch, seating in zip(model.patches, borne.seatings, strict=True):
        pairs = borne.sizes[patch.rows]
        total = sum(_root_of(force2 - Fraction(along * along, patch.normal2), per_force) for along, force2 in pairs)
        for block in (patch.a, patch.b):
            turns[block] += seating.off * total
    for block, force, _ in model.loads:
        turns[block] += Fraction(within.length) * _root_of(_length2(force), model.per_force)
    wrenches, unit = _wrenches(model, forces, per_force)
    gravity = [abs(Fraction(x)) for x in model.sheet.gravity]
    known: dict[int, tuple[Fraction, list[Fraction]]] = {}
    found = {}
    for i, stone, solid in model.free():
        if id(solid.shape) not in known:
            known[id(solid.shape)] = _swelling(stone, solid, k, Fraction(within.length))
        volume, (mx, my, mz) = known[id(solid.shape)]
        gx, gy, gz = gravity
        turned = [my * gz + mz * gy, mz * gx + mx * gz, mx * gy + my * gx]
        density, (pull, turn) = Fraction(stone.density), wrenches[i]
        twist = turns[i] + Fraction(_quotient_above(_root_above(_length2(turn)), 4 * solid.volume6), 24 << unit + k)
        moment = density * _root_of(sum(x * x for x in turned))
        left = Fraction(_root_above(_length2(pull)), 24 << unit)
        mass, left, moment, twist = (_rounded_up(x) for x in (density * volume, left, moment, twist))
        found[i] = _Swing(mass, left, moment, twist, _centre(solid))
    return found


def _centre(solid: _Solid) -> Vec:
    """The centre of mass, each coordinate rounded down to 2**-(per_length + ROOT_BITS) m."""
    x, y, z = solid.moment24
    d = 4 * solid.volume6
    return (x << ROOT_BITS) // d, (y << ROOT_BITS) // d, (z << ROOT_BITS) // d


def _swelling(stone: _Stone, solid: _Solid, k: int, length: Fraction) -> tuple[Fraction, list[Fraction]]:
    """How much the volume (m3) of a block and its first moments about its centre of mass (m4) may change; rounded up.

    While vertices move by L at most, a fan triangle with sides u, v sweeps no more than L B, with the mean of its area
    B = A + L (|u| + |v|) / 2 + 2 L^2 / 3. It takes first moments of L B (x + L) with it, where x, its mean distance
    from the centre along an axis, is at most the root of the mean square, (sum x_i^2 + (sum x_i)^2) / 12.
    """
    bits = k + ROOT_BITS
    reach, (cx, cy, cz) = math.ceil(length * (1 << bits)), _centre(solid)
    at = [
        ((x << ROOT_BITS) - cx, (y << ROOT_BITS) - cy, (z << ROOT_BITS) - cz) for x, y, z in _vectors(stone.vertices, k)
    ]
    total, moments = 0, [0, 0, 0]
    for face in stone.surface.faces:
        for a, b, c in _fan([at[i] for i in face]):
            u, v = _minus(b, a), _minus(c, a)
            sides = _root_above(_length2(u)) + _root_above(_length2(v))
            swept6 = 3 * _root_above(_length2(_cross(u, v))) + 3 * reach * sides + 4 * reach * reach
            total += swept6
            for axis in range(3):
                p, q, r = a[axis], b[axis], c[axis]
                mean6 = _root_above(3 * (p * p + q * q + r * r + (p + q + r) ** 2))
                moments[axis] += swept6 * (mean6 + 6 * reach + 6)
    volume = Fraction(reach * total, 6 << 3 * bits)
    return volume, [Fraction(reach * moment, 36 << 4 * bits) for moment in moments]


def _leaves_first(model: _Model, ways: Mapping[int, int]) -> list[int]:
    """The free blocks, each before the one that its way leads to; all ways end at supports."""
    stones, patches = model.sheet.stones, model.patches
    above = [0] * len(stones)
    parents = {}
    for block, number in ways.items():
        patch = patches[number]
        if block not in (patch.a, patch.b):
            _refuse(f"ways: {_label(model.sheet, number)} is not at block {_short(stones[block].name)}")
        parents[block] = patch.a if patch.b == block else patch.b
        above[parents[block]] += 1
    order = []
    pending = [block for block in ways if not above[block]]
    while pending:
        block = pending.pop()
        order.append(block)
        parent = parents[block]
        above[parent] -= 1
        if not above[parent] and not stones[parent].fixed:
            pending.append(parent)
    if len(order) != len(ways):
        _refuse("ways: some of them go round and never come to a support")
    return order


def _room_used(borne: _Borne, patch: _Patch, swings: list[_Swing]) -> Fraction:
    """What a contact needs to pass swings on, in the room that its forces have inside their cones: `_state_within`.

    With X_k = rho_k times an integer, and C, S, D their sums weighed by F.N (D = det C in the plane, (S^2 - tr C^2) /
    2), C^-1 rho is (S X - C X) / D.
    """
    model, seating, pressed = borne.model, borne.seatings[patch.number], [along for along, _ in borne.sizes[patch.rows]]
    total, where = sum(pressed), _label(model.sheet, patch.number)
    if not total:
        _refuse(f"{where}: it bears nothing and cannot pass anything on")
    flat, middle = _from_middle(patch, pressed)
    spread = [_summed_up(_times(a * x[axis], x) for a, x in zip(pressed, flat, strict=True)) for axis in range(3)]
    s = spread[0][0] + spread[1][1] + spread[2][2]
    d = (s * s - sum(_length2(row) for row in spread)) // 2
    if not d > 0:
        _refuse(f"{where}: its points with forces are in one line")
    scale = total * patch.normal2 << model.per_length  # X counts in so many to the metre
    along, across, turn, twist = _passed_on(model, patch, swings, middle)
    s2 = Fraction(s, total * scale * scale)
    tilting = Fraction(total * scale, d) * (turn + seating.off * (across + twist / _root_of(s2, up=False)))
    press = Fraction(total, 1 << borne.per_force) / _root_of(patch.normal2)
    used = Fraction(0)
    for x, a, slope in zip(flat, pressed, borne.steep[patch.rows], strict=True):
        if a:
            cx, cy, cz = (_dot(row, x) for row in spread)
            normal = along + tilting * _root_of(_length2(_minus(_times(s, x), (cx, cy, cz))))
            aside = across + twist * _root_of(_length2(x)) / (scale * s2)
            need, room = seating.mu * normal + aside, press * (seating.mu - slope)
            if not room > 0:
                _refuse(f"{where}: a force has no room inside its cone")
            used = max(used, _rounded_up(need / room))
    return used


def _from_middle(patch: _Patch, pressed: Sequence[int]) -> tuple[list[Vec], Vec]:
    """P |N|^2 (r - m) of every point along the plane, and m rounded down to 2**-(per_length + ROOT_BITS) m.

    With P the sum of what presses, F.N, and m the centre of it.
    """
    first, normal, total = patch.points[0], patch.normal, sum(pressed)
    arms = [_minus(point, first) for point in patch.points]
    mean = _summed_up(_times(a, arm) for a, arm in zip(pressed, arms, strict=True))
    away = [_minus(_times(total, arm), mean) for arm in arms]
    flat = [_minus(_times(patch.normal2, x), _times(_dot(x, normal), normal)) for x in away]
    x, y, z = (((r * total + x) << ROOT_BITS) // total for r, x in zip(first, mean, strict=True))
    return flat, (x, y, z)


def _summed_up(vectors: Iterable[Vec]) -> Vec:
    x, y, z = (sum(axis) for axis in zip(*vectors, strict=True))
    return x, y, z


def _passed_on(
    model: _Model, patch: _Patch, swings: list[_Swing], middle: Vec
) -> tuple[Fraction, Fraction, Fraction, Fraction]:
    """Sizes of what swings come to at a contact, rounded up: the force along n and across it, N; the moment about a
    point m, and the part of that about n, N m.

    What is across gravity has at most the share |g x n| / |g| of its size along n. Centres of mass and m are rounded:
    each distance by less than 4 units.
    """
    per, bits, normal, normal2 = (
        _exponent(model.sheet.gravity),
        model.per_length + ROOT_BITS,
        patch.normal,
        patch.normal2,
    )
    gravity = _vector(model.sheet.gravity, per)
    gravity2, level2 = _length2(gravity), _length2(_cross(gravity, normal))
    slack, bowed, loose = 4 * _root_above(gravity2), Fraction(0), Fraction(0)
    mass, left = sum(swing.mass for swing in swings), sum(swing.left for swing in swings)
    for swing in swings:
        arm = _minus(swing.centre, middle)
        swung = Fraction(_root_above(_length2(_cross(gravity, arm))) + slack, 1 << per + bits)
        bowed += swing.turn + swing.mass * swung
        loose += swing.twist + swing.left * Fraction(_root_above(_length2(arm)) + 4, 1 << bits)
    along = Fraction(abs(_dot(gravity, normal)), 1 << per) / _root_of(normal2, up=False)
    share = _root_of(Fraction(level2, gravity2 * normal2)) if gravity2 else Fraction(0)
    sizes = mass * along + left, mass * _root_of(Fraction(level2, normal2), per) + left, bowed + loose
    one, two, three, four = (_rounded_up(x) for x in (*sizes, share * bowed + loose))
    return one, two, three, four


def _mechanism_within(model: _Model) -> tuple[dict[str, float], str, str]:
    """Check a motion that no drawing of the family resists, and in which its loads do work in every one.

    At a contact whose blocks do not move alike, with mu' what friction is where the normal leans as far as it may, at
    every corner of its convex outline

        dn - mu' |dd_t| >= sqrt(1 + mu'^2) |w| e        e^2 = L^2 / sin^2(angle / 2) + (L + z)^2

    w being the relative spin, and e how far a corner may get when every edge moves out by L, and the plane up or down.
    dn - mu' |dd_t| is concave, so that it is positive all over the contact then. And in some component, all contacts of
    which are so,

        p.y > sum rho (|g.v| dV + sum |(g x w)_k| dQ_k) + sum L |F x w| + BALANCE sum w (|v| + D |w|)
    """
    within, sheet = model.sheet.within, model.sheet
    assert within is not None
    per = _exponent(chain.from_iterable(sheet.motion))
    motions = [
        _Motion(_times(1 << model.per_length, _vector(row[:3], per)), _vector(row[3:], per)) for row in sheet.motion
    ]
    shut: dict[int, str] = {}
    for patch in model.patches:
        if fault := _resists(model, patch, motions, per):
            shut.setdefault(patch.part, fault)
    unit = 24 << model.per_force + per + model.per_length
    powers, slacks, lost = _powers24(model, motions), _slacks24(model, motions), _power_lost(model, motions, per)
    shares = {c: (lost[c] + slacks[c] / unit) / Fraction(powers[c], unit) for c in range(model.parts) if powers[c] > 0}
    if not shares:
        _refuse("the loads do no work in this motion")
    free = {c: share for c, share in shares.items() if c not in shut}
    if not free:
        _refuse(next(shut[c] for c in shares))
    least = min(free.values())
    figures = {"within": float(within.length), "power_used": float(least)}
    if not least < 1:
        _refuse(f"in some drawing the loads may do no work in this motion ({float(least):.3g} of it is lost)", figures)
    return figures, f"no contact resists, and of the loads' work {float(least):.3g} is lost in no drawing at most", ""


def _resists(model: _Model, patch: _Patch, motions: Motions, per: int) -> str:
    """What is wrong with how a contact opens, if anything is; nothing where its blocks move alike."""
    a, b, within, k = motions[patch.a], motions[patch.b], model.sheet.within, model.per_length
    if a == b:
        return ""
    assert within is not None
    where, mu, lean = _label(model.sheet, patch.number), Fraction(patch.joint.mu), _lean(patch, within, k)
    if lean is None or not mu * lean < 1:
        return f"{where}: with normals that lean so far it may resist anything"
    mu = (mu + lean) / (1 - mu * lean)
    spin = _root_of(1 + mu * mu) * _root_of(_length2(_minus(b.spin, a.spin)), per)
    wide, narrow = _root_of(patch.normal2), _root_of(patch.normal2, up=False)
    facet = _Facet(patch.points, patch.normal, patch.normal2).prepared()
    moves = _moves(patch, motions)
    for i, number, j in _hull(patch):
        d, e = _dot(moves[number], patch.normal), _length2(moves[number])
        across = _root_of(e * patch.normal2 - d * d) / narrow
        off = _root_of(Fraction(_rise(facet, patch.points[number]) ** 2, len(facet.ring) ** 2 * patch.normal2), k)
        aside2 = _aside2(patch, [patch.points[x] for x in (i, number, j)])
        if aside2 is None:
            return f"{where}: the corner at point {number} is too sharp"
        length = Fraction(within.length)
        far = _root_of(length**2 * aside2 + (length + off) ** 2)
        if not (d / wide - mu * across) / (1 << per + k) >= spin * far:
            return f"{where}: at point {number} it does not open enough for every drawing"
    return ""


def _aside2(patch: _Patch, corner: Sequence[Vec]) -> Fraction | None:
    """1 / sin^2 of half the angle at the middle one of three points, seen along N, rounded up; None where it is 0."""
    before, here, after = corner

    def product(u: Vec, v: Vec) -> int:
        return _dot(u, v) * patch.normal2 - _dot(u, patch.normal) * _dot(v, patch.normal)

    u, v = _minus(before, here), _minus(after, here)
    both, sizes = product(u, v), product(u, u) * product(v, v)
    if not sizes:
        return None
    cosine = both / _root_of(sizes, up=both < 0)
    return 2 / (1 - cosine) if cosine < 1 else None


def _hull(patch: _Patch) -> list[tuple[int, int, int]]:
    """The corners of the convex outline of a contact, seen along N, each between the ones beside it.

    Andrew's monotone chain.
    """
    flat = _seen_along(patch, patch.points)
    outline: list[int] = []
    order = sorted(range(len(flat)), key=flat.__getitem__)
    for way in (order, order[::-1]):
        side: list[int] = []
        for i in way:
            while len(side) > 1 and _left(flat[side[-2]], flat[side[-1]], flat[i]) <= 0:
                side.pop()
            side.append(i)
        outline += side[:-1]
    return [
        (before, here, after)
        for (before, here), (_, after) in zip(_around(outline), _around(outline[1:] + outline[:1]), strict=True)
    ]


def _left(a: tuple[int, int], b: tuple[int, int], c: tuple[int, int]) -> int:
    """Positive where c lies to the left of the way from a to b."""
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def _power_lost(model: _Model, motions: Motions, per: int) -> list[Fraction]:
    """By how much p.y of every component may be less in some drawing, W, rounded up."""
    within, k = model.sheet.within, model.per_length
    assert within is not None
    length, lost = Fraction(within.length), [Fraction(0)] * model.parts
    known: dict[int, tuple[Fraction, list[Fraction]]] = {}
    gravity_bits = _exponent(model.sheet.gravity)
    gravity = _vector(model.sheet.gravity, gravity_bits)
    for i, stone, solid in model.free():
        motion = motions[i]
        if motion != _Motion((0, 0, 0), (0, 0, 0)):
            if id(solid.shape) not in known:
                known[id(solid.shape)] = _swelling(stone, solid, k, length)
            volume, moments = known[id(solid.shape)]
            raised = Fraction(abs(_dot(gravity, motion.flow(solid))), 4 * solid.volume6 << gravity_bits + per + k)
            turned = zip(_cross(gravity, motion.spin), moments, strict=True)
            moved = sum((abs(x) * moment for x, moment in turned), Fraction(0)) / (1 << gravity_bits + per)
            lost[model.component[i]] += _rounded_up(Fraction(stone.density) * (raised * volume + moved))
    for block, force, _ in model.loads:
        size = _root_of(_length2(_cross(force, motions[block].spin)), model.per_force + per)
        lost[model.component[block]] += _rounded_up(length * size)
    return lost


PROOFS = {
    "rbe-state": _state,
    "rbe-mechanism": _mechanism,
    "cra-state": _coupled_state,
    "cra-tree": _tree,
    "limit-bounds": _limit,
    "rbe-settled": _settled,
    "rbe-state-within": _state_within,
    "rbe-mechanism-within": _mechanism_within,
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
    print("\n".join(f"  {line}" for line in (report.reason, *report.assumed)))
    return 0 if report.proved else 1


if __name__ == "__main__":
    sys.exit(main())
