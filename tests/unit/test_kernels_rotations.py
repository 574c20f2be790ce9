"""Rotations against SciPy."""

from __future__ import annotations

import numpy as np
from hypothesis import given, strategies as st
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from evolvent.kernels import rotations

component = st.floats(-1.0, 1.0)
vectors = st.tuples(component, component, component).filter(lambda v: np.linalg.norm(v) > 1e-3)
quaternions = st.tuples(component, component, component, component).filter(lambda v: np.linalg.norm(v) > 1e-3)


def scipy_rotation(q: tuple[float, ...]) -> Rotation:
    """SciPy's rotation of a quaternion with the scalar part first."""
    return Rotation.from_quat([q[1], q[2], q[3], q[0]])


@given(vectors, st.floats(-50.0, 50.0), quaternions)
def test_rotation_about_axis_is_scipys(axis, angle, start):
    n = np.array(axis) / np.linalg.norm(axis)
    R0, R = scipy_rotation(start).as_matrix(), np.empty((3, 3))
    rotations.rotation_about_axis(n, angle, R0, R)
    assert_allclose(R, R0 @ Rotation.from_rotvec(angle * n).as_matrix(), atol=1e-13)


@given(quaternions)
def test_rotation_from_quaternion_of_any_length_is_scipys(q):
    R = np.empty((3, 3))
    rotations.rotation_from_quaternion(*q, R)
    assert_allclose(R, scipy_rotation(q).as_matrix(), atol=1e-13)
    assert_allclose(R @ R.T, np.eye(3), atol=1e-13)


@given(quaternions, vectors)
def test_quaternion_rate_is_the_derivative_of_a_turn_at_constant_body_rate(q, omega):
    q0, w, h = np.array(q) / np.linalg.norm(q), np.array(omega), 1e-5

    def at(time):
        turned = scipy_rotation(q0) * Rotation.from_rotvec(time * w)
        x = np.roll(turned.as_quat(), 1)
        return x if x @ q0 > 0.0 else -x

    rate = np.array(rotations.quaternion_rate(*q0, *w))
    assert_allclose(rate, (at(h) - at(-h)) / (2.0 * h), atol=1e-9)
    assert abs(rate @ q0) < 1e-14


@given(quaternions, vectors, vectors)
def test_turn_turn_back_and_cross_are_numpys(q, a, b):
    R = scipy_rotation(q).as_matrix()
    assert_allclose(rotations.turn(R, *a), R @ a, atol=1e-14)
    assert_allclose(rotations.turn_back(R, *a), R.T @ a, atol=1e-14)
    assert_allclose(rotations.cross(*a, *b), np.cross(a, b), atol=1e-14)
