"""Can what is left of the balance be pushed down to the supports, joint by joint, until nothing is left at all?

A joint of which three points press strictly inside their cones can take on any small force and moment. Where a forest
of such joints reaches a support from every free block, the checker of certificates corrects the forces down that
forest, exactly, and the claim has no tolerance. States of least norm lie on the edges of their cones; `centred` moves
them inside.
"""

from heapq import heappop, heappush

import numpy as np

from cyclopean.analysis.equilibrium.exact_balance import Balance
from cyclopean.analysis.equilibrium.own_scale import lighter_weight
from cyclopean.analysis.equilibrium.polishing import PLAIN, Polished, Polisher
from cyclopean.arrays import Floats, Ints
from cyclopean.errors import SolverError
from cyclopean.statics import EquilibriumSystem

__all__ = ["AMPLE", "centred", "forest", "slack"]

AMPLE = 1e2  # times what has to pass: by which a joint's room makes sure that the checker gets through
ROUNDING = 1e-14  # of a force: what counts as inside its cone
SHARES = (0.05, 1e-3, 1e-5)  # of the lighter block's weight, which every point presses more to begin with
STEEPEST = 0.9  # of its cone's opening, which a force uses at most to begin with
ROUNDS = 25  # most steps; walls and vaults need one, arches 1e-5 above their least thickness eight
BALANCED = 1e-9  # own weights: near enough for the polish


def slack(system: EquilibriumSystem, balance: Balance, state: Polished) -> Floats:
    """(m,) least room of the joints between each block and its support, over what has to pass there.

    Zero where no joint with room leads there. The forest is the checker's, of the joints that bear most, each by three
    of its points; what passes is estimated from sizes of forces and moments.
    """
    m = system.blocks
    if not (state.f.any() or state.residual.any()):
        return np.full(m, np.inf)  # nothing acts, so that nothing has to pass
    first = np.unique(balance.joint, return_index=True)[1]
    strength, room = _joints(system, balance, state)
    ends = [np.where(row[first] >= 0, row[first], m) for row in (system.row_a, system.row_b)]
    tree, parent, via = forest(m, np.minimum(*ends), np.maximum(*ends), strength)
    force, moment = (np.linalg.norm(x, axis=1) for x in np.split(state.residual, 2, axis=1))
    at = balance.point[first][via[:m]] if len(first) else np.zeros((m, 3))
    arm = np.linalg.norm(balance.centre - at, axis=1)
    width = balance.width[first]
    pull, turn = force.tolist(), moment.tolist()
    need, ratio = np.zeros(m), np.zeros(m + 1)
    for b in tree[:0:-1].tolist():
        need[b] = pull[b] + (turn[b] + pull[b] * arm[b]) / width[via[b]]
        if (a := int(parent[b])) < m:
            pull[a] += pull[b]
            turn[a] += turn[b] + pull[b] * float(np.linalg.norm(balance.centre[a] - balance.centre[b]))
    ratio[m] = np.inf
    for b in tree[1:].tolist():
        ratio[b] = min(ratio[parent[b]], room[via[b]] / max(need[b], 1e-300))
    return ratio[:m]


def _joints(system: EquilibriumSystem, balance: Balance, state: Polished) -> tuple[Floats, Floats]:
    """(joints,) N: the third largest force at each joint, and how far the three that the checker takes are inside.

    It takes three points that span a large triangle: the first inside its cone, the one furthest from it, the one
    furthest aside. Zero where there are no such three.
    """
    f, mu, joint = state.f, system.mu, balance.joint
    size = np.linalg.norm(f, axis=1)
    room = (mu * f[:, 0] - np.hypot(f[:, 1], f[:, 2])) / np.hypot(1.0, mu)
    inner = np.flatnonzero(room > ROUNDING * size)
    here, count = np.unique(joint, return_counts=True)[0], np.bincount(joint[inner], minlength=int(joint.max()) + 1)
    strength, least = np.zeros(len(here)), np.zeros(len(here))
    inner = inner[count[joint[inner]] >= 3]
    if not len(inner):
        return strength, least
    owner = np.searchsorted(here, joint[inner])
    places, start, local = np.unique(owner, return_index=True, return_inverse=True)

    def largest(value: Floats, rank: int = 0) -> Ints:
        return np.lexsort((-value, local))[start + rank]

    at = balance.point[inner]
    away = at - at[start][local]
    one = largest(np.einsum("ij,ij->i", away, away))
    across = np.cross(away[one][local], away)
    two = largest(np.einsum("ij,ij->i", across, across))
    three = np.min([room[inner[k]] for k in (start, one, two)], axis=0)
    strength[places] = size[inner[largest(size[inner], 2)]] * system.force_unit
    least[places] = np.where(across[two].any(1), three, 0.0) * system.force_unit
    return strength, least


def forest(m: int, a: Ints, b: Ints, strength: Floats) -> tuple[Ints, Ints, Ints]:
    """Nodes from the supports (m) outwards, the parent of each, and the joint that leads there.

    The spanning tree of the largest strengths [Prim]_.

    References
    ----------
    .. [Prim] Prim: Shortest connection networks and some generalizations. Bell System Technical J. 36 (1957).
    """
    beside: list[list[tuple[float, int, int, int]]] = [[] for _ in range(m + 1)]
    for k in np.flatnonzero(strength > 0.0).tolist():
        for here, there in ((int(a[k]), int(b[k])), (int(b[k]), int(a[k]))):
            beside[here].append((-float(strength[k]), k, there, here))
    parent, via = np.full(m + 1, -1), np.zeros(m + 1, np.int64)
    nodes: list[int] = []
    waiting = [(-np.inf, -1, m, m)]
    while waiting:
        _, k, node, before = heappop(waiting)
        if parent[node] < 0:
            nodes.append(node)
            parent[node], via[node] = before, k
            for edge in beside[node]:
                heappush(waiting, edge)
    return np.array(nodes), parent, via


def centred(system: EquilibriumSystem, balance: Balance, polisher: Polisher, state: Polished) -> Polished:
    """A state with more slack than the given one, by a few barrier steps; the given one where none is found."""
    best, most = state, float(np.min(slack(system, balance, state), initial=np.inf))
    for share in SHARES if most < AMPLE else ():
        found = polisher.polished(_inwards(polisher, state.f, share))
        if not found.worst <= PLAIN:
            continue
        here = float(np.min(slack(system, balance, found), initial=np.inf))
        if here > most:
            best, most = found, here
        if most >= AMPLE:
            break
    return best


def _inwards(polisher: Polisher, f: Floats, share: float) -> Floats:
    """Forces that press a little more everywhere, brought back into balance by steps of least size against the room."""
    system = polisher.system
    lighter = lighter_weight(system, polisher.balance.weight / system.force_unit)
    inner = f.copy()
    inner[:, 0] += share * lighter
    inner[polisher.straight, 1:] = 0.0
    most, tangent = STEEPEST * polisher.slope * inner[:, 0], np.hypot(inner[:, 1], inner[:, 2])
    inner[:, 1:] *= np.where(tangent > most, most / np.maximum(tangent, 1e-300), 1.0)[:, None]
    history: list[float] = []
    for _ in range(ROUNDS):
        off = polisher.scaled.residual(inner)
        history.append(float(np.max(np.abs(off), initial=0.0)))
        if history[-1] <= BALANCED or (len(history) > 6 and history[-1] > 0.5 * history[-5]):
            break
        try:
            step = polisher.step(inner, -off)
        except SolverError:
            break
        inner = inner + min(1.0, 0.9 * polisher.room(inner, step)) * step
    return inner
