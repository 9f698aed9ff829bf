"""Limit: how far from collapse?"""

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from cyclopean.analysis.settings import Settings
from cyclopean.api.inputs import Reading
from cyclopean.api.limiting import LIMITED, LimitOptions, limited
from cyclopean.errors import InputError
from cyclopean.service.components.checking import SHARE, laid_out
from cyclopean.service.inputs import option_inputs, option_values
from cyclopean.service.meshes import BLOCKS, model_of
from cyclopean.service.parameters import Answer, Component, Context, Input, Output

if TYPE_CHECKING:
    from cyclopean.analysis import Live


def _limit(given: Mapping[str, Any], context: Context) -> Answer:
    """Find the multiplier at which it falls."""
    from cyclopean.io import json_text, limit_dict

    road = [name for name in ("Surcharge", "Live", "Along") if given[name] is not None]
    live = None if road else _live(given)
    said_of_them = {name: value for name, value in given.items() if name not in ("Push", "Load")}
    base = LimitOptions() if live is None else LimitOptions(push=live.push, tilt=live.tilt)
    wanted = option_values(said_of_them, replace(base, seconds=SHARE * context.seconds))
    assembly, said = model_of(given)
    settings = option_values({name: value for name, value in given.items() if name != "Surcharge"}, Settings())
    found = limited(assembly, live, settings, Reading(), wanted)
    ids = [block.id for block in found.assembly.blocks]
    at = found.governing
    ends = [] if at is None else [ids[int(found.contacts.a[at])], ids[int(found.contacts.b[at])]]
    values = {
        "Outcome": found.word,
        "Reason": found.reason,
        "Stands At": found.lower,
        "Falls At": found.upper,
        "Angle": None if found.angle is None else found.angle[0],
        "Governing": ends,
        **laid_out(found, found.mechanism),
        "Result": json_text(limit_dict(found)).strip(),
    }
    return Answer(values, (*said, *found.warnings))


def _live(given: Mapping[str, Any]) -> "Live":
    """The loads that grow: a push, a force on a block, or else a tilt.

    Raises
    ------
    InputError
        Two of them, a force without a block, or a block without a force.
    """
    from cyclopean.analysis import Live, LiveLoad

    push, force, block = given["Push"], given["Load"], given["Load Block"]
    if (force is None) != (block is None):
        raise InputError("Load: connect both Load and Load Block, the name of the block that it acts on")
    if push is not None and force is not None:
        raise InputError("Push: connect either Push or Load")
    if push is not None:
        return Live(push=tuple(push.tolist()))
    if force is not None:
        return Live(loads=(LiveLoad(block, tuple(force.tolist())),))
    return Live(tilt=given["Azimuth"])


LIMIT = Component(
    "limit",
    "Limit",
    "Limit",
    "Finds how far an assembly is from collapse: by tilting it, unless a push or a load is connected.",
    (
        *BLOCKS,
        *option_inputs(Settings, "mu density"),
        Input("Azimuth", "A", "Number", "Towards which it is tilted, degrees from +x to +y.", default=0.0),
        Input("Push", "P", "Vector", "A push on every block instead, in shares of its weight.", optional=True),
        Input("Load", "L", "Vector", "A force (N) on one block instead.", optional=True),
        Input("Load Block", "Lb", "Text", "Name of that block.", optional=True),
        *option_inputs(Settings, LIMITED.removeprefix("mu density ")),
        *option_inputs(LimitOptions, "method solver polar pushover steps surcharge live_at along"),
    ),
    (
        Output("Outcome", "O", "Text", "limit; unbounded: it never falls; falls: it does so already; or undecided."),
        Output("Reason", "R", "Text", "Why, in a sentence."),
        Output("Stands At", "S", "Number", "Multiplier at which it is proved to stand; of a tilt the tangent."),
        Output("Falls At", "T", "Number", "Multiplier from which on it is proved not to stand."),
        Output("Angle", "D", "Number", "Degrees of a tilt at which it still stands."),
        Output("Governing", "G", "Text", "The two blocks of the joint that gives way most.", "list"),
        Output("Contacts", "C", "Curve", "Outline of each contact; a branch a contact.", "tree"),
        Output("Forces", "F", "Line", "Contact forces just before; a branch a contact.", "tree"),
        Output("Centres", "Oc", "Point", "Centre of mass of each block.", "list"),
        Output("Motion", "Mv", "Vector", "How it falls: velocity of each centre of mass, to a common scale.", "list"),
        Output("Spin", "Ms", "Vector", "How it falls: angular velocity of each block, to that scale.", "list"),
        Output("Certificate", "K", "Text", "The proof of both bounds, as JSON, for cyclopean verify."),
        Output("Result", "J", "Text", "All that was found, as JSON."),
    ),
    _limit,
)  # fmt: skip
