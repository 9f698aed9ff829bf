"""Mechanisms as the checker of certificates takes them, and motions whose joints all open.

With dd = A'y, P the projection onto the friction cones K, W_C all weights and loads of a component, w_i and D_i weight
and box diagonal of a block that moves by v_i and turns by o_i, a mechanism proves collapse where

    p'y > 1e6 W_C ||P(-dd)|| + 1e-9 sum w_i (|v_i| + D_i |o_i|)

over the component. A pebble that falls beside a boulder has hardly any power against 1e6 W_C: the rounding of a joint
that merely slides is too much. A motion of the pebble alone whose joints open has P(-dd) = 0 whatever rounding does.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from cyclopean.analysis.equilibrium.components import group, lightest
from cyclopean.analysis.equilibrium.exact_balance import Balance
from cyclopean.analysis.equilibrium.own_scale import own_rows, own_scaled
from cyclopean.analysis.equilibrium.reference import mechanism_program, solve_program
from cyclopean.arrays import Bools, Floats, Ints
from cyclopean.statics import EquilibriumSystem, project_cones

__all__ = ["drive", "moving_groups", "opened", "pressed"]

COLLAPSE = 1e6  # total weights of a component that the forces of a state may come to
SLOW = 1e-9  # share of every block's own weight that a state may leave unbalanced
MARGIN = 1.5  # by which motions have to pass here
ROUNDING = 1e-15  # of speeds at a joint: what rounding may do to dd
SHARES = (0.3, 0.1, 1e-2, 1e-3, 1e-4, 1e-6, 0.0)  # of the largest own speed; 0 = all blocks
RINGS = 2  # of neighbours that may give way: a key between free stones opens when one of them does
HEAVY = 1e3  # times the heaviest that moves: such neighbours stay at rest
LARGEST = 3000  # blocks of a group; beyond, one programme takes a minute


def drive(system: EquilibriumSystem, balance: Balance, label: Ints, y: Floats) -> Floats:
    """(components,) p'y over what the rule asks for, component by component; above 1 proves collapse.

    Parameters
    ----------
    system : EquilibriumSystem
        m free blocks.
    balance : Balance
        Of the same system.
    label : (m,)
        Component of each block.
    y : (6 m,)
        Scaled velocities.
    """
    count = int(label.max(initial=-1)) + 1
    weight, diagonal = balance.weight / system.force_unit, balance.diagonal / system.length_unit
    rows = system.still(y).reshape(-1, 6)
    fastest = np.zeros(count)
    np.maximum.at(fastest, label, np.abs(rows).max(1))
    rows = rows / np.where(fastest > 0.0, fastest, 1.0)[label][:, None]
    at = label[np.maximum(system.row_a, system.row_b)]
    press = pressed(system, balance, rows)
    power = np.bincount(label, (system.p.reshape(-1, 6) * rows).sum(1), count)
    resistance = np.sqrt(np.bincount(at, press**2, count))
    whole = np.bincount(label, balance.size / system.force_unit, count)
    if system.pull.any():
        whole += np.bincount(at, np.abs(system.pull), count)
    speed = np.linalg.norm(rows[:, :3], axis=1) + diagonal * np.linalg.norm(rows[:, 3:], axis=1)
    needed = COLLAPSE * whole * resistance + SLOW * np.bincount(label, lightest(label, weight) * speed, count)
    return np.asarray(np.where(power > 0.0, power / np.where(needed > 0.0, needed, 1e-300), 0.0))


def pressed(system: EquilibriumSystem, balance: Balance, rows: Floats) -> Floats:
    """(q,) ||P(-dd)|| for (m, 6) velocities, or what rounding of dd may make of it: 0 only where that is certain."""
    dd = -system.gap(rows.ravel())
    speed = np.zeros(len(dd))
    reach = (
        np.linalg.norm(balance.point[: len(dd)], axis=1) / system.length_unit
    )  # moments are about the world's origin
    for row in (system.row_a, system.row_b):
        moving = np.where(row[:, None] >= 0, rows[row], 0.0) if len(rows) else np.zeros((len(row), 6))
        speed += np.linalg.norm(moving[:, :3], axis=1) + reach * np.linalg.norm(moving[:, 3:], axis=1)
    noise = ROUNDING * speed + balance.blur * np.linalg.norm(dd, axis=1)
    found = np.linalg.norm(project_cones(dd, system.mu), axis=1)
    depth = -(dd[:, 0] + system.mu * np.hypot(dd[:, 1], dd[:, 2])) / np.hypot(1.0, system.mu)
    return np.where(depth > noise, 0.0, found + noise)


def opened(system: EquilibriumSystem, balance: Balance, y: Floats, shares: Sequence[float] = SHARES) -> Floats | None:
    """A motion of few blocks that passes the rule with all their joints opening, or None.

    Holds all blocks but those that move, and up to two rings of neighbours, and maximises t subject to
    |(v_i, D_i o_i)| <= 1, p'y >= t and every dd at least t inside {dn >= mu |d_t|}.

    Parameters
    ----------
    system : EquilibriumSystem
        Of one component.
    balance : Balance
        Of the same system.
    y : (6 m,)
        Scaled velocities that a solver ended with: they say which blocks may be falling.
    shares : sequence of float
        Of the largest own speed, from which a block counts as moving; tried one after the other.
    """
    weight, diagonal = balance.weight / system.force_unit, balance.diagonal / system.length_unit
    label = np.zeros(system.blocks, np.int64)
    tried: set[bytes] = set()
    for chosen in moving_groups(system, weight, diagonal, y, shares):
        if chosen.tobytes() in tried or chosen.sum() > LARGEST:
            continue
        tried.add(chosen.tobytes())
        part = group(system, chosen)
        if not part.system.points:
            motion = part.system.p
        else:
            even = own_scaled(part.system, np.ones(len(part.blocks)), diagonal[chosen], np.ones(len(part.points)))
            heaviest = float(weight[chosen].max())
            answer = solve_program(mechanism_program(replace(even, p=even.p / heaviest)), len(part.blocks))
            motion = answer.x[:-1] * own_rows(np.ones(len(part.blocks)), diagonal[chosen])
        if not np.isfinite(motion).all():
            continue
        found = system.still(part.spread(motion, system.blocks))
        if drive(system, balance, label, found)[0] >= MARGIN:
            return found
    return None


def moving_groups(
    system: EquilibriumSystem, weight: Floats, diagonal: Floats, y: Floats, shares: Sequence[float] = SHARES
) -> Iterator[Bools]:
    """Blocks (n,) that move fast in y, (6n,), then with their neighbours; slower and slower."""
    rows = y.reshape(-1, 6) / max(float(np.max(np.abs(y), initial=0.0)), 1e-300)
    speed = np.linalg.norm(rows[:, :3], axis=1) + diagonal * np.linalg.norm(rows[:, 3:], axis=1)
    both = (system.row_a >= 0) & (system.row_b >= 0)
    a, b = system.row_a[both], system.row_b[both]
    for share in shares:
        chosen = speed > share * speed.max(initial=0.0) if share else np.ones(len(weight), bool)
        if not chosen.any():
            continue
        yield chosen
        for _ in range(RINGS):
            light = weight < HEAVY * weight[chosen].max()
            wider = chosen.copy()
            wider[a[chosen[b] & light[a]]] = True
            wider[b[chosen[a] & light[b]]] = True
            chosen = wider
            yield chosen
