"""Sparse factorisation behind one small interface: analyse once, factor many times.

`rslab` (supernodal LDL' and LU, MIT) does the work; `scipy` (SuperLU) is the fallback and the reference it is tested
against. Patterns are symmetric; values may be on either side of the diagonal.
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

    backend: str
    indptr: Ints  # (n + 1,) lower triangle by columns, diagonal included
    indices: Ints  # (nnz,) rows, ascending in each column; of an unsymmetric matrix both triangles
    handle: Any
    symmetric: bool = True

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
            if self.backend == "rslab":
                return Factor(self.handle.factor(np.ascontiguousarray(data)))
            matrix = _symmetric if self.symmetric else _whole
            return Factor(_superlu(matrix(self.indptr, self.indices, data)))
        except (RuntimeError, ValueError) as fault:
            raise SolverError(f"{self.backend}: {fault}") from None


def analyse(
    indptr: Ints, indices: Ints, backend: str = "rslab", threads: int | None = None, symmetric: bool = True
) -> Symbolic:
    """Order a symmetric pattern, given by its lower triangle; by both triangles where the values are not symmetric.

    Parameters
    ----------
    indptr, indices : (n + 1,), (nnz,) int
        Compressed columns, diagonal included, rows ascending.
    backend : {"rslab", "scipy"}
        Which factorisation to use.
    threads : int, optional
        For rslab; the answer does not depend on it.
    symmetric : bool
        LDL' of the lower triangle, or else LU.
    """
    if backend == "rslab":
        import rslab

        n = len(indptr) - 1
        diagonal = indices == np.repeat(np.arange(n), np.diff(indptr))
        count = np.where(diagonal, 2.0 * (len(indices) // max(n, 1) + 1), 1.0)
        options = {} if threads is None else {"threads": threads}
        matrix, path = (_symmetric, "ldlt") if symmetric else (_whole, "lu")
        handle: Any = rslab.analyze(matrix(indptr, indices, count), path=path, **options)
    elif backend == "scipy":
        handle = None
    else:
        raise SolverError(f"no sparse backend '{backend}': choose rslab or scipy")
    return Symbolic(backend, indptr, indices, handle, symmetric)


def _whole(indptr: Ints, indices: Ints, data: Floats) -> Any:
    n = len(indptr) - 1
    return sp.csc_matrix((data, indices, indptr), shape=(n, n))


def _symmetric(indptr: Ints, indices: Ints, data: Floats) -> Any:
    lower = _whole(indptr, indices, data)
    return (lower + sp.tril(lower, -1).T).tocsc()


def _superlu(matrix: Any) -> Any:
    from scipy.sparse.linalg import splu

    return splu(matrix, permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True}, diag_pivot_thresh=0.001)
