"""The peer's own cases: models with frames, and what compas_cra answers. Not part of the project."""

import json
import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp

from cyclopean.solvers import ConicProgram, solve

FOLDER = Path(os.environ.get("CYCLOPEAN_FIXTURES", Path(__file__).parents[2] / "shared" / "fixtures")) / "compas_cra"
NAMES = sorted(path.stem for path in FOLDER.glob("*.json"))
needs_fixtures = pytest.mark.skipif(not NAMES, reason=f"the peer's cases are not at {FOLDER}")


def raw(name: str) -> dict[str, Any]:
    """One fixture as plain JSON."""
    return json.loads((FOLDER / f"{name}.json").read_text())


def peer_system(data: dict[str, Any]) -> tuple[sp.csc_matrix, np.ndarray, float]:
    """(A, p, total weight) in the peer's frames and units: weight = density x volume, unit gravity. Plain loops."""
    free = [b for b in data["blocks"] if not b["fixed"]]
    row = {b["id"]: 6 * i for i, b in enumerate(free)}
    centre = {b["id"]: np.array(b["center"]) for b in data["blocks"]}
    weight = [b["volume"] * (b["density"] or data["density"]) for b in free]
    points = [(f, np.array(r)) for f in data["interfaces"] for r in f["polygon"]]
    A = sp.lil_matrix((6 * len(free), 3 * len(points)))
    for k, (face, r) in enumerate(points):
        for block, sign in ((face["a"], -1.0), (face["b"], 1.0)):
            if block in row:
                for j, axis in enumerate(("n", "u", "v")):
                    e = np.array(face["frame"][axis])
                    e = sign * e / np.linalg.norm(e)
                    wrench = np.concatenate([e, np.cross(r - centre[block], e)])
                    A[row[block] : row[block] + 6, 3 * k + j] = wrench[:, None]
    p = np.zeros((len(free), 6))
    p[:, 2] = [-w for w in weight]
    return A.tocsc(), p.ravel(), float(sum(weight))


def peer_program(data: dict[str, Any]) -> tuple[ConicProgram, float]:
    """The peer's RBE: fn = fn+ - fn-, circumscribed pyramid of 8 faces on fn+, 1e6 on fn-, and its quirk; scaled.

    Unknowns (fn+, fn-, fu, fv) a point. The quirk: fv counts in the objective only at points whose index is divisible
    by 3. The objective has no factor 1/2, so P is twice its weights.
    """
    A, p, total = peer_system(data)
    n = A.shape[1] // 3
    split = sp.kron(sp.identity(n), np.array([[1.0, -1.0, 0, 0], [0, 0, 1.0, 0], [0, 0, 0, 1.0]]), format="csc")
    weights = np.ones((n, 4))
    weights[:, 1] = 1e6
    weights[:, 3] = np.arange(n) % 3 == 0
    angle = 2 * np.pi * np.arange(8) / 8
    faces = np.stack([np.full(8, -data["mu"]), np.zeros(8), np.cos(angle), np.sin(angle)], 1)
    friction = sp.kron(sp.identity(n), faces)
    signs = sp.kron(sp.identity(n), np.array([[-1.0, 0, 0, 0], [0, -1.0, 0, 0]]))
    rows = sp.vstack([A @ split, friction, signs], format="csc")
    b = np.concatenate([-p / total, np.zeros(10 * n)])
    cones = (("zero", len(p), 1), ("nonnegative", 10 * n, 1))
    return ConicProgram(sp.diags(2 * weights.ravel(), format="csc"), np.zeros(4 * n), rows, b, cones), total


def peer_objective(data: dict[str, Any]) -> tuple[float, float]:
    """Our minimum of the peer's problem in the peer's units, and how far IPOPT's tolerances may move it.

    IPOPT satisfies constraints to 1e-8 in the model's own units and relaxes bounds by as much; a constraint violated by
    v moves the minimum by at most its multiplier times v. Its barrier adds about 1e-9 a constraint.
    """
    program, total = peer_program(data)
    for tolerance in (1e-13, 1e-11, 1e-9):
        answer = solve(program, tol_gap_abs=tolerance, tol_gap_rel=1e-10, tol_feas=max(tolerance, 1e-11))
        if answer.word == "solved":
            break
    assert answer.word == "solved", answer.status
    minimum = float(0.5 * answer.x @ (program.P @ answer.x)) * total**2
    slack = 1e-8 * float(np.sum(np.abs(answer.z))) * total + 1e-8 * len(program.b)
    return minimum, slack
