"""Random structures asked of the program and of an oracle that shares nothing with it; runs for hours.

Run `python bench/audit.py --hours H [--seed S] [--rbe N] [--cra N] [--limit N] [--workers 2] [--save DIR] [--tally
FILE]`, or `python bench/audit.py FILE...` for cases that it saved. Structures are drawn by tests/oracle_models.py and
answered by tests/oracle.py; every verdict of ours is verified by the checker again. Prints, by kind and family:
cases, undecided, open (undecided, and the oracle cannot call them either), near (the oracle alone cannot),
contradictions, verdicts without a proof that holds, tracebacks. Each case that fails or stays undecided or open is
kept in DIR as JSON: model, options, what the oracle says and what we say. Ends with status 1 where a case failed.
Counts are those of cases done within the hours.
"""

import argparse
import json
import os
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from itertools import islice
from pathlib import Path
from time import perf_counter

for threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "RAYON_NUM_THREADS"):
    os.environ.setdefault(threads, "1")  # workers are the parallel part

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "tests"))  # the oracle and its models are shared with the tests

from auditing import AGREES, CONTRADICTS, FAILURES, NEAR, OPEN, RAISES, SECONDS, UNDECIDED, UNPROVED, judged  # noqa: E402
from oracle_models import MIXED, SHARES, drawn, loaded  # noqa: E402

OUTCOMES = (AGREES, UNDECIDED, OPEN, NEAR, CONTRADICTS, UNPROVED, RAISES)
BATCH = 20  # cases that a worker takes at once
KINDS = ("rbe", "cra", "limit")
Row = tuple[str, str, int, str, float, dict | None]  # kind, family, seed, outcome, seconds, the case if it is kept


def batch(kind: str, first: int, count: int, seconds: float) -> list[Row]:
    """Cases `first` to `first + count` of a kind."""
    rows: list[Row] = []
    with tempfile.TemporaryDirectory() as folder:
        for seed in range(first, first + count):
            began = perf_counter()
            found = judged(drawn(kind, seed), Path(folder), seconds)
            kept = found.row() | {"seed": seed} if found.outcome in (*FAILURES, UNDECIDED, OPEN) else None
            rows.append((kind, found.case.family, seed, found.outcome, perf_counter() - began, kept))
    return rows


def batches(counts: dict[str, int], seed: int, seconds: float) -> Iterator[tuple[str, int, int, float]]:
    """All of them, kinds taking turns in proportion so that whatever time there is is shared."""
    rounds = {kind: -(-count // BATCH) for kind, count in counts.items()}
    order = sorted(((k + 0.5) / n, kind, k) for kind, n in rounds.items() for k in range(n))
    for _, kind, k in order:
        yield kind, seed + k * BATCH, min(BATCH, counts[kind] - k * BATCH), seconds


def table(rows: Counter[tuple[str, str, str]], spent: Counter[str]) -> str:
    """Counts by kind and family."""
    lines = [f"{'':>22} {'cases':>7} " + " ".join(f"{name:>11}" for name in OUTCOMES)]

    def line(name: str, chosen: Counter[str]) -> str:
        return f"{name:>22} {chosen.total():>7} " + " ".join(f"{chosen[outcome]:>11}" for outcome in OUTCOMES)

    for kind in KINDS:
        families = sorted({family for k, family, _ in rows if k == kind})
        groups = {name: Counter({o: n for (k, f, o), n in rows.items() if (k, f) == (kind, name)}) for name in families}
        if not groups:
            continue
        lines += [line(f"{kind} {name}", group) for name, group in groups.items()]
        whole = sum(groups.values(), Counter())
        mixed = sum((group for name, group in groups.items() if name in MIXED), Counter())
        lines.append(line(f"{kind}, all", whole))
        lines.append(line(f"{kind}, sizes mixed", mixed))
        lines.append(f"{'':>22} {1e3 * spent[kind] / max(1, whole.total()):.1f} ms a case, drawing and oracle included")
    return "\n".join(lines)


def again(files: list[str], seconds: float) -> int:
    """Cases from files, one line each."""
    failed = 0
    with tempfile.TemporaryDirectory() as folder:
        for name in files:
            found = judged(loaded(json.loads(Path(name).read_text())), Path(folder), seconds)
            failed += found.outcome in FAILURES
            print(f"{name}: {found.outcome}; oracle {found.truth}; ours {found.ours}; {found.note}", flush=True)
    return failed


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", nargs="*", help="cases to ask again")
    parser.add_argument("--hours", type=float, default=1.5)
    parser.add_argument("--seed", type=int, default=1_000_000)
    parser.add_argument("--rbe", type=int, default=20_000)
    parser.add_argument("--cra", type=int, default=3_000)
    parser.add_argument("--limit", type=int, default=2_000)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--seconds", type=float, default=SECONDS, help="budget of one coupled search")
    parser.add_argument("--tally", type=Path, help="JSON file for the counts, which docs/validation.md shows")
    parser.add_argument("--save", type=Path, help="folder for cases that fail or stay undecided")
    chosen = parser.parse_args()
    if chosen.files:
        return 1 if again(chosen.files, chosen.seconds) else 0
    counts = {kind: getattr(chosen, kind) for kind in KINDS}
    tasks = batches({k: n for k, n in counts.items() if n}, chosen.seed, chosen.seconds)
    end, rows, spent = perf_counter() + 3600.0 * chosen.hours, Counter(), Counter()
    failed, done, shown = 0, 0, perf_counter()
    if chosen.save:
        chosen.save.mkdir(parents=True, exist_ok=True)
    with ProcessPoolExecutor(chosen.workers) as pool:
        running: set[Future] = {pool.submit(batch, *task) for task in islice(tasks, 2 * chosen.workers)}
        while running:
            finished, running = wait(running, return_when=FIRST_COMPLETED)
            for future in finished:
                if perf_counter() < end:
                    running |= {pool.submit(batch, *task) for task in islice(tasks, 1)}
                for kind, family, seed, outcome, seconds, kept in future.result():
                    rows[kind, family, outcome] += 1
                    spent[kind] += seconds
                    done += 1
                    if outcome in FAILURES:
                        failed += 1
                        print(f"{outcome}: {kind} {seed} ({family}); oracle {kept['oracle']}, ours {kept['ours']}")
                    if kept and chosen.save:
                        (chosen.save / f"{outcome}_{kind}_{seed}.json").write_text(json.dumps(kept))
            if perf_counter() - shown > 60.0:
                shown = perf_counter()
                print(f"{done} of {sum(counts.values())} cases, {failed} failed", flush=True)
    print(table(rows, spent))
    if chosen.tally:
        counted = [[*key, count] for key, count in sorted(rows.items())]
        chosen.tally.write_text(json.dumps({"seed": chosen.seed, "mixed": MIXED, "counts": counted}, indent=0) + "\n")
    print(f"{done} cases, {failed} failed; shares drawn: {', '.join(f'{k} {len(SHARES[k])} families' for k in KINDS)}")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
