"""A settled rubble wall as JSON: `cyclopean.settle/1`."""

from typing import TYPE_CHECKING, Any

from cyclopean import __version__
from cyclopean.design.rubble.dressing import cut_list
from cyclopean.io.files import picked

if TYPE_CHECKING:
    from cyclopean.design.rubble.settle import RubbleWall
    from cyclopean.design.stones.inventory import Inventory

__all__ = ["SCHEMA", "settled_dict"]

SCHEMA = "cyclopean.settle/1"


def settled_dict(
    wall: "RubbleWall", inventory: "Inventory", *, stones_path: str, model_path: str, units: str | None = None
) -> dict[str, Any]:
    """Return where each stone lies as plain lists, numbers and text, ready for JSON.

    Parameters
    ----------
    wall : RubbleWall
        Of stones of this inventory.
    inventory : Inventory
        What it was laid of.
    stones_path, model_path : str
        Where stones and model lie: absolute, or relative to the folder of this file.
    units : str, optional
        Units the stones were read in, where the command said so.
    """
    stones, ids = inventory.stones, [block.id for block in wall.assembly.blocks]
    return {
        "schema": SCHEMA,
        "stones": stones_path,
        "model": model_path,
        "units": units,
        "placements": [
            {
                "stone": stones[laid.stone].id,
                **picked(laid, "transform", "course", "role", "stable", "reason"),
                "cuts": cut_list(laid.cuts),
                "margin": laid.margin if laid.margin > -1e300 else None,  # None: nothing bears it
            }
            for laid in wall.laid
        ],
        "left_over": [{"stone": stones[k].id, "reason": reason} for k, reason in wall.left_over],
        "next": [{"stone": stones[one.stone].id, **picked(one, "transform", "margin")} for one in wall.following],
        **picked(wall, "measures", "settings"),
        "contacts": [
            {"a": ids[p.a], "b": ids[p.b], **picked(p, "kind", "area", "touching", "misfit")} for p in wall.patches
        ],
        "provenance": {"cyclopean": __version__},
    }
