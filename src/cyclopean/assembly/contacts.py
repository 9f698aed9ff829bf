"""Contact patches between blocks, packed."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from cyclopean.arrays import Floats, Ints, sealed
from cyclopean.errors import InputError
from cyclopean.geometry import frames_from_normals, newell_normals

__all__ = ["Contacts"]


@dataclass(frozen=True, slots=True, eq=False)
class Contacts:
    """Planar contact polygons, one row each (c rows, P points in all), in a fixed order.

    Patch k joins blocks a[k] and b[k] and has the points `point[start[k]:start[k + 1]]`, counter-clockwise about the
    normal n that points from `a` into `b`. Every point can carry one force; what `b` feels, `a` feels the opposite of.
    """

    a: Ints  # (c,) block index
    b: Ints  # (c,) block index
    start: Ints  # (c + 1,) offsets into point
    point: Floats  # (P, 3) m, world
    mu: Floats  # (c,) Coulomb coefficient, NaN = not given

    def __post_init__(self) -> None:
        for name in ("a", "b"):
            object.__setattr__(self, name, sealed(f"contacts {name}", getattr(self, name), None, dtype=np.int64))
        c = len(self.a)
        object.__setattr__(self, "b", sealed("contacts b", self.b, c, dtype=np.int64))
        object.__setattr__(self, "start", sealed("contacts start", self.start, c + 1, dtype=np.int64))
        object.__setattr__(self, "point", sealed("contacts point", self.point, None, 3))
        object.__setattr__(self, "mu", sealed("contacts mu", self.mu, c, nan=True))
        if (bad := np.flatnonzero(np.diff(self.start) < 3)).size:
            raise InputError(f"contact {bad[0]}: its polygon has fewer than 3 points")
        if self.start[0] != 0 or self.start[-1] != len(self.point):
            raise InputError("contacts: offsets do not cover the points")
        if (bad := np.flatnonzero(self.a == self.b)).size:
            raise InputError(f"contact {bad[0]}: joins a block to itself")
        if (bad := np.flatnonzero(self.mu < 0)).size:
            raise InputError(f"contact {bad[0]}: mu {self.mu[bad[0]]:g} must not be negative")

    def __len__(self) -> int:
        return len(self.a)

    @classmethod
    def of(
        cls,
        pairs: Sequence[tuple[int, int]],
        polygons: Sequence[Floats],
        mu: Sequence[float | None] | None = None,
    ) -> "Contacts":
        """Pack a list of (a, b) pairs and one (k, 3) polygon each; mu None = not given."""
        ends = np.asarray(pairs, np.int64).reshape(-1, 2)
        start = np.concatenate([[0], np.cumsum([len(p) for p in polygons], dtype=np.int64)]).astype(np.int64)
        point = np.concatenate([np.asarray(p, float).reshape(-1, 3) for p in polygons] or [np.zeros((0, 3))])
        given = [np.nan] * len(polygons) if mu is None else [np.nan if m is None else float(m) for m in mu]
        return cls(ends[:, 0], ends[:, 1], start, point, np.asarray(given, float))

    @property
    def patch(self) -> Ints:
        """(P,) patch of each point."""
        return np.repeat(np.arange(len(self)), np.diff(self.start))

    @property
    def area(self) -> Floats:
        """(c,) m2."""
        return np.asarray(np.linalg.norm(newell_normals(self.point, self.start), axis=1) / 2.0)

    @property
    def frame(self) -> Floats:
        """(c, 3, 3) rows n, u, v: right-handed, orthonormal, n from `a` into `b`."""
        normal = newell_normals(self.point, self.start)
        length = np.linalg.norm(normal, axis=1)
        if (bad := np.flatnonzero(~(length > 0.0))).size:
            raise InputError(f"contact {bad[0]}: its polygon has no area")
        return frames_from_normals(normal / length[:, None])

    def polygon(self, k: int) -> Floats:
        """(m, 3) points of patch k."""
        return self.point[self.start[k] : self.start[k + 1]]

    def with_mu(self, mu: float) -> "Contacts":
        """Fill in `mu` where none is given."""
        return replace(self, mu=np.where(np.isnan(self.mu), mu, self.mu))
