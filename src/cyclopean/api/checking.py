"""Does it stand, and in what order is it built: `check` and `build_sequence` for files and objects alike."""

from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Literal

from cyclopean.api.inputs import Model, assembly_of, said

if TYPE_CHECKING:
    from cyclopean.analysis import Result, Settings
    from cyclopean.design.construction.sequence import BuildSequence

__all__ = ["build_sequence", "check"]

Vector = tuple[float, float, float]


def _silent(_: str) -> None:
    """Tell nobody."""


def check(
    model: Model,
    settings: "Settings | None" = None,
    progress: Callable[[str], None] = _silent,
    *,
    method: Literal["cra", "rbe"] | None = None,
    mu: float | None = None,
    density: float | None = None,
    supports: str | None = None,
    gravity: Vector | None = None,
    tilt: float | tuple[float, float] | None = None,
    tolerance: float | None = None,
    cone: str | None = None,
    solver: str | None = None,
    penalty: bool | None = None,
    eps: float | None = None,
    eta: float | None = None,
    beta_min: float | None = None,
    seconds: float | None = None,
    nodes: int | None = None,
    units: str | None = None,
) -> "Result":
    """Decide whether a structure stands, and prove it.

    What is not said, neither here nor in the settings nor in the model, has a default and is listed in
    `Result.assumed`.

    Parameters
    ----------
    model : path, Assembly or anything with an `assembly`
        The structure; contacts are detected where it gives none.
    settings : Settings, optional
        Options in one object; keywords win over it.
    progress : callable
        Is told the name of each stage as it begins.
    method : {"cra", "rbe"}, optional
        Coupled analysis (the default), or rigid-block equilibrium alone.
    mu, density : float, optional
        Friction coefficient, and kg/m3, where the model gives none.
    supports : str, optional
        "below=Z" (m) or "ids=a,b" instead of what the model says.
    gravity : (x, y, z), optional
        m/s2.
    tilt : degrees, or (degrees, azimuth in degrees), optional
        Turns gravity.
    tolerance : float, optional
        Length (m) within which faces touch.
    cone, solver : str, optional
        As the options of `cyclopean check`.
    penalty : bool, optional
        Measure the tension that joints would have to bear.
    eps, eta, beta_min : float, optional
        Bounds of coupled analysis.
    seconds, nodes : float, int, optional
        Budget of the search.
    units : str, optional
        Unit of length of a file that does not say it.

    Returns
    -------
    Result

    Raises
    ------
    InputError
        A file that cannot be read, options that make no sense, blocks that are not closed solids, contacts off their
        blocks, supports that do not exist.

    Examples
    --------
    >>> import cyclopean
    >>> check(cyclopean.arch(12, span=3.0, thickness=0.3), mu=0.7).verdict
    'stable'
    """
    from cyclopean import analysis

    assembly, assumed = assembly_of(model, units)
    chosen = said(
        analysis.Settings() if settings is None else settings,
        method=method,
        mu=mu,
        density=density,
        supports=supports,
        gravity=gravity,
        tilt=(float(tilt), 0.0) if isinstance(tilt, int | float) else tilt,
        tolerance=tolerance,
        cone=cone,
        solver=solver,
        penalty=penalty,
        eps=eps,
        eta=eta,
        beta_min=beta_min,
        seconds=seconds,
        nodes=nodes,
    )
    result = analysis.check(assembly, chosen, progress)
    return replace(result, warnings=(*assumed, *result.warnings)) if assumed else result


def build_sequence(
    model: Model,
    settings: "Settings | None" = None,
    *,
    method: Literal["cra", "rbe"] | None = None,
    mu: float | None = None,
    density: float | None = None,
    supports: str | None = None,
    gravity: Vector | None = None,
    tolerance: float | None = None,
    seconds: float | None = None,
    lean: float | None = None,
    clearance: float | None = None,
    most_props: int | None = None,
    progress: Callable[[str], None] = _silent,
    watch: "Callable[[int, Result], None] | None" = None,
    executor: Executor | None = None,
    units: str | None = None,
) -> "BuildSequence":
    """Find the order in which a structure is built, and check every stage of it.

    Parameters
    ----------
    model : path, Assembly or anything with an `assembly`
        The finished structure.
    settings : Settings, optional
        Options in one object; keywords win over it.
    method, mu, density, supports, gravity, tolerance, units
        As for `check`.
    seconds : float, optional
        For the coupled search of one stage; 10 where neither this nor settings are given.
    lean : float, optional
        Least share of a joint's normal along gravity from which one stone rests on the other.
    clearance : float, optional
        m, of approach and retreat.
    most_props : int, optional
        Size up to which all sets of props are gone through.
    progress : callable
        Is told what begins.
    watch : callable, optional
        Is given the number of each stage (from 0) and its verdict without props, certificate included.
    executor : Executor, optional
        Checks the certificates of stages while the next ones are looked at; this process where not given.

    Returns
    -------
    BuildSequence

    Raises
    ------
    InputError
        As `check`, and where gravity is zero or `lean` or `clearance` are out of range.

    Examples
    --------
    >>> import cyclopean
    >>> [step.verdict for step in build_sequence(cyclopean.stack(2)).steps]
    ['stable', 'stable']
    """
    from cyclopean.analysis import Settings
    from cyclopean.design.construction import sequence

    extra: dict[str, Any] = {"lean": lean, "clearance": clearance, "most_props": most_props, "watch": watch}
    assembly, assumed = assembly_of(model, units)
    chosen = said(
        Settings(seconds=sequence.SECONDS) if settings is None else settings,
        method=method,
        mu=mu,
        density=density,
        supports=supports,
        gravity=gravity,
        tolerance=tolerance,
        seconds=seconds,
    )
    given = {name: value for name, value in extra.items() if value is not None}
    found = sequence.build_sequence(assembly, chosen, progress=progress, executor=executor, **given)
    return replace(found, warnings=(*assumed, *found.warnings)) if assumed else found
