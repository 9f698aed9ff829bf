"""A small audit in every run of the tests: the program against the oracle; `bench/audit.py` is the long one."""

from collections import Counter
from dataclasses import replace
from pathlib import Path

import pytest

import auditing
import cyclopean
from auditing import CONTRADICTS, FAILURES, NEAR, OPEN, RAISES, UNDECIDED, UNPROVED, contradicts, judged
from cyclopean.analysis.limit_analysis import proving
from laws import quick
from oracle import LimitAnswer
from oracle_models import SHARES, drawn

COUNTS = {"rbe": 4, "cra": 2, "limit": 2} if quick() else {"rbe": 15, "cra": 3, "limit": 6}  # seeds of each family
QUICK = {("cra", "wedge"): (2, 4, 6), ("cra", "squeezed"): (0, 1, 3)}  # ... where others take seconds
# How many of them the program may leave open; every family that is not named: none.
MOST_UNDECIDED = {
    ("rbe", "pins in space"): 1,
    ("cra", "cut"): 1,  # these where the machine is busy: a search has its seconds
    ("cra", "wedge"): 1,
    ("cra", "squeezed"): 1,
}
MOST_NEAR = {"rbe": 1, "cra": 2, "limit": 1}  # ... and the oracle
FAMILIES = [(kind, family) for kind, shares in SHARES.items() for family in shares]


@pytest.mark.parametrize(("kind", "family"), FAMILIES)
def test_nothing_contradicts_the_oracle(kind: str, family: str, tmp_path: Path) -> None:
    seeds = QUICK.get((kind, family), range(15))[: COUNTS[kind]]
    found = {seed: judged(drawn(kind, seed, family), tmp_path) for seed in seeds}
    failed = [(seed, f.outcome, f.truth, f.ours, f.note) for seed, f in found.items() if f.outcome in FAILURES]
    assert not failed
    counts = Counter(f.outcome for f in found.values())
    open_ones = [(seed, f.truth, f.note) for seed, f in found.items() if f.outcome in (UNDECIDED, OPEN)]
    assert counts[UNDECIDED] + counts[OPEN] <= MOST_UNDECIDED.get((kind, family), 0), open_ones
    assert counts[NEAR] <= MOST_NEAR[kind]


@pytest.mark.parametrize("seed", [40098, 40146, 40248])
@pytest.mark.parametrize("most", [proving.OWN_SCALE, 0])
def test_what_needs_its_live_loads_falls_without_them(
    seed: int, most: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also where a model has more blocks than are solved again at their own scale: both bounds alone say "limit"."""
    monkeypatch.setattr(proving, "OWN_SCALE", most)
    found = judged(drawn("limit", seed), tmp_path)
    assert (found.outcome, found.truth) == ("agrees", "falls"), found.note


@pytest.mark.parametrize("seed", [40284, 100574])
def test_bounds_that_solvers_leave_apart_are_brought_together(
    seed: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Cubes on pins of a thousandth of their size."""
    found = judged(drawn("limit", seed), tmp_path)
    assert found.outcome == "agrees", (found.truth, found.ours, found.note)
    monkeypatch.setattr(proving, "_bisected", lambda _case, known, *_: known)
    assert judged(drawn("limit", seed), tmp_path).outcome == UNDECIDED


def test_a_push_that_ten_million_times_its_own_does_not_bring_it_down(tmp_path: Path) -> None:
    """Where solvers find a state at 2e7 times the push, and no more, forces are sought that balance the push alone."""
    found = judged(drawn("limit", 300652), tmp_path)
    assert (found.outcome, found.truth) == ("agrees", "unbounded"), found.note


def test_a_lower_bound_has_no_use_of_what_balance_may_miss(tmp_path: Path) -> None:
    """A stone of 0.45 N beside two of 47 kN: forces that miss 4e-10 of its weight stand 1e-8 above the limit.

    Whether a solver comes upon such forces depends on how the machine rounds.
    """
    assert judged(drawn("limit", 101087), tmp_path).outcome == "agrees"


def test_forces_without_friction_that_are_to_end_at_zero_do_not_pull(tmp_path: Path) -> None:
    assert judged(drawn("rbe", 109792), tmp_path).outcome == "agrees"


# --- the audit can fail ----------------------------------------------------------------------------------------------


def test_a_wrong_verdict_is_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Every verdict turned round, first with the proof of the other model, then with none; then a traceback."""
    case = drawn("rbe", 0, "cut")
    right = judged(case, tmp_path)
    assert right.outcome == "agrees"
    check, other = cyclopean.check, {"stable": "unstable", "unstable": "stable"}

    def turned(*args, **options):
        result = check(*args, **options)
        return replace(result, verdict=other[result.verdict])

    def of_another(path, **options):
        """A true proof of a model with other friction: the verdict is wrong for the one that was asked."""
        for mu in (0.0, 5.0):
            result = check(path, **(options | {"mu": mu}))
            if result.verdict == other[right.ours]:
                return result
        raise AssertionError

    monkeypatch.setattr(cyclopean, "check", turned)
    assert judged(case, tmp_path).outcome == UNPROVED
    monkeypatch.setattr(cyclopean, "check", lambda *a, **o: replace(check(*a, **o), certificate=None))
    assert judged(case, tmp_path).outcome == UNPROVED
    monkeypatch.setattr(cyclopean, "check", of_another)
    assert judged(case, tmp_path).outcome == CONTRADICTS
    monkeypatch.setattr(cyclopean, "check", lambda *_, **__: 1 / 0)
    found = judged(case, tmp_path)
    assert found.outcome == RAISES
    assert "ZeroDivisionError" in found.note
    assert auditing.answer(case) == right.truth


@pytest.mark.parametrize(
    ("truth", "word", "lower", "upper", "wrong"),
    [
        (LimitAnswer("limit", 0.4, 0.41), "limit", 0.405, 0.405, False),
        (LimitAnswer("limit", 0.4, 0.41), "limit", 0.3, 0.5, False),
        (LimitAnswer("limit", 0.4, 0.41), "limit", 0.42, 0.42, True),
        (LimitAnswer("limit", 0.4, 0.41), "limit", 0.39, 0.39, True),
        (LimitAnswer("limit", 0.4, 0.41), "undecided", 0.42, None, True),
        (LimitAnswer("limit", 0.4, 0.41), "undecided", 0.1, None, False),
        (LimitAnswer("limit", 0.4, 0.41), "falls", None, None, True),
        (LimitAnswer("limit", 0.4, 0.41), "unbounded", 1000.0, None, True),
        (LimitAnswer("falls"), "falls", None, None, False),
        (LimitAnswer("falls"), "falls", -0.5, -0.4, False),
        (LimitAnswer("falls"), "limit", 0.1, 0.1, True),
        (LimitAnswer("unbounded"), "unbounded", 1000.0, None, False),
        (LimitAnswer("unbounded"), "limit", 1.0, 1.0, True),
        (LimitAnswer("unbounded"), "falls", None, None, True),
        (LimitAnswer("near"), "falls", None, None, False),
    ],
)
def test_what_contradicts_a_multiplier(truth, word, lower, upper, wrong) -> None:
    assert contradicts(truth, word, lower, upper) is wrong
