"""Monte Carlo runs of a model whose data are not quite known."""

import time
from collections import Counter
from collections.abc import Callable, Iterator
from concurrent.futures import Executor
from dataclasses import dataclass, field

import numpy as np

from cyclopean.analysis.equilibrium.neighbour import Neighbour
from cyclopean.analysis.preparation import PreparedModel, prepare
from cyclopean.analysis.proving import prove, rigid_claim
from cyclopean.analysis.sensitivity_study.ranges import Range, drawn, varied
from cyclopean.analysis.sensitivity_study.throughout import corners
from cyclopean.analysis.settings import Settings
from cyclopean.analysis.verdict import Word
from cyclopean.analysis.warm_start.recheck import recheck
from cyclopean.arrays import Floats
from cyclopean.assembly import Assembly, BodyLoad
from cyclopean.errors import InputError

__all__ = ["CONFIDENCE", "Sampling", "Sensitivity", "sensitivity", "share_between"]

CONFIDENCE = 0.95  # of the interval of Clopper and Pearson, as is usual
MOST = 1_000_000  # samples: the share is known to 0.1 % then
CHUNK = 16  # samples a process takes at a time


@dataclass(frozen=True, slots=True, eq=False)
class Sensitivity:
    """What became of the samples."""

    ranges: tuple[Range, ...]
    seed: int
    values: Floats  # (s, r) of each sample: the value drawn; where each joint or block had its own, their mean
    words: tuple[Word, ...]  # (s,) each with a verified certificate, or "undecided"
    throughout: (
        Word  # "stable" = proved for everything within the ranges; "unstable" = a corner falls; else "undecided"
    )
    why: str  # how `throughout` was found, in a sentence
    method: str
    seconds: float = 0.0
    count: dict[str, int] = field(init=False)

    def __post_init__(self) -> None:
        counted = Counter(self.words)
        object.__setattr__(self, "count", {word: counted[word] for word in ("stable", "unstable", "undecided")})

    @property
    def probability(self) -> tuple[float, float, float]:
        """Lower end, estimate and upper end of the probability that it stands, with 95 % confidence.

        Undecided samples count as falling below and as standing above; the estimate leaves them out.
        """
        stable, unstable, undecided = (self.count[word] for word in ("stable", "unstable", "undecided"))
        n = stable + unstable + undecided
        decided = stable + unstable
        low, _ = share_between(stable, n)
        _, high = share_between(stable + undecided, n)
        return low, stable / decided if decided else float("nan"), high


def share_between(hits: int, n: int, confidence: float = CONFIDENCE) -> tuple[float, float]:
    """Ends of the confidence interval of a share of which `hits` of `n` were found (Clopper and Pearson 1934).

    Examples
    --------
    >>> [round(end, 4) for end in share_between(0, 100)]  # the upper end is 1 - 0.025^(1/100)
    [0.0, 0.0362]
    """
    from scipy.special import betaincinv

    tail = (1.0 - confidence) / 2.0
    low = float(betaincinv(hits, n - hits + 1, tail)) if hits else 0.0
    high = float(betaincinv(hits + 1, n - hits, 1.0 - tail)) if hits < n else 1.0
    return low, high


@dataclass(frozen=True, slots=True)
class Sampling:
    """Samples to be drawn; the same from the same seed, whoever computes them."""

    ranges: tuple[Range, ...]  # independent of each other; every value within its range is as likely
    samples: int = 1000  # 0 for the proof throughout alone
    seed: int = 0  # of the random numbers

    def __post_init__(self) -> None:
        if not self.ranges:
            raise InputError.of("samples", None, "nothing varies; name what does, such as `vary` mu=0.6:0.8")
        if not 0 <= self.samples <= MOST:
            raise InputError.of("samples", self.samples, f"expected 0 to {MOST:,}")
        if not 0 <= self.seed < 2**63:
            raise InputError.of("seed", self.seed, "expected a whole number that is not negative")


def sensitivity(
    assembly: Assembly,
    sampling: Sampling,
    settings: Settings | None = None,
    executor: Executor | None = None,
    progress: Callable[[str], None] = lambda _: None,
) -> Sensitivity:
    """Check a model many times, with values drawn from their ranges, and once for all of them together.

    Every sample's verdict has passed the independent checker. Contacts are found once. Rigid-block equilibrium begins
    each sample from what the one before it came to; coupled analysis begins from nothing, which is quicker there.

    Parameters
    ----------
    assembly : Assembly
        The model.
    sampling : Sampling
        What varies, and how many samples.
    settings : Settings
        As for `check`.
    executor : Executor, optional
        Computes the samples: processes, or a cluster.
    progress : callable
        Is told the name of each stage as it begins.

    Raises
    ------
    InputError
        What `check` refuses, a settlement, or accelerations where densities vary.
    """
    settings = Settings() if settings is None else settings
    ranges, samples = sampling.ranges, sampling.samples
    began = time.perf_counter()
    model = prepare(assembly, settings, progress)
    if model.settled is not None:
        raise InputError.of("vary", None, "a settlement is answered for one model at a time; leave it out")
    accelerated = any(isinstance(load, BodyLoad) and load.acceleration is not None for load in assembly.actions)
    if accelerated and any(r.quantity.startswith("density") for r in ranges):
        raise InputError("`vary` density: loads given as accelerations go with the density; give them in `gravity`")
    progress("corners of the ranges")
    throughout, why = _throughout(model, settings, ranges)
    progress("samples")
    values = np.zeros((samples, len(ranges)))
    words: list[Word] = []
    for chunk in _computed(model, settings, sampling, executor):
        for row, word in chunk:
            values[len(words)] = row
            words.append(word)
        progress(f"sample {len(words)} of {samples}")
    method = settings.chosen_method()
    return Sensitivity(
        ranges, sampling.seed, values, tuple(words), throughout, why, method, time.perf_counter() - began
    )


def _computed(
    model: PreparedModel, settings: Settings, asked: Sampling, executor: Executor | None
) -> Iterator[list[tuple[Floats, Word]]]:
    """Chunks of samples, in order."""
    parts = [range(start, min(start + CHUNK, asked.samples)) for start in range(0, asked.samples, CHUNK)]
    if executor is None:
        yield from (_chunk(model, settings, asked, part) for part in parts)
    else:
        waiting = [executor.submit(_chunk, model, settings, asked, part) for part in parts]
        yield from (future.result() for future in waiting)


def _chunk(model: PreparedModel, settings: Settings, asked: Sampling, part: range) -> list[tuple[Floats, Word]]:
    found: list[tuple[Floats, Word]] = []
    neighbour = Neighbour()
    rigid = settings.chosen_method() == "rbe" and settings.asks_for_rbe() == ""
    for sample in part:
        draw = drawn(asked.ranges, model, asked.seed, sample)
        case = varied(model, draw)
        row = [float(draw[r.quantity][0] if r.quantity == "tilt" else draw[r.quantity].mean()) for r in asked.ranges]
        word = _rigid_word(case, settings, neighbour) if rigid else recheck(case, settings).verdict
        found.append((np.array(row), word))
    return found


def _rigid_word(case: PreparedModel, settings: Settings, neighbour: Neighbour) -> Word:
    system = case.system()
    outcome = neighbour.solve(system, settings.solver)
    return prove(case, settings, system, rigid_claim(outcome)).verdict


def _throughout(model: PreparedModel, settings: Settings, ranges: tuple[Range, ...]) -> tuple[Word, str]:
    """Whether all within the ranges stand, and how that was found."""
    if settings.chosen_method() != "rbe":
        return "undecided", "Only rigid-block equilibrium allows a proof for whole ranges (`method` rbe)."
    cases = corners(model, ranges)
    if cases is None:
        return "undecided", (
            "There is no proof for whole ranges: too many densities, gravity that is not vertical, or joints that pull."
        )
    inside = all(r.quantity != "tilt" for r in ranges)  # else the corners lie a little outside
    for k, case in enumerate(cases):
        word = recheck(case, settings).verdict
        if word == "unstable" and inside:
            return "unstable", f"The worst case within the ranges falls (corner {k + 1} of {len(cases)})."
        if word != "stable":
            return (
                "undecided",
                f"Corner {k + 1} of {len(cases)} around the ranges is {word}: nothing is proved for all.",
            )
    return "stable", (
        f"All {len(cases)} corners around the ranges stand, each by a certificate: so does everything between them."
    )
