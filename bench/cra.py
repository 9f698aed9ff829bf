"""Coupled analysis against compas_cra 0.8.0 on the same blocks and contacts, in one run (extra `peer`).

Run `python bench/cra.py [--peer-limit 60] [--only wall]`; prints one row a case: the peer's set-up and solve and its
word, then our time from arrays (blocks and contacts) to a verified verdict, the solver's part of it, our verdict, the
route that found it, and the ratio. Medians of five runs on our side (of one above two seconds), one run on the peer's,
in a process of its own that is stopped at the limit. `--no-peer` times our side alone and needs no extra;
`--large` adds walls of 1,000 and 10,000 blocks, vaults and domes, which the peer does not reach.

Bridge, snake and others are read from a folder of compas_cra's own cases, CYCLOPEAN_FIXTURES; skipped where they are
not.

One thread: set RAYON_NUM_THREADS=1 and OMP_NUM_THREADS=1 before.
"""

import argparse
import contextlib
import importlib.util
import io
import multiprocessing
import os
import resource
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from statistics import median
from time import perf_counter

from contacts import wall as plain_wall

from cyclopean.analysis import Settings, check
from cyclopean.assembly import Assembly, detect
from cyclopean.design import arch, dome, vault, wall
from cyclopean.io import read_model

MU = 0.84
CASES = Path(os.environ.get("CYCLOPEAN_FIXTURES", "../shared/fixtures")) / "compas_cra"


def with_contacts(model: Assembly) -> Assembly:
    """The same blocks with the contacts that geometry gives."""
    return replace(model, contacts=detect(model).contacts)


def small() -> Iterator[tuple[str, Assembly, Settings]]:
    """Cases that the peer is run on too."""
    upright = Settings(method="cra", mu=MU)
    for side in (5, 8, 10, 15, 20):
        yield f"wall {side}x{side}", with_contacts(plain_wall(side, side)), upright
    for count in (20, 30, 40):
        for thickness in (0.5, 0.6, 0.8, 1.2):
            model = arch(count, span=10.0, thickness=thickness, springers="fixed")
            yield f"arch {count} t={thickness:g}", model, upright
    for name in ("09_bridge", "09b_bridge_uniform", "08_snake", "06_arch20", "07_shelf-stable", "14_cube-curve-short"):
        if (path := CASES / f"{name}.json").is_file():
            yield name[:18], read_model(path)[0], Settings(method="cra")


def large() -> Iterator[tuple[str, Assembly, Settings]]:
    """Cases that the peer does not reach."""
    for side, tilts in ((32, (0, 5, 10)), (100, (0, 5, 10))):
        for tilt in tilts:
            model = wall(side, side)
            yield f"wall {len(model)} tilt {tilt}", model, Settings(method="cra", mu=MU, tilt=(float(tilt), 0.0))
    for rows, columns in ((15, 10), (41, 25)):
        model = vault(rows, columns, thickness=0.2)
        yield f"vault {len(model)}", model, Settings(method="cra", mu=MU)
    for courses, stones in ((4, 12), (18, 56)):
        model = dome(courses, stones, thickness=0.15)
        yield f"dome {len(model)}", model, Settings(method="cra", mu=MU)


def peer_answer(model: Assembly, mu: float, pipe) -> None:
    """Set up and solve by compas_cra with its own options; what it prints on the way is dropped."""
    from compas_cra.equilibrium.cra_native import _CRA_OPTIONS, cra_problem, solve_nlp
    from peer import peer_model

    with contextlib.redirect_stdout(io.StringIO()):
        theirs = peer_model(model, model.contacts)
        began = perf_counter()
        problem = cra_problem(theirs, mu=mu, density=1.0)
        answer = solve_nlp(problem[0], backend="native", options=_CRA_OPTIONS, verbose=False)
        pipe.send((perf_counter() - began, answer.status))


def peer_time(model: Assembly, mu: float, limit: float) -> tuple[float, str]:
    """Seconds and word of the peer, in a process of its own; where it is not installed, that."""
    if importlib.util.find_spec("compas_cra") is None:
        return float("nan"), "absent"
    here, there = multiprocessing.Pipe(duplex=False)
    process = multiprocessing.Process(target=peer_answer, args=(model, mu, there))
    process.start()
    there.close()
    try:
        if not here.poll(limit):
            return limit, f"> {limit:g} s"
        return here.recv()
    except EOFError:
        return float("nan"), "crashed"
    finally:
        process.kill()
        process.join()


def our_time(model: Assembly, settings: Settings):
    """Median seconds from arrays to a verified verdict, and the result."""
    times = []
    for _ in range(5):
        began = perf_counter()
        result = check(model, settings)
        times.append(perf_counter() - began)
        if times[-1] > 2.0:
            break
    return median(times), result


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--peer-limit", type=float, default=60.0)
    parser.add_argument("--no-peer", action="store_true")
    parser.add_argument("--large", action="store_true")
    parser.add_argument("--only", default="")
    chosen = parser.parse_args()
    check(wall(2, 2), Settings(method="cra"))  # imports are not what is timed
    check(wall(12, 12), Settings(method="cra", tilt=(3.0, 0.0)))
    print(
        f"{'case':>20} {'blocks':>6} {'contacts':>8} {'peer s':>8} {'':>10} |"
        f" {'whole s':>8} {'solve':>7} {'verify':>7} {'verdict':>9} {'route':>12} {'ratio':>6} {'peak MB':>8}"
    )
    for large_case, cases in ((False, small()), (True, large() if chosen.large else ())):
        for name, model, settings in cases:
            if not name.startswith(chosen.only):
                continue
            peer, word = float("nan"), "-"
            if not (chosen.no_peer or large_case):
                mu = settings.mu if settings.mu is not None else float(model.contacts.mu[0])
                peer, word = peer_time(model, mu, chosen.peer_limit)
            whole, result = our_time(model, settings)
            peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
            print(
                f"{name:>20} {len(model):>6} {len(model.contacts):>8} {peer:>8.2f} {word:>10} |"
                f" {whole:>8.3f} {result.seconds['solve']:>7.3f} {result.seconds['verify']:>7.3f}"
                f" {result.verdict:>9} {result.provenance.get('route', ''):>12} {peer / whole:>6.0f} {peak:>8.0f}",
                flush=True,
            )


if __name__ == "__main__":
    main()
