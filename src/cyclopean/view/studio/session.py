"""Who decides what the page shows: takes every change in turn, answers at once, has the answer proved when it rests.

    change -> live claim, shown as provisional -> rest -> proof -> shown as proved

"stable" and "unstable" without the word provisional are said only of a result whose certificate has passed the
checker. Where a proof takes a few hundredths of a second, the claim is held back until it is there.
"""

import queue
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from cyclopean.analysis import Result, Settings
from cyclopean.analysis.interactive import Answer, Knobs, LiveModel
from cyclopean.analysis.proving import Claim, rigid_claim
from cyclopean.arrays import Floats
from cyclopean.assembly import Assembly
from cyclopean.assembly.rearranging import Arrangement, Pose
from cyclopean.errors import CyclopeanError
from cyclopean.view.studio.prover import Prover, Question, Reach

REST = 0.25  # s without a change after which a proof is asked for
PROMPT = 0.025  # s: what usually takes no longer to prove is not shown before it is proved
KEPT = 200  # steps that can be undone

Stage = Literal["provisional", "searching", "proved", "undecided", "failed"]


@dataclass(frozen=True, slots=True)
class State:
    """What the user has set; everything shown follows from it."""

    arrangement: Arrangement
    knobs: Knobs
    method: str  # "rbe" or "cra"


@dataclass(frozen=True, slots=True, eq=False)
class Snapshot:
    """What is known of one state."""

    ticket: int
    state: State
    answer: Answer
    result: Result  # to draw; with a verdict only where it is proved
    stage: Stage
    sentence: str

    @property
    def word(self) -> str:
        """What to say in large letters."""
        if self.stage in ("proved", "undecided"):
            return self.result.verdict
        return {"balanced": "stable", "collapse": "unstable", "": "undecided"}[self.answer.word]

    @property
    def proved(self) -> bool:
        """Whether a certificate of the word has passed the checker."""
        return self.stage == "proved"


@dataclass(frozen=True, slots=True)
class Listener:
    """What a session calls, from its own thread."""

    show: Callable[[Snapshot], None]  # every new snapshot
    complain: Callable[[str], None]  # a sentence, when something is refused
    tell: Callable[[Reach | None], None] | None = None  # how far a proved model is from falling; None: not known yet


class Session:
    """Owns the state of one page, which opens with `first`; every method may be called from any thread.

    The settings are what the command said: density, tolerance, bounds; gravity (3,), m/s2, is that before any tilt;
    `assumed` is what neither the file nor the command said.
    """

    def __init__(
        self, first: State, settings: Settings, gravity: Floats, assumed: dict[str, Any], listener: Listener
    ) -> None:
        self.state = first
        self.latest: Snapshot | None = None
        self._settings, self._gravity, self._assumed, self._first = settings, gravity, assumed, first
        self._show, self._complain, self._tell = listener.show, listener.complain, listener.tell
        self._todo: queue.SimpleQueue[Callable[[], None] | None] = queue.SimpleQueue()
        self._past: list[Arrangement] = []
        self._live: LiveModel | None = None
        self._ticket = 0
        self._pending = False  # a state that no proof was asked for yet
        self._open: Answer | None = None  # to the state as it is now
        self._withheld: Snapshot | None = None  # until `_due`, for its proof may come first
        self._due = 0.0
        self._usual: dict[str, float] = {}  # s that a proof takes, by method
        self._reaches: tuple[object, ...] | None = None  # what the reach was asked for
        self._prover = Prover(self._found)
        self._bounds_prover = None if listener.tell is None else Prover(self._found, behind=True)  # takes longer
        self._thread = threading.Thread(target=self._run, name="session", daemon=True)
        self._thread.start()
        self._todo.put(self._touch)

    def set(self, knobs: Knobs | None = None, method: str | None = None) -> None:
        """Turn a knob."""
        self._todo.put(lambda: self._turn(knobs, method))

    def move(self, block: int, pose: Pose, keep: bool = True) -> None:
        """Put a block somewhere; `keep` makes it a step that can be undone."""
        self._todo.put(lambda: self._rearrange(lambda now: now.moved(block, pose), keep))

    def remove(self, block: int) -> None:
        """Take a block out."""
        self._todo.put(lambda: self._rearrange(lambda now: now.without(block), True))

    def put_back(self, block: int) -> None:
        """Put a block where the model has it."""
        self._todo.put(lambda: self._rearrange(lambda now: now.put_back(block), True))

    def undo(self) -> None:
        """Take the last step back that put a block somewhere else."""
        self._todo.put(self._undo)

    def close(self) -> None:
        """Stop working."""
        self._todo.put(None)
        self._thread.join()
        self._prover.close()
        if self._bounds_prover is not None:
            self._bounds_prover.close()

    def _found(self, ticket: int, answer: Result | Reach | str) -> None:
        """Take what a prover has found, from its thread to that of the session."""
        self._todo.put(lambda: self._reached(answer) if isinstance(answer, Reach) else self._answered(ticket, answer))

    def _run(self) -> None:
        while True:
            try:
                task = self._todo.get(timeout=self._patience())
            except queue.Empty:
                self._attempt(self._idle)
                continue
            tasks = [task]
            while not self._todo.empty():  # of several changes only the last is answered
                tasks.append(self._todo.get())
            before = self._ticket
            for one in tasks:
                if one is None:
                    return
                self._attempt(one)
            if self._ticket != before:
                self._attempt(self._answer)

    def _attempt(self, step: Callable[[], None]) -> None:
        """Do this; what cannot be done is said, and the page goes on for everybody."""
        try:
            step()
        except (CyclopeanError, ArithmeticError, ValueError) as error:
            self._complain(str(error))

    def _patience(self) -> float | None:
        """How long (s) to wait for a change; None = as long as it takes."""
        if self._withheld is not None:
            return max(self._due - time.perf_counter(), 0.0)
        return REST if self._pending else None

    def _idle(self) -> None:
        """Nothing came: show what was held back, or ask for the proof of what the page rests on."""
        if self._withheld is not None:
            self._publish(self._withheld)
        elif self._pending:
            self._ask()

    def _touch(self) -> None:
        self._ticket += 1

    def _turn(self, knobs: Knobs | None, method: str | None) -> None:
        fresh = replace(self.state, knobs=knobs or self.state.knobs, method=method or self.state.method)
        replace(self._settings, method=fresh.method)  # refuses a method that there is not
        if fresh != self.state:
            self.state = fresh
            self._touch()

    def _rearrange(self, change: Callable[[Arrangement], Arrangement], keep: bool) -> None:
        found = change(self.state.arrangement)
        if keep:
            self._past = [*self._past[-KEPT:], self.state.arrangement]
        self._arrange(found)

    def _undo(self) -> None:
        if self._past:
            self._arrange(self._past.pop())
        else:
            self._complain("there is nothing to undo")

    def _arrange(self, arrangement: Arrangement) -> None:
        self.state = replace(self.state, arrangement=arrangement)
        self._live = None
        self._touch()

    def _answer(self) -> None:
        """Claim an answer at once; where a proof takes no time, wait for that before showing the claim."""
        state = self.state
        if self._live is None:
            given = {} if self._settings.density is None else {"density": self._settings.density}
            self._live = LiveModel(state.arrangement.assembly, self._gravity, **given)
        answer = self._open = self._live.solve(state.knobs)
        if self._tell is not None and self._reaches is not None:
            now = state.arrangement, state.knobs.mu, state.knobs.everywhere
            if self._reaches[:3] != now:  # what the page says of them holds no more
                self._reaches = None
                self._tell(None)
        stage: Stage = "provisional" if answer.word else "searching"
        snapshot = Snapshot(self._ticket, state, answer, self._live.shown(answer), stage, _claimed(state, answer))
        if self._usual.get(state.method, np.inf) <= PROMPT:
            self._withheld, self._due = snapshot, time.perf_counter() + 2.0 * PROMPT
            self._ask()
        else:
            self._pending = True
            self._publish(snapshot)

    def _question(self, state: State, answer: Answer) -> tuple[Assembly, Settings, Claim | None]:
        """What a proof is asked of: the model as a file would have it, and the claim that may be true."""
        assert self._live is not None
        contacts = self._live.contacts
        if state.knobs.everywhere:
            contacts = replace(contacts, mu=self._live.friction(state.knobs))
        assembly = replace(state.arrangement.assembly, contacts=contacts)
        x, y, z = state.knobs.turned(self._gravity).tolist()
        settings = replace(
            self._settings, method=state.method, mu=state.knobs.mu, gravity=(x, y, z), tilt=None, supports=""
        )
        useful = answer.word == "collapse" or (answer.word == "balanced" and state.method == "rbe")
        claim = rigid_claim(answer.outcome) if useful and answer.outcome is not None else None
        return assembly, settings, claim

    def _ask(self) -> None:
        """Have the state proved that the page rests on."""
        self._pending = False
        if self._open is not None:
            self._prover.ask(Question(self._ticket, *self._question(self.state, self._open)))

    def _answered(self, ticket: int, found: Result | str) -> None:
        """Show what a proof came to, unless the page has moved on."""
        answer, live = self._open, self._live
        if ticket != self._ticket or answer is None or live is None:
            return
        if isinstance(found, str):
            self._publish(Snapshot(ticket, self.state, answer, live.shown(answer), "failed", found))
            return
        self._usual[self.state.method] = found.seconds["total"]
        live.learn(found)
        result = replace(found, assumed=self._still_assumed(), warnings=self.state.arrangement.notes)
        stage: Stage = "undecided" if result.verdict == "undecided" else "proved"
        self._publish(Snapshot(ticket, self.state, answer, result, stage, result.reason))
        self._ask_reach(answer)

    def _reach_depends_on(self, reach: Reach) -> tuple[object, ...]:
        knobs = self.state.knobs
        return self.state.arrangement, knobs.mu, knobs.everywhere, reach.azimuth, reach.heading

    def _ask_reach(self, answer: Answer) -> None:
        """Ask how far the model is from falling, from the level; tilt and push of the moment play no part."""
        if self._tell is None or self._bounds_prover is None:
            return
        push = np.array(self.state.knobs.push)
        size = float(np.hypot(*push))
        x, y = (push / size).tolist() if size > 0.0 else (1.0, 0.0)
        reach = Reach(self.state.knobs.azimuth, (x, y))
        if self._reach_depends_on(reach) == self._reaches:
            return
        self._reaches = self._reach_depends_on(reach)
        self._tell(None)
        assembly, settings, _ = self._question(self.state, answer)
        x, y, z = self._gravity.tolist()
        level = replace(settings, gravity=(x, y, z), method="rbe")
        self._bounds_prover.ask(Question(self._ticket, assembly, level, None, reach))

    def _reached(self, found: Reach) -> None:
        """Tell how far the model is from falling, unless blocks or friction are others by now."""
        if self._tell is not None and self._reach_depends_on(found)[:3] == (self._reaches or ())[:3]:
            self._tell(found)

    def _still_assumed(self) -> dict[str, Any]:
        """Of what was assumed at first, what nobody has said since."""
        touched = {
            "mu": self.state.knobs.mu != self._first.knobs.mu,
            "gravity": not np.array_equal(self.state.knobs.turned(self._gravity), self._gravity),
        }
        return {name: value for name, value in self._assumed.items() if not touched.get(name, False)}

    def _publish(self, snapshot: Snapshot) -> None:
        self._withheld = None
        self.latest = snapshot
        self._show(snapshot)


def _claimed(state: State, answer: Answer) -> str:
    """What a claim is worth, in a sentence."""
    if answer.word == "collapse":
        return "The solver has a mechanism; it is proved once the sliders rest."
    if answer.word == "balanced" and state.method == "cra":
        return "The solver balances every load; whether a motion brings these forces about is decided at rest."
    if answer.word == "balanced":
        return "The solver balances every load; it is proved once the sliders rest."
    return "No quick answer: neither a state nor a mechanism yet. It is decided once the sliders rest."
