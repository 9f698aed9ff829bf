"""Verdicts worked out in a process beside this one, the newest question first.

A proof takes from milliseconds to a minute and cannot be stopped half-way. So it is asked of a child process: the page
goes on meanwhile, and a question that nobody waits for any more is dropped with its process.
"""

import multiprocessing
import os
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from multiprocessing.connection import Connection
from typing import Any

from cyclopean.analysis import LimitResult, Live, Result, Settings, check, limit
from cyclopean.analysis.proving import Claim
from cyclopean.assembly import Assembly
from cyclopean.errors import CyclopeanError
from cyclopean.processes import ChildProcess
from cyclopean.view.studio.latest_value import LatestValue

PATIENCE = 1.0  # s that an outdated question may still take before its process is ended
BEHIND = 10  # steps of niceness
GLANCE = 0.05  # s between looks at whether a question is outdated


@dataclass(frozen=True, slots=True)
class Reach:
    """How far a model is from falling; asked as a question with None, answered in words."""

    azimuth: float  # degrees
    heading: tuple[float, float]  # unit vector of the push
    tilt: str = ""
    push: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class Question:
    """One model to decide; or, where `reach` says which way, how far it is from falling."""

    ticket: int
    assembly: Assembly
    settings: Settings
    claim: Claim | None
    reach: Reach | None = None


class Prover:
    """Asks one child process; `answered` is called from a thread of its own.

    It is given the ticket of the newest question and its `Result` or `Reach`, or what went wrong as text. The process
    gives way to all others if `behind`, where the system can have that.
    """

    def __init__(self, answered: Callable[[int, Result | Reach | str], None], behind: bool = False) -> None:
        self._answered, self._behind = answered, behind
        self._box: LatestValue[Question] = LatestValue()
        self._child: Any = None
        self._line: Connection | None = None
        self._thread = threading.Thread(target=self._run, name="prover", daemon=True)
        self._thread.start()

    def ask(self, question: Question) -> None:
        """Ask this, and forget what was asked before."""
        self._box.put(question)

    def close(self) -> None:
        """End the child process."""
        self._box.end()
        self._thread.join()

    def _run(self) -> None:
        try:
            self._start()  # it takes a second to load: before anybody asks
            while (question := self._box.take()) is not None:
                answer = self._put(question)
                if answer is not None:
                    self._answered(question.ticket, answer)
        finally:
            self._stop()

    def _put(self, question: Question) -> Result | Reach | str | None:
        """Ask the child; None where the question was outdated before it was answered."""
        if self._child is None or not self._child.is_alive():
            self._start()
        assert self._line is not None
        began = time.monotonic()
        try:
            self._line.send(question)
            while not self._line.poll(GLANCE):
                if self._box.ended or (self._box.waiting and time.monotonic() - began > PATIENCE):
                    self._stop()
                    return None
            answer: Result | Reach | str = self._line.recv()
        except (EOFError, OSError):
            self._stop()
            return "the process that proves has ended; move a slider to try again"
        return None if self._box.waiting else answer

    def _start(self) -> None:
        self._line, end = multiprocessing.Pipe()
        child = ChildProcess(target=_serve, args=(end, self._behind), name="cyclopean-prover", daemon=True)
        child.start()
        self._child = child
        end.close()

    def _stop(self) -> None:
        if self._line is not None:
            self._line.close()
            self._line = None
        if self._child is not None:
            self._child.terminate()
            self._child.join()
            self._child = None


def _serve(line: Connection, behind: bool) -> None:
    """Answer questions until nobody asks any more."""
    if behind and hasattr(os, "nice"):
        os.nice(BEHIND)
    while True:
        try:
            question = line.recv()
        except (EOFError, OSError):
            return
        try:
            line.send(_answer(question))
        except OSError:
            return


def _answer(question: Question) -> Result | Reach | str:
    try:
        if question.reach is not None:
            return _reached(question, question.reach)
        return check(replace(question.assembly, settlements=()), question.settings, warm=question.claim)
    except CyclopeanError as error:
        return str(error)


def _reached(question: Question, reach: Reach) -> Reach:
    """Limits of tilt and push by rigid-block equilibrium, from the gravity of the settings."""
    tilt = limit(question.assembly, Live(tilt=reach.azimuth), question.settings)
    push = limit(question.assembly, Live(push=(*reach.heading, 0.0)), question.settings)
    degrees = None if tilt.angle is None else tilt.angle[1]
    return replace(reach, tilt=_words(tilt, degrees, "°"), push=_words(push, push.upper, " of the weight"))


def _words(found: LimitResult, value: float | None, unit: str) -> str:
    if found.word == "limit" and value is not None:
        return f"{value:.3g}{unit}"
    return {"unbounded": "none at all", "falls": "any: it falls already"}.get(found.word, "not found")
