"""How far from collapse: `limit` for files and objects alike."""

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Unpack

from cyclopean.analysis.settings import Settings
from cyclopean.api.inputs import Model, Reading, assembly_of
from cyclopean.api.keywords import LimitKeywords, given_to, takes
from cyclopean.errors import InputError
from cyclopean.options import check_options, option
from cyclopean.texts import PointLoad

if TYPE_CHECKING:
    from cyclopean.analysis import LimitResult, Live

__all__ = ["LIMITED", "LimitOptions", "limit", "limited"]

# Options of `Settings` that limit analysis has; of `method`, `solver` and `seconds` it has its own.
LIMITED = "mu density supports gravity tolerance combination factors tension cohesion"
STEPS = 20  # points of a pushover curve: enough to draw it


def _silent(_: str) -> None:
    """Tell nobody."""


@dataclass(frozen=True, slots=True)
class LimitOptions:
    """Which loads grow, how their limit is looked for, and what is told beside it."""

    push: tuple[float, float, float] | None = option(
        None, "Push every block, in multiples of its weight.", "vector", metavar="X,Y,Z"
    )
    tilt: float | None = option(
        None, "Tilt the ground towards azimuth AZ (degrees from +x to +y) [0].", "number", metavar="[AZ]"
    )
    loads: tuple[PointLoad, ...] = option(
        (), "Force (N) on a block, at its centroid or a point.", "loads", metavar="BLOCK:FX,FY,FZ[@X,Y,Z]", word="load"
    )
    method: str = option("rbe", "cra also brackets the limit without dilatancy [rbe].", choices=("rbe", "cra"))
    solver: str = option("auto", "Who looks for the bounds.", choices=("auto", "interior", "clarabel"))
    seconds: float | None = option(
        None,
        "Time for both bounds and their proof; cra: for each trial as well [60].",
        "number",
        metavar="S",
        above=0.0,
    )
    polar: int | None = option(
        None, "With `tilt`: towards N azimuths; the least is answered.", "whole", metavar="N", least=1, most=3600
    )
    pushover: tuple[float, str] | None = option(
        None, "Follow the mechanism as far: 0.1m or 10deg of the fastest block.", "reach", metavar="REACH"
    )
    steps: int | None = option(None, "Steps of `pushover` [20].", "whole", metavar="N", least=1, most=10_000)

    def __post_init__(self) -> None:
        check_options(self)
        if self.polar is not None and self.tilt is None:
            raise InputError.of("polar", self.polar, "goes with `tilt` only")
        if self.pushover is None and self.steps is not None:
            raise InputError.of("steps", self.steps, "goes with `pushover` only")
        if self.pushover is not None and not self.pushover[0] > 0.0:
            raise InputError.of("pushover", None, "expected a positive length such as 0.1m, or an angle such as 10deg")

    def live(self) -> "Live":
        """The loads that grow.

        Raises
        ------
        InputError
            None is said, or two.
        """
        from cyclopean.analysis import Live, LiveLoad

        given = [f"`{name}`" for name in ("push", "tilt", "loads") if getattr(self, name) not in (None, ())]
        if len(given) != 1:
            raise InputError(
                f"{' and '.join(given) or 'nothing grows'}: give exactly one of `push` X,Y,Z, `tilt` [AZ] and"
                " `loads` BLOCK:FX,FY,FZ (which may stand several times)"
            )
        return Live(self.push, self.tilt, tuple(LiveLoad(*load) for load in self.loads))


@takes(
    LimitOptions,
    Settings,
    Reading,
    only=f"push tilt loads polar pushover steps solver {LIMITED} method seconds units strict",
)
def limit(
    model: Model,
    live: "Live | None" = None,
    settings: Settings | None = None,
    progress: Callable[[str], None] = _silent,
    **options: Unpack[LimitKeywords],
) -> "LimitResult":
    """By how much may loads grow before a structure falls, by rigid-block equilibrium?

    Exactly one of `live`, `push`, `tilt` and `loads` says which loads.

    Parameters
    ----------
    model : path, Assembly, anything with an `assembly`, or a list or table of bodies
        The structure.
    live : Live, optional
        What grows, in one object.
    settings : Settings, optional
        Options in one object; keywords win over it.
    progress : callable
        Is told the name of each stage as it begins.
    **options

    Returns
    -------
    LimitResult
        `lower`: it stands up to this multiplier; `upper`: it does not from this one on.

    Raises
    ------
    InputError
        As `check`; and loads that name no block, act on supports only, or are zero.

    Examples
    --------
    A cube that is pushed sideways slides at its friction:

    >>> import cyclopean
    >>> round(limit(cyclopean.stack(1), push=(1.0, 0.0, 0.0), mu=0.5).value, 6)
    0.5
    """
    own: dict[str, Any] = dict(options)
    chosen, reading = given_to(limit, {n: v for n, v in own.items() if n in f"{LIMITED} units strict".split()},
                               settings or Settings(), Reading())  # fmt: skip
    (wanted,) = given_to(limit, own, LimitOptions())
    if live is not None and (wanted.push is not None or wanted.tilt is not None or wanted.loads):
        raise InputError("live: says what grows; leave out push, tilt and loads")
    return limited(model, live or wanted.live(), chosen, reading, wanted, progress)


def limited(
    model: Model,
    live: "Live",
    settings: Settings,
    reading: Reading,
    wanted: LimitOptions,
    progress: Callable[[str], None] = _silent,
) -> "LimitResult":
    """`limit` with its options in objects, as every front end calls it."""
    from cyclopean import analysis

    began = time.perf_counter()

    def left() -> float | None:
        """What is left of the time given; never nothing at all."""
        return None if wanted.seconds is None else max(wanted.seconds - (time.perf_counter() - began), 1e-3)

    assembly, said = assembly_of(model, reading)
    chosen = settings if wanted.seconds is None else replace(settings, seconds=wanted.seconds)
    read, around = time.perf_counter() - began, None
    shared: dict[str, Any] = {"solver": wanted.solver, "progress": progress}
    if wanted.polar is not None and live.tilt is not None:
        around = analysis.polar_tilt(assembly, chosen, count=wanted.polar, first=live.tilt, seconds=left(), **shared)
        found = around.least
    else:
        found = analysis.limit(assembly, live, chosen, seconds=left(), **shared)
    coupled = None
    if wanted.method == "cra":
        coupled = analysis.coupled_bracket(assembly, found, chosen, progress=progress)
    curve = None
    if wanted.pushover is not None:
        reach, unit = wanted.pushover
        count, budget = wanted.steps or STEPS, left()
        curve = analysis.pushover(
            assembly, found.live, chosen, reach=reach, unit=unit, steps=count, seconds=budget, progress=progress
        )
    return replace(
        found,
        warnings=(*said, *found.warnings),
        seconds={"read": read, **found.seconds, "total": time.perf_counter() - began},
        coupled=coupled,
        polar=around,
        pushover=curve,
    )
