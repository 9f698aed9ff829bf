"""The sequence file `cyclopean.sequence/1`."""

from typing import TYPE_CHECKING, Any

from cyclopean import __version__
from cyclopean.io.files import picked

if TYPE_CHECKING:  # only a name here: converting a file must not load the solvers
    from cyclopean.design.construction.centring import Prop
    from cyclopean.design.construction.ordering import Cycle, Edge
    from cyclopean.design.construction.sequence import BuildSequence, GivenOrder, Step

__all__ = ["sequence_dict"]

SCHEMA = "cyclopean.sequence/1"


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
