"""What may be asked of an order of building."""

from collections.abc import Sequence
from dataclasses import dataclass

from cyclopean.options import check_options, option

__all__ = ["SequenceOptions"]


@dataclass(frozen=True, slots=True)
class SequenceOptions:
    """How an order of building is looked for, or which one is given: a file, or ids or numbers of blocks."""

    bearing: float | None = option(
        None,
        "Share of a joint's normal along gravity that makes one rest on the other [0.1].",
        "number",
        metavar="C",
        least=0.0,
    )
    clearance: float | None = option(
        None, "Length (m) of approach and retreat [0.1].", "number", metavar="L", above=0.0, unit="metres"
    )
    order: str | Sequence[str | int] | None = option(
        None, "An order that somebody gives: ids in a text, CSV or JSON file [found].", metavar="FILE"
    )

    def __post_init__(self) -> None:
        check_options(self)
