"""Cholesky in a skyline: solves the banded systems of photo blocks, with the same bits for any number of
threads (LAPACK's threads change the last ones)."""

import numba
import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import reverse_cuthill_mckee

from tasks.stitching.view import Array

LEAST_PIVOT, ROUNDING = 1e-14, 1e-9  # of an unknown's own diagonal: less is rounding, in either direction


def solve_positive(A: Array, b: Array, shared: int = 0) -> Array:
    """x of A x = b for a symmetric positive definite (N, N) A and (N,) or (N, K) b, ordered to a narrow band
    first. The last `shared` unknowns touch all others and stay last. What A leaves undetermined but for
    rounding hardly holds, and so moves far.

    Raises np.linalg.LinAlgError where A is not positive definite."""
    own = len(b) - shared
    banded = reverse_cuthill_mckee(csr_matrix(A[:own, :own] != 0), symmetric_mode=True)
    order = np.concatenate([banded, np.arange(own, len(b))]).astype(np.int64)
    permuted = np.ascontiguousarray(A[np.ix_(order, order)])
    filled = permuted != 0
    first = np.argmax(filled, axis=1).astype(np.int64)
    x = np.ascontiguousarray(b[order].reshape(len(b), -1), dtype=float)
    if not _factor_and_solve(permuted, first, x):
        raise np.linalg.LinAlgError("matrix is not positive definite")
    result = np.empty_like(x)
    result[order] = x
    return result.reshape(b.shape)


@numba.njit(cache=True, nogil=True)
def _factor_and_solve(A: Array, first: Array, x: Array) -> bool:
    """x: (N, K) the right sides, then the solutions, in place."""
    n = len(x)
    for i in range(n):
        for j in range(first[i], i + 1):
            total = A[i, j]
            for k in range(max(first[i], first[j]), j):
                total -= A[i, k] * A[j, k]
            if j < i:
                A[i, j] = total / A[j, j]
            elif not (A[i, i] > 0.0 and total > -ROUNDING * A[i, i]):
                return False
            else:
                A[i, i] = np.sqrt(max(total, LEAST_PIVOT * A[i, i]))
    for i in range(n):
        for k in range(first[i], i):
            if A[i, k] != 0.0:
                x[i] -= A[i, k] * x[k]
        x[i] /= A[i, i]
    for i in range(n - 1, -1, -1):
        x[i] /= A[i, i]
        for k in range(first[i], i):
            if A[i, k] != 0.0:
                x[k] -= A[i, k] * x[i]
    return True
