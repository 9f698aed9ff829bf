"""Plane models against an exact integer programme, and models in space by two seeds of the restarts.

Run `python bench/plane.py [--plane 1000] [--space 500] [--nodes 2000]`; prints how many were coupled, refuted and
undecided, what the integer programme (tests/plane_cases.py) says of them, contradictions, and the time of both. Trees
of plane models are walked from the root again; states are measured.
"""

import argparse
import sys
from collections import Counter
from pathlib import Path
from time import process_time

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))  # the models are shared with the tests

from coupled_cases import coupled_case
from cyclopean.analysis import Settings
from cyclopean.analysis.coupled.alternation import alternation
from cyclopean.analysis.coupled.states import Bounds, measure
from cyclopean.analysis.coupled.tree import refute
from cyclopean.analysis.preparation import prepare
from cyclopean.statics import EquilibriumSystem
from plane_cases import has_state, plane_case, tree_holds


def word(system: EquilibriumSystem, bounds: Bounds, nodes: int, seed: int) -> str:
    """By alternation from this seed, then by the tree."""
    found = alternation(system, bounds, budget=100, seed=seed)
    answer = None if found.found else refute(system, bounds, nodes)
    if answer is None or answer.word == "coupled":
        best = found if answer is None else answer.best
        assert measure(system, bounds.unit(), best.f, best.dq).accepted
        return "coupled"
    assert answer.root is None or tree_holds(system, bounds.unit(), answer.root)
    return answer.word


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--plane", type=int, default=1000)
    parser.add_argument("--space", type=int, default=500)
    parser.add_argument("--nodes", type=int, default=2000)
    chosen = parser.parse_args()
    counts, began, exact = Counter[tuple[str, str]](), process_time(), 0.0
    for seed in range(chosen.plane):
        case = plane_case(seed)
        said, before = word(case.system, case.bounds, chosen.nodes, 0), process_time()
        outer = has_state(case, outer=True)
        inner = outer and has_state(case, outer=False)
        exact += process_time() - before
        counts[said, "state" if inner else "near" if outer else "none"] += 1
    took = process_time() - began
    wrong = counts["coupled", "none"] + counts["refuted", "state"]
    print(
        f"plane: {chosen.plane} models, {wrong} contradictions; {took - exact:.0f} s, integer programme {exact:.0f} s"
    )
    for (said, truth), count in sorted(counts.items()):
        print(f"{said:>12} {truth:>6} {count:>6}")
    pairs, began = Counter[tuple[str, ...]](), process_time()
    for seed in range(chosen.space):
        drawn = coupled_case(seed)
        asked = Settings(method="cra", mu=drawn.mu, gravity=drawn.gravity)
        system = prepare(drawn.assembly, asked).system()
        pairs[tuple(sorted(word(system, asked.bounds(), chosen.nodes // 20, walk) for walk in (1, 2)))] += 1
    wrong = pairs["coupled", "refuted"]
    print(f"space: {chosen.space} models, two seeds, {wrong} contradictions; {process_time() - began:.0f} s")
    for both, count in sorted(pairs.items()):
        print(f"{both[0]:>12} {both[1]:>10} {count:>6}")


if __name__ == "__main__":
    main()
