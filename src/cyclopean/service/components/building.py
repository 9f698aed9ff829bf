"""Sequence: in which order is it built, and does every stage stand? Settle: a rubble wall of stones as found."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from cyclopean.analysis.settings import Settings
from cyclopean.api.checking import sequenced
from cyclopean.design.construction.options import SequenceOptions
from cyclopean.design.rubble.wall import SettleSettings
from cyclopean.io.rhino_json import Pose
from cyclopean.service.inputs import option_inputs, option_values
from cyclopean.service.meshes import BLOCKS, FOLDER, STONES, model_in, model_of, model_text, moved, stones_of
from cyclopean.service.parameters import Answer, Component, Context, Input, Output

Given = Mapping[str, Any]


def _sequence(given: Given, context: Context) -> Answer:
    """Find the order of building."""
    from cyclopean.design.construction.sequence import SECONDS, dot_text
    from cyclopean.io import json_text, sequence_dict

    settings = option_values(given, Settings(seconds=min(SECONDS, context.seconds / 2.0)))
    assembly, said = model_of(given)
    options = replace(option_values(given, SequenceOptions()), order=given["Given Order"] or None)
    found = sequenced(assembly, settings, options)
    top = max(found.layer.tolist(), default=0)
    values = {
        "Order": list(found.order),
        "Layers": [[i for i in found.order if found.layer[i] == level] for level in range(1, top + 1)],
        "Rests On": [list(step.rests_on) for step in found.steps],
        "Way In": [[] if step.free is None else [-step.free] for step in found.steps],
        "Verdicts": [step.verdict for step in found.steps],
        "Props": [list(step.props) for step in found.steps],
        "Put Up": [prop.said([block.id for block in assembly.blocks]) for prop in found.props],
        "Nearest": [] if found.given is None else list(found.given.nearest.order),
        "Result": json_text(sequence_dict(found, dot_text(found))).strip(),
    }
    return Answer(values, (*said, *found.warnings))


SEQUENCE = Component(
    "sequence",
    "Sequence",
    "Sequence",
    "Finds the order in which a structure is built, and whether every stage stands. Blocks are told by their numbers.",
    (
        *BLOCKS,
        *option_inputs(Settings, "mu density method supports gravity tolerance"),
        *option_inputs(SequenceOptions, "bearing clearance"),
        Input(
            "Given Order", "Go", "Integer", "Blocks in an order of your own; found where not connected.", "list",
            optional=True,
        ),
    ),
    (
        Output("Order", "O", "Integer", "Blocks that are not held, the first to be laid first.", "list"),
        Output("Layers", "L", "Integer", "The same by layers; a branch a layer.", "tree"),
        Output("Rests On", "R", "Integer", "What each stone rests on; a branch a step.", "tree"),
        Output("Way In", "W", "Vector", "Which way each comes in, if it is not trapped; a branch a step.", "tree"),
        Output("Verdicts", "V", "Text", "Whether what stands after each step is stable.", "list"),
        Output("Props", "P", "Integer", "Blocks to be held after each step; a branch a step.", "tree"),
        Output("Put Up", "U", "Text", "Centrings and struts, and until when each is needed.", "list"),
        Output("Nearest", "N", "Integer", "The valid order nearest to the one given.", "list"),
        Output("Result", "J", "Text", "All that was found, as JSON."),
    ),
    _sequence,
)  # fmt: skip


def _settle(given: Given, context: Context) -> Answer:
    """Lay stones dry."""
    from cyclopean.design.rubble.settle import settle

    inventory = stones_of(given, context)
    stands, said = (None, ()) if given["Standing"] is None else model_in("Standing", given["Standing"])
    wall = settle(inventory, option_values(given, SettleSettings()), standing=stands, advice=given["Next"])
    poses: list[Pose] = [(laid.rotation, laid.shift) for laid in wall.laid]
    placed = [moved(inventory.stones[laid.stone], pose) for laid, pose in zip(wall.laid, poses, strict=True)]
    values = {
        "Placed": placed,
        "Planes": poses,
        "Stone": [laid.stone for laid in wall.laid],
        "Sits": [laid.stable for laid in wall.laid],
        "Course": [laid.course for laid in wall.laid],
        "Role": [laid.role for laid in wall.laid],
        "Left Over": [stone for stone, _ in wall.left_over],
        "Next Stones": [laid.stone for laid in wall.following],
        "Void": wall.measures.void,
        "Model": model_text(wall.assembly),
    }
    return Answer(values, (*inventory.notes, *said))


SETTLE = Component(
    "settle",
    "Settle",
    "Settle",
    "Lays found stones dry, course after course, without cutting them, and says which sit.",
    (
        STONES,
        *FOLDER,
        *option_inputs(
            SettleSettings,
            "length height thickness wythes batter corner opening ends coursed through hearting pins copes inward dress"
            " all look_ahead margin friction lean yaws ways",
        ),
        Input("Standing", "Sg", "Text", "A wall that stands already, as Model says it: to go on with.", optional=True),
        Input("Next", "Nx", "Integer", "Tell so many stones to lay next, and lay the first alone.", default=0),
    ),
    (
        Output("Placed", "S", "Mesh", "The stones where they lie, in the order they were laid.", "list"),
        Output("Planes", "P", "Plane", "Where the xy plane of each stone goes: Orient from World XY.", "list"),
        Output("Stone", "I", "Integer", "Number of each, in the order they came in.", "list"),
        Output(
            "Sits", "Si", "Boolean", "Whether its centre of mass stands inside the hull of what it touches.", "list"
        ),
        Output("Course", "C", "Integer", "Course of each.", "list"),
        Output("Role", "R", "Text", "What each is: stone, through-stone, hearting, pin, lintel or cope.", "list"),
        Output("Left Over", "X", "Integer", "Stones that are not in the wall.", "list"),
        Output("Next Stones", "Ns", "Integer", "Stones that could be laid next, the best first.", "list"),
        Output("Void", "V", "Number", "Share of the wall that is not stone."),
        Output("Model", "M", "Text", "The wall with its contacts, for Check."),
    ),
    _settle,
)
