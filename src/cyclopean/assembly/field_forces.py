"""Earth, water and fill as forces on blocks: before anything is analysed, so that a certificate holds nothing else.

What looks at them is found in `exposed`, how hard they press in `field_loads`. A force stays as it is while the blocks
move, also that of passive earth: it is a push and no resistance.
"""

from dataclasses import replace
from typing import Any

import numpy as np

from cyclopean.arrays import Bools, Floats
from cyclopean.assembly.blocks import Assembly
from cyclopean.assembly.contacts import Contacts
from cyclopean.assembly.exposed import Exposed, clipped, exposed, joined_loads, resultants, ring_quadrature
from cyclopean.assembly.field_loads import STEEP, Earth, FieldLoad, Fill, Water
from cyclopean.assembly.loading import members
from cyclopean.assembly.loads import Load
from cyclopean.errors import InputError

__all__ = ["resolved_fields", "surcharge_loads", "with_soil"]

UP = np.array([0.0, 0.0, 1.0])


def resolved_fields(assembly: Assembly, contacts: Contacts) -> tuple[Assembly, tuple[str, ...]]:
    """The same assembly with earth, water and fill as forces at points, each of its case; and a line on each.

    Parameters
    ----------
    assembly : Assembly
        The model, its meshes sound.
    contacts : Contacts
        Its joints, in which water may press.

    Raises
    ------
    InputError
        No face looks at one of them, or no wedge of earth is in equilibrium.
    """
    loads, said, movable = list(assembly.loads), [], _free(assembly)
    for row in assembly.actions:
        if isinstance(row, FieldLoad):
            found, words = _forces(assembly, row, contacts)
            free = [load for load in found if movable[load.block]]
            blocks = len({load.block for load in free})
            size = float(np.linalg.norm(sum((load.force for load in free), np.zeros(3))))
            loads += found
            said.append(f"{words}: {size / 1e3:.4g} kN on {blocks} free block{'s' * (blocks != 1)}")
    rest = tuple(row for row in assembly.actions if not isinstance(row, FieldLoad))
    return replace(assembly, loads=tuple(loads), actions=rest) if said else assembly, tuple(said)


def with_soil(assembly: Assembly, surcharge: float | None, height: float | None) -> Assembly:
    """The same assembly with another surcharge (Pa) or height (m, world) of all its earth.

    Raises
    ------
    InputError
        It has none.
    """
    given = {"surcharge": surcharge, "height": height}
    said: dict[str, Any] = {name: value for name, value in given.items() if value is not None}
    if not said:
        return assembly
    if not any(isinstance(row, Earth) for row in assembly.actions):
        field = "surcharge" if surcharge is not None else "soil_height"
        raise InputError.of(field, next(iter(said.values())), "the model has no soil; add one to its loads")
    rows = (replace(row, **said) if isinstance(row, Earth) else row for row in assembly.actions)
    return replace(assembly, actions=tuple(rows))


def surcharge_loads(assembly: Assembly, surcharge: float) -> tuple[Load, ...]:
    """Forces of a surcharge (Pa) alone on all earth of the model; errors as `with_soil` and `resolved_fields`."""
    rows = [row for row in with_soil(assembly, surcharge, None).actions if isinstance(row, Earth)]
    return joined_loads(load for row in rows for load in _earth(assembly, row, 0.0)[0])


def _forces(assembly: Assembly, row: FieldLoad, contacts: Contacts) -> tuple[tuple[Load, ...], str]:
    """The forces of one of them, and what is said of it."""
    if isinstance(row, Earth):
        loads, words = _earth(assembly, row, row.unit_weight)
    elif isinstance(row, Water):
        loads, words = _water(assembly, row, contacts)
    else:
        assert isinstance(row, Fill)
        loads, words = _fill(assembly, row)
    return joined_loads(loads), words


def _free(assembly: Assembly) -> Bools:
    """(n,) blocks that the model does not call supports: forces on these do nothing, and are not told."""
    return np.array([not block.fixed for block in assembly.blocks], bool)


def _looking(assembly: Assembly, row: FieldLoad, way: Floats, low: float | None, high: float | None) -> Exposed:
    """What looks at it.

    Raises
    ------
    InputError
        Nothing does.
    """
    if isinstance(row, Fill):
        found = seen_from_above(assembly, row)
    else:
        found = exposed(assembly, way, members(assembly, row))
        if isinstance(row, Earth) and high is None and len(found.block):
            back = found.normal[:, 2] <= np.tan(np.radians(STEEP)) * (found.normal @ way)
            upright = (
                found.only(back) if back.any() else found
            )  # no ground or roof itself, where there is anything else
            high = float(upright.corners[:, 2].max())
        found = found.between(low, high)
    if not len(found.block):
        where = "up" if way[2] else f"towards azimuth {row.side:g}"  # type: ignore[attr-defined]
        bounds = "".join(f" {word} z = {z:g} m" for word, z in (("above", low), ("below", high)) if z is not None)
        name = {Earth: "soil", Water: "water", Fill: "fill"}[type(row)]
        raise InputError(f"loads: {name} on no face: no face looks {where}{bounds}; check its side, heights and group")
    return found


def seen_from_above(assembly: Assembly, row: Fill) -> Exposed:
    """What lies open below the surface of fill; from above all blocks hide what is below them."""
    found = exposed(assembly, UP, np.ones(len(assembly), bool), high=row.height)
    return found.only(members(assembly, row)[found.block])


def _azimuth(degrees: float) -> Floats:
    """(3,) level unit vector; exact where it is along an axis."""
    angle = np.radians(degrees)
    return np.array([np.cos(angle), np.sin(angle), 0.0]).round(15)


def _earth(assembly: Assembly, row: Earth, unit_weight: float) -> tuple[list[Load], str]:
    """Forces of earth of this unit weight (N/m3), and its state, coefficient and angles in words."""
    way = _azimuth(row.side)
    pieces = _looking(assembly, row, way, row.foot, row.height)
    top = float(pieces.corners[:, 2].max()) if row.height is None else row.height
    size = pieces.area * _free(assembly)[pieces.block]
    size = size if size.any() else pieces.area
    upward = pieces.normal[:, 2] / (pieces.normal @ way)
    theta = float(np.degrees(np.arctan(size @ upward / size.sum()))) if row.back is None else row.back
    factor, (kh, kv) = row.coefficient(theta), row.seismic
    back, slope = np.radians([theta, row.slope])
    load = row.surcharge * (1.0 if row.state == "rest" else np.cos(back) * np.cos(slope) / np.cos(back - slope))
    lean = np.radians({"active": theta + row.wall_friction, "passive": theta - row.wall_friction}.get(row.state, 0.0))
    share = factor * (1.0 - kv)
    push = np.tile(-(np.cos(lean) * way + np.sin(lean) * UP), (len(size), 1))
    loads = resultants(pieces, share * (unit_weight * top + load), -share * unit_weight * UP, push, row.case)
    angles = f"earth {row.friction:g}, wall {row.wall_friction:g}, back {theta:.3g}, slope {row.slope:g} degrees"
    by = "at rest" if row.state == "rest" else f"{row.state} by Coulomb's wedge"
    quake = f", seismic {kh:g}, {kv:g}" if any(row.seismic) else ""
    return loads, f"soil {by}, K = {factor:.4g} ({angles}{quake}), ground at z = {top:.4g} m"


def _water(assembly: Assembly, row: Water, contacts: Contacts) -> tuple[list[Load], str]:
    """Forces of water on what looks at it and in joints, and what is said of it."""
    way = _azimuth(row.side)
    pieces = _looking(assembly, row, way, row.foot, row.head)
    inward = -pieces.normal / (pieces.normal @ way)[:, None]
    loads = resultants(pieces, row.unit_weight * row.head, -row.unit_weight * UP, inward, row.case)
    here = members(assembly, row)
    for k in range(len(contacts)) if row.uplift != "none" else ():
        if here[contacts.a[k]] or here[contacts.b[k]]:
            loads += _in_joint(row, way, contacts, k)
    highest = float(max(assembly.mesh.vertex[here[assembly.mesh.vertex_body], 2]))
    above = f" ({row.head - highest:.3g} m above the highest stone, where nothing holds it)"
    told = f"water up to z = {row.head:g} m{above if row.head > highest else ''}"
    return loads, f"{told}, uplift in joints {row.uplift}"


def _in_joint(row: Water, way: Floats, contacts: Contacts, k: int) -> list[Load]:
    """What water in one joint does to its two blocks.

    The level to which it would rise in a pipe is that of the head where the joint is nearest to the water; where the
    uplift falls in a line it is that of the joint itself at its other end.
    """
    ring, frame = contacts.polygon(k), contacts.frame[k]
    reach = ring @ way
    near, far = float(reach.max()), float(reach.min())
    fall = np.zeros(3)
    if row.uplift == "linear" and near - far > 1e-6 * float(np.ptp(ring, axis=0).max()):
        end = float(ring[reach < far + 0.01 * (near - far), 2].mean())  # its corners there
        fall = (row.head - end) / (near - far) * way
    start, slope = row.unit_weight * (row.head - near * float(fall @ way)), row.unit_weight * (fall - UP)
    ring = clipped(ring, start + ring @ slope)
    if len(ring) < 3:
        return []
    at, weight = ring_quadrature((ring - ring[0]) @ frame[1:].T)
    point = ring[0] + at @ frame[1:]
    share = weight * (start + point @ slope)
    total = float(share.sum())
    if not total > 0.0:
        return []
    centre, ends = share @ point / total, ((int(contacts.a[k]), -1.0), (int(contacts.b[k]), 1.0))
    return [Load(block, sign * total * frame[0], centre, row.case) for block, sign in ends]


def _fill(assembly: Assembly, row: Fill) -> tuple[list[Load], str]:
    """Forces of fill on what looks up at it, and what is said of it."""
    pieces = _looking(assembly, row, UP, None, row.height)
    press = -pieces.normal / pieces.normal[:, 2:] * [row.level, row.level, 1.0]
    loads = resultants(pieces, row.unit_weight * row.height + row.surcharge, -row.unit_weight * UP, press, row.case)
    level = f"{row.level:g} times that level, always" if row.level else "no level pressure"
    return loads, f"fill up to z = {row.height:g} m, its weight and {level}"
