"""A second opinion on a certificate, in floats and with nothing of the checker: does the file prove its claim?

A damaged file may still be a proof, if of another model: lower friction does not heal a mechanism. `conditions`
rebuilds the model from the file with the code of the analysis and returns the worst miss of what its kind requires, 0
or less for a proof. Only conditions that every proof meets are used, so a positive miss convicts the checker. It does
not look at meshes, or at whether contacts lie on their blocks.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import islice, pairwise
from typing import Any

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from cyclopean.analysis import Bounds, measure
from cyclopean.assembly import Assembly, Block, Contacts, Load
from cyclopean.statics import EquilibriumSystem, equilibrium_system

ALLOWED = 1e-9  # what the format allows a state to miss
ROUNDING = 1e-10  # ... and our floats


@dataclass(frozen=True)
class Zone:
    """What a cell of a tree assumes of one point: status, directions between two unit rays of (u, v), speeds."""

    status: str
    rays: tuple[np.ndarray, np.ndarray] | None
    slow: float
    fast: float


def rebuilt(certificate: Mapping[str, Any]) -> tuple[EquilibriumSystem, list[str]]:
    """The scaled equilibrium system of a certificate's model, and the names of its free blocks."""
    names = [b["id"] for b in certificate["blocks"]]
    blocks = [
        Block(b["id"], np.array(b["vertices"], float), b["faces"], b["density"], b["fixed"])
        for b in certificate["blocks"]
    ]
    joints = certificate["contacts"]
    contacts = Contacts.of(
        [(names.index(c["a"]), names.index(c["b"])) for c in joints],
        [np.array(c["polygon"], float) for c in joints],
        [c["mu"] for c in joints],
    )
    loads = [
        Load(names.index(load["block"]), np.array(load["force"], float), np.array(load["point"], float))
        for load in certificate["loads"]
    ]
    fixed = np.array([b["fixed"] for b in certificate["blocks"]], bool)
    model = Assembly(tuple(blocks), contacts, tuple(loads))
    system = equilibrium_system(model, contacts, fixed, np.array(certificate["gravity"], float), 1.0)
    assert len(system.used) == len(contacts.point)
    return system, [names[i] for i in system.free]


def conditions(certificate: Mapping[str, Any]) -> float:
    """How far the file misses what its kind requires; nothing positive for a proof."""
    system, names = rebuilt(certificate)
    kind = certificate["kind"]
    if kind == "rbe-mechanism":
        return _mechanism(system, _motion(certificate["mechanism"], system, names))
    if kind == "rbe-state":
        f = _forces(_world(certificate), system)
        total = np.sum(np.linalg.norm(system.p.reshape(-1, 6)[:, :3], axis=1))
        cone = np.max(np.hypot(f[:, 1], f[:, 2]) - system.mu * f[:, 0] - 1e-12 * np.abs(f[:, 0]), initial=0.0)
        return float(max(np.linalg.norm(system.residual(f)) / total - 1.5 * ALLOWED, cone / total - ROUNDING))
    bounds = Bounds(certificate["eps"], certificate["eta"], certificate["beta_min"]).unit()
    if kind == "cra-state":
        f = _forces(_world(certificate), system)
        f[:, 1:] *= (np.hypot(f[:, 1], f[:, 2]) > ALLOWED * np.maximum(1.0, np.abs(f[:, 0])))[:, None]
        dq = _motion(certificate["mechanism"], system, names) / certificate["eps"]
        found = measure(system, bounds, f, dq)
        return max(found.worst - 10 * ALLOWED, found.cone - ROUNDING)  # balance: force and moment, and what was dropped
    zones = [Zone("open", None, 0.0, bounds.eta)] * system.points
    return _tree(certificate["tree"], zones, certificate["eps"], system, names, bounds)


def _world(certificate: Mapping[str, Any]) -> list[list[float]]:
    """Forces as three numbers: halves added up, or without friction a multiple of the contact's area vector."""
    rows = iter(certificate["forces"])
    found = []
    for joint in certificate["contacts"]:
        polygon = np.array(joint["polygon"], float)
        arms = polygon - polygon[0]
        normal = np.sum(np.cross(arms, np.roll(arms, -1, axis=0)), axis=0)
        for row in islice(rows, len(polygon)):
            found.append((sum(row) * normal if joint["mu"] == 0 else np.reshape(row, (-1, 3)).sum(0)).tolist())
    return found


def _forces(rows: Sequence[Sequence[float]], system: EquilibriumSystem) -> np.ndarray:
    return np.einsum("qij,qj->qi", system.frame, np.array(rows, float).reshape(-1, 3)) / system.force_unit


def _motion(rows: Mapping[str, Sequence[float]], system: EquilibriumSystem, names: Sequence[str]) -> np.ndarray:
    motion = np.array([rows[name] for name in names], float).reshape(-1, 6)
    return (motion * np.repeat([1.0, system.length_unit], 3)).ravel()


def _mechanism(system: EquilibriumSystem, y: np.ndarray) -> float:
    """1 - (the forces it demands, in units of a million weights) of the component that demands most."""
    inward = -system.gap(y)
    n, t, mu = inward[:, 0], np.hypot(inward[:, 1], inward[:, 2]), system.mu
    # projection onto the cone |t| <= mu n: itself, nothing (polar cone), or onto its edge (1, mu) / sqrt(1 + mu^2)
    edge = (n + mu * t) / np.sqrt(1.0 + mu**2)
    size = np.where(t <= mu * n, np.hypot(n, t), np.where(edge <= 0.0, 0.0, edge))
    weight = np.linalg.norm(system.p.reshape(-1, 6)[:, :3], axis=1)
    work = np.sum((system.p * y).reshape(-1, 6), axis=1)
    noise = 1e-13 * np.max(np.abs(y), initial=0.0)  # per point, of cancelling velocities
    joined = (system.row_a >= 0) & (system.row_b >= 0)
    ends = system.row_a[joined], system.row_b[joined]
    count, part = connected_components(coo_array((np.ones(len(ends[0])), ends), shape=(system.blocks,) * 2), False)
    demands = []
    for c in range(count):
        own = part[np.maximum(system.row_a, system.row_b)] == c
        resists = max(np.linalg.norm(size[own]) - noise * np.sqrt(np.sum(own)), 1e-300)
        demands.append(np.sum(work[part == c]) / (resists * np.sum(weight[part == c]) * 1e6))
    return float(1.0 - max(demands) - 1e-6)


# --- trees -----------------------------------------------------------------------------------------------------------


def _tree(
    node: Mapping[str, Any],
    zones: list[Zone],
    eps: float,
    system: EquilibriumSystem,
    names: Sequence[str],
    bounds: Bounds,
) -> float:
    """The worst of all leaves, and of all splits that do not cover."""
    if "point" not in node:
        return _leaf(node, zones, eps, system, names, bounds)
    k = node["point"]
    zone = zones[k]
    if "rays" in node:
        parts, missing = _sectors(node, zone, system.frame[k])
        branches = node["sectors"]
    elif "speed" in node:
        speed = node["speed"] / eps
        parts = [replace(zone, fast=speed), replace(zone, slow=speed)]
        branches, missing = [node["slower"], node["faster"]], max(zone.slow - speed, speed - zone.fast)
    else:
        parts = [replace(zone, status=status) for status in ("engaged", "unloaded")]
        branches, missing = [node["engaged"], node["unloaded"]], 0.0
    inner = [
        _tree(branch, [*zones[:k], part, *zones[k + 1 :]], eps, system, names, bounds)
        for branch, part in zip(branches, parts, strict=True)
    ]
    return max(missing, *inner)


def _turn(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.arctan2(a[0] * b[1] - a[1] * b[0], a @ b) % (2 * np.pi))


def _sectors(node: Mapping[str, Any], zone: Zone, frame: np.ndarray) -> tuple[list[Zone], float]:
    rays = [np.array(r, float) @ frame[1:].T for r in node["rays"]]
    rays = [r / np.linalg.norm(r) for r in rays]
    edges, whole = [*rays, rays[0]], 2 * np.pi
    if zone.rays is not None:
        edges, whole = [zone.rays[0], *rays, zone.rays[1]], _turn(*zone.rays)
    turns = [_turn(a, b) for a, b in pairwise(edges)]
    missing = max(abs(sum(turns) - whole) - 1e-9, max(turns) - np.pi)
    return [replace(zone, rays=(a, b)) for a, b in pairwise(edges)], missing


def _leaf(
    leaf: Mapping[str, Any],
    zones: list[Zone],
    eps: float,
    system: EquilibriumSystem,
    names: Sequence[str],
    bounds: Bounds,
) -> float:
    """Work that the forces of a state would do at most, less what they do at least, relative; both bounds generous."""
    y, w = np.zeros(len(system.p)), np.zeros((system.points, 3))
    if "mechanism" in leaf:
        y = _motion(leaf["mechanism"], system, names) / eps
    if "forces" in leaf:
        w = _forces(leaf["forces"], system)
    share = 1.0 if "mechanism" in leaf and "forces" in leaf else 0.0
    left = np.linalg.norm((share * system.p - system.A @ w.ravel()).reshape(-1, 6)[:, :3], axis=1)
    far = np.sqrt(2.0) * max(1.0, bounds.eta)  # no a-priori bound on a block's displacement is smaller
    most = sum(_most(w[k], zone, bounds) for k, zone in enumerate(zones)) + far * float(np.sum(left))
    gap = system.gap(y)
    loaded = [k for k, zone in enumerate(zones) if zone.status != "unloaded"]
    short = [_short(gap[k], zones[k], share, system.mu[k], bounds) for k in loaded]
    thrust = far * float(np.sum(np.linalg.norm(system.p.reshape(-1, 6)[:, :3], axis=1)))
    least = float(system.p @ y) - max(short, default=0.0) * thrust
    size = abs(most) + abs(float(system.p @ y)) + float(np.max(np.abs(w), initial=0.0)) * system.points
    return (most - least) / size - 1e-9 if size else 1.0


def _along(x: np.ndarray, zone: Zone) -> float:
    """The largest e.x over unit e in the zone's directions."""
    if zone.rays is None or not np.any(x):
        return float(np.linalg.norm(x))
    a, b = zone.rays
    if _turn(a, x) <= _turn(a, b):
        return float(np.linalg.norm(x))
    return float(max(a @ x, b @ x))


def _most(w: np.ndarray, zone: Zone, bounds: Bounds) -> float:
    """The largest w.dd over the displacements of the zone."""
    slide = _along(w[1:], zone)
    normal = -w[0] if zone.status == "engaged" else max(-w[0], bounds.eta * w[0])
    return normal + (zone.fast if slide >= 0.0 else zone.slow) * slide


def _short(gap: np.ndarray, zone: Zone, share: float, mu: float, bounds: Bounds) -> float:
    """By how much a force of the zone may do less than it must, per unit of fn."""
    slide = share * max(bounds.beta, zone.slow) - _along(gap[1:], zone)
    return max(0.0, -(share + gap[0]), -(share + gap[0] + mu * slide))
