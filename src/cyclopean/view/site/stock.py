"""Of what the stones of a structure are made, and what is left over."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from itertools import groupby

from cyclopean.view.site.cuts import CutStone

__all__ = ["LeftOver", "Stock", "told"]


@dataclass(frozen=True, slots=True)
class LeftOver:
    """A stone, or a piece of one, that is not in the structure."""

    name: str
    volume: float  # m3
    why: str


@dataclass(frozen=True, slots=True, eq=False)
class Stock:
    """What is known of the stones as they were found or bought; nothing where a model alone is given."""

    cut: Mapping[int, CutStone] = field(default_factory=dict)  # stones that are cut, by block
    source: Mapping[int, str] = field(default_factory=dict)  # of what a block is made, as its card says it
    left: tuple[LeftOver, ...] = ()


def told(left: Iterable[LeftOver]) -> Iterator[str]:
    """What is left over, a line for each reason, with litres."""
    every = sorted(left, key=lambda one: one.why)
    for why, some in groupby(every, key=lambda one: one.why):
        those = list(some)
        litres = 1000.0 * sum(one.volume for one in those)
        names = ", ".join(f"{one.name} ({1000.0 * one.volume:.3g})" for one in those)
        yield f"{len(those)} {why}, {litres:,.0f} litres in all: {names}."
