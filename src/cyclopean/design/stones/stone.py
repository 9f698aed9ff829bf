"""One stone: a closed triangle mesh in its own frame, and what is measured of it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from cyclopean.arrays import Floats, Ints, sealed
from cyclopean.errors import InputError
from cyclopean.geometry import mass_properties, pack
from cyclopean.representation import one_line

__all__ = ["Stone", "in_body_frame", "stone_of"]

SPECK = 1e-9  # m: a stone that is thinner is none, and its products would leave double precision


@dataclass(frozen=True, slots=True, eq=False)
class Stone:
    """A found stone. Its frame is that of the file it came from; its body frame has its centroid as origin.

    A point x of the stone has the body coordinates axes (x - centroid).
    """

    __repr__ = one_line

    id: str
    vertices: Floats  # (v, 3) m, stone frame
    triangles: Ints  # (t, 3) counter-clockwise from outside
    volume: float  # m3
    centroid: Floats  # (3,) m, stone frame
    axes: Floats  # (3, 3) rows: principal axes in the stone frame, longest extent first, right-handed
    half: Floats  # (3,) m: semi-axes of the solid ellipsoid of the same inertia, longest first
    hull_volume: float  # m3
    area: float  # m2 of the surface
    density: float | None = None  # kg/m3; None = not said


def stone_of(name: str, vertices: ArrayLike, triangles: ArrayLike, density: float | None = None) -> Stone:
    """Measure a closed, outward triangle mesh.

    The axes are the eigenvectors of the inertia about the centroid, and each points to the side on which the stone
    reaches farther, so that they turn with the stone and do not depend on how it was triangulated.

    Raises
    ------
    InputError
        The mesh encloses no positive volume, is thinner than a nanometre, or a triangle names a vertex that is not
        there.
    """
    point = sealed(f"stone '{name}': vertices", vertices, None, 3)
    corner = sealed(f"stone '{name}': triangles", triangles, None, 3, dtype=np.int64)
    if corner.size and not (0 <= corner.min() and corner.max() < len(point)):
        raise InputError(f"stone '{name}': a triangle names a vertex that is not there; there are {len(point)}")
    mass = mass_properties(pack([(point, corner)]))
    volume = float(mass.volume[0])
    if not volume > 0.0:
        raise InputError(f"stone '{name}': encloses no volume; its mesh must be closed and its faces face outwards")
    value, vector = np.linalg.eigh(mass.spread[0])
    half = np.sqrt(5.0 * np.maximum(value[::-1], 0.0) / volume)
    if not half[2] > SPECK:
        raise InputError(f"stone '{name}': is thinner than {SPECK:g} m; check the units")
    axes = _directed(vector[:, ::-1].T, point - mass.centroid[0])
    edge = point[corner]
    area = float(np.linalg.norm(np.cross(edge[:, 1] - edge[:, 0], edge[:, 2] - edge[:, 0]), axis=1).sum() / 2.0)
    return Stone(
        name,
        point,
        corner,
        volume,
        sealed("centroid", mass.centroid[0], 3),
        sealed("axes", axes, 3, 3),
        sealed("half", half, 3),
        _hull_volume(name, point - mass.centroid[0]),
        area,
        density,
    )


def _hull_volume(name: str, point: Floats) -> float:
    """Volume (m3) of the convex hull, by Qhull: manifold3d's loses percents where many points are nearly in a plane."""
    from scipy.spatial import ConvexHull, QhullError

    try:
        return float(ConvexHull(point).volume)
    except QhullError:
        raise InputError(f"stone '{name}': is as flat as a sheet; a stone has a volume") from None


def _directed(axes: Floats, point: Floats) -> Floats:
    """Turn each axis to the side on which the stone reaches farther; the last one makes the frame right-handed."""
    reach = point @ axes.T
    sign = np.where(reach.max(axis=0) >= -reach.min(axis=0), 1.0, -1.0)
    turned: Floats = axes * sign[:, None]
    turned[2] = np.cross(turned[0], turned[1])
    return turned


def in_body_frame(stone: Stone) -> Floats:
    """Vertices (v, 3) in the body frame (m)."""
    placed: Floats = (stone.vertices - stone.centroid) @ stone.axes.T
    return placed
