"""Best fit, by hand and by laws."""

from typing import get_args

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cyclopean.analysis import Settings, check
from cyclopean.design.ashlar.best_fit import Method, Weights, best_fit, pack, score, scores_of
from cyclopean.design.ashlar.planning import AshlarSettings
from cyclopean.design.ashlar.stock import Slab
from cyclopean.design.ashlar.wall import ashlar
from cyclopean.errors import InputError
from laws import examples
from test_ashlar import BOX, BRICK, laws, of

SLOT = np.array([0.3, 0.2, 0.15])


def mixed(count, seed=1, low=0.2, high=0.6):
    rng = np.random.default_rng(seed)
    return [Slab(f"m{k:03d}", (round(float(x), 3), 0.2, 0.15)) for k, x in enumerate(rng.uniform(low, high, count))]


@pytest.mark.parametrize(
    ("size", "by_hand"),
    [
        ((0.3, 0.2, 0.15), 1.0),
        ((0.6, 0.2, 0.15), 0.4 / 2 + 0.2 + 0.2 + 0.2 / 2),
        ((0.3, 0.4, 0.15), 0.4 + 0.2 / 2 + 0.2 + 0.2),
        ((0.3, 0.2, 0.20), 0.4 + 0.2 + 0.2 * 0.75 + 0.2 * 0.75),
        ((0.1, 0.2, 0.15), 0.4 / 3 + 0.2 + 0.2 + 0.2 / 3),
    ],
)
def test_score_by_hand(size, by_hand):
    assert score(np.array(size), SLOT) == pytest.approx(by_hand)


def test_only_the_ratios_of_the_weights_count():
    sizes = np.random.default_rng(0).uniform(0.1, 0.5, (20, 2, 3))
    assert score(sizes, SLOT, Weights(4, 2, 2, 2)) == pytest.approx(score(sizes, SLOT))
    assert score(sizes, SLOT, Weights(1, 0, 0, 0)) == pytest.approx(
        1 - np.abs(sizes[..., 0] - 0.3) / np.maximum(sizes[..., 0], 0.3)
    )


@given(st.lists(st.tuples(*[st.floats(0.05, 2.0)] * 3), min_size=1, max_size=8))
def test_a_score_is_a_share_and_one_only_for_the_slot(sizes):
    found = score(np.array(sizes), SLOT)
    assert ((found >= 0.0) & (found <= 1.0)).all()
    assert (found < 1.0 - 1e-9).tolist() == [not np.allclose(s, SLOT, rtol=3e-9) for s in sizes] or found.max() > 0.999


def test_the_case_of_the_earlier_system():
    """6 courses as there; it places 30 with open ends, we have 33 of the same 30 slabs (see test_ashlar)."""
    done = pack(AshlarSettings(1.5, 1.0, 0.2), of(30, BOX), slots="bond")
    assert (done.wall.readout.courses, done.wall.readout.blocks, done.wall.readout.leftover) == (6, 33, 0)
    stack = pack(AshlarSettings(1.5, 1.0, 0.2, bond="stack"), of(30, BOX), slots="bond")
    assert (stack.wall.readout.blocks, stack.mean, stack.poor) == (30, 1.0, 0)


def test_it_chooses_the_long_one_and_the_offcut_that_fits():
    """0.30 over 0.10 for a slot of 0.30; and for one of 0.15 the half that is left over, not a new slab."""
    rule = best_fit()
    sizes = np.array([[[0.1, 0.2, 0.15]] * 2, [[0.3, 0.2, 0.15]] * 2])
    assert rule(sizes, np.ones((2, 2), bool), SLOT) == (1, False)
    wall = pack(AshlarSettings(0.6, 0.3, 0.2), of(5, BOX), slots="bond").wall
    assert [s.sawn.offcut for s in wall.laid if s.slot.course == 1] == [False, False, True]
    assert wall.readout.cuts == 1


def test_first_fit_takes_over_where_nothing_scores_enough():
    """A slot that only slabs of three times its length can fill: the score is 0.4/3 + 0.2 + 0.2 + 0.2/3 = 0.6."""
    sizes = np.array([[[0.9, 0.2, 0.15], [0.2, 0.9, 0.15]], [[0.92, 0.2, 0.15], [0.2, 0.92, 0.15]]])
    fits = np.array([[True, False], [True, False]])
    calls = []

    def order(k, least):
        calls.append(best_fit(Weights(), least)(sizes[::k], fits[::k], SLOT))
        return calls[-1]

    assert order(1, 0.5) == (0, False)  # the better one
    assert order(-1, 0.5) == (1, False)  # wherever it stands
    assert order(-1, 0.7) == (0, False)  # the first one, whichever is better
    long = pack(AshlarSettings(0.3, 0.15, 0.2, unit=0.3), of(1, (0.9, 0.2, 0.15)), slots="bond", least_score=0.7)
    assert (long.wall.readout.blocks, long.poor) == (1, 1)
    assert best_fit()(sizes, np.zeros((2, 2), bool), SLOT) is None


def test_together_can_beat_one_after_the_other():
    """14 slabs of which one after the other spoils one that would have filled a later slot uncut."""
    lengths = np.random.default_rng(7).choice([0.3, 0.35, 0.4, 0.45, 0.5, 0.6], 14)
    stock = [Slab(f"{k:02d}", (float(x), 0.2, 0.15)) for k, x in enumerate(lengths)]
    own = AshlarSettings(1.2, 0.3, 0.2, unit=0.3)
    best, together = (pack(own, stock, method=m, slots="bond") for m in ("best", "global"))
    assert [s.slot for s in together.wall.laid] == [s.slot for s in best.wall.laid]
    assert together.mean > best.mean + 0.05
    assert (together.wall.readout.cuts, best.wall.readout.cuts) == (5, 6)
    laws(together.wall)


def test_uncut_stones_are_assigned_together():
    """Slots of 0.30 and slabs of 0.30 among longer ones: those of 0.30 fill them, whatever the order."""
    stock = [*of(10, BOX), *of(6, (0.45, 0.2, 0.15), "long")]
    done = pack(AshlarSettings(1.5, 0.3, 0.2, bond="stack", unit=0.3), stock, method="global", slots="bond")
    assert done.mean == 1.0
    assert done.wall.readout.cuts == 0
    assert done.wall.readout.leftover == 6


@pytest.mark.parametrize("method", get_args(Method))
@pytest.mark.parametrize("bond", ["running", "flemish"])
def test_laws(method, bond):
    stock = mixed(60) if bond == "running" else of(120, BRICK)
    done = pack(AshlarSettings(1.7, 0.6, 0.2, bond=bond), stock, method=method, slots="bond")
    laws(done.wall)
    assert done.wall.readout.coverage == pytest.approx(1.0)
    assert done.mean == pytest.approx(scores_of(done.wall).mean())
    assert check(done.wall.assembly, Settings(method="cra")).verdict == "stable"
    again = pack(AshlarSettings(1.7, 0.6, 0.2, bond=bond), stock[::-1], method=method, slots="bond")
    assert [(s.slot, s.sawn.slab) for s in again.wall.laid] == [(s.slot, s.sawn.slab) for s in done.wall.laid]


@settings(max_examples=examples(15), deadline=None)
@given(st.integers(0, 10_000), st.floats(0.8, 3.0), st.sampled_from([0.0, 0.01]))
def test_laws_of_free_slots(seed, length, joint):
    own = AshlarSettings(length, 0.6, 0.2, head=joint, bed=joint)
    done = pack(own, mixed(45, seed))
    laws(done.wall)
    if not done.wall.gaps:
        top = max(s.slot.high[2] for s in done.wall.laid)
        assert done.wall.readout.coverage == pytest.approx(top / own.height)
        assert done.wall.readout.aligned == 0


def test_free_slots_cut_far_fewer_stones_than_those_of_a_bond():
    own = AshlarSettings(3.0, 0.9, 0.2)
    free, bond = (pack(own, mixed(80, 5), slots=s).wall.readout for s in ("free", "bond"))
    assert free.coverage == pytest.approx(1.0)
    assert bond.coverage == pytest.approx(1.0)
    assert free.cuts < bond.cuts / 3


def test_the_first_fit_of_pack_is_ashlar():
    own = AshlarSettings(1.7, 0.6, 0.2)
    one, other = ashlar(own, mixed(60)), pack(own, mixed(60), method="first", slots="bond").wall
    assert [(s.slot, s.sawn.slab) for s in one.laid] == [(s.slot, s.sawn.slab) for s in other.laid]


@pytest.mark.parametrize(
    ("options", "why"),
    [
        ({"method": "worst"}, "method: expected best, first or global, got 'worst'"),
        ({"slots": "none"}, "slots: expected free or bond, got 'none'"),
        ({"method": "global"}, "slots: the method global needs slots that are known"),
        ({"least_score": 1.5}, "least_score: must be between 0 and 1"),
    ],
)
def test_refusals(options, why):
    with pytest.raises(InputError, match=why):
        pack(AshlarSettings(1.5, 1.0, 0.2), of(30, BOX), **options)


def test_refused_weights_and_bonds():
    with pytest.raises(InputError, match="scores: must not be negative, got -1"):
        Weights(-1.0)
    with pytest.raises(InputError, match="scores: one of them must be more than 0"):
        Weights(0.0, 0.0, 0.0, 0.0)
    with pytest.raises(InputError, match="slots: a bond with through-stones, or one other than running"):
        pack(AshlarSettings(1.5, 1.0, 0.2, bond="stack"), of(30, BOX))
