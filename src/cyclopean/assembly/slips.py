"""What is drawn soundly and yet can hardly be meant: stones in stones, two units in one file, crossed surfaces."""

from collections.abc import Sequence

import numpy as np

from cyclopean.arrays import Bools
from cyclopean.assembly.blocks import Assembly
from cyclopean.assembly.contacts import Contacts
from cyclopean.errors import InputError
from cyclopean.geometry.boxes import box_pairs
from cyclopean.geometry.frames import solid_angles
from cyclopean.geometry.mending import place_text
from cyclopean.geometry.mesh_repair import self_crossings
from cyclopean.geometry.polyhedra import bodies_of, triangles

__all__ = ["slips"]

FACTORS = (25.4, 100.0, 304.8, 1000.0)  # between inches, feet, centimetres or metres and millimetres or metres
NEAR_FACTOR = 1.5  # times that sizes may be off such a factor: stones are not all alike
CLEFT = 8.0  # times that the least of the larger stones is larger than the largest of the smaller ones
SAMPLES = 8  # corners of a block that are looked up in another


def slips(assembly: Assembly, contacts: Contacts) -> tuple[str, ...]:
    """Warnings, one line for each kind of slip.

    Raises
    ------
    InputError
        A block lies wholly inside another and touches it nowhere, where the model does not give its contacts itself.
    """
    if assembly.contacts is None:
        _refuse_stones_in_stones(assembly, contacts)
    return (*_two_units(assembly, contacts), *_crossed(assembly))


def _two_units(assembly: Assembly, contacts: Contacts) -> Sequence[str]:
    """Say where blocks fall into two sizes that differ as two units of length do, and none of one touches the other."""
    size = assembly.mesh.diagonal
    order = np.argsort(size, kind="stable")
    ratio = size[order[1:]] / np.maximum(size[order[:-1]], 1e-300)
    if not len(ratio) or not ratio.max() >= CLEFT:
        return ()
    k = int(np.argmax(ratio)) + 1
    large = np.zeros(len(size), bool)
    large[order[k:]] = True
    times = float(np.median(size[large]) / max(float(np.median(size[~large])), 1e-300))
    factor = min(FACTORS, key=lambda one: abs(np.log(one / times)))
    if (large[contacts.a] != large[contacts.b]).any() or not 1 / NEAR_FACTOR < times / factor < NEAR_FACTOR:
        return ()
    few = np.flatnonzero(large if 2 * k > len(size) else ~large)
    word = "larger" if 2 * k > len(size) else "smaller"
    what = f"block '{assembly.blocks[few[0]].id}' is" if len(few) == 1 else f"{len(few)} blocks are"
    first = "" if len(few) == 1 else f" ('{assembly.blocks[few[0]].id}' first)"
    return (
        f"{what} about {factor:g} times {word} than the other {len(size) - len(few)}{first} and nothing joins"
        " them: two units of length in one file?",
    )


def _crossed(assembly: Assembly) -> Sequence[str]:
    found = self_crossings(assembly.mesh)
    if not found:
        return ()
    body, place = found[0]
    more = f" (and {len(found) - 1} more blocks)" if len(found) > 1 else ""
    return (
        f"block '{assembly.blocks[body].id}' crosses itself near {place_text(place)}{more}:"
        " what it goes round twice counts twice, or not at all",
    )


def _refuse_stones_in_stones(assembly: Assembly, contacts: Contacts) -> None:
    low, high = assembly.mesh.boxes()
    a, b = box_pairs(low, high, 0.0)
    i, j = np.concatenate([a, b]), np.concatenate([b, a])
    held = ((low[i] > low[j]) & (high[i] < high[j])).all(axis=1)
    n = len(assembly)
    touching = np.concatenate([contacts.a * n + contacts.b, contacts.b * n + contacts.a])
    held &= ~np.isin(i * n + j, touching)
    inside = [(x, y) for x, y in zip(i[held].tolist(), j[held].tolist(), strict=True) if _inside(assembly, x, y).all()]
    if inside:
        one, other = (assembly.blocks[k].id for k in inside[0])
        more = f" (and {len(inside) - 1} more)" if len(inside) > 1 else ""
        place = place_text(assembly.mass.centroid[inside[0][0]])
        raise InputError(
            f"block '{one}' is inside block '{other}' near {place} and touches it nowhere{more};"
            " two stones cannot be in one place: leave one out, or draw the hollow"
        )


def _inside(assembly: Assembly, block: int, other: int) -> Bools:
    """(k,) whether corners of a block are inside another."""
    mesh = bodies_of(assembly.mesh, np.array([other]))
    corner = mesh.vertex[triangles(mesh)[0]]
    points = assembly.blocks[block].vertices
    some = points[np.linspace(0, len(points) - 1, min(SAMPLES, len(points))).astype(int)]
    return np.array([solid_angles(corner - point).sum() > 0.5 for point in some])
