"""Certificates of states, verified by other processes while the work goes on.

A stage of building begins from the state of the stage before, which is a guess whatever the checker will say of it. So
the next stage need not wait for the checker, as long as nobody is told a verdict that has not passed it.
"""

from concurrent.futures import Executor, Future
from typing import Any

from cyclopean.analysis.verdict import Result
from cyclopean.proof import Report, verify

__all__ = ["Deferred"]

STATES = ("rbe-state", "cra-state")


class Deferred:
    """A judge for `recheck`: takes states for proved, and remembers what is still to be found out about them.

    Parameters
    ----------
    executor : Executor
        Runs the checker.
    """

    def __init__(self, executor: Executor) -> None:
        self.executor = executor
        self._waiting: dict[int, tuple[Any, Future[Report]]] = {}

    def __call__(self, certificate: Any) -> Report:
        """Hand a state to the checker and take it for proved; look at anything else at once."""
        if certificate["kind"] not in STATES:
            return verify(certificate)
        self._waiting[id(certificate)] = certificate, self.executor.submit(verify, certificate)
        return Report(True, certificate["kind"], "", "", {})

    def proved(self, result: Result) -> bool:
        """Wait for what the checker says of a result that this judge let pass; True for any other result."""
        _, future = self._waiting.pop(id(result.certificate), (None, None))
        return future is None or future.result().proved
