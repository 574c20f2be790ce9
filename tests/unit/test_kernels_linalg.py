"""Dense and banded factorisations against NumPy and SciPy."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, strategies as st
from numpy.testing import assert_allclose
from scipy import linalg as scipy_linalg

from evolvent.algebra import linalg

seeds = st.integers(0, 2**32 - 1)


def positive_definite(rng: np.random.Generator, n: int) -> np.ndarray:
    A = rng.normal(size=(n, n))
    return A @ A.T + n * np.eye(n)


def banded(rng: np.random.Generator, n: int, w: int) -> tuple[np.ndarray, np.ndarray]:
    """A symmetric positive definite matrix of half bandwidth w, full and as rows a(i, i - k)."""
    lower = np.tril(rng.normal(size=(n, n)), -1) * (np.subtract.outer(np.arange(n), np.arange(n)) <= w)
    full = lower + lower.T
    full += np.diag(np.abs(full).sum(axis=1) + rng.uniform(0.1, 2.0, n))
    rows = np.zeros((n, w + 1))
    for k in range(min(w, n - 1) + 1):
        rows[k:, k] = np.diagonal(full, -k)
    return full, rows


@given(seeds, st.integers(1, 8), st.integers(0, 2))
def test_cholesky_is_scipys(seed, n, room):
    A = positive_definite(np.random.default_rng(seed), n + room)
    L = A.copy()
    assert linalg.cholesky(L, n)
    assert_allclose(np.tril(L[:n, :n]), scipy_linalg.cholesky(A[:n, :n], lower=True), rtol=1e-12, atol=1e-12)
    above = np.triu(np.ones_like(A, dtype=bool), 1)
    assert_allclose(L[above], A[above], rtol=0.0, atol=0.0)
    assert_allclose(L[n:, n:], A[n:, n:], rtol=0.0, atol=0.0)


@given(seeds, st.integers(1, 8))
def test_cholesky_solve_is_scipys(seed, n):
    rng = np.random.default_rng(seed)
    A, b = positive_definite(rng, n), rng.normal(size=n)
    L, x = A.copy(), b.copy()
    linalg.cholesky(L, n)
    linalg.cholesky_solve(L, n, x)
    assert_allclose(x, scipy_linalg.cho_solve(scipy_linalg.cho_factor(A), b), rtol=1e-11, atol=1e-12)


@pytest.mark.parametrize("entry", [0.0, -1.0, np.nan])
def test_cholesky_reports_what_is_not_positive_definite(entry):
    A = np.diag([1.0, entry, 2.0])
    assert not linalg.cholesky(A, 3)


@given(seeds, st.integers(1, 30), st.integers(0, 5))
def test_banded_ldl_solves_as_scipys_solve_banded(seed, n, w):
    rng = np.random.default_rng(seed)
    full, rows = banded(rng, n, w)
    b = rng.normal(size=n)
    bands = np.zeros((2 * w + 1, n))
    for k in range(min(w, n - 1) + 1):
        bands[w + k, : n - k] = np.diagonal(full, -k)
        bands[w - k, k:] = np.diagonal(full, k)
    x = b.copy()
    assert linalg.banded_ldl(rows, n, w) == -1
    linalg.banded_ldl_solve(rows, n, w, x)
    assert_allclose(x, scipy_linalg.solve_banded((w, w), bands, b), rtol=1e-11, atol=1e-12)


@given(seeds, st.integers(2, 12), st.integers(1, 4))
def test_banded_ldl_names_the_first_row_that_others_imply(seed, n, w):
    rng = np.random.default_rng(seed)
    row = int(rng.integers(1, n))
    J = np.zeros((n, 3 * n))  # constraint rows, each coupled to the one before it
    for i in range(n):
        J[i, 3 * max(i - 1, 0) : 3 * i + 3] = rng.normal(size=3 * i + 3 - 3 * max(i - 1, 0))
    J[row] = 2.0 * J[row - 1]
    full = J @ J.T
    rows = np.zeros((n, w + 2))
    for k in range(min(w + 1, n - 1) + 1):
        rows[k:, k] = np.diagonal(full, -k)
    assert linalg.banded_ldl(rows, n, w + 1) == row
