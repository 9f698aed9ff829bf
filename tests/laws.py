"""How much a law is tried on: an eighth of its examples by default, all of them by `--thorough`."""

import os
from collections.abc import Sequence
from typing import TypeVar

import pytest

__all__ = ["cases", "chosen", "examples", "nightly", "quick", "some"]

Case = TypeVar("Case")
_THOROUGH = [False]
SHARE = 8  # one in so many is tried for every change
FEWEST = 5  # examples; below that hypothesis tries little more than zeros and ones


def chosen(thorough: bool) -> None:
    """Say once, before any test is imported, which of the two is wanted."""
    _THOROUGH[0] = thorough


def quick() -> bool:
    """Whether this is the run of every change, not the nightly one."""
    return not _THOROUGH[0]


def examples(thorough: int, share: int = SHARE) -> int:
    """How many examples a law gets that is given so many at night: one in eight, or fewer of those that are dear."""
    return max(thorough // share, min(thorough, FEWEST)) if quick() else thorough


def cases(variable: str, thorough: int, share: int = SHARE) -> int:
    """How many random cases: what the variable of the environment says, or as many as for `examples`."""
    return int(os.environ.get(variable) or examples(thorough, share))


def some(thorough: Sequence[Case], share: int = SHARE) -> list[Case]:
    """Cases that are alike but for a word or a seed: the first of every eight, or all at night."""
    return list(thorough[:: share if quick() else 1])


def nightly(test: object) -> object:
    """A test that takes long and repeats in another order what quicker ones hold."""
    return pytest.mark.skipif(quick(), reason="runs with --thorough")(test)
