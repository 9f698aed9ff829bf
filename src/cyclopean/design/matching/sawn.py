"""Which stones of a wall are sawn new and get no found stone: dressed ones, which no boulder is like."""

from collections.abc import Sequence
from fnmatch import fnmatchcase

import numpy as np

from cyclopean.arrays import Bools, Ints
from cyclopean.design.walls.openings import Kind
from cyclopean.errors import InputError

__all__ = ["DRESSED", "sawn_blocks"]

DRESSED: dict[str, tuple[Kind, ...]] = {
    "voussoirs": ("voussoir", "keystone"),
    "lintels": ("lintel",),
    "quoins": ("quoin",),
    "coping": ("coping",),
}


def sawn_blocks(ids: Sequence[str], fixed: Bools, kinds: Sequence[Kind], asked: str) -> Ints:
    """Find the blocks that are sawn.

    Parameters
    ----------
    ids : sequence of str
        Of the n blocks of a wall.
    fixed : (n,) bool
        Supports, which are no stones.
    kinds : sequence of str
        What each stone that is no support is for, as drawn; empty where the wall does not say it.
    asked : str
        Words of `DRESSED`, ids and patterns of ids such as c01-*, between commas; "" = none.

    Returns
    -------
    (k,) int
        Their numbers, in order.

    Raises
    ------
    InputError
        A word that no stone answers to.

    Examples
    --------
    >>> sawn_blocks(["ground", "a", "b"], np.array([True, False, False]), ["stone", "lintel"], "lintels,a").tolist()
    [1, 2]
    """
    free = np.flatnonzero(~fixed).tolist()
    found = set[int]()
    for word in filter(None, (part.strip() for part in asked.split(","))):
        named = {i for i in free if fnmatchcase(ids[i], word)}
        if not named and word in DRESSED:
            if not kinds:
                raise InputError.of(
                    "sawn", word, "the wall does not say what its stones are for; name ids, or patterns such as c01-*"
                )
            named = {i for i, kind in zip(free, kinds, strict=True) if kind in DRESSED[word]}
        if not named:
            raise InputError.of("sawn", word, f"no stone of the wall is one; expected {', '.join(DRESSED)}, or ids")
        found |= named
    return np.array(sorted(found), np.int64)
