"""Robust verdicts on models by chance: how far they hold, how long they take, and whether other drawings contradict.

Run `python bench/within.py [--models 1000] [--drawings 5] [--seed 0]`.

Of every model by chance (stacks on slopes, arches, walls and domes, some loaded) the largest length is found for which
its answer was proved of all drawings; then drawings within that length, half of them as badly off as can be, are
decided by rigid-block equilibrium, with the contacts listed. Prints each that says otherwise, and a sum.
"""

import argparse
import sys
from collections import Counter
from pathlib import Path
from time import perf_counter

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))  # models and drawings are shared with the tests

from cyclopean.analysis.checking import decide
from cyclopean.analysis.equilibrium.deciding import decide_rigid
from cyclopean.analysis.robust.search import certain_length
from within_cases import SETTINGS, another_drawing, any_model, prepared

SAID = {"stable": "collapse", "unstable": "balanced"}  # what no drawing within the length may come to


def main() -> None:
    """Run."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--models", type=int, default=1000)
    parser.add_argument("--drawings", type=int, default=5)
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    words: Counter[str] = Counter()
    shares: dict[str, list[float]] = {"stable": [], "unstable": []}
    spent = 0.0
    for number in range(given.models):
        rng = np.random.default_rng((given.seed, number))
        model = prepared(any_model(rng))
        result = decide(model, SETTINGS)
        words[result.verdict] += 1
        if result.verdict == "undecided":
            continue
        began = perf_counter()
        length = certain_length(model, None if result.verdict == "stable" else result.mechanism)
        spent += perf_counter() - began
        width = float(np.min(model.contacts.area / model.contacts.perimeter))
        shares[result.verdict].append(length / width)
        for drawing in range(given.drawings if length else 0):
            other = another_drawing(model, length, rng)
            word = decide_rigid(other, other.system()).word
            words[f"{result.verdict}, drawn otherwise: {word}"] += 1
            if word == SAID[result.verdict]:
                print(f"CONTRADICTION: seed {given.seed}, model {number}, drawing {drawing}, within {length:g} m")
    for word, count in sorted(words.items()):
        print(f"{count:7d}  {word}")
    for word, found in shares.items():
        if found:
            none, middle = sum(x == 0.0 for x in found), np.quantile(found, [0.1, 0.5, 0.9])
            print(f"{word}: length by least area / perimeter {middle.round(3).tolist()} (10, 50, 90 %), none {none}")
    print(f"{spent / max(given.models, 1):.2f} s a model for the lengths")


if __name__ == "__main__":
    main()
