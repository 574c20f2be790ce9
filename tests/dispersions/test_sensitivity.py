"""Regression and indices of Sobol against closed forms: a linear model, and the function of Ishigami."""

import math

import numpy as np
import pytest

from evolvent.design.dispersions import sensitivity
from evolvent.design.studies import draws


def ishigami(x):
    """The function with a = 7, b = 0.1 of angles (n, 3) from -pi to pi."""
    return np.sin(x[:, 0]) + 7.0 * np.sin(x[:, 1]) ** 2 + 0.1 * x[:, 2] ** 4 * np.sin(x[:, 0])


def test_a_linear_model_has_its_own_coefficients():
    rng = np.random.default_rng(2)
    x = rng.normal(size=(400, 3)) * [1.0, 2.0, 5.0] + [3.0, 0.0, -1.0]
    y = 2.0 * x[:, 0] - 3.0 * x[:, 1] + 7.0
    found = sensitivity.regression(x, y, 0.95)
    expected = np.array([2.0, -3.0, 0.0]) * x.std(axis=0) / y.std()
    np.testing.assert_allclose(found.coefficients, expected, atol=1e-12)
    assert found.r2 == pytest.approx(1.0, abs=1e-12)


def test_intervals_of_coefficients_cover_as_often_as_they_state():
    rng = np.random.default_rng(3)
    inside = 0
    for _ in range(400):
        x = rng.normal(size=(30, 2))
        found = sensitivity.regression(x, x @ [1.0, 0.0] + rng.normal(size=30), 0.9)
        inside += found.low[1] <= 0.0 <= found.high[1]
    assert 335 <= inside <= 385  # 90 % of 400 within four standard deviations


def test_a_regression_says_why_there_is_none():
    x = np.random.default_rng(0).normal(size=(20, 2))
    assert "too few" in sensitivity.regression(x[:3], x[:3, 0], 0.95).why
    assert "does not vary" in sensitivity.regression(x, np.full(20, 3.0), 0.95).why
    assert "vary together" in sensitivity.regression(x[:, [0, 0]], x[:, 1], 0.95).why
    fixed = sensitivity.regression(np.column_stack([x[:, 0], np.ones(20)]), x[:, 0], 0.95)
    np.testing.assert_allclose(fixed.coefficients, [1.0, 0.0], atol=1e-12)


def test_indices_of_ishigamis_function():
    """Closed form: Ishigami and Homma (1990), a = 7, b = 0.1."""
    u = draws.probabilities("saltelli", 4096, 3, 7)
    assert u.shape == (4096 * 5, 3)
    found = sensitivity.sobol(ishigami(math.pi * (2.0 * u - 1.0)), 3, 0.95)
    a, b, pi = 7.0, 0.1, math.pi
    variance = a**2 / 8 + b * pi**4 / 5 + b**2 * pi**8 / 18 + 0.5
    first = np.array([0.5 * (1 + b * pi**4 / 5) ** 2, a**2 / 8, 0.0]) / variance
    mixed = b**2 * pi**8 * (1 / 18 - 1 / 50) / variance
    total = first + np.array([mixed, 0.0, mixed])
    np.testing.assert_allclose(found.first, first, atol=0.02)
    np.testing.assert_allclose(found.total, total, atol=0.02)
    assert np.all(found.first_low <= first)
    assert np.all(first <= found.first_high)
    assert np.all(found.total_low <= total)
    assert np.all(total <= found.total_high)


def test_indices_leave_out_rows_without_a_value():
    u = draws.probabilities("saltelli", 256, 2, 1)
    y = 3.0 * u[:, 0] + u[:, 1]
    whole = sensitivity.sobol(y, 2, 0.95)
    np.testing.assert_allclose(whole.first, [0.9, 0.1], atol=0.03)
    y[5] = np.nan  # of the first sample, row 5
    y[256 * 3 + 7] = np.nan  # of a mixed one, row 7
    found = sensitivity.sobol(y, 2, 0.95)
    assert (found.rows, found.left_out) == (254, 2)
    np.testing.assert_allclose(found.first, whole.first, atol=0.03)
    assert "8 are needed" in sensitivity.sobol(np.full(1024, np.nan), 2, 0.95).why
    assert "does not vary" in sensitivity.sobol(np.ones(1024), 2, 0.95).why
