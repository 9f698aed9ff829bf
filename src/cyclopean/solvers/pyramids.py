"""Second-order cones as pyramids, for solvers that know linear cones only."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp

from cyclopean.arrays import Floats
from cyclopean.errors import SolverError
from cyclopean.solvers.programs import Cone, ConicProgram

__all__ = ["Linearised", "linearised"]


@dataclass(frozen=True, slots=True, eq=False)
class Linearised:
    """A programme with pyramids in place of its second-order cones, and the way back."""

    program: ConicProgram
    fold: Any  # (m', m) sparse: rows of the linear programme from those of the conic one, A' = fold A, b' = fold b

    def multipliers(self, z: Floats) -> Floats:
        """(m,) multipliers of the conic programme from (m',) those of the linear one: P x + q + A'z stays as it is.

        With circumscribed pyramids they lie in the dual cones, with inscribed ones up to 1 / cos(pi / K) beyond.
        """
        return np.asarray(self.fold.T @ z)


def linearised(program: ConicProgram, faces: int, inscribed: bool = True) -> Linearised:
    """Put K faces s0 c >= cos(theta_k) s1 + sin(theta_k) s2, theta_k = 2 pi k / K, in place of s0 >= |(s1, s2)|.

    Inscribed, c = cos(pi / K): what satisfies the pyramid satisfies the cone. Circumscribed, c = 1: conversely.

    Parameters
    ----------
    program : ConicProgram
        Second-order cones of dimension 3 only.
    faces : int
        K >= 3.
    inscribed : bool
        Which.

    Raises
    ------
    SolverError
        A second-order cone of another dimension, or fewer than three faces.
    """
    if faces < 3:
        raise SolverError(f"a pyramid of {faces} faces: it needs at least 3")
    angle = 2.0 * np.pi * np.arange(faces) / faces
    cos, sin = np.cos(angle), np.sin(angle)
    cos[np.abs(cos) < 1e-15] = 0.0  # exactly 0 where it should be
    sin[np.abs(sin) < 1e-15] = 0.0
    head = np.full(faces, np.cos(np.pi / faces) if inscribed else 1.0)
    face = sp.csr_matrix(np.stack([head, -cos, -sin], 1))
    blocks: list[Any] = []
    cones: list[Cone] = []
    for kind, size, count in program.cones:
        if kind != "second-order":
            blocks.append(sp.identity(size * count))
            cones.append((kind, size, count))
        elif size == 3:
            blocks.append(sp.kron(sp.identity(count), face))
            cones.append(("nonnegative", faces, count))
        elif count:
            raise SolverError(f"only second-order cones of dimension 3 become pyramids; this one has {size}")
    fold = sp.block_diag(blocks, format="csr") if blocks else sp.csr_matrix((0, 0))
    linear = ConicProgram(program.P, program.q, fold @ program.A, fold @ program.b, tuple(cones))
    return Linearised(linear, fold)
