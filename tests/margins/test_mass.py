"""The mass matrix of a position: its banded root gives its norms, and a motion without mass is no root."""

import numpy as np
import pytest

from evolvent.analysis.margins.mass import Mass


def test_root() -> None:
    """Norms of forces by the inverse of the mass matrix, and moves of a given energy."""
    A = np.random.default_rng(1).standard_normal((6, 6))
    M, f = A @ A.T + np.eye(6), np.arange(12.0).reshape(6, 2)
    mass = Mass(M)
    half = mass.half(f)
    assert half.T @ half == pytest.approx(f.T @ np.linalg.solve(M, f), rel=1e-12)
    assert M @ mass.back(half) == pytest.approx(f, abs=1e-12)
    assert mass @ f == pytest.approx(M @ f, rel=1e-14)


def test_a_motion_without_mass() -> None:
    """It has no root."""
    with pytest.raises(np.linalg.LinAlgError):
        Mass(np.diag([1.0, 0.0])).half(np.ones(2))
