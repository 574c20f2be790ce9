"""Block-tridiagonal LU with a border, against dense LU."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from evolvent import jit
from evolvent.kernels import blocks

Array = np.ndarray


@pytest.fixture(autouse=True, scope="module")
def _load() -> None:
    jit.load(blocks.functions())


def dense(matrix: blocks.Bordered) -> Array:
    """The whole matrix."""
    n, m, _ = matrix.A.shape
    k = int(matrix.counts[blocks.BORDER])
    A = np.zeros((n * m, (n + 2) * m))
    for i in range(n):
        A[i * m : (i + 1) * m, i * m : (i + 3) * m] = matrix.A[i]
    return np.block([[A[:, m:-m], matrix.B[:, :k]], [matrix.C[:, :k].T, matrix.E[:k, :k]]])


def randomly(
    rng: np.random.Generator, n: int, m: int, k: int, *, spare: int = 0, saddle: bool = False
) -> blocks.Bordered:
    """Random matrix whose blocks need interchanges; as a saddle point its corner is zero."""
    matrix = blocks.bordered(n, m, k, spare=spare)
    matrix.A[:] = rng.standard_normal(matrix.A.shape)
    matrix.A[0, :, :m] = matrix.A[-1, :, 2 * m :] = 0.0
    matrix.A[:, :, m : 2 * m] += 3.0 * m * np.eye(m)[rng.permutation(m)]
    matrix.B[:, :k] = rng.standard_normal((n * m, k))
    matrix.C[:, :k] = matrix.B[:, :k] if saddle else rng.standard_normal((n * m, k))
    if not saddle:
        matrix.E[:k, :k] = rng.standard_normal((k, k))
    return matrix


def chain(n: int, m: int) -> Array:
    """Blocks of springs between n nodes of m unknowns that nothing holds: singular, m rigid modes."""
    A = np.zeros((n, m, 3 * m))
    rng = np.random.default_rng(7)
    for i in range(n - 1):
        root = rng.standard_normal((m, m))
        K = root @ root.T + np.eye(m)
        A[i, :, m : 2 * m] += K
        A[i, :, 2 * m :] -= K
        A[i + 1, :, m : 2 * m] += K
        A[i + 1, :, :m] -= K
    return A


@given(
    n=st.integers(1, 7),
    m=st.sampled_from([1, 2, 3, 5, 6, 12]),
    k=st.integers(0, 4),
    seed=st.integers(0, 10_000),
)
def test_solution_of_random_systems(n: int, m: int, k: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    matrix = randomly(rng, n, m, k)
    full = dense(matrix)
    X = rng.standard_normal((3, n * m + k))
    expected = np.linalg.solve(full, X.T).T
    assert blocks.factor(matrix) == 0
    for row in X:
        blocks.solve(matrix, row)
    assert_allclose(X, expected, rtol=0.0, atol=1e-11 * np.linalg.cond(full) * np.abs(expected).max())


@pytest.mark.parametrize("m", [6, 12])
@pytest.mark.parametrize("scale", [1e-9, 1.0, 1e9])
def test_saddle_point_with_constraints_of_any_scale(rng: np.random.Generator, m: int, scale: float) -> None:
    matrix = randomly(rng, 10, m, 5, saddle=True)
    matrix.B[:] *= scale
    matrix.C[:] *= scale
    full = dense(matrix)
    x = rng.standard_normal(full.shape[0])
    x[10 * m :] /= scale  # multipliers whose forces are of the size of the others
    b = full @ x
    assert blocks.factor(matrix) == 0
    blocks.solve(matrix, b)
    assert_allclose(b[: 10 * m], x[: 10 * m], rtol=1e-9, atol=1e-9)
    assert_allclose(b[10 * m :], x[10 * m :], rtol=1e-9, atol=1e-9 / scale)


def test_border_at_the_first_block_only(rng: np.random.Generator) -> None:
    matrix = randomly(rng, 8, 6, 3)
    matrix.B[6:] = matrix.C[6:] = 0.0
    full, x = dense(matrix), rng.standard_normal(51)
    b = full @ x
    assert blocks.factor(matrix) == 0
    assert not matrix.B[6:].any()  # nothing was spread over the other blocks
    assert matrix.counts[blocks.ROWS] == 6
    blocks.solve(matrix, b)
    assert_allclose(b, x, rtol=1e-10, atol=1e-10)


@pytest.mark.parametrize("redundant", [1, 2, 3])
def test_redundant_constraints_are_counted_and_named(rng: np.random.Generator, redundant: int) -> None:
    k = 5
    matrix = randomly(rng, 6, 6, k, saddle=True)
    weights = rng.standard_normal((k - redundant, redundant))
    matrix.B[:, k - redundant :] = matrix.B[:, : k - redundant] @ weights
    matrix.C[:] = matrix.B
    full = dense(matrix)
    x = np.linalg.lstsq(full, full @ np.ones(36 + k), rcond=1e-12)[0]
    b = full @ np.ones(36 + k)
    assert blocks.factor(matrix) == redundant
    blocks.solve(matrix, b)
    assert_allclose(b[:36], x[:36], rtol=1e-9, atol=1e-9)
    assert_allclose(full @ b, full @ np.ones(36 + k), rtol=1e-9, atol=1e-9)
    named = matrix.order[1, k - redundant : k]
    assert not b[36 + named].any()


def test_constraint_of_nothing_is_redundant(rng: np.random.Generator) -> None:
    matrix = randomly(rng, 3, 6, 2, saddle=True)
    matrix.B[:, 1] = matrix.C[:, 1] = 0.0
    assert blocks.factor(matrix) == 1
    assert matrix.order[0, 1] == 1


@pytest.mark.parametrize(("n", "m"), [(2, 3), (12, 6), (5, 12), (200, 6)])
def test_blocks_that_only_the_border_holds(rng: np.random.Generator, n: int, m: int) -> None:
    matrix = blocks.bordered(n, m, m, spare=m)
    matrix.A[:] = chain(n, m)
    matrix.B[-m:, :m] = matrix.C[-m:, :m] = np.eye(m)  # holds the last node
    full, b = dense(matrix), rng.standard_normal(n * m + m)
    expected = np.linalg.solve(full, b)
    assert blocks.factor(matrix) == 0
    assert matrix.counts[blocks.DEFERRED] == m
    blocks.solve(matrix, b)
    assert_allclose(b, expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max())


def test_freedom_that_nothing_holds_is_counted(rng: np.random.Generator) -> None:
    matrix = blocks.bordered(9, 6, 4, spare=6)
    matrix.A[:] = chain(9, 6)
    matrix.B[:4, :4] = matrix.C[:4, :4] = np.eye(4)
    assert blocks.factor(matrix) == 2


@pytest.mark.parametrize("value", [0.0, np.nan, np.inf])
def test_singular_blocks_are_refused(rng: np.random.Generator, value: float) -> None:
    matrix = randomly(rng, 4, 6, 0)
    matrix.A[2, :, 8] = value
    matrix.A[1, :, 12 + 2] = matrix.A[3, :, 2] = 0.0
    with np.errstate(invalid="ignore"):  # what NumPy says of inf - inf where nothing is compiled
        assert blocks.factor(matrix) == blocks.SINGULAR


@pytest.mark.parametrize("m", [3, 6, 12])
def test_padded_rows_change_nothing(rng: np.random.Generator, m: int) -> None:
    matrix, wide = randomly(rng, 7, m, 4), blocks.bordered(7, m + 2, 4, spare=2)
    for part in range(3):  # two rows more in each block, with nothing but a unit diagonal
        wide.A[:, :m, part * (m + 2) : part * (m + 2) + m] = matrix.A[:, :, part * m : (part + 1) * m]
    wide.A[:, m, 2 * m + 2] = wide.A[:, m + 1, 2 * m + 3] = 1.0
    kept = np.array([i * (m + 2) + r for i in range(7) for r in range(m)])
    wide.B[kept, :4], wide.C[kept, :4], wide.E[:4, :4] = matrix.B, matrix.C, matrix.E
    b = rng.standard_normal(7 * m + 4)
    x = np.zeros(7 * (m + 2) + 4)
    x[kept], x[-4:] = b[:-4], b[-4:]
    assert blocks.factor(matrix) == blocks.factor(wide) == 0
    assert wide.counts[blocks.DEFERRED] == 0
    blocks.solve(matrix, b)
    blocks.solve(wide, x)
    assert_allclose(x[kept], b[:-4], rtol=1e-10, atol=1e-10)
    assert_allclose(x[-4:], b[-4:], rtol=1e-10, atol=1e-10)
    assert_allclose(np.delete(x[:-4], kept), 0.0, atol=0.0)


def test_clear(rng: np.random.Generator) -> None:
    matrix = randomly(rng, 3, 6, 2)
    blocks.clear(matrix)
    assert not dense(matrix).any()


def test_quality_falls_with_the_condition(rng: np.random.Generator) -> None:
    matrix = blocks.bordered(1, 2, 0)
    matrix.A[0, :, 2:4] = [[1.0, 1.0], [1.0, 1.0 + 1e-9]]
    assert blocks.factor(matrix) == 0
    assert_allclose(matrix.quality[0], 1e-9, rtol=1e-6)
