import numpy as np
import pytest

from cloth_ros.tradeoff.eigenvalues import (
    NotConvergedError,
    has_eigenvalue_above,
    largest_eigenvalue,
)


@pytest.mark.parametrize('symmetric', [True, False])
@pytest.mark.parametrize('size', [1, 3, 310])
def test_the_eigenvalue_is_that_of_the_matrix(size, symmetric):
    """Of sizes below and above that from which on ARPACK is used."""
    random = np.random.default_rng(size)
    matrix = random.standard_normal((size, size))
    matrix = matrix + matrix.T if symmetric else matrix
    start = random.standard_normal(size)
    expected = np.linalg.eigvals(matrix).real.max()
    found = largest_eigenvalue(matrix.__matmul__, start, 1e-9, symmetric=symmetric)
    assert found.real == pytest.approx(expected, rel=1e-5)
    assert found == largest_eigenvalue(matrix.__matmul__, start, 1e-9, symmetric=symmetric)
    assert has_eigenvalue_above(matrix.__matmul__, start, expected - 0.1, 1e-6)
    assert not has_eigenvalue_above(matrix.__matmul__, start, expected + 0.1, 1e-6)


def test_a_field_that_is_mapped_to_nothing_has_the_eigenvalue_zero():
    assert largest_eigenvalue(np.zeros_like, np.ones((3, 8, 9)), 1e-6, symmetric=True) == 0


def test_what_does_not_converge_is_no_eigenvalue():
    """A nilpotent shift: its vectors are never close to the only one that it keeps, e₀."""
    start = np.random.default_rng(0).standard_normal(600)

    def shift(x: np.ndarray) -> np.ndarray:
        return np.append(x[1:], 0.0)

    with pytest.raises(NotConvergedError):
        largest_eigenvalue(shift, start, 1e-12)
    assert not has_eigenvalue_above(shift, start, 0.5, 1e-12)
