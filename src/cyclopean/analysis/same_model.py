"""Is a certificate about this model? What it says of blocks, contacts and loads, held against the model itself.

Coordinates agree to `ROUNDING` of the largest one, for formats of files round; contacts that the model does not list
are detected anew, and agree to the tolerance of detection. What a model leaves open (gravity, friction, density,
supports) is no difference: it is told as assumed.
"""

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from cyclopean.analysis.equilibrium.reference import parse_cone
from cyclopean.analysis.preparation import joined
from cyclopean.analysis.pyramids import edges_of
from cyclopean.analysis.settings import Settings
from cyclopean.arrays import Bools, Floats
from cyclopean.assembly import (
    Assembly,
    Block,
    Contacts,
    grounded,
    paired_friction,
    resolved_fields,
    resolved_loads,
    supports,
)
from cyclopean.errors import InputError
from cyclopean.geometry import mesh_faults

__all__ = ["Comparison", "compare"]

ROUNDING = 1e-12  # of the largest coordinate, or of the number itself
COMPUTED = 1e3  # times that for loads that follow from areas and volumes
BLURRED = 1e-6  # by which edges of a pyramid may differ: frames of narrow polygons are that sure
STANDING, FALLING = ("rbe-state", "cra-state"), ("rbe-mechanism", "cra-tree")  # more friction helps, or none would
LISTED = 10  # differences told one by one before they are only counted

Row = Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class Comparison:
    """What a certificate says of a model that the model does not say."""

    differences: tuple[str, ...]  # one line each, the first few and how many more; none = it is this model
    assumed: tuple[str, ...]  # what the model leaves open and the certificate fills in
    apart: float  # m: by how much lengths differ at most that count as the same


class _Joint(NamedTuple):
    """A contact as either side has it; its normal points from the first block of the pair to the second."""

    pair: tuple[str, str]  # ids, in order
    polygon: Floats  # (k, 3) m
    mu: float  # NaN = not given
    tension: float  # Pa, NaN = not given
    facing: Floats  # (3,) normal at a point, NaN = a polygon
    pyramid: str = ""  # what stands for its friction cone; "other" where that is no regular pyramid of its mu

    @property
    def words(self) -> str:
        """How a difference names it."""
        return f"contact '{self.pair[0]}' - '{self.pair[1]}'"


@dataclass(slots=True)
class _Lengths:
    """Up to where lengths count as the same (m), and the largest difference so far that did."""

    most: float
    apart: float = 0.0

    def same(self, distance: float, most: float = 0.0) -> bool:
        """Whether a distance is no more than rounding, or than `most` where that is larger."""
        if not distance <= max(self.most, most):
            return False
        self.apart = max(self.apart, distance)
        return True


def compare(certificate: Mapping[str, Any], assembly: Assembly, settings: Settings | None = None) -> Comparison:
    """Hold a certificate against a model.

    Parameters
    ----------
    certificate : mapping
        As it stands in a file, accepted by the checker: nothing in it is checked again.
    assembly : Assembly
        The model. Loads of every case act with factor 1; supports are those that it names, else the lowest blocks.
    settings : Settings, optional
        Their `tolerance`: what the drawing is forgiven where contacts are detected.

    Raises
    ------
    InputError
        Blocks that are not closed solids, contacts off their blocks, surface loads off the faces of theirs.
    """
    if faults := mesh_faults(assembly.mesh):
        raise InputError(f"block '{assembly.blocks[faults[0][0]].id}' {faults[0][1]}; mend its mesh")
    stones: dict[str, Row] = {stone["id"]: stone for stone in certificate["blocks"]}
    fixed, lowest = _supports(assembly)
    found, forgiven = joined(assembly, Settings() if settings is None else settings, fixed)
    if forgiven is not None and lowest:
        fixed = grounded(assembly, found.contacts, fixed, forgiven.gap)
    held_there = {name for name, stone in stones.items() if stone["fixed"]}
    held_here = {block.id for block, whole in zip(assembly.blocks, fixed, strict=True) if whole}
    corners = [assembly.mesh.vertex, *(np.asarray(stone["vertices"], float) for stone in stones.values())]
    lengths = _Lengths(ROUNDING * max(float(np.abs(rows).max(initial=0.0)) for rows in corners))
    tolerance = found.tolerance if assembly.contacts is None else 0.0  # with which contacts were detected
    contacts = _joints(assembly, found.contacts)
    here = [one for one in contacts if not {*one.pair} <= held_here and not {*one.pair} <= held_there]
    there = [one for one in map(_listed, certificate["contacts"]) if not {*one.pair} <= held_here]
    pairs, lines = _paired(here, there, lengths, tolerance)
    told = [
        *_blocks(stones, assembly, fixed, lengths),
        *lines,
        *_materials(pairs, certificate["kind"]),
        *_loads(certificate["loads"], assembly, found.contacts, stones, lengths),
        *_settlements(certificate, assembly),
    ]
    more = [f"... and {len(told) - LISTED} more differences"] if len(told) > LISTED else []
    assumed = tuple(_assumed(certificate, assembly, pairs, lowest, tolerance))
    return Comparison((*told[:LISTED], *more), assumed, lengths.apart)


def _supports(assembly: Assembly) -> tuple[Bools, bool]:
    """(n,) which blocks the model holds, and whether only because they are the lowest."""
    if all(block.fixed is False and not block.held for block in assembly.blocks):
        return np.zeros(len(assembly), bool), False
    fixed, rule = supports(assembly)
    return fixed, rule == "lowest"


# ---------------------------------------------------------------------------------------------------------------------
# Blocks.


def _blocks(stones: Mapping[str, Row], assembly: Assembly, fixed: Bools, lengths: _Lengths) -> Iterator[str]:
    ids = {block.id for block in assembly.blocks}
    for name in (name for name in stones if name not in ids):
        yield f"block '{name}' is only in the certificate"
    for block, whole in zip(assembly.blocks, fixed.tolist(), strict=True):
        if block.id not in stones:
            yield f"block '{block.id}' is missing in the certificate"
        else:
            for what in _changed(stones[block.id], block, whole, lengths):
                yield f"block '{block.id}' {what}"


def _changed(stone: Row, block: Block, fixed: bool, lengths: _Lengths) -> Iterator[str]:
    """How a block of the certificate differs from that of the model."""
    there = np.asarray(stone["vertices"], float).reshape(-1, 3)
    if len(there) != len(block.vertices):
        yield f"has {len(there)} vertices, in the model {len(block.vertices)}"
    else:
        away = float(np.linalg.norm(there - block.vertices, axis=1).max(initial=0.0))
        if not lengths.same(away):
            yield f"has vertices up to {away:.3g} m from those of the model"
        if _rings(stone["faces"]) != _rings(block.faces):
            yield "has other faces than in the model"
    if block.density is not None and not _near(stone["density"], block.density):
        yield f"has {stone['density']:.15g} kg/m3, in the model {block.density:.15g}"
    if stone["fixed"] != fixed:
        yield "is a support, in the model it is free" if stone["fixed"] else "is free, in the model it is a support"
    elif not fixed and tuple(stone.get("held", ())) != block.held:
        held, said = ", ".join(stone.get("held", ())) or "nothing", ", ".join(block.held) or "nothing"
        yield f"is held in {held}, in the model in {said}"


def _rings(faces: Sequence[Sequence[int]]) -> list[tuple[int, ...]]:
    """Faces, each from its least corner on, in an order that does not depend on the file's.

    >>> _rings([(2, 0, 1), (4, 3, 1)]) == _rings([(1, 4, 3), (0, 1, 2)])
    True
    """
    first = [min(range(len(face)), key=face.__getitem__) for face in faces]
    return sorted((*face[k:], *face[:k]) for face, k in zip(map(tuple, faces), first, strict=True))


def _near(x: float, y: float) -> bool:
    return abs(x - y) <= ROUNDING * abs(y)


# ---------------------------------------------------------------------------------------------------------------------
# Contacts.


def _joints(assembly: Assembly, contacts: Contacts) -> list[_Joint]:
    """The contacts of the model, with the friction of its materials."""
    contacts = paired_friction(assembly, contacts)[0]
    names = [block.id for block in assembly.blocks]
    rows = zip(*(x.tolist() for x in (contacts.a, contacts.b, contacts.mu, contacts.strength_given)), strict=True)
    return [
        _joint((names[a], names[b]), contacts.polygon(k), mu, pull, contacts.normal_given[k])
        for k, (a, b, mu, pull) in enumerate(rows)
    ]


def _listed(row: Row) -> _Joint:
    polygon, facing = (np.asarray(row.get(key, [np.nan] * 3), float) for key in ("polygon", "normal"))
    found = _joint((row["a"], row["b"]), polygon, row["mu"], row.get("tension", 0.0), facing)
    return found._replace(pyramid=_pyramid(np.array(row["edges"], float), polygon, row)) if "edges" in row else found


def _pyramid(edges: Floats, polygon: Floats, row: Row) -> str:
    """The name of a regular pyramid by its edges."""
    facing = [row["normal"]] if "normal" in row else None
    contact = Contacts.of([(0, 1)], [polygon], [row["mu"]], facing=facing)
    names = [f"{kind}:{len(edges)}" for kind in ("inscribed", "circumscribed")]
    regular = {name: edges_of(contact, parse_cone(name))[0] for name in names}
    return next(
        (name for name, wanted in regular.items() if np.allclose(edges, wanted, rtol=0.0, atol=BLURRED)), "other"
    )


def _joint(pair: tuple[str, str], polygon: Floats, mu: float, tension: float, facing: Floats) -> _Joint:
    if pair[0] < pair[1]:
        return _Joint(pair, polygon, mu, tension, facing)
    return _Joint(pair[::-1], polygon[::-1], mu, tension, -facing)


def _paired(
    here: Iterable[_Joint], there: Iterable[_Joint], lengths: _Lengths, tolerance: float
) -> tuple[list[tuple[_Joint, _Joint]], list[str]]:
    """Contacts of the model with those of the certificate that are the same, and one line on each that has no partner.

    Of the same two blocks first those that agree go together, then those that are nearest.
    """
    places: dict[tuple[str, str], tuple[list[_Joint], list[_Joint]]] = defaultdict(lambda: ([], []))
    for side, joints in enumerate((here, there)):
        for joint in joints:
            places[joint.pair][side].append(joint)
    pairs, lines = [], []
    for ours, theirs in places.values():
        alone = []
        for one in ours:
            agree = (k for k, other in enumerate(theirs) if lengths.same(_away(one.polygon, other.polygon), tolerance))
            if (k := next(agree, None)) is None:
                alone.append(one)
            else:
                pairs.append((one, theirs.pop(k)))
        for one in alone:
            if not theirs:
                lines.append(f"{one.words} is missing in the certificate")
                continue
            away, k = min((_away(one.polygon, other.polygon), k) for k, other in enumerate(theirs))
            pairs.append((one, theirs.pop(k)))
            lines.append(f"{one.words} has its corners up to {away:.3g} m from those in the model")
        lines += [f"{other.words} is only in the certificate" for other in theirs]
    return pairs, lines


def _away(p: Floats, q: Floats) -> float:
    """How far (m) corners of two polygons are apart at most: one by one round both, or each from the nearest."""
    if len(p) == len(q):
        shifts = {0, int(np.argmin(np.sum((q - p[0]) ** 2, axis=1)))}
        return min(float(np.linalg.norm(np.roll(q, -k, axis=0) - p, axis=1).max()) for k in shifts)
    from scipy.spatial import cKDTree

    return float(max(cKDTree(q).query(p)[0].max(), cKDTree(p).query(q)[0].max()))


def _materials(pairs: Iterable[tuple[_Joint, _Joint]], kind: str) -> Iterator[str]:
    """Normals of points; friction and tension where the model gives them.

    What stands with less friction stands with more, and what falls with more falls with less.
    """
    for here, there in pairs:
        if there.pyramid == "other":
            yield f"{here.words} has a pyramid that is no regular one of its mu"
        if not np.allclose(here.facing, there.facing, rtol=0.0, atol=ROUNDING, equal_nan=True):
            yield f"{here.words} faces another way than in the model"
        if not (np.isnan(here.mu) or _near(there.mu, here.mu) or _is_harder(kind, there.mu - here.mu)):
            yield f"{here.words} has mu {there.mu:.15g}, in the model {here.mu:.15g}"
        if not np.isnan(here.tension) and not _near(there.tension, here.tension):
            yield f"{here.words} pulls with {there.tension:.15g} Pa, in the model {here.tension:.15g}"


def _is_harder(kind: str, more: float) -> bool:
    """Whether a proof with so much more friction than the model has is one for the model too."""
    return (kind in STANDING and more < 0.0) or (kind in FALLING and more > 0.0)


# ---------------------------------------------------------------------------------------------------------------------
# Loads and settlements.


def _loads(
    rows: Sequence[Row], assembly: Assembly, contacts: Contacts, stones: Mapping[str, Row], lengths: _Lengths
) -> Iterator[str]:
    """Loads of the model, at points, against those of the certificate; in any order."""
    wide = COMPUTED if assembly.actions else 1.0
    filled = [
        replace(block, density=stones[block.id]["density"] or None)
        if block.density is None and block.id in stones
        else block
        for block in assembly.blocks
    ]
    pressed = resolved_fields(replace(assembly, blocks=tuple(filled)), contacts)[0]
    acting = resolved_loads(pressed, None, 0.0).loads
    here = [(assembly.blocks[load.block].id, load.force, load.point) for load in acting if load.force.any()]
    left = [(row["block"], np.array(row["force"], float), np.array(row["point"], float)) for row in rows]
    left = [row for row in left if row[1].any()]
    room = wide * ROUNDING * max((float(np.linalg.norm(force)) for _, force, _ in here), default=0.0)
    for name, force, point in here:
        for k, (other, pull, at) in enumerate(left):
            near = float(np.linalg.norm(at - point))
            if other == name and np.linalg.norm(pull - force) <= room and lengths.same(near, wide * lengths.most):
                del left[k]
                break
        else:
            yield f"{_load_words(name, force, point)} is missing in the certificate"
    for row in left:
        yield f"{_load_words(*row)} is only in the certificate"


def _load_words(name: str, force: Floats, point: Floats) -> str:
    return f"the load {_triple(force)} N on block '{name}' at {_triple(point)}"


def _settlements(certificate: Row, assembly: Assembly) -> Iterator[str]:
    """What the ground does to supports, where the model says it and the certificate is about that."""
    if certificate["kind"] != "rbe-settled" or not assembly.settlements:
        return
    there = {name: np.array(row, float) for name, row in certificate["settlements"].items()}
    here = {assembly.blocks[one.block].id: one.motion for one in assembly.settlements}
    for name in dict.fromkeys((*here, *there)):
        said, found = here.get(name, np.zeros(6)), there.get(name, np.zeros(6))
        if not np.linalg.norm(said - found) <= ROUNDING * np.linalg.norm(said):
            yield f"block '{name}' settles in another way than in the model"


# ---------------------------------------------------------------------------------------------------------------------
# What the model leaves open.


def _assumed(
    certificate: Row,
    assembly: Assembly,
    pairs: Sequence[tuple[_Joint, _Joint]],
    lowest: bool,
    tolerance: float,
) -> Iterator[str]:
    open_mu = [there.mu for here, there in pairs if np.isnan(here.mu)]
    if open_mu:
        yield f"mu {_span(open_mu)}{_share(len(open_mu), len(pairs), 'contacts')}"
    given = {block.id: block.density for block in assembly.blocks}
    densities = [s["density"] for s in certificate["blocks"] if given.get(s["id"], 0.0) is None and not s["fixed"]]
    free = sum(not stone["fixed"] for stone in certificate["blocks"])
    if densities:
        yield f"density {_span(densities)}{_share(len(densities), free, 'free blocks')}"
    if pyramids := {there.pyramid for _, there in pairs if there.pyramid}:
        yield f"PYRAMIDS for friction cones, {', '.join(sorted(pyramids))}"
    if other := [there.mu for here, there in pairs if not (np.isnan(here.mu) or _near(there.mu, here.mu))]:
        than = "less" if certificate["kind"] in STANDING else "more"
        yield f"mu {_span(other)}{_share(len(other), len(pairs), 'contacts')}, {than} than in the model"
    if lowest:
        yield "supports lowest"
    if tolerance > 0.0:
        yield f"contacts where faces touch to {tolerance:.3g} m"
    pulls = [there.tension for here, there in pairs if np.isnan(here.tension) and there.tension > 0.0]
    if pulls:
        yield f"JOINTS THAT PULL {_span(pulls)} Pa{_share(len(pulls), len(pairs), 'contacts')}"
    yield f"gravity {_triple(certificate['gravity'])}"
    if "live" in certificate:
        yield "what grows with the multiplier"
    if certificate["kind"] == "rbe-settled" and not assembly.settlements:
        yield "how supports settle"


def _share(count: int, total: int, what: str) -> str:
    return "" if count == total else f" at {count} of {total} {what}"


def _span(values: Sequence[float]) -> str:
    low, high = f"{min(values):.6g}", f"{max(values):.6g}"
    return low if min(values) == max(values) else f"{low} to {high}"


def _triple(vector: Iterable[float]) -> str:
    return "(" + ", ".join(f"{x + 0.0:.6g}" for x in vector) + ")"
