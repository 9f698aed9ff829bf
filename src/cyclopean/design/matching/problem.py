"""What is to be matched: stones and cells, where the stones' longest axes may lie, and who does the work."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from cyclopean.arrays import Floats
from cyclopean.design.matching.cells import Cells
from cyclopean.design.stones.stone import Stone

__all__ = ["Bonds", "Problem", "Singles"]

Singles = NDArray[np.float32]
Job = TypeVar("Job")
Done = TypeVar("Done")


@dataclass(frozen=True, slots=True, eq=False)
class Bonds:
    """Along what the longest axes of some stones lie, to within an angle."""

    way: NDArray[Any]  # (b, 3) unit, without sign
    angle: float  # radians


@dataclass(frozen=True, slots=True, eq=False)
class Problem:
    """Stones (n) and cells (m). All poses are of body frames, about the cells' centres."""

    stones: Sequence[Stone]
    points: Singles  # (n, p, 3) m, evenly spread in each stone, body frame
    cells: Cells
    bonds: Bonds | None = None  # of each cell
    executor: Executor | None = None  # runs ranking and refining; None = this process does, with the same answer
    progress: Callable[[str], None] = lambda _: None  # told what is being done
    volume: Floats = field(init=False)  # (n,) m3

    def __post_init__(self) -> None:
        object.__setattr__(self, "volume", np.array([s.volume for s in self.stones]))

    def done(self, what: str, work: Callable[[Job], Done], jobs: Iterable[Job], count: int) -> Iterator[Done]:
        """The results of so many jobs, in order."""
        found = map(work, jobs) if self.executor is None else self.executor.map(work, jobs)
        for number, one in enumerate(found):
            self.progress(f"{what}: {number + 1} of {count}")
            yield one
