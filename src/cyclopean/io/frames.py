"""The file for a robot or crane `cyclopean.frames/1`: where each stone waits, comes in and lies; where tools go."""

from typing import TYPE_CHECKING, Any

from cyclopean import __version__
from cyclopean.io.files import plain

if TYPE_CHECKING:
    from cyclopean.design.construction.laying import LaidStone
    from cyclopean.design.construction.sequence import BuildSequence

__all__ = ["frames_dict"]

SCHEMA = "cyclopean.frames/1"
STOPS = ("yard", "lift", "approach", "place", "retract")
CONVENTIONS = {
    "units": "lengths in metres, masses in kilograms, angles none: a frame is a matrix",
    "world": "the model's own coordinates; 'up' is against gravity, 'along' the wall, 'into' from its face to its back",
    "frame": (
        "4 x 4, row by row, right-handed; the last column is the origin, the first three the axes. It says where the"
        " stone's own frame stands: origin at its centre of gravity, axes as in the world while it is in the wall."
        " A point x of the model moves with frame F to F place^-1 (x, 1)."
    ),
    "way": "yard, lift, approach, place; then the tool lets go and goes to retract",
    "free": "false where no straight way leads in; approach and retract are then above the place",
}


def frames_dict(sequence: "BuildSequence", stones: "tuple[LaidStone, ...]") -> dict[str, Any]:
    """Return the frames of all stones in the order of laying as plain lists, numbers and text, ready for JSON.

    Parameters
    ----------
    sequence : BuildSequence
        The structure and how it is built.
    stones : tuple of LaidStone
        Its stones.
    """
    return {
        "schema": SCHEMA,
        "model": sequence.assembly.name,
        "conventions": CONVENTIONS,
        **{name: plain(getattr(sequence, name)) for name in ("along", "up", "gravity")},
        "steps": [
            {
                "step": stone.step,
                "stone": stone.id,
                "mass": plain(stone.mass),
                "free": step.free is not None,
                **{stop: plain(getattr(step.frames, stop)) for stop in STOPS},
            }
            for stone, step in zip(stones, sequence.steps, strict=True)
        ],
        "provenance": {"cyclopean": __version__},
    }
