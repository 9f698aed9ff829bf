"""Sparse symmetric factorisation behind one small interface: analyse once, factor many times.

`rslab` (supernodal LDL', MIT) does the work; `scipy` (SuperLU) is the fallback and the reference it is tested against.
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
    """A factorised symmetric matrix."""

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

    backend: str
    indptr: Ints  # (n + 1,) lower triangle by columns, diagonal included
    indices: Ints  # (nnz,) rows, ascending in each column
    handle: Any

    def factor(self, data: Floats) -> Factor:
        """Factor the symmetric matrix whose lower triangle is `data` (nnz,) on this pattern.

        Raises
        ------
        SolverError
            A value is not finite, or the matrix is singular.
        """
        if not np.isfinite(data).all():
            raise SolverError("the matrix to factor holds values that are not finite")
        try:
            if self.backend == "rslab":
                return Factor(self.handle.factor(np.ascontiguousarray(data)))
            return Factor(_superlu(_symmetric(self.indptr, self.indices, data)))
        except (RuntimeError, ValueError) as fault:
            raise SolverError(f"{self.backend}: {fault}") from None


def analyse(indptr: Ints, indices: Ints, backend: str = "rslab", threads: int | None = None) -> Symbolic:
    """Order the pattern of a symmetric matrix given by its lower triangle (columns, diagonal included).

    Parameters
    ----------
    indptr, indices : (n + 1,), (nnz,) int
        Compressed columns of the lower triangle, rows ascending.
    backend : {"rslab", "scipy"}
        Which factorisation to use.
    threads : int, optional
        For rslab; the answer does not depend on it.
    """
    if backend == "rslab":
        import rslab

        count = np.ones(len(indices))
        diagonal = indptr[:-1]
        count[diagonal] = 2.0 * (len(indices) // max(len(diagonal), 1) + 1)
        options = {} if threads is None else {"threads": threads}
        handle: Any = rslab.analyze(_symmetric(indptr, indices, count), path="ldlt", **options)
    elif backend == "scipy":
        handle = None
    else:
        raise SolverError(f"no sparse backend '{backend}': choose rslab or scipy")
    return Symbolic(backend, indptr, indices, handle)


def _symmetric(indptr: Ints, indices: Ints, data: Floats) -> Any:
    n = len(indptr) - 1
    lower = sp.csc_matrix((data, indices, indptr), shape=(n, n))
    return (lower + sp.tril(lower, -1).T).tocsc()


def _superlu(matrix: Any) -> Any:
    from scipy.sparse.linalg import splu

    return splu(matrix, permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True}, diag_pivot_thresh=0.001)
