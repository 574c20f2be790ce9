"""The mass matrix of a position: its banded root gives its norms, and a motion without mass is no root."""

from collections.abc import Callable

import numpy as np
import pytest
import scipy

from evolvent.analysis.margins.mass import Mass


@pytest.mark.parametrize("kept", [np.asarray, scipy.sparse.csr_matrix])
def test_root(kept: Callable) -> None:
    """Norms of forces by the inverse of the mass matrix, dense or sparse, and moves of a given energy."""
    A = np.random.default_rng(1).standard_normal((6, 6))
    M, f = A @ A.T + np.eye(6), np.arange(12.0).reshape(6, 2)
    mass = Mass(kept(M))
    half = mass.half(f)
    assert half.T @ half == pytest.approx(f.T @ np.linalg.solve(M, f), rel=1e-12)
    assert M @ mass.back(half) == pytest.approx(f, abs=1e-12)
    assert mass @ f == pytest.approx(M @ f, rel=1e-14)


@pytest.mark.parametrize("kept", [np.asarray, scipy.sparse.csr_matrix])
def test_a_motion_without_mass(kept: Callable) -> None:
    """It has no root."""
    with pytest.raises(np.linalg.LinAlgError):
        Mass(kept(np.diag([1.0, 0.0]))).half(np.ones(2))
