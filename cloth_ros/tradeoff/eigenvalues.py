"""Largest eigenvalues of linear maps of displacement fields, by ARPACK (`scipy.sparse.linalg`)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..model.grid import Array

# Length of the Krylov basis, and the number of times that ARPACK may restart it.  Steps of sheets
# of 24 × 24 took up to 360 products where they are stable, with all eigenvalues close to the unit
# circle, and 80 to 160 where one lies outside.
_BASIS = 40
# Size up to which the matrix is assembled: as many products as ARPACK needs, and exact.
_DENSE = 300
_RESTARTS = 40
# Multiple of the tolerance that the residual of what ARPACK returns may have.
_SLACK = 10

Operator = Callable[[Array], Array]


class NotConvergedError(ArithmeticError):
    """No eigenvalue was found to the tolerance that was asked for."""


def largest_eigenvalue(
    operator: Operator, start: Array, tolerance: float, *, symmetric: bool = False
) -> complex:
    """
    Return the eigenvalue with the largest real part.

    Parameters
    ----------
    operator
        Linear; takes and returns a real array of the shape of `start`.
    start
        Initial vector; given, so that the same call returns the same bits.
    tolerance
        Residual |A v − λ v| that is small enough, as a share of |λ|, for |v| = 1.
    symmetric
        True if the matrix of the operator is known to be symmetric.

    Raises
    ------
    NotConvergedError
        The residual is still larger after the last restart.

    """
    from scipy.sparse.linalg import ArpackNoConvergence, LinearOperator, eigs, eigsh

    def product(vector: Array) -> Array:
        return operator(vector.reshape(start.shape)).ravel()

    def complex_product(vector: Array) -> Array:
        return product(vector.real) + 1j * product(vector.imag)

    n = start.size
    if n <= _DENSE:
        matrix = np.array([product(unit) for unit in np.eye(n)]).T
        values = np.linalg.eigvalsh(matrix) if symmetric else np.linalg.eigvals(matrix)
        return complex(values[np.argmax(values.real)])
    if not product(start.ravel()).any():  # the zero matrix, which ARPACK refuses
        return 0j
    # Without symmetry in complex arithmetic: the driver for real matrices returned values that
    # are none, with vectors of length 1e-10, where the largest pair is complex (SciPy 1.17).
    solve, which = (eigsh, 'LA') if symmetric else (eigs, 'LR')
    multiply, dtype = (product, float) if symmetric else (complex_product, complex)
    try:
        (value,), vectors = solve(
            LinearOperator((n, n), matvec=multiply, dtype=dtype),
            k=1,
            which=which,
            v0=start.ravel().astype(dtype),
            tol=tolerance,
            ncv=_BASIS,
            maxiter=_RESTARTS,
        )
    except ArpackNoConvergence as error:
        raise NotConvergedError(str(error)) from None
    if symmetric:
        return complex(value)
    vector = vectors[:, 0]
    residual = float(np.linalg.norm(multiply(vector) - value * vector))
    if not residual <= _SLACK * tolerance * abs(value) * np.linalg.norm(vector):
        raise NotConvergedError(f'an eigenvalue of {value:g} has the residual {residual:g}')
    return complex(value)


def has_eigenvalue_above(operator: Operator, start: Array, bound: float, tolerance: float) -> bool:
    """
    Return whether an eigenvalue has a real part above `bound`.

    False if none is found to the tolerance: iterations are slow where many eigenvalues are close
    to the largest one, as in stable steps; that of an unstable mode is isolated and found soon.
    """
    try:
        return largest_eigenvalue(operator, start, tolerance).real > bound
    except NotConvergedError:
        return False
