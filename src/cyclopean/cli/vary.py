"""`check --vary`: how sure is the verdict, when the data are not?"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

import typer

from cyclopean.cli.terminal import warn
from cyclopean.cli.values import whole
from cyclopean.cli.workers import workers
from cyclopean.errors import InputError

if TYPE_CHECKING:
    from cyclopean.analysis import Sensitivity, Settings
    from cyclopean.assembly import Assembly

__all__ = ["Cluster", "Samples", "Seed", "Vary", "Wanted", "Workers", "asked", "sensitivity_lines", "vary"]

Vary = Annotated[
    list[str] | None,
    typer.Option(
        "--vary",
        metavar="Q=LOW:HIGH",
        help="Draw samples with mu, mu-each, density, density-each, joints (wear, m) or tilt within a range.",
    ),
]
Samples = Annotated[str | None, typer.Option(metavar="N", help="With --vary: how many [1000].")]
Seed = Annotated[str | None, typer.Option(metavar="N", help="With --vary: of the random numbers [0].")]
Workers = Annotated[str | None, typer.Option(metavar="N", help="With --vary: processes [1].")]
Cluster = Annotated[str | None, typer.Option(metavar="ADDRESS", help="With --vary: scheduler of a dask cluster.")]


@dataclass(frozen=True, slots=True)
class Wanted:
    """What was asked for."""

    texts: tuple[str, ...]
    samples: int
    seed: int
    workers: int
    cluster: str | None


def asked(
    vary: list[str] | None, samples: str | None, seed: str | None, workers: str | None, cluster: str | None
) -> Wanted | None:
    """Read the options; None where nothing varies.

    Raises
    ------
    InputError
        A number that is none, or an option that says how to vary where nothing does.
    """
    if not vary:
        options = {"--samples": samples, "--seed": seed, "--workers": workers, "--cluster": cluster}
        idle = [option for option, text in options.items() if text is not None]
        if idle:
            raise InputError(f"{idle[0]}: nothing varies; say what does, such as --vary mu=0.6:0.8")
        return None
    return Wanted(
        tuple(vary),
        1000 if samples is None else whole("--samples", samples),
        0 if seed is None else whole("--seed", seed),
        1 if workers is None else whole("--workers", workers),
        cluster,
    )


def vary(assembly: "Assembly", settings: "Settings", wanted: Wanted, progress: Callable[[str], None]) -> "Sensitivity":
    """Draw and check the samples, by whoever is to do it."""
    from cyclopean import analysis

    ranges = analysis.ranges_of(list(wanted.texts))
    with workers(wanted.workers, wanted.cluster) as executor:
        found = analysis.sensitivity(assembly, ranges, settings, wanted.samples, wanted.seed, executor, progress)
    if found.count["undecided"]:
        warn(f"--vary: {found.count['undecided']} of {len(found.words)} samples are undecided")
    return found


def sensitivity_lines(found: "Sensitivity") -> list[str]:
    """Say what the samples came to."""
    what = ", ".join(f"{r.quantity} {r.low:g} to {r.high:g}" for r in found.ranges)
    lines = [f"  vary     {what}: {found.why}"]
    if found.words:
        low, estimate, high = found.probability
        count = found.count
        lines.append(
            f"           {count['stable']} of {len(found.words)} samples stand, {count['unstable']} fall,"
            f" {count['undecided']} undecided: {100 * estimate:.1f} % stand"
            f" (95 % sure: {100 * low:.1f} to {100 * high:.1f} %)"
        )
    return lines
