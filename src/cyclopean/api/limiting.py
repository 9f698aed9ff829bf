"""How far from collapse: `limit` for files and objects alike."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Literal

from cyclopean.api.inputs import Model, assembly_of, said
from cyclopean.errors import InputError

if TYPE_CHECKING:
    from cyclopean.analysis import LimitResult, Live, Settings

__all__ = ["limit"]

Vector = tuple[float, float, float]


def _silent(_: str) -> None:
    """Tell nobody."""


def limit(
    model: Model,
    live: "Live | None" = None,
    settings: "Settings | None" = None,
    progress: Callable[[str], None] = _silent,
    *,
    push: Vector | None = None,
    tilt: float | None = None,
    loads: Mapping[str, Vector] | None = None,
    mu: float | None = None,
    density: float | None = None,
    supports: str | None = None,
    gravity: Vector | None = None,
    tolerance: float | None = None,
    solver: Literal["auto", "interior", "clarabel"] = "auto",
    seconds: float | None = None,
    units: str | None = None,
) -> "LimitResult":
    """By how much may loads grow before a structure falls, by rigid-block equilibrium?

    Exactly one of `live`, `push`, `tilt` and `loads` says which loads.

    Parameters
    ----------
    model : path, Assembly or anything with an `assembly`
        The structure.
    live : Live, optional
        What grows, in one object; also loads at given points.
    settings : Settings, optional
        Options in one object; keywords win over it.
    progress : callable
        Is told the name of each stage as it begins.
    push : (x, y, z), optional
        A body acceleration; with a unit vector the multiplier is a share of the weight.
    tilt : float, optional
        Tilts the ground towards this azimuth (degrees from +x to +y); the answer has its angle.
    loads : mapping of str to (x, y, z), optional
        Block and force (N) at its centroid, at multiplier 1.
    mu, density, supports, gravity, tolerance, units
        As for `check`.
    solver : {"auto", "interior", "clarabel"}
        Who looks for the bounds; both are checked by another program.
    seconds : float, optional
        Time after which what is proved by then is told: bounds that are further apart.

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
    from cyclopean import analysis

    assembly, assumed = assembly_of(model, units)
    if live is None:
        forces = tuple(analysis.LiveLoad(block, force) for block, force in (loads or {}).items())
        grows = analysis.Live(push, tilt, forces)
    elif push is not None or tilt is not None or loads:
        raise InputError("live: says what grows; leave out push, tilt and loads")
    else:
        grows = live
    chosen = said(
        analysis.Settings() if settings is None else settings,
        mu=mu,
        density=density,
        supports=supports,
        gravity=gravity,
        tolerance=tolerance,
    )
    found = analysis.limit(assembly, grows, chosen, progress, solver=solver, seconds=seconds)
    return replace(found, warnings=(*assumed, *found.warnings)) if assumed else found
