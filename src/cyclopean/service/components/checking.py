"""Check: does it stand, why, and what is the proof?"""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from cyclopean.arrays import Floats
from cyclopean.errors import InputError
from cyclopean.service.meshes import BLOCKS, contact_curves, contact_names, model_of
from cyclopean.service.parameters import Answer, Component, Context, Input, Output

if TYPE_CHECKING:
    from cyclopean.analysis import LimitResult, Result, Settings

__all__ = ["CHECK", "DENSITY", "FRICTION", "METHOD", "force_lines", "settings_of"]

METHODS = ("cra", "rbe")
SHARE = 0.8  # of the time that a solve may take, for the search; the rest is for reading, proving and writing
LONGEST = 0.5  # of a mean block: the line of the largest force

FRICTION = Input(
    "Friction", "mu", "Number", "Friction coefficient of the joints; what a Model says wins.", default=0.84
)
DENSITY = Input("Density", "rho", "Number", "kg/m3 of the stones; what a Model says wins.", default=2400.0)
METHOD = Input("Method", "Me", "Text", "cra, coupled analysis; or rbe, equilibrium alone.", default="cra")


def settings_of(given: Mapping[str, Any], seconds: float) -> "Settings":
    """Settings of an analysis from the inputs FRICTION, DENSITY and METHOD, and `Gravity` and `Tilt` where there are.

    Raises
    ------
    InputError
        A value that cannot be; names the input.
    """
    from cyclopean.analysis import Settings

    method = given["Method"].strip().lower()
    if method not in METHODS:
        raise InputError(f"Method: expected {' or '.join(METHODS)}, got '{given['Method'][:40]}'")
    if not given["Friction"] >= 0.0:
        raise InputError(f"Friction: {given['Friction']:g} is less than 0")
    if not 0.0 < given["Density"] <= 1e12:
        raise InputError(f"Density: {given['Density']:g} is no density in kg/m3")
    gravity = given.get("Gravity")
    tilt = given.get("Tilt", 0.0), given.get("Azimuth", 0.0)
    return Settings(
        method=method,
        mu=given["Friction"],
        density=given["Density"],
        gravity=None if gravity is None else tuple(gravity.tolist()),
        tilt=tilt if tilt[0] else None,
        seconds=seconds,
    )


def _check(given: Mapping[str, Any], context: Context) -> Answer:
    """Check a model and lay out what was found."""
    from cyclopean.analysis import check
    from cyclopean.io import json_text, result_dict

    settings = settings_of(given, SHARE * context.seconds)
    assembly, said = model_of(given)
    result = check(assembly, settings)
    centre = result.assembly.mass.centroid
    moving = result.verdict == "unstable" and result.mechanism is not None
    motion = result.mechanism if moving else None
    values = {
        "Verdict": result.verdict,
        "Reason": result.reason,
        "Utilisation": None if result.utilisation is None else [[u] for u in result.utilisation.tolist()],
        "Contacts": [[curve] for curve in contact_curves(result.contacts)],
        "Pairs": contact_names(result.assembly, result.contacts),
        "Forces": force_lines(result),
        "Resultants": None if result.force is None else list(_resultants(result)),
        "Centres": list(centre),
        "Motion": None if motion is None else list(motion[:, :3]),
        "Spin": None if motion is None else list(motion[:, 3:]),
        "Certificate": None if result.certificate is None else json_text(result.certificate).strip(),
        "Result": json_text(result_dict(result)).strip(),
    }
    return Answer(values, (*said, *result.warnings))


def force_lines(result: "Result | LimitResult") -> list[list[Floats]]:
    """For each contact, a line (2, 3) in m for each point that carries force: what the second block feels.

    The largest is half as long as a mean block, so they can be compared with each other.
    """
    if result.force is None:
        return []
    world = _world(result)
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


def _world(result: "Result | LimitResult") -> Floats:
    """(P, 3) N at each contact point, on the second block, in the world's axes."""
    assert result.force is not None
    frame = result.contacts.frame if result.frame is None else result.frame
    return np.asarray(np.einsum("pi,pij->pj", result.force, frame[result.contacts.patch]))


def _resultants(result: "Result") -> Floats:
    """(c, 3) N of each contact."""
    world, count = _world(result), len(result.contacts)
    return np.stack([np.bincount(result.contacts.patch, world[:, k], count) for k in range(3)], axis=1)


CHECK = Component(
    "check",
    "Check",
    "Check",
    "Tells whether a dry-jointed assembly stands, and proves it.",
    (
        *BLOCKS,
        FRICTION,
        DENSITY,
        METHOD,
        Input("Gravity", "G", "Vector", "m/s2; 9.80665 down -z where nothing is connected.", optional=True),
        Input("Tilt", "T", "Number", "Degrees by which gravity is turned towards the azimuth.", default=0.0),
        Input("Azimuth", "A", "Number", "Degrees from +x to +y.", default=0.0),
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
