"""Answers that are known, beside those that the program gives: writes docs/validation.md.

Run `python bench/validation.py [--quick]` with CYCLOPEAN_FIXTURES naming the folder above `compas_cra`. Three parts:
numbers that stand in books, found by bisection on the verdict or by one programme; every one of compas_cra's own cases;
and tests that hold a law or damage a file, counted as pytest ran them. `--quick` prints the first part and writes
nothing. The page bears no date and no times: it changes when an answer does.
"""

import argparse
import ast
import json
import os
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as ElementTree
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from cyclopean.analysis import Settings, check, solve_rbe
from cyclopean.assembly import Assembly
from cyclopean.design import arch, stack, wall
from cyclopean.design.carving.carve import carve
from cyclopean.design.stones.stone import stone_of
from cyclopean.geometry.solids import CUBE, mesh_of, solid_of
from cyclopean.io import read_model

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "tests"))  # models and limits by hand are shared with the tests that pin them

from near_limit import G, limit_multiplier, posed  # noqa: E402
from test_textbook import UPRIGHT, bisected, lune, tilted  # noqa: E402

PAGE = ROOT / "docs" / "validation.md"
FOLDER = Path(os.environ.get("CYCLOPEAN_FIXTURES", ROOT.parent / "shared" / "fixtures")) / "compas_cra"
TALLY = ROOT / "bench" / "audit.json"  # what bench/audit.py counted last
KINDS = {"rbe": "Rigid-block equilibrium", "cra": "Coupled analysis", "limit": "Limits"}
OUTCOMES = ("agrees", "undecided", "open", "near", "contradicts", "unproved", "raises")
ROUNDING = 1e-12  # of sums of a few floats
PROGRAMME = 1e-7  # relative; what the conic programme behind a multiplier is solved to, times its conditioning
LAWS = (
    *("test_near_limit", "test_laws", "test_cra_laws", "test_cra_random", "test_rbe"),
    *("test_proof_checker", "test_proof_cra_state", "test_proof_cra_tree", "test_proof_laws", "test_proof_mutations"),
    *("test_mutated_certificates", "test_proof_fast_paths", "test_proof_standalone"),
    *("test_matching_laws", "test_fuzz", "test_io_fuzz"),
)
# How many random models are settled within their seconds is a fact of the machine, and no answer.
TIMED = ("test_cra_random.py::test_both_verdicts_and_all_kinds_are_drawn",)


@dataclass(frozen=True)
class Known:
    """One number that is known, and how to find it."""

    what: str
    source: str
    value: float
    within: float  # how far ours may be off: digits quoted, width of the bisection, or rounding
    find: Callable[[], float]


def stands(model: Assembly, mu: float, gravity: np.ndarray = UPRIGHT) -> bool:
    """Whether forces were found; within a billionth of the limit, where neither answer is proved, they were not."""
    return solve_rbe(posed(model, mu, gravity)).word == "balanced"


def falls_at(count: int, mu: float, low: float, high: float) -> float:
    """Slope (degrees) at which a stack of cubes falls."""
    return -bisected(lambda t: stands(stack(count), mu, tilted(-t)), -high, -low, 2e-6)


def thickness(voussoirs: int) -> float:
    """Least t/R of a semicircular arch on plane springings."""
    return bisected(lambda t: stands(arch(voussoirs, radius=1.0, thickness=t, facets=32), 0.84), 0.100, 0.115, 2e-6)


def least_friction(voussoirs: int) -> float:
    """Least mu at which a semicircle of any thickness stands."""

    def at(t: float) -> float:
        model = arch(voussoirs, radius=1.0, thickness=t, facets=16)
        return bisected(lambda mu: stands(model, mu), 0.25, 0.45, 2e-5)

    return min(at(t) for t in (0.16, 0.18, 0.20, 0.22, 0.24))


def pushed(model: Assembly, mu: float, heading: Sequence[float]) -> float:
    """Multiplier of weight, sideways, at which a model falls (associated flow)."""
    base = posed(model, mu, np.array([0.0, 0.0, -G]))
    both = posed(model, mu, G * np.array([heading[0], heading[1], -1.0]))
    return limit_multiplier(base, both.p * (both.force_unit / base.force_unit) - base.p)


def overhang() -> float:
    """How far a block may stand out over another."""
    return -bisected(lambda x: stands(stack(2, offset=[0.0, -x]), 0.84), -0.6, -0.4, 1e-7)


def reach(count: int) -> float:
    """How far a harmonic stack may stand out: the reach found by stretching all overhangs alike."""
    steps = [0.0, *[1 / (2 * k) for k in range(count, 0, -1)]]

    def holds(stretch: float) -> bool:
        return stands(stack(count + 1, size=(1, 1, 0.25), offset=[-stretch * s for s in steps]), 0.84)

    return -bisected(holds, -1.1, -0.9, 1e-7) * sum(steps)


def carved_cube() -> float:
    """Share carved off a cube that is a tenth too large, centred in its cell."""
    from cyclopean.assembly import Block

    corner = np.array([[x, y, z] for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)])
    oversize = stone_of("cube", *mesh_of(solid_of(1.1 * corner - 0.05, CUBE)))
    return float(carve(oversize, Block("cell", corner, CUBE), np.eye(3), np.zeros(3)).carved_share)


def textbook() -> Iterator[Known]:
    """Every number, cheapest first."""
    statics, bisection = "statics", 1e-5
    for mu in (0.3, 0.5, 0.7):
        yield Known(
            f"Slope at which a cube slides, mu = {mu:g} (degrees)",
            statics,
            float(np.rad2deg(np.arctan(mu))),
            bisection,
            lambda mu=mu: falls_at(1, mu, 5.0, 44.0),
        )
    yield Known("Slope at which a cube tips, mu = 2 (degrees)", statics, 45.0, bisection, lambda: falls_at(1, 2, 5, 60))
    tips = float(np.rad2deg(np.arctan(0.5)))
    yield Known("Slope at which two cubes tip (degrees)", statics, tips, bisection, lambda: falls_at(2, 0.84, 5, 44))
    yield Known("Overhang of one block", statics, 0.5, 1e-6, overhang)
    for count in (2, 4, 8):
        harmonic = 0.5 * sum(1 / k for k in range(1, count + 1))
        yield Known(f"Reach of a harmonic stack of {count}", statics, harmonic, 3e-6, lambda n=count: reach(n))
    for base, mu in ((1.0, 0.5), (0.25, 0.84), (0.5, 0.5)):
        yield Known(
            f"Push that moves a block, b/h = {base:g}, mu = {mu:g} (weights)",
            "min(mu, b/h)",
            min(mu, base),
            PROGRAMME,
            lambda b=base, m=mu: pushed(stack(1, size=(b, 1.0, 1.0)), m, (1.0, 0.0)),
        )
    for side in (7, 12):
        yield Known(
            f"Push out of its plane that tips a wall of {side} courses, 0.2 m thick and high (weights)",
            "T / (m H)",
            1.0 / side,
            PROGRAMME,
            lambda n=side: pushed(wall(n, n, length=0.4, depth=0.2, height=0.2), 0.84, (0.0, 1.0)),
        )
    for voussoirs, value in ((20, 0.10746), (21, 0.10679), (40, 0.10746), (80, 0.10746)):
        yield Known(
            f"Least t/R of a semicircular arch of {voussoirs}",
            "Cocchetti & Rizzi 2020; linear programme",
            value,
            1.5e-5,
            lambda n=voussoirs: thickness(n),
        )
    for voussoirs, value in ((20, 0.3090), (80, 0.3094)):
        yield Known(
            f"Least friction of a semicircular arch of {voussoirs}",
            "Cocchetti & Rizzi 2020",
            value,
            3e-4,
            lambda n=voussoirs: least_friction(n),
        )
    thin = arch(80, radius=1.0, thickness=0.10746 * 1.0005, facets=32)
    yield Known(
        "Friction below which the thinnest arch slides too",
        "Cocchetti & Rizzi 2020",
        0.3958,
        4e-3,
        lambda: bisected(lambda mu: stands(thin, mu), 0.30, 0.60, 1e-4),
    )
    yield Known(
        "Least t/R of a hemispherical dome, by lunes",
        "linear programme",
        0.0428,
        2e-4,
        lambda: bisected(lambda t: stands(lune(160, t), 0.84), 0.035, 0.055, 1e-5),
    )
    yield Known("Share carved off stone 10 % oversize", "1 - 1.1^-3", 1 - 1.1**-3, ROUNDING, carved_cube)


def digits(known: Known) -> int:
    """Decimals that mean something: one more than the allowance."""
    return min(12, 1 + int(np.ceil(-np.log10(known.within))))


def textbook_rows() -> tuple[list[str], int]:
    """Rows of the first table, and how many of them are off."""
    rows, off = [], 0
    for known in textbook():
        found = known.find()
        agrees = abs(found - known.value) <= known.within
        off += not agrees
        n = digits(known)
        quoted = f"{known.value:.{n}f}".rstrip("0").rstrip(".")
        word = "" if agrees else " **off**"
        rows.append(f"| {known.what} | {known.source} | {quoted} | {found:.{n}f}{word} | {known.within:.1g} |")
        print(rows[-1], flush=True)
    return rows, off


def peer_rows() -> tuple[list[str], int]:
    """Rows of the second table: what statics expects of compas_cra's cases, what it says, what we prove."""
    from fixtures_compas_cra import NAMES, raw
    from test_peer import FALLING
    from test_peer_cra import JAMMED, OPEN, WIDE

    rows, off = [], 0
    for name in NAMES:
        model, _ = read_model(FOLDER / f"{name}.json")
        eta = 100.0 if name.startswith(WIDE) else 10.0
        rbe = check(model, Settings(method="rbe"))
        cra = check(model, Settings(method="cra", eta=eta, seconds=5.0 if name in OPEN else 60.0))
        expected = (
            "falls" if name in FALLING else "forces only" if name in JAMMED else "open" if name in OPEN else "stands"
        )
        wanted = {"falls": ("unstable",) * 2, "forces only": ("stable", "unstable"), "stands": ("stable",) * 2}
        off += expected != "open" and (rbe.verdict, cra.verdict) != wanted[expected]
        theirs = (raw(name)["peer"]["cra"] or {}).get("verdict") or "no answer"
        proof = f"`{cra.certificate['kind']}`" if cra.certificate else ""
        rows.append(f"| {name} | {expected} | {theirs} | {rbe.verdict} | {cra.verdict} | {proof} |")
        print(rows[-1], flush=True)
    return rows, off


def audit_rows() -> list[str]:
    """Rows of the table of random structures: a kind each, and those of them whose stones differ in size."""
    tally = json.loads(TALLY.read_text(encoding="utf-8"))
    rows = []
    for kind, name in KINDS.items():
        for what, mixed in ((name, False), (f"{name}, sizes mixed", True)):
            count: Counter[str] = Counter()
            for one, family, outcome, number in tally["counts"]:
                count[outcome] += number * (one == kind and (family in tally["mixed"] or not mixed))
            cells = " | ".join(f"{count[outcome]:,}" for outcome in OUTCOMES)
            rows.append(f"| {what} | {count.total():,} | {cells} |")
    return rows


def law_rows() -> tuple[list[str], int]:
    """Rows of the third table: files of tests, what they hold, and how many cases passed and failed."""
    files = [path for name in LAWS if (path := ROOT / "tests" / f"{name}.py").exists()]
    with tempfile.TemporaryDirectory() as folder:
        report = Path(folder) / "report.xml"
        without = [f"--deselect=tests/{name}" for name in TIMED]
        command = [sys.executable, "-m", "pytest", "-n", "auto", f"--junitxml={report}", *without, *map(str, files)]
        subprocess.run(command, cwd=ROOT, check=False, stdout=subprocess.DEVNULL)
        cases = list(ElementTree.parse(report).getroot().iter("testcase"))
    passed: Counter[str] = Counter()
    failed: Counter[str] = Counter()
    for case in cases:
        file = case.get("classname", "").split(".")[-1]
        bad = case.find("failure") is not None or case.find("error") is not None
        (failed if bad else passed)[file] += case.find("skipped") is None
    rows = []
    for path in files:
        said = (ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or "").splitlines()[0]
        rows.append(f"| {said} | `tests/{path.name}` | {passed[path.stem]:,} | {failed[path.stem] or 0} |")
        print(rows[-1], flush=True)
    return rows, sum(failed.values())


TEMPLATE = """# Validation

Answers that are known, beside those that this program gives. The page is written by `python bench/validation.py`, which
computes every number anew; it bears no date because it changes only when an answer does. The tests pin the same
numbers, so a change that breaks one does not pass.

**{off} of {count} rows are off.**

## Numbers that stand in books

Limits are found by bisection on whether forces are found (pushes by one conic programme). *Within* is the allowance:
the digits that are quoted, the width of the bisection, or rounding. Arches have facets, 16 or 32 chords a voussoir,
where the sources have arcs.

| Answer | Source | Known | Found | Within |
|---|---|---|---|---|
{textbook}

Milankovitch (1907) gives 0.1075 for the arch of thin voussoirs; with all weight on the centre line it is 0.107426. The
dome is cut into lunes, see `tests/test_textbook.py`.

- G. Cocchetti, E. Rizzi: Analytical and numerical analysis on the collapse modes of least-thickness circular masonry
  arches at decreasing friction. *Frattura ed Integrità Strutturale* 14(51) (2020), 356-375.
- M. Milankovitch: Theorie der Druckkurven. *Zeitschrift für Mathematik und Physik* 55 (1907), 1-27.

## compas_cra's own cases

*Expected* is by statics: cubes slide beyond atan(mu) and two of them tip at 26.565 degrees; wedges whose faces open
downwards drop; in `16_A` and `16_H` forces balance that nothing can produce. *Its CRA* is what compas_cra 0.8.0 says:
its "infeasible" is local, and proves nothing. `07_shelf` and `07_shelf-s3` stay open here: with the 5 s that each has
for this page they are *undecided*; what more time finds stands in the
[benchmarks](benchmarks.md#compas_cras-own-cases).

| Case | Expected | Its CRA | Our RBE | Our CRA | Proof |
|---|---|---|---|---|---|
{peer}

## Random structures, answered twice

`bench/audit.py --seed {seed} --tally bench/audit.json` draws structures in eleven families (cut by lines and planes,
fans, wedges, slivers, pins, small stones on big ones, sizes up to 1 : 10,000) and asks this program and an oracle
that shares nothing with it (`tests/oracle.py`: linear programmes and searches by HiGHS, checked in extended
precision). *Undecided* are what the oracle knows and the program does not say; *open* what neither says; *near* what
only the oracle cannot call.

| Question | Cases | Agree | Undecided | Open | Near | Contradict | Without a proof | Tracebacks |
|---|---|---|---|---|---|---|---|---|
{audit}

`tests/test_random_planes.py` asks 1,000 more by `--thorough`, in the plane alone, of a linear programme that HiGHS
solves: joints without friction, stones up to 1 : 300, loads on single blocks, pushes in any direction. At rest 482 fall
and 518 stand; of these 301 have a limit and 217 none. All agree, none is undecided, every proof holds. Bounds of a
limit lie within 1e-6 of it, or of the multiplier that is a block's own weight: what a certificate lets a state miss
keeps them up to 5e-5 apart at small multipliers.

## Laws, random models, damaged files

Tests that compare with no known answer but hold the program to laws: a verdict does not change with units, place,
direction, order or names; two solvers that share no code agree on models within 2 % of their limit; every verdict has
a certificate that an exact checker accepts, and a damaged certificate is refused. Counted as they ran.

| What | File | Passed | Failed |
|---|---|---|---|
{laws}

`CYCLOPEAN_CASES`, `CYCLOPEAN_CLI_FUZZ` and the like in these files ask for more cases than a normal run has.

## What is not validated here

The numbers above say that the program solves its equations. Whether the equations describe a wall is asked by
[experiments](experiments.md), and [the limits](limits.md) of the theory are listed.
"""


def main(given: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="only the numbers that stand in books; write nothing")
    quick = parser.parse_args(given).quick
    known, off = textbook_rows()
    if quick:
        return int(off > 0)
    if not FOLDER.is_dir():
        print(f"{FOLDER} is not there: CYCLOPEAN_FIXTURES has to name the folder above compas_cra", file=sys.stderr)
        return 2
    peer, wrong = peer_rows()
    laws, failed = law_rows()
    seed = json.loads(TALLY.read_text(encoding="utf-8"))["seed"]
    tables = {
        "seed": seed,
        "audit": "\n".join(audit_rows()),
        "textbook": "\n".join(known),
        "peer": "\n".join(peer),
        "laws": "\n".join(laws),
    }
    count = len(known) + len(peer) + len(laws)
    bad = off + wrong + sum(not row.endswith("| 0 |") for row in laws)
    PAGE.write_text(TEMPLATE.format(off=bad or "None", count=count, **tables), encoding="utf-8")
    return int(bad + failed > 0)


if __name__ == "__main__":
    raise SystemExit(main())
