"""Whether a model stands throughout a box of values: a proof by a few corners.

By rigid-block equilibrium three things hold. Forces that are admissible with less friction are so with more. Forces on
a worn joint are forces on the whole one. And loads for which a state exists form a convex cone, so that a state exists
for every load between loads that have one. So the least friction and the deepest wear are the worst, and of densities
and tilts only the corners of a polyhedron around them matter. None of this holds for coupled analysis.

Tilts up to theta towards any azimuth are gravities in a round cone; it lies inside the pyramid with `SIDES` edges at
the angle theta', tan theta' = tan theta / cos(pi / SIDES).
"""

from dataclasses import replace
from itertools import product

import numpy as np

from cyclopean.analysis.preparation import PreparedModel
from cyclopean.analysis.sensitivity_study.ranges import Range, varied
from cyclopean.arrays import Floats
from cyclopean.statics import turned_gravity

__all__ = ["corners"]

SIDES = 16  # of the pyramid: 2 % more tilt than the cone
TOO_MANY = 256  # corners: each is a check


def corners(model: PreparedModel, ranges: tuple[Range, ...]) -> list[PreparedModel] | None:
    """Models that prove, if each of them stands by rigid-block equilibrium, that all within the ranges do.

    Parameters
    ----------
    model : PreparedModel
        As it was said.
    ranges : tuple of Range
        What varies. Densities that are drawn block by block have a corner for every choice of ends.

    Returns
    -------
    list of PreparedModel or None
        None where they would be more than 256, where gravity that is not vertical is to be tilted, and where joints
        that pull are worn: what is left of them pulls elsewhere.
    """
    span = {r.quantity: r for r in ranges}
    if "tilt" in span and model.gravity[:2].any():
        return None  # turned about horizontal axes it sweeps no round cone
    if "joints" in span and model.contacts.strength.any():
        return None
    worst: dict[str, Floats] = {name: np.array([span[name].low]) for name in ("mu", "mu-each") if name in span}
    if "joints" in span:
        worst["joints"] = np.full(len(model.contacts), span["joints"].high)
    weights = _weights(model, span)
    if weights is None:
        return None
    gravities = _gravities(model.gravity, span.get("tilt"), alone=_scales(model))
    if len(weights) * len(gravities) > TOO_MANY:
        return None
    return [
        replace(case, gravity=gravity)
        for case in (varied(model, worst | density) for density in weights)
        for gravity in gravities
    ]


def _scales(model: PreparedModel) -> bool:
    """Whether states go with the size of gravity: nothing but weight acts, and no joint has a strength of its own."""
    return not model.assembly.loads and not model.contacts.strength.any()


def _weights(model: PreparedModel, span: dict[str, Range]) -> list[dict[str, Floats]] | None:
    """Densities at the corners."""
    if "density" in span:
        whole = span["density"]
        ends = {whole.high} if _scales(model) else {whole.low, whole.high}
        return [{"density": np.array([end])} for end in sorted(ends)]
    if "density-each" not in span:
        return [{}]
    each, free = span["density-each"], np.flatnonzero(~model.fixed)
    if 2.0 ** len(free) > TOO_MANY:
        return None
    found = []
    for choice in product(sorted({each.low, each.high}), repeat=len(free)):
        density = np.full(len(model.assembly), each.low)
        density[free] = choice
        found.append({"density-each": density})
    return found


def _gravities(gravity: Floats, tilt: Range | None, alone: bool) -> list[Floats]:
    """Gravities at the corners; `alone` = there are no loads but weight, so that their size does not matter."""
    if tilt is None or tilt.high == 0.0:
        return [gravity]
    beyond = np.arctan(np.tan(np.deg2rad(tilt.high)) / np.cos(np.pi / SIDES))
    rim = [turned_gravity(gravity, float(np.rad2deg(beyond)), azimuth) for azimuth in np.arange(SIDES) * 360.0 / SIDES]
    if alone:
        return rim
    # the cap lies between two slices of the pyramid: one at its top, one as low as the cap's rim
    top, low = 1.0 / np.cos(beyond), np.cos(np.deg2rad(tilt.high)) / np.cos(beyond)
    return [g * size for g in rim for size in (top, low)]
