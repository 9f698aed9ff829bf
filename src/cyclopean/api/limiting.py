"""How far from collapse: `limit` for files and objects alike."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Unpack

from cyclopean.analysis.settings import Settings
from cyclopean.api.inputs import Model, Reading, assembly_of, silent
from cyclopean.api.keywords import LimitKeywords, given_to, takes
from cyclopean.errors import InputError
from cyclopean.options import check_options, option
from cyclopean.texts import PointLoad, number

if TYPE_CHECKING:
    from cyclopean.analysis import LimitResult, Live
    from cyclopean.assembly import Assembly, Load, Road

# Options of `Settings` that limit analysis has; of `method`, `solver` and `seconds` it has its own.
LIMITED = "mu density supports gravity tolerance combination factors soil_height tension cohesion"
GROWING = ("push", "tilt", "loads", "surcharge", "live_at", "along")
KILO = 1000.0  # N: the unit of a load on a road
STEPS = 20  # points of a pushover curve: enough to draw it


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
    surcharge: float | None = option(
        None, "A surcharge of so much on the soil of the model.", "number", metavar="PA", above=0.0, unit="Pa"
    )
    live_at: str = option(
        "", "A load of 1 kN down, on a block or on the road at x (m).", metavar="BLOCK|x=X", word="live"
    )
    along: tuple[float, float] | None = option(
        None, "The same on the road in `steps` steps from x0 to x1 (m); the least is answered.", "span", metavar="X0:X1"
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
        None,
        "With `tilt` or `push`: towards N azimuths; the least is answered.",
        "whole",
        metavar="N",
        least=1,
        most=3600,
    )
    pushover: tuple[float, str] | None = option(
        None, "Follow the mechanism as far: 0.1m or 10deg of the fastest block.", "reach", metavar="REACH"
    )
    steps: int | None = option(None, "Steps of `pushover` or `along` [20].", "whole", metavar="N", least=1, most=10_000)

    def __post_init__(self) -> None:
        check_options(self)
        level = self.push is not None and any(self.push[:2])
        if self.polar is not None and self.tilt is None and not level:
            raise InputError.of("polar", self.polar, "goes with `tilt`, or a `push` that is not upright")
        if self.along is not None and not self.along[0] < self.along[1]:
            raise InputError.of("along", None, "expected X0:X1 with X0 below X1")
        if self.pushover is None and self.along is None and self.steps is not None:
            raise InputError.of("steps", self.steps, "goes with `pushover` or `along` only")
        if self.pushover is not None and not self.pushover[0] > 0.0:
            raise InputError.of("pushover", None, "expected a positive length such as 0.1m, or an angle such as 10deg")

    def check(self) -> "LimitOptions":
        """The same, if exactly one thing grows.

        Raises
        ------
        InputError
            None is said, or two.
        """
        given = [f"`{name}`" for name in GROWING if getattr(self, name) not in (None, (), "")]
        if len(given) != 1:
            raise InputError(
                f"{' and '.join(given) or 'nothing grows'}: give exactly one of `push` X,Y,Z, `tilt` [AZ],"
                " `loads` BLOCK:FX,FY,FZ (which may stand several times), `surcharge` PA, `live_at` BLOCK|x=X and"
                " `along` X0:X1"
            )
        return self

    def grows(self, assembly: "Assembly") -> "Live":
        """The loads that grow, but for a load that travels; errors as `check`, and loads that find no place."""
        from cyclopean.analysis import Live, LiveLoad
        from cyclopean.assembly import Road, surcharge_loads

        self.check()
        if self.surcharge is not None:
            words = f"a surcharge of {self.surcharge:g} Pa on the soil"
            return _forces(assembly, surcharge_loads(assembly, self.surcharge), words)
        if self.live_at.startswith("x="):
            return _on_road(assembly, Road.of(assembly), number("`live_at`", self.live_at[2:]))
        if self.live_at:
            if all(block.id != self.live_at for block in assembly.blocks):
                raise InputError.of("live_at", self.live_at, "there is no such block; give one, or a place, x=X")
            return Live(loads=(LiveLoad(self.live_at, (0.0, 0.0, -KILO)),), words=f"1 kN on '{self.live_at}'")
        return Live(self.push, self.tilt, tuple(LiveLoad(*load) for load in self.loads))

    def places(self, assembly: "Assembly") -> "list[tuple[float, Live]]":
        """The load that travels, in each place (m)."""
        from cyclopean.assembly import Road

        assert self.along is not None
        road, count = Road.of(assembly), self.steps or STEPS
        step = (self.along[1] - self.along[0]) / count
        return [(x, _on_road(assembly, road, x)) for x in (self.along[0] + k * step for k in range(count + 1))]


def _on_road(assembly: "Assembly", road: "Road", x: float) -> "Live":
    """1 kN at x (m)."""
    return _forces(assembly, road.loads(x, KILO), f"1 kN on the road at x = {x:g} m, {road.words}")


def _forces(assembly: "Assembly", loads: "Sequence[Load]", words: str) -> "Live":
    """Loads that grow, from forces at points."""
    from cyclopean.analysis import Live, LiveLoad

    rows = [(assembly.blocks[one.block].id, tuple(one.force.tolist()), tuple(one.point.tolist())) for one in loads]
    return Live(loads=tuple(LiveLoad(*row) for row in rows), words=words)


@takes(
    LimitOptions,
    Settings,
    Reading,
    only=f"push tilt loads surcharge live_at along polar pushover steps solver {LIMITED} method seconds units strict",
)
def limit(
    model: Model,
    live: "Live | None" = None,
    settings: Settings | None = None,
    progress: Callable[[str], None] = silent,
    **options: Unpack[LimitKeywords],
) -> "LimitResult":
    """By how much may loads grow before a structure falls, by rigid-block equilibrium?

    Exactly one of `live`, `push`, `tilt`, `loads`, `surcharge`, `live_at` and `along` says which loads.

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
    if live is not None and (more := [name for name in GROWING if getattr(wanted, name) not in (None, (), "")]):
        raise InputError(f"live: says what grows; leave out {more[0]}")
    return limited(model, live, chosen, reading, wanted, progress)


def limited(
    model: Model,
    live: "Live | None",
    settings: Settings,
    reading: Reading,
    wanted: LimitOptions,
    progress: Callable[[str], None] = silent,
) -> "LimitResult":
    """`limit` with its options in objects, as every front end calls it; `live` where they do not say what grows."""
    from cyclopean import analysis
    from cyclopean.assembly import with_soil

    began = time.perf_counter()

    def left() -> float | None:
        """What is left of the time given; never nothing at all."""
        return None if wanted.seconds is None else max(wanted.seconds - (time.perf_counter() - began), 1e-3)

    assembly, said = assembly_of(model, reading)
    chosen = settings if wanted.seconds is None else replace(settings, seconds=wanted.seconds)
    read = time.perf_counter() - began
    shared: dict[str, Any] = {"solver": wanted.solver, "progress": progress}
    sited = with_soil(assembly, None, settings.soil_height)
    if live is None and wanted.check().along is not None:
        moved = analysis.travelling(assembly, wanted.places(sited), chosen, seconds=left(), **shared)
        found = replace(moved.least, travelling=moved)
    else:
        live = live or wanted.grows(sited)
        around = None
        if wanted.polar is not None:
            around = analysis.polar(assembly, live, chosen, count=wanted.polar, seconds=left(), **shared)
        found = analysis.limit(assembly, live, chosen, seconds=left(), **shared) if around is None else around.least
        found = replace(found, polar=around)
    coupled = None
    if wanted.method == "cra":
        coupled = analysis.coupled_bracket(assembly, found, chosen, progress=progress)
    curve = None
    if wanted.pushover is not None:
        reach = analysis.Reach(*wanted.pushover, wanted.steps or STEPS)
        curve = analysis.pushover(assembly, found.live, reach, chosen, left(), progress)
    return replace(
        found,
        warnings=(*said, *found.warnings),
        seconds={"read": read, **found.seconds, "total": time.perf_counter() - began},
        coupled=coupled,
        pushover=curve,
    )
