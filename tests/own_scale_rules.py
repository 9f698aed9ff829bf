"""The rules of a state and of a mechanism, stone by stone, in fractions: slow, plain, and without the program's code.

For tests of solvers. w_i = rho_i V_i |g| (9.80665 where gravity is zero), D_i the diagonal of a block's box; a
component is what contacts join of the free blocks. Square roots are rounded to the strict side.
"""

import math
from collections.abc import Iterator
from fractions import Fraction
from itertools import pairwise
from typing import Any

Vec = tuple[Fraction, Fraction, Fraction]
ZERO: Vec = (Fraction(0), Fraction(0), Fraction(0))


def vec(row: Any) -> Vec:
    return tuple(Fraction(float(x)) for x in row)  # type: ignore[return-value]


def add(a: Vec, b: Vec) -> Vec:
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


def sub(a: Vec, b: Vec) -> Vec:
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def times(s: Fraction, a: Vec) -> Vec:
    return (s * a[0], s * a[1], s * a[2])


def dot(a: Vec, b: Vec) -> Fraction:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Vec, b: Vec) -> Vec:
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def root(x: Fraction, up: bool) -> Fraction:
    """The square root to 1e-18 of itself, not below it (or not above it)."""
    if x <= 0:
        return Fraction(0)
    shift = max(0, 130 - (x.numerator.bit_length() - x.denominator.bit_length()))
    shift += shift % 2
    whole = (x.numerator << shift) // x.denominator
    found = math.isqrt(whole) + (1 if up else 0)
    return Fraction(found + (1 if up else 0), 1 << (shift // 2)) if up else Fraction(found, 1 << (shift // 2))


class Rules:
    """The model in fractions."""

    def __init__(self, model: Any) -> None:
        """Take a `PreparedModel`: assembly, contacts, fixed, gravity, density."""
        self.assembly, self.contacts = model.assembly, model.contacts
        self.free = [i for i in range(len(model.assembly)) if not model.fixed[i]]
        g = vec(model.gravity)
        standard = Fraction(9.80665) ** 2
        size2 = dot(g, g) or standard
        self.force, self.moment, self.centre, self.weight, self.diagonal, self.total = {}, {}, {}, {}, {}, {}
        for i in self.free:
            block = model.assembly.blocks[i]
            volume, first = solid(block)
            mass = Fraction(float(model.density if block.density is None else block.density)) * volume
            self.centre[i] = times(1 / volume, first)
            self.weight[i] = root(mass * mass * size2, up=False)
            low = [min(c) for c in zip(*block.vertices.tolist(), strict=True)]
            high = [max(c) for c in zip(*block.vertices.tolist(), strict=True)]
            box = sub(vec(high), vec(low))
            self.diagonal[i] = root(dot(box, box), up=False)
            self.force[i] = times(mass, g)
            self.moment[i] = ZERO
            self.total[i] = root(mass * mass * dot(g, g), up=True)
        for load in model.assembly.loads:
            if load.block in self.force:
                push, at = vec(load.force), vec(load.point)
                i = load.block
                self.force[i] = add(self.force[i], push)
                self.moment[i] = add(self.moment[i], cross(sub(at, self.centre[i]), push))
                self.total[i] += root(dot(push, push), up=True)
        self.held = {
            i: [name in model.assembly.blocks[i].held for name in ("x", "y", "z", "rx", "ry", "rz")] for i in self.free
        }
        self.component = self._components()
        self.points = [
            (c, vec(model.contacts.point[k]))
            for c in range(len(model.contacts))
            for k in range(model.contacts.start[c], model.contacts.start[c + 1])
        ]
        self.mu = [Fraction(float(mu)) for mu in model.contacts.mu]
        self.pull = [Fraction(float(t)) for t in model.contacts.pull]
        self.normal = [area_vector(model.contacts.polygon(c)) for c in range(len(model.contacts))]

    def _components(self) -> dict[int, int]:
        above = {i: i for i in self.free}

        def top(i: int) -> int:
            while above[i] != i:
                i = above[i]
            return i

        for a, b in zip(self.contacts.a.tolist(), self.contacts.b.tolist(), strict=True):
            if a in above and b in above:
                above[top(a)] = top(b)
        return {i: top(i) for i in self.free}

    def state(self, used: Any, high: Any, low: Any, limit: float = 1e-9) -> str:
        """ "" if the forces at the used points are a state, else what is wrong."""
        squares: dict[int, Fraction] = {}
        for k, f in self.forces(used, high, low):
            c = self.points[k][0]
            a, b, mu, normal = int(self.contacts.a[c]), int(self.contacts.b[c]), self.mu[c], self.normal[c]
            size = root(dot(normal, normal), up=False)
            pressed = add(f, times(self.pull[k] / size, normal)) if self.pull[k] else f
            along = dot(pressed, normal)
            if along < 0 or (mu and dot(pressed, pressed) * dot(normal, normal) > (1 + mu * mu) * along * along):
                return f"point {k} is outside its cone"
            here = self.component[a if a in self.force else b]
            squares[here] = squares.get(here, Fraction(0)) + dot(f, f)
        for here, square in squares.items():
            whole = sum((self.total[i] for i in self.free if self.component[i] == here), Fraction(0))
            if square > (10**6 * whole) ** 2:
                return "forces beyond the cap"
        for i, row in zip(self.free, self._left(used, high, low), strict=True):
            most = Fraction(limit) * self.weight[i]
            if dot(row[:3], row[:3]) > most**2 or dot(row[3:], row[3:]) > (most * self.diagonal[i]) ** 2:
                return f"block {i}: {[float(x) for x in row]} beyond {limit} of its weight"
        return ""

    def forces(self, used: Any, high: Any, low: Any) -> Iterator[tuple[int, Vec]]:
        """Point and force on block b; without friction a row holds one number, that of the area vector."""
        for row, k in enumerate(used.tolist()):
            c = self.points[k][0]
            f = vec(high[row]) if low is None else add(vec(high[row]), vec(low[row]))
            assert self.mu[c] or not (f[1] or f[2])
            yield k, f if self.mu[c] else times(f[0], self.normal[c])

    def residuals(self, used: Any, high: Any, low: Any) -> list[list[float]]:
        """(free blocks, 6) N, N m about the own centre."""
        return [[float(x) for x in row] for row in self._left(used, high, low)]

    def _left(self, used: Any, high: Any, low: Any) -> list[Any]:
        force, moment = dict(self.force), dict(self.moment)
        for k, f in self.forces(used, high, low):
            c, point = self.points[k]
            for i, pull in ((int(self.contacts.a[c]), times(Fraction(-1), f)), (int(self.contacts.b[c]), f)):
                if i in force:
                    force[i] = add(force[i], pull)
                    moment[i] = add(moment[i], cross(sub(point, self.centre[i]), pull))
        rows = [(self.held[i], (*force[i], *moment[i])) for i in self.free]
        return [tuple(Fraction(0) if h else x for h, x in zip(held, row, strict=True)) for held, row in rows]

    def mechanism(self, motion: Any) -> bool:
        """Whether (free blocks, 6) m/s, rad/s of their centres of mass prove collapse of some component."""
        v = {i: vec(row[:3]) for i, row in zip(self.free, motion, strict=True)}
        w = {i: vec(row[3:]) for i, row in zip(self.free, motion, strict=True)}
        for i in self.free:
            if any(h and x for h, x in zip(self.held[i], (*v[i], *w[i]), strict=True)):
                return False
        against: dict[int, Fraction] = {}
        pulls: dict[int, tuple[Fraction, Fraction]] = {}
        for k, (c, point) in enumerate(self.points):
            a, b, normal = int(self.contacts.a[c]), int(self.contacts.b[c]), self.normal[c]
            if a not in v and b not in v:
                continue
            p, q = (add(v[i], cross(w[i], sub(point, self.centre[i]))) if i in v else ZERO for i in (a, b))
            here = self.component[a if a in v else b]
            against[here] = against.get(here, Fraction(0)) + pressed2(sub(p, q), normal, self.mu[c])
            work, size = pulls.get(here, (Fraction(0), Fraction(0)))
            opening = dot(sub(q, p), normal) / root(dot(normal, normal), up=False)
            pulls[here] = (work + self.pull[k] * opening, size + abs(self.pull[k]))
        for here in set(self.component.values()):
            members = [i for i in self.free if self.component[i] == here]
            power = sum((dot(self.force[i], v[i]) + dot(self.moment[i], w[i]) for i in members), Fraction(0))
            work, size = pulls.get(here, (Fraction(0), Fraction(0)))
            whole = sum((self.total[i] for i in members), size)
            speed = {i: root(dot(v[i], v[i]), True) + self.diagonal[i] * root(dot(w[i], w[i]), True) for i in members}
            slow = min(self.weight[i] for i in members) * sum(speed.values(), Fraction(0))
            need = 10**6 * whole * root(against.get(here, Fraction(0)), True) + Fraction(1000001, 10**15) * slow
            if power - work > need:
                return True
        return False


def solid(block: Any) -> tuple[Fraction, Vec]:
    corner = [vec(row) for row in block.vertices]
    origin = corner[0]
    volume, first = Fraction(0), ZERO
    for face in block.faces:
        for i, j in pairwise(face[1:]):
            a, b, c = (sub(corner[k], origin) for k in (face[0], i, j))
            six = dot(a, cross(b, c))
            volume += six / 6
            first = add(first, times(six / 24, add(add(a, b), c)))
    return volume, add(first, times(volume, origin))


def area_vector(polygon: Any) -> Vec:
    ring = [vec(row) for row in polygon]
    found = ZERO
    for p, q in pairwise(ring[1:]):
        found = add(found, cross(sub(p, ring[0]), sub(q, ring[0])))
    return found


def pressed2(x: Vec, normal: Vec, mu: Fraction) -> Fraction:
    """|P(x)|^2, P onto the friction cone, not below it by more than rounding to 1e-18."""
    n2 = dot(normal, normal)
    size = root(n2, True)
    along = dot(x, normal) / size
    across = root(dot(x, x) - dot(x, normal) ** 2 / n2, True)
    m = mu
    if along >= 0 and across <= m * along:
        return dot(x, x)
    if dot(x, normal) + m * across * size <= 0:
        return Fraction(0)
    return (along + m * across) ** 2 / (1 + m * m)
