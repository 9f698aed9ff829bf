"""Sparse factorisation behind one small interface: analyse once, factor many times.

`rslab` (supernodal LDL' and LU, MIT) does the work. Patterns are symmetric; values may be on either side of the
diagonal.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp

from cyclopean.arrays import Floats, Ints
from cyclopean.errors import SolverError

__all__ = ["Factor", "Symbolic", "analyse"]


@dataclass(frozen=True, slots=True, eq=False)
class Factor:
    """A factorised matrix."""

    handle: Any

    def solve(self, rhs: Floats) -> Floats:
        """Solve S x = rhs; (n,) in, (n,) out.

        Raises
        ------
        SolverError
            The answer is not finite: the matrix is singular to working precision.
        """
        x = np.asarray(self.handle.solve(rhs), dtype=np.float64)
        if not np.isfinite(x).all():
            raise SolverError("the factorised matrix is singular to working precision")
        return x


@dataclass(frozen=True, slots=True, eq=False)
class Symbolic:
    """The ordering and fill of one pattern; `factor` takes new values on it."""

    indptr: Ints  # (n + 1,) lower triangle by columns, diagonal included
    indices: Ints  # (nnz,) rows, ascending in each column; of an unsymmetric matrix both triangles
    handle: Any

    def factor(self, data: Floats) -> Factor:
        """Factor the matrix with `data` (nnz,) on this pattern: a symmetric one by its lower triangle.

        Raises
        ------
        SolverError
            A value is not finite, or the matrix is singular.
        """
        if not np.isfinite(data).all():
            raise SolverError("the matrix to factor holds values that are not finite")
        try:
            return Factor(self.handle.factor(np.ascontiguousarray(data)))
        except (RuntimeError, ValueError) as fault:
            raise SolverError(f"rslab: {fault}") from None


def analyse(indptr: Ints, indices: Ints, threads: int | None = None, symmetric: bool = True) -> Symbolic:
    """Order a symmetric pattern, given by its lower triangle; by both triangles where the values are not symmetric.

    Parameters
    ----------
    indptr, indices : (n + 1,), (nnz,) int
        Compressed columns, diagonal included, rows ascending.
    threads : int, optional
        The answer does not depend on it.
    symmetric : bool
        LDL' of the lower triangle, or else LU.
    """
    import rslab

    n = len(indptr) - 1
    diagonal = indices == np.repeat(np.arange(n), np.diff(indptr))
    count = np.where(diagonal, 2.0 * (len(indices) // max(n, 1) + 1), 1.0)
    options = {} if threads is None else {"threads": threads}
    matrix = sp.csc_matrix((count, indices, indptr), shape=(n, n))
    if symmetric:
        matrix = (matrix + sp.tril(matrix, -1).T).tocsc()
    return Symbolic(indptr, indices, rslab.analyze(matrix, path="ldlt" if symmetric else "lu", **options))
