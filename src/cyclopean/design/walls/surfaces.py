"""Surfaces that a wall's pattern is laid on: (u, v) in metres to a point and the outward unit normal.

u runs along the foot, v up the face, and the normal n = S_u x S_v points at whoever looks at the face: with u along x
and v along z the plane's normal is -y, and the wall stands behind the face at y > 0. Lengths are true along the foot
and, but for ruled and free surfaces, up the face. A positive radius bulges towards the viewer, a negative is hollow.

The stone lies between two points of each normal: the front, S - n b v, and the back, S - n d, with depth d at the foot
and batter b, so that the thickness d - b v tapers from the front. Offsets along the normal stay apart as long as
1 - d k > 0 for both principal curvatures k of S (dn = k dS): the radius of a bulge must exceed the depth.

By hand: on a cylinder of radius 2 the far side of a quarter turn lies at (2, 2) in plan; its normal points along +x.

>>> point, normal = Cylinder(2.0).at(np.array([[np.pi, 0.5]]))
>>> (point.round(12) + 0.0).tolist(), (normal.round(12) + 0.0).tolist()
([[2.0, 2.0, 0.5]], [[1.0, 0.0, 0.0]])
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike

from cyclopean.arrays import Floats, sealed
from cyclopean.design.options import finite, not_negative, positive, within
from cyclopean.errors import InputError

__all__ = [
    "Cone",
    "Cylinder",
    "Free",
    "HeightGrid",
    "Plane",
    "ReturnPlane",
    "Ruled",
    "Sheet",
    "Sphere",
    "Surface",
    "Thickness",
    "Twist",
    "refuse_folds",
    "tightest_bulge",
]

STEP = 1e-4  # of the wall's size, for differences: truncation and rounding are then both about 1e-8
SAMPLES = 25  # each way, of the search for the tightest bend


class Surface(Protocol):
    """Anything that maps (n, 2) metres to points and outward unit normals, (n, 3) each."""

    def at(self, uv: Floats) -> tuple[Floats, Floats]:
        """Points (m) and outward unit normals."""


@runtime_checkable
class Sheet(Surface, Protocol):
    """A surface that has an end, and knows itself where its offsets fold."""

    def refuse_folds(self, thickness: "Thickness") -> None:
        """Refuse a wall whose back would fold into itself, with the place."""


@dataclass(frozen=True, slots=True)
class Plane:
    """The upright plane y = 0."""

    def at(self, uv: Floats) -> tuple[Floats, Floats]:
        """Points (m) and outward unit normals, (n, 3) each."""
        u, v = np.asarray(uv, float).T
        return _columns(u, 0.0, v), _columns(0.0 * u, -1.0, 0.0)


@dataclass(frozen=True, slots=True)
class ReturnPlane:
    """The upright plane in which a wall goes on that turns back by a right angle at the right end of `Plane`."""

    x: float  # m; where the corner is

    def __post_init__(self) -> None:
        finite("return plane x", self.x)

    def at(self, uv: Floats) -> tuple[Floats, Floats]:
        """Points (m) and outward unit normals, (n, 3) each."""
        u, v = np.asarray(uv, float).T
        return _columns(0.0 * u + self.x, u, v), _columns(1.0 + 0.0 * u, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Cylinder:
    """Curved in plan, upright."""

    radius: float  # m; of the face
    middle: float = 0.0  # u at which the normal is -y (m)

    def __post_init__(self) -> None:
        _bent("cylinder radius", self.radius)
        finite("middle", self.middle)

    def at(self, uv: Floats) -> tuple[Floats, Floats]:
        """Points (m) and outward unit normals, (n, 3) each."""
        u, v = np.asarray(uv, float).T
        turn = _turn("cylinder", u - self.middle, self.radius)
        sin, cos = np.sin(turn), np.cos(turn)
        return _columns(self.middle + self.radius * sin, self.radius * (1.0 - cos), v), _columns(sin, -cos, 0.0)


@dataclass(frozen=True, slots=True)
class Cone:
    """Curved in plan, leaning towards its axis; v runs up the slope."""

    radius: float  # m; of the face at its foot
    lean: float = 10.0  # degrees from upright towards the axis
    middle: float = 0.0  # u at which the face looks along -y (m)

    def __post_init__(self) -> None:
        _bent("cone radius", self.radius)
        within("cone lean", self.lean, -80.0, 80.0)
        finite("middle", self.middle)

    def at(self, uv: Floats) -> tuple[Floats, Floats]:
        """Points (m) and outward unit normals, (n, 3) each."""
        u, v = np.asarray(uv, float).T
        lean = np.radians(self.lean) * np.sign(self.radius)  # towards the axis, wherever that is
        turn = _turn("cone", u - self.middle, self.radius)
        ring = self.radius - v * np.sin(lean)
        if not np.all(ring * np.sign(self.radius) > 0.0):
            raise InputError(f"surface: a cone of radius {self.radius:g} m ends below {v.max():g} m; let it lean less")
        sin, cos = np.sin(turn), np.cos(turn)
        point = _columns(self.middle + ring * sin, self.radius - ring * cos, v * np.cos(lean))
        return point, _columns(np.cos(lean) * sin, -np.cos(lean) * cos, np.sin(lean))


@dataclass(frozen=True, slots=True)
class Sphere:
    """Patch of a sphere; upright at its foot unless that is put at another latitude."""

    radius: float  # m; of the face
    latitude: float = 0.0  # degrees, of the foot
    middle: float = 0.0  # u at which the face looks along -y (m)

    def __post_init__(self) -> None:
        _bent("sphere radius", self.radius)
        within("sphere latitude", self.latitude, -80.0, 80.0)
        finite("middle", self.middle)

    def at(self, uv: Floats) -> tuple[Floats, Floats]:
        """Points (m) and outward unit normals, (n, 3) each."""
        u, v = np.asarray(uv, float).T
        foot = np.radians(self.latitude) * np.sign(self.radius)
        turn = _turn("sphere", u - self.middle, self.radius * np.cos(foot))
        rise = foot + v / self.radius
        if not np.all(np.abs(rise) < np.pi / 2.0):
            raise InputError(
                f"surface: a sphere of radius {self.radius:g} m ends below {v.max():g} m; make the radius larger"
            )
        ring = np.cos(rise)
        normal = _columns(ring * np.sin(turn), -ring * np.cos(turn), np.sin(rise))
        away = np.array([self.middle, self.radius * np.cos(foot), -self.radius * np.sin(foot)])
        return away + self.radius * normal, normal


Curve = Callable[[Floats], Any]


@dataclass(frozen=True, slots=True)
class Ruled:
    """Straight lines from a curve at the foot to one at the top."""

    foot: Curve  # u (n,) to x, y, z (m)
    top: Curve
    width: float  # m; where u ends
    height: float  # m; v at which the top is reached

    def __post_init__(self) -> None:
        positive("ruled width", self.width)
        positive("ruled height", self.height)

    def at(self, uv: Floats) -> tuple[Floats, Floats]:
        """Points (m) and outward unit normals, (n, 3) each."""
        return Free(self._point, self.width, self.height).at(uv)

    def _point(self, u: Floats, v: Floats) -> Any:
        share = (v / self.height)[:, None]
        return ((1.0 - share) * _columns(*self.foot(u)) + share * _columns(*self.top(u))).T


@dataclass(frozen=True, slots=True)
class Free:
    """Any smooth surface, as a function of u and v; normals from differences."""

    point: Callable[[Floats, Floats], Any]  # u (n,), v (n,) to x, y, z (m)
    width: float  # m; the function is asked for 0..width and 0..height only
    height: float  # m

    def __post_init__(self) -> None:
        positive("surface width", self.width)
        positive("surface height", self.height)

    def at(self, uv: Floats) -> tuple[Floats, Floats]:
        """Points (m) and outward unit normals, (n, 3) each."""
        u, v = np.asarray(uv, float).T
        step = STEP * float(np.hypot(self.width, self.height))
        a, b = np.clip(u - step, 0.0, self.width), np.clip(u + step, 0.0, self.width)
        along = self._sampled(b, v) - self._sampled(a, v)
        a, b = np.clip(v - step, 0.0, self.height), np.clip(v + step, 0.0, self.height)
        up = self._sampled(u, b) - self._sampled(u, a)
        normal = np.cross(along, up)
        length = np.linalg.norm(normal, axis=1)
        flat = ~(length > 1e-9 * np.linalg.norm(along, axis=1) * np.linalg.norm(up, axis=1)) | ~(length > 0.0)
        if (bad := np.flatnonzero(flat)).size:
            raise InputError(
                f"surface: it has no normal at u = {u[bad[0]]:g}, v = {v[bad[0]]:g} m; make it regular there"
            )
        return self._sampled(u, v), normal / length[:, None]

    def _sampled(self, u: Floats, v: Floats) -> Floats:
        answer = self.point(u, v)
        if len(answer) != 3:
            raise InputError(f"surface: expected x, y, z for every u, v, got {len(answer)} rows")
        return sealed("surface", _columns(*answer, like=u), len(u), 3)


@dataclass(frozen=True, slots=True)
class Twist:
    """Straight foot, and a straight top turned in plan about the middle; ruled between."""

    degrees: float  # of the top, counter-clockwise seen from above
    width: float  # m
    height: float  # m

    def __post_init__(self) -> None:
        within("twist", self.degrees, -80.0, 80.0)
        positive("surface width", self.width)
        positive("surface height", self.height)

    def at(self, uv: Floats) -> tuple[Floats, Floats]:
        """Points (m) and outward unit normals, (n, 3) each."""
        return Ruled(lambda u: (u, 0.0, 0.0), self._top, self.width, self.height).at(uv)

    def _top(self, u: Floats) -> tuple[Floats, Floats, float]:
        cos, sin = np.cos(np.radians(self.degrees)), np.sin(np.radians(self.degrees))
        middle = self.width / 2.0
        return middle + (u - middle) * cos, (u - middle) * sin, self.height


@dataclass(frozen=True, slots=True, eq=False)
class HeightGrid:
    """How far (m) the face stands out towards the viewer, on a regular grid; bicubic between."""

    relief: Floats  # (rows, columns) m; rows from the foot up, columns along it
    width: float  # m
    height: float  # m
    spline: Any = field(init=False, repr=False)

    def __post_init__(self) -> None:
        from scipy.interpolate import RectBivariateSpline

        positive("surface width", self.width)
        positive("surface height", self.height)
        relief = sealed("surface", self.relief, None, None)
        if min(relief.shape) < 2:
            raise InputError(f"surface: a height grid needs at least 2 x 2 values, got {relief.shape}")
        object.__setattr__(self, "relief", relief)
        v, u = (np.linspace(0.0, s, n) for s, n in zip((self.height, self.width), relief.shape, strict=True))
        order = [min(3, n - 1) for n in relief.shape]
        object.__setattr__(self, "spline", RectBivariateSpline(v, u, relief, kx=order[0], ky=order[1]))

    def at(self, uv: Floats) -> tuple[Floats, Floats]:
        """Points (m) and outward unit normals, (n, 3) each."""
        u, v = np.asarray(uv, float).T
        out, up, along = (self.spline.ev(v, u, dx=dx, dy=dy) for dx, dy in ((0, 0), (1, 0), (0, 1)))
        normal = _columns(-along, -1.0, -up, like=u)  # S_u x S_v of S = (u, -out, v)
        return _columns(u, -out, v), normal / np.linalg.norm(normal, axis=1)[:, None]


@dataclass(frozen=True, slots=True)
class Thickness:
    """Of a wall, along the normal: `depth` at the foot, less `batter` times the height up the face."""

    depth: float = 0.2  # m
    batter: float = 0.0  # m a metre; taken off the front

    def __post_init__(self) -> None:
        positive("depth", self.depth)
        not_negative("batter", self.batter)

    def rails(self, surface: Surface, uv: ArrayLike) -> tuple[Floats, Floats]:
        """Front and back end (m) of the stone on each normal, (n, 3) each.

        Raises
        ------
        InputError
            The batter leaves nothing of the thickness.
        """
        point = sealed("uv", uv, None, 2)
        taken = self.batter * point[:, 1]
        if not np.all(taken < self.depth):
            raise InputError(
                f"batter: {self.batter:g} leaves nothing of the depth {self.depth:g} m at a height of "
                f"{point[:, 1].max():g} m; give less than {self.depth / point[:, 1].max():.3g}"
            )
        face, normal = surface.at(point)
        front = face - normal * taken[:, None] if self.batter else face
        return front, face - normal * self.depth


def tightest_bulge(surface: Surface, width: float, height: float) -> tuple[float, Floats]:
    """Least radius (m) of the bulges of a surface over 0..width, 0..height (inf: none), and (2,) u and v (m) there.

    By differences of points and normals on a grid: the largest eigenvalue of I^-1 II, II = S_i . n_j.
    """
    size = float(np.hypot(width, height))
    step = STEP * min(width, height)
    u, v = (np.linspace(step, s - step, SAMPLES) for s in (width, height))
    grid = np.stack(np.meshgrid(u, v), -1).reshape(-1, 2)
    along, up = np.array([step, 0.0]), np.array([0.0, step])
    ahead, behind = ([surface.at(grid + s * d) for d in (along, up)] for s in (1.0, -1.0))
    face = [(a[0] - b[0]) / (2.0 * step) for a, b in zip(ahead, behind, strict=True)]
    turn = [(a[1] - b[1]) / (2.0 * step) for a, b in zip(ahead, behind, strict=True)]
    first = np.array([[(a * b).sum(1) for b in face] for a in face]).transpose(2, 0, 1)
    second = np.array([[(a * b).sum(1) for b in turn] for a in face]).transpose(2, 0, 1)
    bends = np.linalg.eigvals(np.linalg.solve(first, second)).real.max(axis=1)
    bend, place = float(bends.max()), grid[int(bends.argmax())]
    return 1.0 / bend if bend > 1e-7 / size else np.inf, place


def refuse_folds(surface: Surface, thickness: Thickness, width: float, height: float) -> None:
    """Refuse a wall whose back would fold into itself.

    Raises
    ------
    InputError
        The surface bulges with a radius that does not exceed the depth.
    """
    if isinstance(surface, Sheet):
        return surface.refuse_folds(thickness)
    radius, (u, v) = tightest_bulge(surface, width, height)
    if not radius > thickness.depth * (1.0 + 1e-6):
        raise InputError(
            f"surface: it bends with a radius of {radius:.3g} m at u = {u:.3g}, v = {v:.3g} m, not more than the "
            f"wall's depth {thickness.depth:g} m; bend it less or make the wall thinner"
        )


def _columns(*parts: Any, like: Floats | None = None) -> Floats:
    wide = np.broadcast_arrays(*parts, *(() if like is None else (like,)))[:3]
    return np.stack([np.asarray(p, float) for p in wide], 1)


def _bent(name: str, radius: float) -> None:
    if finite(name, radius) == 0.0:
        raise InputError(f"{name}: must not be 0; positive bulges towards the viewer, negative is hollow")


def _turn(name: str, along: Floats, radius: float) -> Floats:
    """Angle of each point round the axis (radians)."""
    turn = along / radius
    if not np.all(np.abs(turn) < np.pi):
        raise InputError(
            f"surface: a {name} with a foot of radius {abs(radius):g} m closes on itself before "
            f"{2.0 * np.abs(along).max():g} m; make the radius larger"
        )
    return np.asarray(turn)
