"""`make retaining` and `make bridge`: walls with earth behind them, arches with fill above."""

from cyclopean.cli.make import template
from cyclopean.design.earthworks import BridgeShape, DryStone, Soil

retaining = template(
    "retaining",
    "Make a dry-stone wall with batter and through-stones, and the earth behind it.",
    {"stones": "Whole stones in a course.", "courses": "Number of courses."},
    shape=DryStone(),
    soil=Soil(),
)
bridge = template(
    "bridge",
    "Make an arch bridge: arch, spandrel walls and fill.",
    {"voussoirs": "Number of voussoirs."},
    shape=BridgeShape(),
)
