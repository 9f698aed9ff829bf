"""The sequence file `cyclopean.sequence/1`, and `cyclopean.frames/1` for a robot or crane.

The latter says where each stone waits, comes in and lies, and where tools go.
"""

from typing import TYPE_CHECKING, Any

import numpy as np

from cyclopean import __version__
from cyclopean.io.files import picked, plain

if TYPE_CHECKING:  # only a name here: converting a file must not load the solvers
    from cyclopean.arrays import Floats
    from cyclopean.design.construction.centring import Prop
    from cyclopean.design.construction.laying import LaidStone
    from cyclopean.design.construction.ordering import Cycle, Edge
    from cyclopean.design.construction.sequence import BuildSequence, GivenOrder, Step

__all__ = ["compas_frames", "frames_dict", "sequence_dict"]

SCHEMA = "cyclopean.sequence/1"
FRAMES = "cyclopean.frames/1"
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


def sequence_dict(sequence: "BuildSequence", dot: str) -> dict[str, Any]:
    """Return a building sequence as plain lists, numbers and text, ready for JSON; keys as in `docs/sequence.md`.

    Parameters
    ----------
    sequence : BuildSequence
        The sequence.
    dot : str
        Its graph in the DOT language.
    """
    ids = [block.id for block in sequence.assembly.blocks]
    first = sequence.first_unstable
    kept = {(e.upper, e.lower) for e in sequence.graph.kept}
    top = max(sequence.layer.tolist(), default=0)
    words = [step.verdict for step in sequence.steps]
    return {
        "schema": SCHEMA,
        "model": sequence.assembly.name,
        **picked(sequence, "method", "assumed", "lean"),
        "blocks": len(ids),
        "free": len(sequence.steps),
        "order": [ids[i] for i in sequence.order],
        "supports": [name for name, held in zip(ids, sequence.fixed.tolist(), strict=True) if held],
        "layers": [[ids[i] for i in sequence.order if sequence.layer[i] == level] for level in range(1, top + 1)],
        "stages": {word: words.count(word) for word in ("stable", "unstable", "undecided")},
        "first_unstable": None if first is None else _stage(sequence.steps[first], first + 1, ids),
        "props": [_prop(prop, ids) for prop in sequence.props],
        "held": sum(len(prop.blocks) for prop in sequence.props),
        "least_held": sequence.least_props,
        "given": None if sequence.given is None else _given(sequence.given, ids),
        "trapped": [ids[step.block] for step in sequence.steps if step.free is None],
        "steps": [_step(step, number, sequence, ids) for number, step in enumerate(sequence.steps, 1)],
        "graph": [{**_edge(e, ids), "broken": (e.upper, e.lower) not in kept} for e in sequence.graph.edges],
        "cycles": [_cycle(cycle, ids) for cycle in sequence.graph.cycles],
        "dot": dot,
        "colours": dict(zip(ids, sequence.colour.tolist(), strict=True)),
        **picked(sequence, "along", "up", "seconds"),
        "provenance": {"cyclopean": __version__},
    }


def _stage(step: "Step", number: int, ids: list[str]) -> dict[str, Any]:
    return {
        "step": number,
        "block": ids[step.block],
        "verdict": step.verdict,
        "props": [ids[i] for i in step.props],
        "with_props": step.propped,
        "smallest": step.smallest if step.props else None,
        "moving": [ids[i] for i in step.moving],
        "how": step.how or None,
    }


def _prop(prop: "Prop", ids: list[str]) -> dict[str, Any]:
    return {
        "kind": prop.kind,
        "blocks": [ids[i] for i in prop.blocks],
        "from_step": prop.first + 1,
        "last_step": prop.last + 1,
        "until": None if prop.until is None else ids[prop.until],
        "keystone": prop.keystone,
    }


def _given(given: "GivenOrder", ids: list[str]) -> dict[str, Any]:
    nearest = given.nearest
    return {
        "valid": not given.faults,
        "faults": [
            {
                "step": fault.step + 1,
                "block": ids[fault.block],
                "missing": [ids[i] for i in fault.missing],
                "trapped_by": [ids[i] for i in fault.trapped_by],
            }
            for fault in given.faults
        ],
        "nearest": {
            "order": [ids[i] for i in nearest.order],
            "moved": [ids[i] for i in nearest.moved],
            "least_moves": nearest.least,
            "stages": {word: given.words.count(word) for word in ("stable", "unstable", "undecided")},
        },
    }


def _step(step: "Step", number: int, sequence: "BuildSequence", ids: list[str]) -> dict[str, Any]:
    return _stage(step, number, ids) | {
        **picked(step, "layer", "free", "reason", "seconds", "frames"),
        "rests_on": [ids[i] for i in step.rests_on],
        "blocked_by": [ids[i] for i in step.blocked_by],
        "proof": {"kind": step.proof, "seal": step.seal} if step.proof else None,
        "continued": step.warm,
        "colour": int(sequence.colour[step.block]),
    }


def _edge(edge: "Edge", ids: list[str]) -> dict[str, Any]:
    return {"upper": ids[edge.upper], "lower": ids[edge.lower], "support": edge.support}


def _cycle(cycle: "Cycle", ids: list[str]) -> dict[str, Any]:
    return {
        "blocks": [ids[i] for i in cycle.blocks],
        "broken": [_edge(edge, ids) for edge in cycle.broken],
        "alternatives": [
            {"break": _edge(edge, ids), "order": [ids[i] for i in order]} for edge, order in cycle.alternatives
        ],
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
        "schema": FRAMES,
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
