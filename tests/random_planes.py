"""Random structures in the plane, and linear programmes of their own for what stands and what may grow.

A question is a shape of `oracle_models` with stones of up to 1 : 300 in size, a friction for each joint (none often, on
all joints or on some), dead loads on single blocks, and what grows: a push of all stones in any direction, up too, or a
force on one block. The equilibrium matrix is made here, in fractions, moments about the first corner of each block:

    A f + p + t q = 0,  f >= 0     columns n + mu t and n - mu t at both ends of a joint (n alone without friction)

HiGHS answers it in units of each block's own weight and size.
"""

import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import linprog

import cyclopean
from auditing import refused
from oracle import G
from oracle_models import PLANE_FAMILIES, Plane, leaning, patches, plane_shape, polygon_mass, solids, space, unit

CLOSE = 1e-6  # of the multiplier, or of one that is the block's own weight: bounds of each other, and HiGHS of both
MIXED = 300.0  # largest stone over smallest, by the square roots of their areas
Force = tuple[int, np.ndarray, np.ndarray]  # block, (2,) N, (2,) m


@dataclass(frozen=True, eq=False)
class Question:
    """What is asked: whether `shape` stands under gravity and `dead`, and how far `push` or `live` may grow."""

    family: str
    shape: Plane
    mu: tuple[float, ...]  # of each joint
    gravity: np.ndarray  # (2,) m/s2
    dead: tuple[Force, ...] = ()
    push: np.ndarray | None = None  # (2,) in g
    live: Force | None = None

    def document(self) -> dict[str, Any]:
        """As `cyclopean.model/1`; contacts are listed only where their frictions differ."""
        blocks = [
            {"id": f"b{k}", "vertices": v.tolist(), "faces": faces, "density": rho, "fixed": held}
            for k, ((v, faces), rho, held) in enumerate(
                zip(solids(self.shape), self.shape.density, self.shape.fixed, strict=True)
            )
        ]
        model: dict[str, Any] = {"schema": "cyclopean.model/1", "units": "m", "name": "plane", "blocks": blocks}
        if len(set(self.mu)) > 1:
            model["contacts"] = [
                {"a": f"b{a}", "b": f"b{b}", "polygon": polygon.tolist(), "mu": mu}
                for (a, b, polygon), mu in zip(patches(self.shape), self.mu, strict=True)
            ]
        middle = np.array([0.0, 0.5 * self.shape.depth, 0.0])
        model["loads"] = [
            {"block": f"b{k}", "force": space(force).tolist(), "point": (space(point) + middle).tolist()}
            for k, force, point in self.dead
        ]
        return model

    def options(self) -> dict[str, Any]:
        """Of `check`."""
        return {"mu": self.mu[0], "gravity": tuple(space(self.gravity).tolist())}

    def grows(self) -> dict[str, Any]:
        """Of `limit`, besides."""
        if self.live is None:
            assert self.push is not None
            return {"push": tuple(space(self.push).tolist())}
        block, force, point = self.live
        x, _, z = space(point).tolist()
        return {"loads": ((f"b{block}", tuple(space(force).tolist()), (x, 0.5 * self.shape.depth, z)),)}

    def unit(self) -> float:
        """The multiplier at which what grows is the weight of the block that it acts on."""
        if self.live is None:
            return 1.0
        block, force, _ = self.live
        return _weight(self.shape, block) / float(np.linalg.norm(force))


def question(seed: int) -> Question:
    """Question number `seed`."""
    rng = np.random.default_rng([seed, 29])
    family = str(rng.choice(list(PLANE_FAMILIES)))
    while True:
        shape = plane_shape(rng, family)
        area = [polygon_mass(part)[0] for part in shape.parts]
        if max(area) <= MIXED**2 * min(area):
            break
    smooth = rng.random()
    mu = np.full(len(shape.joints), rng.uniform(0.0, 1.5))
    if smooth < 0.2:
        mu[:] = 0.0
    elif smooth < 0.5:
        mu = np.where(rng.random(len(mu)) < 0.5, 0.0, rng.uniform(0.0, 1.5, len(mu)))
    asked = Question(family, shape, tuple(mu.tolist()), leaning(rng, 2) if rng.random() < 0.4 else np.array([0.0, -G]))
    if rng.random() < 0.3:
        asked = replace(asked, dead=(_force(rng, asked),))
    if rng.random() < 0.4:
        return replace(asked, live=_force(rng, asked))
    return replace(asked, push=unit(rng.choice([0.0, np.pi / 2, np.pi, -np.pi / 2, rng.uniform(0.0, 2 * np.pi)])))


def _force(rng: np.random.Generator, asked: Question) -> Force:
    """On one free block, at a point inside it, of a hundredth to a hundred times its weight."""
    shape = asked.shape
    block = int(rng.choice([k for k, held in enumerate(shape.fixed) if not held]))
    corners = shape.parts[block]
    force = _weight(shape, block) * 10.0 ** rng.uniform(-2, 2) * unit(rng.uniform(0.0, 2 * np.pi))
    return block, force, rng.dirichlet(np.ones(len(corners))) @ corners


def _weight(shape: Plane, block: int) -> float:
    """In N."""
    return polygon_mass(shape.parts[block])[0] * shape.depth * shape.density[block] * G


# --- equilibrium in fractions ----------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Programme:
    """A f + p + t q = 0 with f >= 0; rows Fx, Fz and moment of each free block, in N and N m."""

    A: list[list[Fraction]]
    p: list[Fraction]
    q: list[Fraction]
    unit: list[Fraction]  # own weight, or own weight times own size


def programme(asked: Question) -> Programme:
    """The equations of a question."""
    shape = asked.shape
    free = [k for k, held in enumerate(shape.fixed) if not held]
    row = {k: 3 * i for i, k in enumerate(free)}
    origin = {k: _exact(shape.parts[k][0]) for k in free}
    p, q = [Fraction(0)] * (3 * len(free)), [Fraction(0)] * (3 * len(free))
    units = []
    for k in free:
        mass, moment = _mass(shape.parts[k])
        dense = Fraction(shape.depth) * Fraction(shape.density[k])
        _add(p, row[k], dense, mass, moment, _exact(asked.gravity))
        if asked.push is not None:
            _add(q, row[k], dense * Fraction(G), mass, moment, _exact(asked.push))
        weight = mass * dense * Fraction(G)
        units += [weight, weight, weight * Fraction(float(np.linalg.norm(np.ptp(shape.parts[k], axis=0))))]
    for loads, into in ((asked.dead, p), (() if asked.live is None else (asked.live,), q)):
        for k, force, point in loads:
            arm = [x - o for x, o in zip(_exact(point), origin[k], strict=True)]
            _add(into, row[k], Fraction(1), Fraction(1), arm, _exact(force))
    columns = []
    for (a, b, ends, _), mu in zip(shape.joints, asked.mu, strict=True):
        (px, pz), (qx, qz) = map(_exact, ends)
        along, out = (qx - px, qz - pz), (qz - pz, px - qx)
        length = Fraction(float(np.hypot(*map(float, along))))
        ways = (Fraction(mu), -Fraction(mu)) if mu else (Fraction(0),)
        for point in map(_exact, ends):
            for way in ways:
                force = [(n + way * t) / length for n, t in zip(out, along, strict=True)]
                column = [Fraction(0)] * len(p)
                for k, sign in ((b, 1), (a, -1)):
                    if k in row:
                        arm = [x - o for x, o in zip(point, origin[k], strict=True)]
                        _add(column, row[k], Fraction(sign), Fraction(1), arm, force)
                columns.append(column)
    return Programme([list(r) for r in zip(*columns, strict=True)], p, q, units)


def _exact(vector: Sequence[float]) -> list[Fraction]:
    return [Fraction(float(x)) for x in vector]


def _add(
    into: list[Fraction], at: int, by: Fraction, size: Fraction, arm: list[Fraction], force: list[Fraction]
) -> None:
    """A force times `size`, and its moment with arms that are times `size` already."""
    into[at] += by * size * force[0]
    into[at + 1] += by * size * force[1]
    into[at + 2] += by * (arm[0] * force[1] - arm[1] * force[0])


def _mass(corner: np.ndarray) -> tuple[Fraction, list[Fraction]]:
    """Area of a polygon, and area times its centroid from the first corner."""
    origin, *others = map(_exact, corner)
    own = [[x - o for x, o in zip(point, origin, strict=True)] for point in others]
    area, moment = Fraction(0), [Fraction(0), Fraction(0)]
    for (ax, az), (bx, bz) in pairwise(own):
        twice = ax * bz - az * bx
        area += twice / 2
        moment = [moment[0] + twice * (ax + bx) / 6, moment[1] + twice * (az + bz) / 6]
    return area, moment


# --- answers -----------------------------------------------------------------------------------------------------


def by_highs(asked: Programme, grows: bool = True) -> tuple[str, float]:
    """The largest t >= 0: "limit" and t, "unbounded", "falls" (no t at all), or "failed"."""
    A = np.array([[float(x / u) for x in row] for row, u in zip(asked.A, asked.unit, strict=True)])
    p, q = (np.array([float(x / u) for x, u in zip(v, asked.unit, strict=True)]) for v in (asked.p, asked.q))
    scale = 1.0 / np.abs(A).max(axis=0)  # of the lighter block at each point
    size = 1.0 / max(1e-300, float(np.abs(q).max())) if grows else 0.0
    found = linprog(
        np.append(np.zeros(A.shape[1]), -1.0),
        A_eq=np.column_stack([A * scale, q * size]),
        b_eq=-p,
        bounds=np.column_stack(
            [np.zeros(A.shape[1] + 1), np.append(np.full(A.shape[1], np.inf), np.inf if grows else 1.0)]
        ),
        method="highs",
        options={"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10},
    )
    word = {0: "limit", 2: "falls", 3: "unbounded"}.get(found.status, "failed")
    return word, float(found.x[-1]) * size if word == "limit" else float("nan")


def judged(asked: Question, folder: Path) -> list[str]:
    """What the program says that HiGHS does not, or that it does not prove; empty where all is well."""
    path, wrong = folder / "plane.json", list[str]()
    path.write_text(json.dumps(asked.document()))
    equations = programme(asked)
    rest, grown = by_highs(equations, grows=False)[0], by_highs(equations)
    found = cyclopean.check(path, method="rbe", **asked.options())
    if found.verdict != ("unstable" if rest == "falls" else "stable"):
        wrong.append(f"check: {found.verdict}, HiGHS: {rest}")
    if missing := refused(found.certificate, "rbe-state", "rbe-mechanism"):
        wrong.append(f"check: {missing}")
    most = cyclopean.limit(path, **asked.options(), **asked.grows())
    if most.word != ("falls" if rest == "falls" else grown[0]):
        wrong.append(f"limit: {most.word} {most.lower} {most.upper}, HiGHS: {rest}, {grown}")
    elif most.word == "limit":
        assert most.lower is not None
        assert most.upper is not None
        room = CLOSE * max(abs(grown[1]), asked.unit())
        if most.upper - most.lower > room or abs(most.value - grown[1]) > room:
            wrong.append(f"limit: {most.lower} {most.upper}, HiGHS: {grown[1]}")
    if most.word in ("limit", "unbounded") and (missing := refused(most.certificate, "limit-bounds")):
        wrong.append(f"limit: {missing}")
    return wrong
