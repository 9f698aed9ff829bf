"""Does it stand, and in what order is it built: `check` and `build_sequence` for files and objects alike."""

import os
import time
from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Unpack

from cyclopean.analysis.settings import Settings
from cyclopean.api.inputs import Model, Reading, assembly_of, silent
from cyclopean.api.keywords import CheckKeywords, SequenceKeywords, given_to, takes
from cyclopean.design.construction.options import SequenceOptions
from cyclopean.errors import InputError
from cyclopean.options import check_options, first_said, option

if TYPE_CHECKING:
    from cyclopean.analysis import Margins, Result
    from cyclopean.assembly import Assembly
    from cyclopean.design.construction.sequence import BuildSequence

SEQUENCED = "method mu density supports gravity tolerance seconds"  # options of `Settings` that every stage has


@dataclass(frozen=True, slots=True)
class CheckOptions:
    """What a check tells beside its verdict, and of what contacts."""

    rough: float | str | None = option(
        None, "Find contacts of rough surfaces, nearer than this (m) [flat faces only].", "length", metavar="L|auto"
    )
    steps: int | None = option(
        None, "rbe: follow the settlement in so many steps [a small one only].", "whole", metavar="N", least=1
    )
    margins: bool | None = option(None, "Say how far it is from falling [up to 600 contact points].", "flag")
    vary: tuple[str, ...] = option(
        (),
        "Draw samples with mu, mu-each, density, density-each, joints (wear, m) or tilt within a range.",
        "texts",
        metavar="Q=LOW:HIGH",
    )
    samples: int = option(1000, "With `vary`: how many.", "whole", metavar="N", least=0)
    seed: int = option(0, "With `vary`: of the random numbers.", "whole", metavar="N", least=0)

    def __post_init__(self) -> None:
        check_options(self)
        if self.rough not in (None, "auto") and not (isinstance(self.rough, int | float) and self.rough > 0.0):
            raise InputError.of("rough", self.rough, "expected a positive length in metres, or auto")
        if not self.vary and (idle := first_said(self, "samples seed")):
            raise InputError.of(idle, None, "nothing varies; say what does, such as `vary` mu=0.6:0.8")


@takes(Settings, Reading, CheckOptions)
def check(
    model: Model,
    settings: Settings | None = None,
    progress: Callable[[str], None] = silent,
    *,
    executor: Executor | None = None,
    **options: Unpack[CheckKeywords],
) -> "Result":
    """Decide whether a structure stands, and prove it.

    What is not said, neither here nor in the settings nor in the model, has a default and is listed in
    `Result.assumed`.

    Parameters
    ----------
    model : path, Assembly, anything with an `assembly`, or a list or table of bodies
        The structure; contacts are detected where it gives none.
    settings : Settings, optional
        Options in one object; keywords win over it.
    progress : callable
        Is told the name of each stage as it begins.
    executor : Executor, optional
        Checks the samples of `vary`.
    **options

    Returns
    -------
    Result
        Also `path`, `sensitivity`, and `margins`, which are found when they are first asked for.

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
    chosen, reading, more = given_to(check, options, settings or Settings(), Reading(), CheckOptions())
    return examined(model, chosen, reading, more, progress, executor)


def examined(
    model: Model,
    chosen: Settings,
    reading: Reading,
    more: CheckOptions,
    progress: Callable[[str], None] = silent,
    executor: Executor | None = None,
) -> "Result":
    """`check` with its options in objects, as every front end calls it."""
    from cyclopean import analysis

    began = time.perf_counter()
    if more.margins and chosen.cone != "exact":
        raise InputError.of("margins", None, "are measured with friction cones; leave out `cone`")
    assembly, said = assembly_of(model, reading)
    if idle := chosen.without_effect():
        said = (*said, idle)
    read = time.perf_counter() - began
    if more.rough is not None:
        assembly, notes = _on_rough_surfaces(assembly, more.rough)
        said = (*said, *notes)
    result = analysis.check(assembly, chosen, progress, remedies=True)
    given = _as_judged(assembly, result) if assembly.contacts is None else assembly
    if more.steps is not None and result.verdict != "unstable":
        path = analysis.subsidence(given, chosen, steps=more.steps, progress=progress)
        result = replace(path.judged(result), path=path)
    drawn = None
    if more.vary:
        sampling = analysis.Sampling(analysis.ranges_of(list(more.vary)), more.samples, more.seed)
        drawn = analysis.sensitivity(assembly, sampling, chosen, executor, progress)
        if drawn.count["undecided"]:
            said = (*said, f"`vary`: {drawn.count['undecided']} of {len(drawn.words)} samples are undecided")
    return replace(
        result,
        warnings=(*said, *result.warnings),
        seconds={"read": read, **result.seconds, "total": time.perf_counter() - began},
        sensitivity=drawn,
        spare=_Spare(_as_judged(assembly, result), chosen) if _tells_margins(result, more.margins, chosen) else None,
    )


def _as_judged(assembly: "Assembly", result: "Result") -> "Assembly":
    """The model with the contacts, and where it names none the supports, that the verdict is about."""
    blocks = assembly.blocks
    if result.assumed.get("supports") == "lowest":
        blocks = tuple(replace(b, fixed=held) for b, held in zip(blocks, result.fixed.tolist(), strict=True))
    return replace(assembly, blocks=blocks, contacts=result.contacts)


def _on_rough_surfaces(assembly: "Assembly", rough: "float | str") -> "tuple[Assembly, tuple[str, ...]]":
    """Give a model that lists no contacts those of its rough surfaces (`rough`: m, or auto); say what they are."""
    from cyclopean.assembly import rough_contacts
    from cyclopean.assembly.patches import patch_notes

    if assembly.contacts is not None:
        raise InputError.of("rough", None, "the model lists its contacts; leave it out")
    contacts, patches = rough_contacts(assembly, rough if isinstance(rough, float | int) else None)
    return replace(assembly, contacts=contacts), patch_notes(assembly, patches)


def _tells_margins(result: "Result", wanted: bool | None, chosen: Settings) -> bool:
    """Whether a model has margins to be told of; without being asked only where that takes about a second."""
    moved = result.settled is not None or result.path is not None
    if wanted is False or result.verdict != "stable" or moved or chosen.cone != "exact":
        return False
    from cyclopean.analysis.safety_margins import POINTS

    return bool(wanted) or len(result.contacts.point) <= POINTS


@dataclass(slots=True)
class _Spare:
    """Finds margins when they are first asked for, once."""

    model: "Assembly"  # with its contacts; it stands
    settings: Settings
    found: "Margins | None" = None

    def __call__(self) -> "Margins":
        if self.found is None:
            from cyclopean import analysis

            self.found = analysis.margins(analysis.prepare(self.model, self.settings), self.settings, True)
        return self.found


@takes(Settings, Reading, SequenceOptions, only=f"{SEQUENCED} units strict bearing clearance order")
def build_sequence(
    model: Model,
    settings: Settings | None = None,
    *,
    progress: Callable[[str], None] = silent,
    watch: "Callable[[int, Result], None] | None" = None,
    executor: Executor | None = None,
    **options: Unpack[SequenceKeywords],
) -> "BuildSequence":
    """Find the order in which a structure is built, and check every stage of it.

    Parameters
    ----------
    model : path, Assembly, anything with an `assembly`, or a list or table of bodies
        The finished structure.
    settings : Settings, optional
        Options in one object; keywords win over it. 30 seconds for the search of one stage where not given.
    progress : callable
        Is told what begins.
    watch : callable, optional
        Is given the number of each stage (from 0) and its verdict without props, certificate included.
    executor : Executor, optional
        Does runs of stages side by side, with the same answers; this process where not given.
    **options

    Returns
    -------
    BuildSequence

    Raises
    ------
    InputError
        As `check`, and where gravity is zero, `bearing` or `clearance` are out of range, or `order` names blocks that
        are not there, names one twice or leaves one out.

    Examples
    --------
    >>> import cyclopean
    >>> [step.verdict for step in build_sequence(cyclopean.stack(2)).steps]
    ['stable', 'stable']
    """
    from cyclopean.design.construction.sequence import SECONDS

    base = Settings(seconds=SECONDS) if settings is None else settings
    chosen, reading, order = given_to(build_sequence, options, base, Reading(), SequenceOptions())
    assembly, assumed = assembly_of(model, reading)
    found = sequenced(assembly, chosen, order, progress, executor, watch)
    return replace(found, warnings=(*assumed, *found.warnings)) if assumed else found


def sequenced(
    model: Model,
    settings: Settings,
    wanted: SequenceOptions,
    progress: Callable[[str], None] = silent,
    executor: Executor | None = None,
    watch: "Callable[[int, Result], None] | None" = None,
) -> "BuildSequence":
    """`build_sequence` with its options in objects, as every front end calls it."""
    from cyclopean.design.construction import sequence

    assembly, assumed = assembly_of(model)
    path = wanted.order if isinstance(wanted.order, str | os.PathLike) else None
    if path is not None:
        from cyclopean.io import read_order

        wanted = replace(wanted, order=read_order(path))
    try:
        found = sequence.build_sequence(assembly, settings, wanted, progress, executor, watch)
    except InputError as error:
        if path is None or error.field != "order":
            raise
        raise InputError.of("order", path, error.expected) from None
    return replace(found, warnings=(*assumed, *found.warnings)) if assumed else found
