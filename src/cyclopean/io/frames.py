"""The file for a robot or crane `cyclopean.frames/1`: where each stone waits, comes in and lies; where tools go."""

from typing import TYPE_CHECKING, Any

import numpy as np

from cyclopean import __version__
from cyclopean.io.files import plain

if TYPE_CHECKING:
    from cyclopean.arrays import Floats
    from cyclopean.design.construction.laying import LaidStone
    from cyclopean.design.construction.sequence import BuildSequence

__all__ = ["compas_frames", "frames_dict"]

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
    "bases": (
        "the frames of the wall and of the yard, each in the world: origin at the left end, the face and the foot of"
        " the stones, in the wall and as they lie in the yard; axes along, into, up. 'in_wall' and 'in_yard' hold every"
        " stop as seen from there: base^-1 frame"
    ),
    "compas": "frames.compas.json holds the same, in the world, as lists of compas.geometry.Frame, one a stop",
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
    bases = {"wall": _base(sequence, 0.0), "yard": _base(sequence, sequence.yard)}
    steps = []
    for stone, step in zip(stones, sequence.steps, strict=True):
        stops = {stop: getattr(step.frames, stop) for stop in STOPS}
        seen = {f"in_{name}": {s: np.linalg.solve(base, f) for s, f in stops.items()} for name, base in bases.items()}
        told = {"step": stone.step, "stone": stone.id, "mass": stone.mass, "free": step.free is not None}
        steps.append(plain(told | stops | seen))
    return {
        "schema": SCHEMA,
        "model": sequence.assembly.name,
        "conventions": CONVENTIONS,
        **{name: plain(getattr(sequence, name)) for name in ("along", "up", "gravity")},
        "bases": plain(bases),
        "steps": steps,
        "provenance": {"cyclopean": __version__},
    }


def _base(sequence: "BuildSequence", shift: Any) -> "Floats":
    """(4, 4) frame at the left end, the face and the foot of all stones that are laid, each moved by its shift (m)."""
    mesh = sequence.assembly.mesh
    axes = np.stack([sequence.along, np.cross(sequence.up, sequence.along), sequence.up])
    moved = mesh.vertex + (shift[mesh.vertex_body] if np.ndim(shift) else shift)
    laid = np.isin(mesh.vertex_body, sequence.order)
    frame = np.eye(4)
    frame[:3, :3] = axes.T
    frame[:3, 3] = (moved[laid] @ axes.T).min(axis=0, initial=np.inf) @ axes if laid.any() else 0.0
    return frame


def compas_frames(frames: dict[str, Any]) -> dict[str, Any]:
    """Return the frames of `frames_dict` as COMPAS reads them: a list of `compas.geometry/Frame` for each stop."""

    def one(matrix: Any) -> dict[str, Any]:
        x, y, _, point = np.asarray(matrix)[:3].T.tolist()
        return {"dtype": "compas.geometry/Frame", "data": {"point": point, "xaxis": x, "yaxis": y}}

    return {
        "stones": [step["stone"] for step in frames["steps"]],
        **{base: one(matrix) for base, matrix in frames["bases"].items()},
        "stops": {stop: [one(step[stop]) for step in frames["steps"]] for stop in STOPS},
    }
