"""OSQP, Clarabel and our chain on the rigid-block equilibrium of walls, cold and warm, in one run.

Run `python bench/qp.py [--faces 16] [--tilts 0,5,40] [--seconds 120]`; one thread: set RAYON_NUM_THREADS=1 and
OMP_NUM_THREADS=1 before. The walls have 54, 95 and 145 interfaces, where a home-made ADMM took 5 s and more, and on to
1,170. For each: the time of the chain, of Clarabel on exact cones, of Clarabel and OSQP on the same pyramids (cold, and
its steps), of OSQP again from its answer after the loads have changed by 1 % (warm, and its steps), and of
the whole route `--solver osqp`; then ratios, and residuals in the exact cones (||A f + p|| in total loads; one over the
bound of a mechanism) of the answers on pyramids as they are, and of the chain and the route after mending.
"""

import argparse
import warnings
from collections.abc import Callable
from dataclasses import replace
from time import perf_counter
from typing import TypeVar

import numpy as np

from cyclopean.analysis import Cone, Outcome, rbe_program, solve_rbe
from cyclopean.assembly import supports
from cyclopean.design import wall
from cyclopean.solvers import ConicAnswer, solve
from cyclopean.statics import EquilibriumSystem, equilibrium_system, project_cones, turned_gravity

Answer = TypeVar("Answer")
MU = 0.7
GRAVITY = np.array([0.0, 0.0, -9.80665])
WALLS = {54: (7, 3), 95: (7, 5), 145: (4, 13), 307: (12, 9), 650: (14, 16), 1170: (20, 20)}


def posed(columns: int, courses: int, tilt: float) -> tuple[EquilibriumSystem, int]:
    model = wall(columns, courses)
    assert model.contacts is not None
    gravity = turned_gravity(GRAVITY, tilt, 30.0)
    return equilibrium_system(model, model.contacts.with_mu(MU), supports(model)[0], gravity, 2400.0), len(
        model.contacts
    )


def timed(work: Callable[[], Answer], repeats: int = 3) -> tuple[float, Answer]:
    """The best of some runs, fewer where one is long."""
    best, answer = np.inf, None
    for _ in range(repeats):
        began = perf_counter()
        answer = work()
        best = min(best, perf_counter() - began)
        if best > 2.0:
            break
    assert answer is not None
    return best, answer


def unbalanced(system: EquilibriumSystem, answer: ConicAnswer) -> float:
    """||A f + p|| in total loads of a raw answer put into the exact cones."""
    if answer.word != "solved":
        return np.nan
    f = project_cones(answer.x.reshape(-1, 3), system.mu)
    total = float(np.sum(np.linalg.norm(system.p.reshape(-1, 6)[:, :3], axis=1)))
    return float(np.linalg.norm(system.residual(f))) / total


def warm(system: EquilibriumSystem, cone: Cone, options: dict[str, float]) -> tuple[float, ConicAnswer]:
    """A second solve from the answer of the first, with loads 1 % off in both directions."""
    program = rbe_program(system, cone)
    first = solve(program, "osqp", **options)
    b = program.b.copy()
    b[: len(system.p)] *= 1.0 + 0.01 * np.cos(np.arange(len(system.p)))
    return timed(lambda: solve(replace(program, b=b), "osqp", (first.x, first.z), **options), repeats=1)


def row(interfaces: int, tilt: float, faces: int, seconds: float) -> str:
    system, found = posed(*WALLS[interfaces], tilt)
    cone = Cone("inscribed", faces)
    program = rbe_program(system, cone)
    chain, ours = timed(lambda: solve_rbe(system))
    exact, reference = timed(lambda: solve_rbe(system, "clarabel"))
    pyramid, flat = timed(lambda: solve(program))
    options = {"time_limit": seconds}
    cold, raw = timed(lambda: solve(program, "osqp", **options))
    again, second = warm(system, cone, options)
    whole, mended = timed(lambda: solve_rbe(system, "osqp"), repeats=1)
    return (
        f"{found:>10} {system.points:>6} {tilt:>4.0f} {_word(ours, reference, mended):>30}"
        f" {chain:>8.4f} {exact:>8.4f} {pyramid:>8.4f} {cold:>8.4f} {raw.iterations:>6} {again:>8.4f}"
        f" {second.iterations:>6} {whole:>8.4f}"
        f" {exact / chain:>6.1f} {cold / chain:>6.1f} {again / chain:>6.1f} {cold / exact:>6.2f}"
        f" {unbalanced(system, flat):>8.0e} {unbalanced(system, raw):>8.0e}"
        f" {_reached(ours):>8.0e} {_reached(mended):>8.0e}"
    )


def _word(*outcomes: Outcome) -> str:
    return "/".join(outcome.word for outcome in outcomes)


def _reached(outcome: Outcome) -> float:
    """Residual of a state; of a mechanism, one over its bound."""
    return outcome.balance if outcome.word == "balanced" else 1.0 / max(outcome.bound, 1e-300)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--faces", type=int, default=16)
    parser.add_argument("--tilts", default="0,5,40")
    parser.add_argument("--seconds", type=float, default=120.0)
    chosen = parser.parse_args()
    warnings.simplefilter("ignore")
    solve_rbe(posed(2, 2, 0.0)[0], "osqp")  # imports are not what is timed
    solve_rbe(posed(2, 2, 0.0)[0], "clarabel")
    print(
        f"{'interfaces':>10} {'points':>6} {'tilt':>4} {'chain/clarabel/osqp':>30} {'chain s':>8} {'clarabel':>8}"
        f" {'its flat':>8} {'cold':>8} {'steps':>6} {'warm':>8} {'steps':>6} {'route':>8} {'cl/ch':>6} {'co/ch':>6}"
        f" {'wa/ch':>6} {'co/cl':>6} {'r flat':>8} {'r osqp':>8} {'r chain':>8} {'r route':>8}"
    )
    for interfaces in WALLS:
        for tilt in (float(t) for t in chosen.tilts.split(",")):
            print(row(interfaces, tilt, chosen.faces, chosen.seconds), flush=True)


if __name__ == "__main__":
    main()
