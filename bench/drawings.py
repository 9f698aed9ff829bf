"""Do drawings that do not quite meet get the verdict of the exact model?

    python bench/drawings.py [CASES] [SEED]

Models of several kinds are disturbed: vertices by 1e-9 to 3e-3 of a block's size, blocks turned by 0.001 to 1 degree,
lifted or sunk as much; half of them are then unwelded triangles in random order, half of these turned. Each is
checked with `tolerance` auto, and as it is. Far from the limit (friction 0.8 and 1.25 times, tilts of 3 degrees) the
verdict has to be that of the exact model; near it, anything but silence.
"""

import sys
import time
from collections import Counter
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

from cyclopean.analysis import Settings, check
from cyclopean.assembly.mending import mended
from cyclopean.errors import InputError
from imprecise import disturbed, far_from_limit, model_of, rolled, shaken, shifted, soup, verdict

HOW = {"vertices": (shaken, 1e-9, 3e-3), "turned": (rolled, np.radians(0.001), np.radians(1.0)),
       "lifted": (shifted, 1e-9, 3e-3)}  # fmt: skip


def main(cases: int, seed: int) -> None:
    counts: Counter[str] = Counter()
    start = time.perf_counter()
    for k in range(seed, seed + cases):
        rng = np.random.default_rng(k)
        model, mu = model_of(rng), float(rng.choice([0.3, 0.6, 0.84]))
        name = list(HOW)[int(rng.integers(len(HOW)))]
        how, least, most = HOW[name]
        share = float(np.exp(rng.uniform(np.log(least), np.log(most))))
        some = float(rng.choice([1.0, 0.3]))
        drawn = disturbed(model, how, share, rng, some)
        if rng.random() < 0.5:
            name, drawn = f"{name}, soup", mended(soup(drawn, rng)).assembly
        exact = verdict(model, mu=mu)
        far = far_from_limit(model, mu, exact)
        try:
            plain = check(drawn, Settings(method="rbe", mu=mu))
        except InputError:  # an edge shorter than the disturbance: the block crosses itself
            counts[f"{name}: refused"] += 1
            continue
        auto = check(drawn, Settings(method="rbe", mu=mu, tolerance="auto"))
        same = "same" if auto.verdict == exact else f"{exact} -> {auto.verdict}"
        counts[f"{name}, {'far' if far else 'near'}: {same}"] += 1
        if plain.verdict != exact and not plain.warnings:
            counts["silent"] += 1
            print(k, "silent", exact, plain.verdict)
        if far and auto.verdict != exact:
            print(
                k,
                model.name,
                name,
                f"{share:.2g}",
                some,
                f"mu {mu}",
                exact,
                "->",
                auto.verdict,
                auto.assumed.get("tolerance"),
                auto.provenance.get("refused", "")[:90],
            )
    for what, count in sorted(counts.items()):
        print(f"{count:6}  {what}")
    print(f"{cases} cases, {time.perf_counter() - start:.0f} s")


if __name__ == "__main__":
    main(int((sys.argv[1:] or ["200"])[0]), int((sys.argv[2:] or ["0"])[0]))
