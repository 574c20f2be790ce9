"""Small matrices: products, inverses, modes, Gauss's rule, and the sign of a mode shape."""

from __future__ import annotations

import numpy as np
import pytest

from evolvent_base.dense import dot, facing, inverse, legendre, modes, norm, product


def test_products_are_those_of_numpy(rng):
    A, B, v = rng.random((4, 3)), rng.random((3, 5)), rng.random(5)
    assert product(A, B) == pytest.approx(A @ B, rel=1e-14)
    assert product(A, B, v) == pytest.approx(A @ B @ v, rel=1e-14)
    stack = rng.random((6, 3, 3))
    assert product(stack, stack, np.eye(3)) == pytest.approx(stack @ stack, rel=1e-14)
    assert product(stack, v[:3]) == pytest.approx(stack @ v[:3], rel=1e-14)
    assert dot(v, v) == pytest.approx(v @ v, rel=1e-14)
    assert norm(v) == pytest.approx(np.linalg.norm(v), rel=1e-14)


@pytest.mark.parametrize("n", [1, 2, 4, 6])
def test_inverse_and_modes_of_a_stiffness(n, rng):
    """Of parts that differ by ten powers of ten, as stretch and bending do."""
    scale = np.geomspace(1.0, 1e5, n)
    A = rng.random((n, n))
    A = (A @ A.T + n * np.eye(n)) * np.outer(scale, scale)
    assert (inverse(A) * np.outer(scale, scale)) == pytest.approx(
        np.linalg.inv(A / np.outer(scale, scale)), rel=1e-10, abs=1e-12
    )
    values, vectors = modes(A)
    assert np.sort(values) == pytest.approx(np.linalg.eigvalsh(A), rel=1e-8, abs=1e-13 * values.max())
    assert vectors.T @ vectors == pytest.approx(np.eye(n), abs=1e-13)
    assert vectors @ np.diag(values) @ vectors.T == pytest.approx(A, abs=1e-13 * values.max())


def test_modes_of_a_matrix_that_is_not_definite():
    values, _ = modes(np.array([[1.0, 2.0], [2.0, 1.0]]))
    assert np.sort(values) == pytest.approx([-1.0, 3.0], rel=1e-14)
    values, vectors = modes(np.diag([2.0, -1.0, 0.0]))
    assert values.tolist() == [2.0, -1.0, 0.0]
    assert vectors.tolist() == np.eye(3).tolist()


@pytest.mark.parametrize("n", range(1, 9))
def test_the_rule_of_gauss_integrates_what_it_can(n):
    x, w = legendre(n)
    for power in range(2 * n):
        assert np.sum(w * x**power) == pytest.approx((1.0 + (-1.0) ** power) / (power + 1.0), abs=1e-14)
    assert np.all(np.diff(x) > 0.0)
    assert (x + x[::-1]).tolist() == [0.0] * n


def test_the_largest_component_of_a_shape_is_positive():
    shapes = np.array([[0.1, -2.0, 1.0], [0.0, 0.0, 0.0], [1.0, 0.5, -0.2]])
    assert facing(shapes).tolist() == [-1.0, 1.0, 1.0]
    assert facing(shapes[None])[0].tolist() == [-1.0, 1.0, 1.0]
    assert facing(np.array([1.0, 2.0j])) == pytest.approx(-1.0j)


@pytest.mark.parametrize("round_off", [-1e-9, 0.0, 1e-9])
def test_of_equal_components_the_first_is_positive_whatever_round_off_does(round_off):
    shape = np.array([0.2, -0.2 + round_off, 0.1])
    assert facing(shape) == 1.0
    assert facing(-shape) == -1.0
