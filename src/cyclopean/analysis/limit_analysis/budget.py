"""How much time is left: limit analysis has bounds to show long before it has closed the gap."""

import time
from dataclasses import dataclass, field, replace

__all__ = ["UNLIMITED", "Budget"]

PROOF = 8e-5  # s a contact point that the exact checker takes for a certificate of both bounds, idle
LEAST = 0.1  # of the whole time: is left to the search even where the proof would take all of it
OVER = 0.2  # of the whole time: by how much a proof may come late


@dataclass(frozen=True, slots=True)
class Budget:
    """A deadline, in wall-clock time; without one by default.

    The machine may be busy with other work. Then a second of computing takes longer than one, and what has been seen of
    that so far is expected of what is still to come.
    """

    seconds: float = float("inf")
    kept: float = 0.0  # s: put by for what comes after
    began: float = field(default_factory=lambda: time.perf_counter())
    worked: float = field(default_factory=lambda: time.process_time())

    @property
    def limited(self) -> bool:
        """Whether there is a deadline at all."""
        return self.seconds < float("inf")

    @property
    def left(self) -> float:
        """Seconds; negative when it is over."""
        return self.began + self.seconds - self.kept - time.perf_counter()

    @property
    def over(self) -> bool:
        """Whether to stop."""
        return self.limited and not (self.left > 0.0)

    def before(self, share: float) -> "Budget":
        """The same, with some share of the whole time put by."""
        return replace(self, kept=self.kept + share * self.seconds) if self.limited else self

    def proof(self, points: int) -> float:
        """Seconds that the proof of both bounds is expected to take."""
        passed, worked = time.perf_counter() - self.began, time.process_time() - self.worked
        return PROOF * points * max(1.0, passed / worked if worked > 0.0 else 1.0)

    def before_proof(self, points: int) -> "Budget":
        """What of it the search may use."""
        if not self.limited:
            return self
        return replace(self, kept=min(self.kept + self.proof(points), (1.0 - LEAST) * self.seconds))

    def allows_proof(self, points: int) -> bool:
        """Whether a proof would end about in time."""
        return not self.limited or self.proof(points) <= max(self.left, 0.0) + OVER * self.seconds


UNLIMITED = Budget()
