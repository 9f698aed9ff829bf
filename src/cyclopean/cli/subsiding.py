"""`check --settle --steps`: a settlement that is not small, step by step."""

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from cyclopean.analysis import Result, Settings, Subsidence
    from cyclopean.assembly import Assembly

__all__ = ["Steps", "followed", "path_lines"]

Steps = Annotated[
    str | None, typer.Option(metavar="N", help="rbe: follow the settlement in so many steps [a small one only].")
]
FEW = 24  # rows of the table on the terminal


def followed(
    assembly: "Assembly", settings: "Settings", result: "Result", steps: int | None, stage: Callable[[str], None]
) -> "tuple[Result, Subsidence | None]":
    """The path of a settlement and the verdict on all of it, where that was asked for and there is one."""
    from cyclopean import analysis

    if steps is None or result.verdict != "stable":
        return result, None
    given = replace(assembly, contacts=result.contacts) if assembly.contacts is None else assembly
    path = analysis.subsidence(given, settings, steps=steps, progress=stage)
    return path.judged(result), path


def path_lines(path: "Subsidence | None", result: "Result") -> list[str]:
    """The table: how far, what was found, and the widest joint."""
    if path is None:
        return []
    ids, a, b = [block.id for block in result.assembly.blocks], path.contacts.a, path.contacts.b
    lines = ["  path     settlement m   found       widest joint m"]
    every = -(-len(path.steps) // FEW)
    for k, step in enumerate(path.steps):
        if k % every and k < len(path.steps) - 3:
            continue
        joint = "" if step.joint < 0 else f"   {ids[a[step.joint]]} and {ids[b[step.joint]]}"
        lines.append(f"           {step.settlement:<12.5g}   {step.word:9}   {step.opening:<8.4g}{joint}".rstrip())
    if not path.proved:
        lines.append(
            "  NOT PROVED  no certificate covers any of these states but the first, which moves by next to nothing"
        )
    return lines
