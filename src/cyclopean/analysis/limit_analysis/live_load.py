"""What is made to grow in limit analysis: a push on every block, a tilt of the ground, or given loads."""

from dataclasses import dataclass

import numpy as np

from cyclopean.arrays import Floats
from cyclopean.assembly import Assembly, Load
from cyclopean.errors import InputError

__all__ = ["STANDARD_GRAVITY", "Live", "LiveLoad", "live_loads", "sideways"]

STANDARD_GRAVITY = 9.80665  # m/s2: the unit of a push


@dataclass(frozen=True, slots=True)
class LiveLoad:
    """A force (N) on a block at multiplier 1, at a point (m) or at the block's centroid."""

    block: str
    force: tuple[float, float, float]
    point: tuple[float, float, float] | None = None


@dataclass(frozen=True, slots=True)
class Live:
    """The loads that grow; exactly one of the three.

    `push`: a body acceleration in multiples of standard gravity, so that (1, 0, 0) gives the classical horizontal
    multiplier in shares of weight. `tilt`: the ground is tilted towards this azimuth (degrees from +x to +y); the
    multiplier is the tangent of the angle. `loads`: forces.
    """

    push: tuple[float, float, float] | None = None
    tilt: float | None = None
    loads: tuple[LiveLoad, ...] = ()
    words: str = ""  # what the loads stand for, as in "3 times ..."

    def __post_init__(self) -> None:
        if sum((self.push is not None, self.tilt is not None, bool(self.loads))) != 1:
            raise InputError("live loads: give exactly one of a push, a tilt and loads")
        vectors = [("push", self.push), ("tilt", self.tilt)]
        for load in self.loads:
            vectors += [(f"load on '{load.block}'", load.force), (f"load on '{load.block}'", load.point)]
        for name, value in vectors:
            if value is not None and not np.isfinite(value).all():
                raise InputError(f"{name}: expected finite numbers")
        for name, force in [("push", self.push), *((f"load on '{load.block}'", load.force) for load in self.loads)]:
            if force is not None and not np.any(force):
                raise InputError(f"{name}: is zero, so nothing grows; give a direction")

    @property
    def kind(self) -> str:
        """Which of the three: "push", "tilt" or "load"."""
        return "push" if self.push is not None else "tilt" if self.tilt is not None else "load"


def live_loads(assembly: Assembly, live: Live, gravity: Floats) -> tuple[Floats, tuple[Load, ...]]:
    """(3,) m/s2 and loads that are added at multiplier 1.

    Raises
    ------
    InputError
        A load on a block that is not in the model, or gravity that a tilt does not turn.
    """
    nothing = np.zeros(3)
    if live.push is not None:
        return STANDARD_GRAVITY * np.array(live.push, float), ()
    if live.tilt is not None:
        return sideways(gravity, live.tilt), ()
    index = {block.id: i for i, block in enumerate(assembly.blocks)}
    loads = []
    for load in live.loads:
        if load.block not in index:
            raise InputError.of("load", load.block, f"there is no block '{load.block}' in the model")
        i = index[load.block]
        point = assembly.mass.centroid[i] if load.point is None else np.array(load.point, float)
        loads.append(Load(i, np.array(load.force, float), point))
    return nothing, tuple(loads)


def sideways(gravity: Floats, azimuth: float) -> Floats:
    """(3,) m/s2: what gravity becomes when it is turned by 90 degrees towards `azimuth`.

    Gravity tilted by an angle is cos times (itself, less what lies along the axis of the tilt) plus sin times this.

    Raises
    ------
    InputError
        There is no gravity across the axis.

    Examples
    --------
    >>> (sideways(np.array([0.0, 0, -10]), 90.0).round(12) + 0.0).tolist()
    [0.0, 10.0, 0.0]
    """
    heading = np.deg2rad(azimuth)
    axis = np.array([np.sin(heading), -np.cos(heading), 0.0])  # of a turn from -z towards the azimuth
    turned = np.cross(axis, gravity)
    if not float(np.linalg.norm(turned)) > 1e-9 * float(np.linalg.norm(gravity)):
        raise InputError.of("tilt", azimuth, "gravity lies along the axis of the tilt, or is zero; nothing turns")
    return np.asarray(turned)
