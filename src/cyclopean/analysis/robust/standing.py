"""Forces of which every drawing of a family has others near by that balance exactly.

They act at points L inside the outlines of their contacts, within cones that are narrower by the angle. What they leave
on a block in another drawing goes down a forest of contacts to the supports; forces are looked for that have room for
that. The contact takes a force (wn, wt) and a moment t about its centre of pressure up in proportion to its pressures
a_k = fn_k / P: with rho_k from the centre, C = sum a rho rho' and S its trace, the room at each point is

    P (mu - |ft_k| / fn_k) >= mu (wn + |C^-1 rho_k| t) + wt + |rho_k| tn / S

What is needed depends on the forces, so both are found in turns: the most room in the shares that the forces before
would have needed.
"""

from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
import scipy.sparse as sp

from cyclopean.analysis.certificates import force_rows
from cyclopean.analysis.equilibrium.polishing import PLAIN, Polished
from cyclopean.analysis.equilibrium.reference import solve_program
from cyclopean.analysis.equilibrium.slack import forest
from cyclopean.analysis.preparation import PreparedModel
from cyclopean.analysis.proving import polished
from cyclopean.analysis.robust.family import Family, swelling, warps
from cyclopean.arrays import Floats, Ints
from cyclopean.assembly import worn
from cyclopean.solvers import Cone, ConicProgram
from cyclopean.statics import EquilibriumSystem, project_cones

__all__ = ["standing"]

ROUNDS = 4  # of forces and what they need; one or two are usual
ROOM = 0.99  # of a contact's room that may be needed: rounding takes less of the rest
MOST = 3.0  # times what is needed, to which room is looked for
FLOOR = 1e-3  # of the lighter block's weight, spread over the points, which every one presses at least
SMALL = 1e-6  # price of forces beside that of room: it keeps those bounded that nothing else bounds
THIN = 1e-12  # of a contact's spread, below which its points are in a line
TINY = 1e-300  # what is divided by instead of zero
INSET = 1e-6  # by which points are further inside than L: rounding, and corners that are two, must not bring them out


@dataclass(frozen=True, slots=True, eq=False)
class _Case:
    """A model of which the contacts are drawn in and rub less: m free blocks, q points, j contacts that bear."""

    model: PreparedModel
    system: EquilibriumSystem
    off: Floats  # (j,) m: how far points may be off the planes of contacts
    family: Family
    origin: Ints  # (c,) contact of the whole model that each one of these is a part of
    joint: Ints  # (q,) number of it among those that bear
    ends: Ints  # (j, 2) free blocks at each, -1 = fixed
    mass: Floats  # (m,) kg: by how much weights may differ
    turn: Floats  # (m,) N m: and their moments
    push: Floats  # (m,) N m: moments of loads of which the points move

    @property
    def point(self) -> Floats:
        """(q, 3) m."""
        return self.model.contacts.point[self.system.used]

    @property
    def centre(self) -> Floats:
        """(m, 3) m."""
        return self.model.assembly.mass.centroid[self.system.free]


class _Need(NamedTuple):
    """What forces need: the largest share of any contact's room, N at every point, and contacts by which blocks go."""

    share: float
    point: Floats  # (q,)
    ways: Ints  # (m,) contact, among those that bear; -1 = none


def standing(model: PreparedModel, family: Family) -> tuple[dict[str, Any] | None, float]:
    """What a certificate holds that the model stands in every drawing of a family, and the share of room it needs.

    Parameters
    ----------
    model : PreparedModel
        It stands as it is.
    family : Family
        By how much drawings differ.

    Returns
    -------
    proof : dict or None
        None where no such forces were found.
    share : float
        Of the room of some contact, in the best forces found; infinite where there are none.
    """
    if model.fixed.all():
        return {"within": family.entry(), "points": [], "forces": [], "ways": {}}, 0.0
    case = _case(model, family)
    if case is None:
        return None, np.inf
    q, lighter = case.system.points, case.system.lighter * case.system.force_unit
    count = np.bincount(case.joint)[case.joint]
    need, best, found = FLOOR * lighter / count, np.inf, None
    wanted = np.maximum(need, 0.1 * lighter / count)
    for _ in range(ROUNDS):
        f = _with_room(case.system, wanted / case.system.force_unit)
        if f is None or not q:
            break
        state = polished(case.model, case.system, f)
        told = _need(case, state)
        if told.share < best:
            best, found = told.share, (state, told)
        if best <= ROOM or not np.isfinite(told.share):
            break
        wanted = np.maximum(need, told.point)
    if found is None or best > ROOM or not found[0].worst <= PLAIN:
        return None, best
    return _proof(model, case, *found), best


def _case(model: PreparedModel, family: Family) -> _Case | None:
    """The model with what is left of its contacts; None where some block is left without any."""
    contacts, lean = model.contacts, family.leans(model.contacts)
    known = np.where(np.isfinite(lean), lean, 0.0)
    left = np.where(np.isfinite(lean), (contacts.mu - known) / (1.0 + contacts.mu * known), -1.0)
    bears = np.flatnonzero((left > 0.0) & ~(model.fixed[contacts.a] & model.fixed[contacts.b]))
    if not len(bears):
        return None
    rounding, warp = 16.0 * np.spacing(float(np.max(np.abs(contacts.point)))), warps(contacts)
    depth = np.hypot(family.length, 2.0 * warp[bears]) * (1.0 + INSET) + rounding
    drawn, part = worn(replace(contacts, mu=left.clip(0.0)).only(bears), depth)
    small = replace(model, contacts=drawn)
    system, origin = small.system(), bears[part]
    if len(np.setdiff1d(np.arange(system.blocks), (system.row_a, system.row_b))):
        return None
    known, joint = np.unique(origin[drawn.patch], return_inverse=True)
    row = np.full(len(model.assembly), -1)
    row[system.free] = np.arange(system.blocks)
    volume, moment = (x[system.free] for x in swelling(model.assembly, family.length))
    density, g = model.assembly.densities(model.density)[system.free], np.abs(model.gravity)
    turned = moment[:, [1, 2, 0]] * g[[2, 0, 1]] + moment[:, [2, 0, 1]] * g[[1, 2, 0]]
    push = np.zeros(len(model.assembly))
    for load in model.assembly.loads:
        push[load.block] += family.length * float(np.linalg.norm(load.force))
    return _Case(
        small,
        system,
        family.length + 2.0 * warp[known],
        family,
        origin,
        joint,
        np.stack([row[contacts.a[known]], row[contacts.b[known]]], 1),
        density * volume,
        density * np.linalg.norm(turned, axis=1),
        push[system.free],
    )


def _with_room(system: EquilibriumSystem, wanted: Floats) -> Floats | None:
    """(q, 3) scaled forces that balance, each with as many times the (q,) wanted room in its cone as all may have."""
    q, n = system.points, 3 * system.points + 1
    stretch = np.ones((q, 3))
    stretch[:, 0] = system.mu
    asked = np.zeros((q, 3))
    asked[:, 0] = system.mu * wanted
    cones = sp.hstack([sp.diags(-stretch.ravel()), asked.reshape(-1, 1)])
    balance = sp.hstack([system.A, sp.csr_matrix((len(system.p), 1))])
    most = sp.csr_matrix(([1.0], ([0], [n - 1])), shape=(1, n))
    A = sp.vstack([balance, most, cones], format="csc")
    b = np.concatenate([-system.p, [MOST], np.zeros(3 * q)])
    price = SMALL / (max(system.total, 1e-300) ** 2)
    P = sp.diags(np.append(np.full(3 * q, price), 0.0), format="csc")
    kinds: tuple[Cone, ...] = (("zero", len(system.p), 1), ("nonnegative", 1, 1), ("second-order", 3, q))
    answer = solve_program(ConicProgram(P, np.append(np.zeros(3 * q), -1.0), A, b, kinds), system.blocks)
    if answer.word != "solved" or not answer.x[-1] > 0.0:
        return None
    return project_cones(answer.x[:-1].reshape(-1, 3), system.mu)


class _Pressures(NamedTuple):
    """How forces press on the j contacts that bear, at q points; m free blocks."""

    press: Floats  # (q,) N
    steep: Floats  # (q,) |ft| / fn
    share: Floats  # (q,) of each contact's press
    whole: Floats  # (j,) N
    middle: Floats  # (j, 3) m: centre of pressure
    arm: Floats  # (q,) m from it
    lever: Floats  # (q,) 1/m: |C^-1 rho|
    spread: Floats  # (j,) m2: S
    narrow: Floats  # (j,) m2: about the lesser of the two variances that make S
    left: Floats  # (m,) N that forces leave on each block, and
    twist: Floats  # (m,) N m: what they leave, and what they and loads may leave in another drawing


def _pressures(case: _Case, state: Polished) -> _Pressures:
    joint, at, count = case.joint, case.point, len(case.ends)
    f = state.f * case.system.force_unit
    press, across = f[:, 0], np.hypot(f[:, 1], f[:, 2])

    def summed(values: Floats) -> Floats:
        return np.bincount(joint, values, count).astype(float)

    whole = summed(press)
    share = press / np.maximum(whole, TINY)[joint]
    middle = np.stack([summed(share * at[:, k]) for k in range(3)], 1)
    u, v = np.einsum("qij,qj->iq", case.system.frame[:, 1:], at - middle[joint])
    uu, uv, vv = (summed(share * one * two) for one, two in ((u, u), (u, v), (v, v)))
    spread, area = uu + vv, uu * vv - uv**2
    tilt = np.hypot(vv[joint] * u - uv[joint] * v, uu[joint] * v - uv[joint] * u)
    off = case.off * summed(across)
    twist = case.push + np.linalg.norm(state.residual[:, 3:], axis=1)
    for end in case.ends.T:
        np.add.at(twist, end[end >= 0], off[end >= 0])
    return _Pressures(
        press,
        across / np.maximum(press, TINY),
        share,
        whole,
        middle,
        np.hypot(u, v),
        tilt / np.maximum(area, TINY)[joint],
        spread,
        np.maximum(area, 0.0) / np.maximum(spread, TINY),
        np.linalg.norm(state.residual[:, :3], axis=1),
        twist,
    )


def _need(case: _Case, state: Polished) -> _Need:
    """What forces need in the worst drawing, if what every block has to pass on goes down the strongest contacts."""
    m, joint, mu, at = case.system.blocks, case.joint, case.system.mu, _pressures(case, state)
    strength = np.where(at.narrow > THIN * at.spread, at.whole * np.sqrt(at.narrow), 0.0)
    ends = np.where(case.ends < 0, m, case.ends)
    down = forest(m, ends.min(1), ends.max(1), strength)
    if len(down[0]) <= m:
        return _Need(np.inf, np.zeros(len(joint)), np.full(m, -1))
    worst, wanted = 0.0, np.zeros(len(joint))
    start = np.searchsorted(joint, np.arange(len(ends) + 1))
    for j, (along, across, turn, twist) in _passed(case, at, down).items():
        k = slice(int(start[j]), int(start[j + 1]))
        t = turn + case.off[j] * (across + twist / np.sqrt(at.spread[j]))
        more = mu[k] * (along + at.lever[k] * t) + across + at.arm[k] * twist / at.spread[j]
        room = at.whole[j] * (mu[k] - at.steep[k])
        used = np.where(at.press[k] > 0.0, more, 0.0) / np.maximum(room, TINY)
        worst = max(worst, float(used.max()))
        wanted[k] = at.share[k] * more / mu[k]
    return _Need(worst, wanted, down[2][:m])


def _passed(case: _Case, at: _Pressures, down: tuple[Ints, Ints, Ints]) -> dict[int, tuple[float, float, float, float]]:
    """Sizes of what goes through every contact of a forest: the force along n and across it, N; the moment about the
    centre of pressure, and the part of that about n, N m.
    """
    (tree, parent, via), m, gravity = down, case.system.blocks, case.model.gravity
    size = float(np.linalg.norm(gravity)) or 1.0
    normal = np.zeros((len(case.ends), 3))
    normal[case.joint] = case.system.frame[:, 0]
    above: list[list[int]] = [[i] for i in range(m)]
    found = {}
    for block in tree[:0:-1].tolist():
        held, j = above[block], int(via[block])
        arm = case.centre[held] - at.middle[j]
        mass, left = float(case.mass[held].sum()), float(at.left[held].sum())
        swung = case.mass[held] @ np.linalg.norm(np.cross(gravity, arm), axis=1)
        bowed = float(swung + case.turn[held].sum())
        loose = float(at.twist[held].sum() + at.left[held] @ np.linalg.norm(arm, axis=1))
        aside = float(np.linalg.norm(np.cross(gravity, normal[j])))
        along, across = mass * abs(float(gravity @ normal[j])) + left, mass * aside + left
        found[j] = along, across, bowed + loose, bowed * aside / size + loose
        if (below := int(parent[block])) < m:
            above[below] += held
        above[block] = []
    return found


def _proof(model: PreparedModel, case: _Case, state: Polished, told: _Need) -> dict[str, Any]:
    """The part of a certificate that is not the model."""
    contacts, drawn = model.contacts, case.model.contacts
    used = np.flatnonzero(~(model.fixed[contacts.a] & model.fixed[contacts.b]))
    place = {int(k): i for i, k in enumerate(used)}
    points: list[list[list[float]]] = [[] for _ in used]
    for k in range(len(drawn)):
        points[place[int(case.origin[k])]] += drawn.polygon(k).tolist()
    known = np.unique(case.origin[drawn.patch])
    names = [model.assembly.blocks[i].id for i in case.system.free]
    ways = {name: place[int(known[j])] for name, j in zip(names, told.ways, strict=True)}
    rows = force_rows(case.system, drawn, state.parts)
    return {"within": case.family.entry(), "points": points, "forces": rows, "ways": ways}
