"""Contact patches between blocks, packed."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from cyclopean.arrays import Bools, Floats, Ints, sealed
from cyclopean.errors import InputError
from cyclopean.geometry import following, frames_from_normals, newell_normals, offsets, ragged
from cyclopean.representation import one_line

__all__ = ["UNIT", "Contacts"]

NONE = np.full(3, np.nan)  # the normal that a polygon has by itself
EACH = ("a", "b", "mu", "tension", "lean", "facing")  # fields of which each contact has one
UNIT = 1e-9  # by which the length of a normal may differ from 1: a text of ten digits does


@dataclass(frozen=True, slots=True, eq=False)
class Contacts:
    """Planar contact polygons, one row each (c rows, P points in all), in a fixed order.

    Patch k joins blocks a[k] and b[k] and has the points `point[start[k]:start[k + 1]]`, counter-clockwise about the
    normal n that points from `a` into `b`. Every point can carry one force; what `b` feels, `a` feels the opposite of.
    Where a corner of a block touches the other, or edges cross, there is a single point, and `facing` gives n.
    """

    __repr__ = one_line

    a: Ints  # (c,) block index
    b: Ints  # (c,) block index
    start: Ints  # (c + 1,) offsets into point
    point: Floats  # (P, 3) m, world
    mu: Floats  # (c,) Coulomb coefficient, NaN = not given
    tension: Floats | None = None  # (c,) Pa that the joint may pull, NaN = not given; None = all not given
    lean: Floats | None = None  # (c,) rad by which rough or curved faces lean from n; NaN = flat; None = all flat
    facing: Floats | None = None  # (c, 3) unit normal of single points; NaN = a polygon; None = all are polygons

    def __post_init__(self) -> None:
        object.__setattr__(self, "a", sealed("contacts a", self.a, None, dtype=np.int64))
        c = len(self.a)
        for name, count in (("b", c), ("start", c + 1)):
            object.__setattr__(self, name, sealed(f"contacts {name}", getattr(self, name), count, dtype=np.int64))
        object.__setattr__(self, "point", sealed("contacts point", self.point, None, 3))
        for name in ("mu", "tension", "lean"):
            value = np.full(c, np.nan) if getattr(self, name) is None else getattr(self, name)
            object.__setattr__(self, name, sealed(f"contacts {name}", value, c, nan=True))
        facing = np.full((c, 3), np.nan) if self.facing is None else self.facing
        object.__setattr__(self, "facing", sealed("contacts facing", facing, c, 3, nan=True))
        for name, value in (("tension", self.strength_given), ("mu", self.mu)):
            if (bad := np.flatnonzero(value < 0)).size:
                raise InputError(f"contact {bad[0]}: {name} {value[bad[0]]:g} must not be negative")
        points, alone = np.diff(self.start), self.at_points
        if (bad := np.flatnonzero(np.where(alone, points != 1, points < 3))).size:
            said = "has more points than one" if alone[bad[0]] else "has fewer than 3 points"
            raise InputError(f"contact {bad[0]}: its polygon {said}")
        if (bad := np.flatnonzero(~(np.abs(np.linalg.norm(self.normal_given[alone], axis=1) - 1.0) <= UNIT))).size:
            raise InputError(f"contact {np.flatnonzero(alone)[bad[0]]}: its normal is not of length 1")
        if self.start[0] != 0 or self.start[-1] != len(self.point):
            raise InputError("contacts: offsets do not cover the points")
        if (bad := np.flatnonzero(self.a == self.b)).size:
            raise InputError(f"contact {bad[0]}: joins a block to itself")

    def __len__(self) -> int:
        return len(self.a)

    @classmethod
    def of(
        cls,
        pairs: Sequence[tuple[int, int]] | Ints,
        polygons: Sequence[Floats],
        mu: Sequence[float | None] | Floats | None = None,
        tension: Sequence[float | None] | Floats | None = None,
        lean: Sequence[float | None] | Floats | None = None,
        facing: Sequence[Floats | None] | Floats | None = None,
    ) -> "Contacts":
        """Pack a list of (a, b) pairs and one (k, 3) polygon each; mu or tension None = not given, lean None = flat.

        `facing` is the normal of each contact at a single point, None of a polygon.
        """
        ends = np.asarray(pairs, np.int64).reshape(-1, 2)
        start = offsets([len(p) for p in polygons])
        point = np.concatenate([np.zeros((0, 3)), *(np.asarray(p, float).reshape(-1, 3) for p in polygons)])

        def filled(values: Sequence[float | None] | Floats | None) -> Floats:
            given = [None] * len(polygons) if values is None else values
            return np.array([np.nan if x is None else float(x) for x in given], float)

        return cls(
            ends[:, 0],
            ends[:, 1],
            start,
            point,
            filled(mu),
            filled(tension),
            filled(lean),
            None if facing is None else np.array([NONE if x is None else x for x in facing], float).reshape(-1, 3),
        )

    @property
    def patch(self) -> Ints:
        """(P,) patch of each point."""
        return np.repeat(np.arange(len(self)), np.diff(self.start))

    @property
    def area(self) -> Floats:
        """(c,) m2; 0 of a single point."""
        return np.asarray(np.linalg.norm(newell_normals(self.point, self.start), axis=1) / 2.0)

    @property
    def scale(self) -> Floats:
        """(c,) m2: length of what stands for a contact's normal in a proof: twice the area; 1 of a point."""
        return np.where(self.at_points, 1.0, 2.0 * self.area)

    @property
    def perimeter(self) -> Floats:
        """(c,) m."""
        if not len(self):
            return np.zeros(0)
        side = np.linalg.norm(self.point[following(self.start)] - self.point, axis=1)
        return np.asarray(np.add.reduceat(side, self.start[:-1]))

    @property
    def frame(self) -> Floats:
        """(c, 3, 3) rows n, u, v: right-handed, orthonormal, n from `a` into `b`."""
        normal = np.where(self.at_points[:, None], self.normal_given, newell_normals(self.point, self.start))
        length = np.linalg.norm(normal, axis=1)
        if (bad := np.flatnonzero(~(length > 0.0))).size:
            raise InputError(f"contact {bad[0]}: its polygon has no area")
        return frames_from_normals(normal / length[:, None])

    @classmethod
    def joined(cls, parts: Sequence["Contacts"]) -> "Contacts":
        """The patches of several (one at least), one after the other."""
        whole = {name: np.concatenate([getattr(part, name) for part in parts]) for name in ("point", *EACH)}
        return cls(start=offsets(np.concatenate([np.diff(part.start) for part in parts])), **whole)

    def polygon(self, k: int) -> Floats:
        """(m, 3) points of patch k."""
        return self.point[self.start[k] : self.start[k + 1]]

    def only(self, which: Ints) -> "Contacts":
        """Patches of these numbers, in this order."""
        each = {name: getattr(self, name)[which] for name in EACH}
        start, point = offsets(np.diff(self.start)[which]), self.point[ragged(self.start, which)[1]]
        return Contacts(start=start, point=point, **each)

    def surface(self, k: int) -> dict[str, object]:
        """What a file says of the surface of patch k."""
        if self.at_points[k]:
            return {"surface": "point", "normal": self.normal_given[k].tolist()}
        return {} if np.isnan(self.leaning[k]) else {"surface": "rough"}

    def with_mu(self, mu: float) -> "Contacts":
        """Fill in `mu` where none is given."""
        return replace(self, mu=np.where(np.isnan(self.mu), mu, self.mu))

    def with_tension(self, tension: float) -> "Contacts":
        """Fill in `tension` (Pa) where none is given."""
        return replace(self, tension=np.where(np.isnan(self.strength_given), tension, self.strength_given))

    @property
    def strength_given(self) -> Floats:
        """(c,) Pa that each joint may pull as given, NaN = not given."""
        assert self.tension is not None
        return self.tension

    @property
    def leaning(self) -> Floats:
        """(c,) rad by which the faces of each joint may lean from its normal; NaN = they are flat, and may not."""
        assert self.lean is not None
        return self.lean

    @property
    def at_points(self) -> Bools:
        """(c,) where blocks touch with a corner or an edge of one of them, and not with faces."""
        return np.asarray(~np.isnan(self.normal_given[:, 0]))

    @property
    def normal_given(self) -> Floats:
        """(c, 3) unit normals of contacts at points, NaN where the polygon has it."""
        assert self.facing is not None
        return self.facing

    @property
    def strength(self) -> Floats:
        """(c,) Pa that each joint may pull; 0 where nothing is said, and at points, which have no area to pull with."""
        return np.where(self.at_points, 0.0, np.nan_to_num(self.strength_given, nan=0.0))

    @property
    def shares(self) -> Floats:
        """(P,) share of its patch's area that goes with each point: they add up to 1 and keep the patch's centroid.

        With g the centroid and a_j the area of the triangle (g, r_j, r_j+1), point j has (a_j-1 + a_j) / (2 a). For an
        even stress over the patch these are forces at its corners with the same resultant, force and moment: triangle
        by triangle a third goes to each corner, and what comes to g goes on in the same proportions. A corner of a
        polygon that is not convex may have a share below zero; the resultant is exact all the same.
        """
        start, patch, alone = self.start, self.patch, self.at_points
        if not len(self):
            return np.zeros(0)
        count = np.diff(start)
        normal = newell_normals(self.point, start)
        after = following(start)
        before = np.argsort(after)

        def areas(local: Floats) -> Floats:
            turn = np.einsum("pi,pi->p", np.cross(local, local[after]), normal[patch])
            return np.asarray(turn / np.where(alone, 1.0, np.einsum("ci,ci->c", normal, normal))[patch])

        local = self.point - np.repeat(self.point[start[:-1]], count, axis=0)
        fan = areas(local)  # from the first corner
        middle = np.add.reduceat(fan[:, None] * (local + local[after]), start[:-1], axis=0) / 3.0
        around = areas(local - middle[patch])
        return np.where(alone[patch], 1.0, (around + around[before]) / 2.0)

    @property
    def pull(self) -> Floats:
        """(P,) N that each point may pull: strength x area x share."""
        return np.asarray((self.strength * self.area)[self.patch] * self.shares)
