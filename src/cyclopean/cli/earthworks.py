"""`make retaining` and `make bridge`: walls with earth behind them, arches with fill above."""

from typing import Annotated

from cyclopean.cli.command import command
from cyclopean.cli.make import Material, Out, counted, made
from cyclopean.design.earthworks import BridgeShape, DryStone, Soil

__all__ = ["bridge", "retaining"]


@command()
def retaining(
    stones: Annotated[int, counted("STONES", "Whole stones in a course.")],
    courses: Annotated[int, counted("COURSES", "Number of courses.")],
    files: Out,
    shape: DryStone = DryStone(),
    soil: Soil = Soil(),
    material: Material = Material(),
) -> int:
    """Make a dry-stone wall with batter and through-stones, and the earth behind it."""
    return made("retaining", (stones, courses), files, material, shape=shape, soil=soil)


@command()
def bridge(
    voussoirs: Annotated[int, counted("VOUSSOIRS", "Number of voussoirs.")],
    files: Out,
    shape: BridgeShape = BridgeShape(),
    material: Material = Material(),
) -> int:
    """Make an arch bridge: arch, spandrel walls and fill."""
    return made("bridge", (voussoirs,), files, material, shape=shape)
