"""Options of every command that analyses a model: how it is read, and what fills in where it says nothing."""

from typing import Annotated

import typer

__all__ = [
    "Cohesion",
    "Combination",
    "Density",
    "Factors",
    "Gravity",
    "ModelFile",
    "Mu",
    "Settle",
    "Supports",
    "Tension",
    "Tolerance",
    "Units",
]

ModelFile = Annotated[str, typer.Argument(metavar="MODEL", show_default=False, help="Model file.")]
Mu = Annotated[str | None, typer.Option(metavar="M", help="Friction where the model gives none [0.84].")]
Density = Annotated[str | None, typer.Option(metavar="D", help="kg/m3 where the model gives none [2400].")]
Supports = Annotated[
    str, typer.Option(metavar="S", show_default=False, help="below=Z or ids=a,b instead of what the model says.")
]
Gravity = Annotated[str | None, typer.Option(metavar="X,Y,Z", help="m/s2 [0,0,-9.80665].")]
Units = Annotated[str | None, typer.Option(metavar="U", help="Unit of the model's lengths, such as mm.")]
Tolerance = Annotated[str | None, typer.Option(metavar="L", help="Length (m) within which faces touch.")]
Combination = Annotated[
    str, typer.Option(metavar="NAME", show_default=False, help="Combination of load cases that the model names.")
]
Factors = Annotated[
    list[str] | None,
    typer.Option("--factor", metavar="CASE=X", help="Factor of a load case; self is the weight. Repeatable."),
]
Tension = Annotated[
    str | None, typer.Option(metavar="PA", help="rbe: what joints may pull where the model gives none [0, dry].")
]
Cohesion = Annotated[str | None, typer.Option(metavar="PA", help="rbe: the same, given as mu times it.")]
Settle = Annotated[
    list[str] | None,
    typer.Option(metavar="BLOCK:DX,DY,DZ[,RX,RY,RZ]", help="rbe: small settlement of a support (m, rad). Repeatable."),
]
