"""Check: does it stand, why, and what is the proof?"""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from cyclopean.analysis.settings import Settings
from cyclopean.api.checking import CheckOptions, examined
from cyclopean.api.inputs import Reading
from cyclopean.arrays import Floats
from cyclopean.service.inputs import option_inputs, option_values
from cyclopean.service.meshes import BLOCKS, contact_curves, contact_names, model_of
from cyclopean.service.parameters import Answer, Component, Context, Input, Output

if TYPE_CHECKING:
    from cyclopean.analysis import LimitResult, Result

SHARE = 0.8  # of the time that a solve may take, for the search; the rest is for reading, proving and writing
LONGEST = 0.5  # of a mean block: the line of the largest force
FIRST = "mu density method gravity"  # inputs that have always been first
THEN = (
    "supports tolerance weights combination factors tension cohesion settlement penalty cone solver eps eta beta_min"
    " nodes within surcharge soil_height"
)


def _check(given: Mapping[str, Any], context: Context) -> Answer:
    """Check a model and lay out what was found."""
    from cyclopean.io import json_text, result_dict
    from cyclopean.view.figures import resultants

    turned = {**given, "Tilt": (given["Tilt"], given["Azimuth"]) if given["Tilt"] else None}
    settings = option_values(turned, Settings(seconds=SHARE * context.seconds))
    assembly, said = model_of(given)
    result = examined(assembly, settings, Reading(), option_values(given, CheckOptions()))
    motion = result.mechanism if result.verdict == "unstable" else None
    values = {
        "Verdict": result.verdict,
        "Reason": result.reason,
        "Utilisation": None if result.utilisation is None else [[u] for u in result.utilisation.tolist()],
        "Pairs": contact_names(result.assembly, result.contacts),
        "Resultants": None if (found := resultants(result)) is None else list(found.force),
        **laid_out(result, motion),
        "Result": json_text(result_dict(result)).strip(),
    }
    return Answer(values, (*said, *result.warnings))


def laid_out(result: "Result | LimitResult", motion: Floats | None) -> dict[str, Any]:
    """What every answer shows: joints, forces in them, a motion (n, 6) of the blocks, the proof."""
    from cyclopean.io import json_text

    return {
        "Contacts": [[curve] for curve in contact_curves(result.contacts)],
        "Forces": _force_lines(result),
        "Centres": list(result.assembly.mass.centroid),
        "Motion": None if motion is None else list(motion[:, :3]),
        "Spin": None if motion is None else list(motion[:, 3:]),
        "Certificate": None if result.certificate is None else json_text(result.certificate).strip(),
    }


def _force_lines(result: "Result | LimitResult") -> list[list[Floats]]:
    """For each contact, a line (2, 3) in m for each point that carries force: what the second block feels.

    The largest is half as long as a mean block, so they can be compared with each other.
    """
    if result.force is None:
        return []
    frame = result.contacts.frame if result.frame is None else result.frame
    world = np.einsum("pi,pij->pj", result.force, frame[result.contacts.patch])  # in the world's axes
    size = np.linalg.norm(world, axis=1)
    largest = float(size.max(initial=0.0))
    if not largest > 0.0:
        return [[] for _ in range(len(result.contacts))]
    volume = np.abs(result.assembly.mass.volume)
    scale = LONGEST * float(np.cbrt(volume).mean()) / largest
    lines = np.stack([result.contacts.point, result.contacts.point + scale * world], axis=1)
    start = result.contacts.start
    return [
        [lines[i] for i in range(start[k], start[k + 1]) if size[i] > 1e-9 * largest] for k in range(len(start) - 1)
    ]


CHECK = Component(
    "check",
    "Check",
    "Check",
    "Tells whether a dry-jointed assembly stands, and proves it.",
    (
        *BLOCKS,
        *option_inputs(Settings, FIRST),
        Input("Tilt", "T", "Number", "Degrees by which gravity is turned towards the azimuth.", default=0.0),
        Input("Azimuth", "A", "Number", "Degrees from +x to +y.", default=0.0),
        *option_inputs(Settings, THEN),
        *option_inputs(CheckOptions),
    ),
    (
        Output("Verdict", "V", "Text", "stable, unstable or undecided."),
        Output("Reason", "R", "Text", "Why, in a sentence."),
        Output(
            "Utilisation", "U", "Number", "Share of its friction that each contact uses; a branch a contact.", "tree"
        ),
        Output("Contacts", "C", "Curve", "Outline of each contact; a branch a contact.", "tree"),
        Output("Pairs", "P", "Text", "The two blocks of each contact; a branch a contact.", "tree"),
        Output("Forces", "F", "Line", "Contact forces on the second block; a branch a contact.", "tree"),
        Output("Resultants", "N", "Vector", "Sum of the forces of each contact, in newtons.", "list"),
        Output("Centres", "O", "Point", "Centre of mass of each block.", "list"),
        Output("Motion", "Mv", "Vector", "Where it falls: velocity of each centre of mass, to a common scale.", "list"),
        Output("Spin", "Ms", "Vector", "Where it falls: angular velocity of each block, to that scale.", "list"),
        Output("Certificate", "K", "Text", "The proof, as JSON, for cyclopean verify."),
        Output("Result", "J", "Text", "All that was found, as JSON."),
    ),
    _check,
)
