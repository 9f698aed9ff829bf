"""Two processes that share the work on one wall: both come to what one alone does, whoever is faster.

Mutants killed: the first that stands not waited for; what belongs to an earlier turn taken for this one; differing
walls not noticed.
"""

import multiprocessing
from concurrent.futures import Future, ThreadPoolExecutor
from time import sleep

import numpy as np
import pytest

from cyclopean.design.rubble.sharing import Share, shared
from cyclopean.errors import InputError


def together(do):
    """What do(share) gives for each of two shares on one line, at the same time."""

    def one(line, which):
        with line:
            return do(Share(line, which))

    with ThreadPoolExecutor(2) as pool:
        both = [pool.submit(one, line, which) for which, line in enumerate(multiprocessing.Pipe())]
    return [part.result() for part in both[::-1]]


def work(share, seed):
    """Some turns of both kinds, of which only the result of trials is noted; each takes its own time."""
    draw, pace, came = np.random.default_rng(seed), np.random.default_rng([seed, share.which]), []
    for turn in range(30):
        stands = draw.random(int(draw.integers(0, 9))) < 0.3

        def tried(k, stands=stands, turn=turn):
            sleep(float(pace.choice([0.0, 1e-3])))
            return (turn, k) if stands[k] else f"falls {k}"

        came.append(share.until(len(stands), tried))
        if came[-1] and not isinstance(came[-1][-1], str):
            share.laid(bytes(came[-1][-1]))
        own = [(k, turn) for k in range(5) if share.mine(k)]
        came.append(sorted(one for some in share.both(own) for one in some))
    return came


@pytest.mark.parametrize("seed", range(3))
def test_two_come_to_what_one_does(seed):
    alone = work(Share(), seed)
    assert together(lambda share: work(share, seed)) == [alone, alone]
    assert any(one and isinstance(one[-1], tuple) for one in alone[::2])
    assert any(one and isinstance(one[-1], str) for one in alone[::2])


def test_only_what_can_be_the_first_is_done():
    done = []
    assert Share().until(9, lambda k: done.append(k) or (k if k == 3 else "falls")) == ["falls"] * 3 + [3]
    assert done == [0, 1, 2, 3]


def test_two_that_lay_otherwise_are_stopped():
    def other(share):
        share.laid(bytes([share.which]))
        share.both([])
        return share.both([])

    with pytest.raises(InputError, match="came to different walls"):
        together(other)


def test_one_that_ends_is_told_of():
    class Gone:
        def submit(self, *given):
            gone = Future()
            gone.set_exception(InputError("it was ended"))
            return gone

    with pytest.raises(InputError, match="it was ended"), shared(Gone(), print) as share:
        share.both([])
