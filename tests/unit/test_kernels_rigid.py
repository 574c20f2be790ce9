"""Rigid bodies against formulas written with NumPy matrices."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from evolvent import model as mdl
from evolvent.assembly.builder import Builder
from evolvent.kernels import rigid

INERTIA = np.array([[0.5, 0.02, -0.01], [0.02, 0.7, 0.03], [-0.01, 0.03, 0.9]])


def kinematics(t, y, bodies):
    rigid.kinematics(t, y, Builder(np.zeros(3)).build().model._replace(bodies=bodies))


def skew(a):
    return np.array([[0.0, -a[2], a[1]], [a[2], 0.0, -a[0]], [-a[1], a[0], 0.0]])


def turned(rotvec):
    return Rotation.from_rotvec(rotvec).as_matrix()


def free_body(rng):
    """One free body and its state: position, quaternion, velocity, angular velocity in body axes."""
    bodies = mdl.zeros("bodies", 1)
    bodies["motion"], bodies["iq"], bodies["iv"], bodies["mass"] = rigid.FREE, 0, 7, 2.5
    bodies["inertia"][0] = INERTIA
    return bodies, rng.normal(size=13)


def spinning_body(rng):
    bodies = mdl.zeros("bodies", 1)
    axis = rng.normal(size=3)
    axis /= np.linalg.norm(axis)
    bodies["motion"], bodies["iq"], bodies["iv"] = rigid.SPIN, 0, 1
    bodies["axis"][0], bodies["R0"][0], bodies["x0"][0] = axis, turned(rng.normal(size=3)), rng.normal(size=3)
    bodies["spin_inertia"] = axis @ INERTIA @ axis
    return bodies, rng.normal(size=2)


def rotation_of(y):
    return Rotation.from_quat([y[4], y[5], y[6], y[3]]).as_matrix()


def test_kinematics_of_a_free_body(rng):
    bodies, y = free_body(rng)
    bodies["F"] = 9.0
    kinematics(0.0, y, bodies)
    R = rotation_of(y)
    assert_allclose(bodies["R"][0], R, atol=1e-14)
    assert_allclose(bodies["x"][0], y[:3])
    assert_allclose(bodies["v"][0], y[7:10])
    w = R @ y[10:13]
    assert_allclose(bodies["w"][0], w, atol=1e-14)
    I = R @ INERTIA @ R.T  # noqa: E741
    expected = np.zeros((6, 6))
    expected[:3, :3], expected[3:, 3:] = 2.5 * np.eye(3), I
    assert not bodies["has_mass_matrix"][0]
    rigid.assemble_mass_matrix(bodies, 0)
    assert bodies["has_mass_matrix"][0]
    assert_allclose(bodies["M"][0], expected, atol=1e-14)
    assert_allclose(bodies["F"][0], np.concatenate([np.zeros(3), -np.cross(w, I @ w)]), atol=1e-13)


def test_kinematics_of_a_spinning_body(rng):
    bodies, y = spinning_body(rng)
    kinematics(0.0, y, bodies)
    axis = bodies["axis"][0]
    R = bodies["R0"][0] @ turned(y[0] * axis)
    assert_allclose(bodies["R"][0], R, atol=1e-14)
    assert_allclose(bodies["w"][0], y[1] * (R @ axis), atol=1e-14)
    assert_allclose(bodies["x"][0], bodies["x0"][0])
    assert bodies["J"][0] == bodies["spin_inertia"][0]


def test_kinematics_of_a_driven_body(rng):
    bodies, _ = spinning_body(rng)
    bodies["motion"], bodies["rate"] = rigid.DRIVEN, 1.7
    kinematics(2.0, np.zeros(0), bodies)
    R = bodies["R0"][0] @ turned(3.4 * bodies["axis"][0])
    assert_allclose(bodies["R"][0], R, atol=1e-13)
    assert_allclose(bodies["w"][0], 1.7 * (R @ bodies["axis"][0]), atol=1e-13)


def test_velocity_and_centripetal_acceleration_of_a_point_are_derivatives(rng):
    bodies, y = spinning_body(rng)
    s, h = rng.normal(size=3), 1e-5

    def place(time):
        kinematics(0.0, np.array([y[0] + y[1] * time, y[1]]), bodies)
        found = np.array(rigid.point_kinematics(bodies, 0, *s))
        return bodies["x"][0] + found[:3], found[3:], found[:3]

    (x0, v0, _), (x2, v2, _) = place(-h), place(h)
    _, v, d = place(0.0)
    assert_allclose(v, (x2 - x0) / (2.0 * h), atol=1e-9)
    assert_allclose(rigid.centripetal(bodies, 0, *d), (v2 - v0) / (2.0 * h), atol=1e-9)


def test_add_wrench_is_force_and_moment(rng):
    F, d, f = rng.normal(size=6), rng.normal(size=3), rng.normal(size=3)
    expected = F + np.concatenate([f, np.cross(d, f)])
    rigid.add_wrench(F, *d, *f)
    assert_allclose(F, expected, atol=1e-14)


def ring(rng):
    """Mass, radius, arm, axis, rate and acceleration of a ring, and its inertia about its centre."""
    m, r, d, n = 0.3, 0.7, rng.normal(size=3), rng.normal(size=3)
    n /= np.linalg.norm(n)
    return (m, r, *d, *n, 1.7, -0.4), 0.5 * m * r**2 * (np.eye(3) + np.outer(n, n))


def test_ring_on_a_free_body_is_many_point_masses_that_go_round(rng):
    """Newton-Euler with 12 point masses spaced evenly, each with its Coriolis and own acceleration."""
    bodies, y = free_body(rng)
    kinematics(0.0, y, bodies)
    rigid.assemble_mass_matrix(bodies, 0)
    M, F, w = bodies["M"][0].copy(), bodies["F"][0].copy(), bodies["w"][0].copy()
    given, _ = ring(rng)
    m, r, centre, n, rate, acceleration = given[0], given[1], np.array(given[2:5]), np.array(given[5:8]), *given[8:]
    rigid.add_ring(bodies, 0, *given)
    x = np.cross(n, [1.0, 0.0, 0.0])
    x /= np.linalg.norm(x)
    for angle in 2.0 * np.pi * np.arange(12) / 12:
        e = np.cos(angle) * x + np.sin(angle) * np.cross(n, x)
        d, u = centre + r * e, r * rate * np.cross(n, e)
        a = r * acceleration * np.cross(n, e) - r * rate**2 * e
        J = np.hstack([np.eye(3), -skew(d)])  # acceleration of the point due to the twist's rate
        M += m / 12 * J.T @ J
        F -= m / 12 * J.T @ (np.cross(w, np.cross(w, d)) + 2.0 * np.cross(w, u) + a)
    assert_allclose(bodies["M"][0], M, atol=1e-13)
    assert_allclose(bodies["F"][0], F, atol=1e-13)


def test_ring_on_a_spinning_body_adds_to_its_inertia(rng):
    bodies, y = spinning_body(rng)
    kinematics(0.0, y, bodies)
    n = bodies["R"][0] @ bodies["axis"][0]
    given, inertia = ring(rng)
    rigid.add_ring(bodies, 0, *given)
    across = np.cross(n, given[2:5])
    expected = bodies["spin_inertia"][0] + given[0] * across @ across + n @ inertia @ n
    assert_allclose(bodies["J"][0], expected, atol=1e-14)


def test_ring_leaves_the_mass_of_a_driven_body_alone(rng):
    bodies, _ = spinning_body(rng)
    bodies["motion"], bodies["rate"] = rigid.DRIVEN, 1.0
    kinematics(0.0, np.zeros(0), bodies)
    rigid.add_ring(bodies, 0, *ring(rng)[0])
    assert bodies["F"].any()
    assert not bodies["M"].any()


def test_respond_solves_with_the_mass_matrix(rng):
    bodies, y = free_body(rng)
    kinematics(0.0, y, bodies)
    rigid.add_ring(bodies, 0, *ring(rng)[0])
    rigid.factorise(bodies)
    F, a = rng.normal(size=6), np.empty(6)
    rigid.respond(bodies, 0, F, a)
    assert_allclose(a, np.linalg.solve(bodies["M"][0], F), atol=1e-12)


def test_respond_without_a_mass_matrix_equals_that_with_one(rng):
    """The inertia in body axes gives the same accelerations; `solve_inertia` is accurate for a slender body."""
    bodies, y = free_body(rng)
    kinematics(0.0, y, bodies)
    F, a, whole = rng.normal(size=6), np.empty(6), np.empty(6)
    rigid.factorise(bodies)
    rigid.respond(bodies, 0, F, a)
    assert not bodies["has_mass_matrix"][0]
    rigid.assemble_mass_matrix(bodies, 0)
    rigid.factorise(bodies)
    rigid.respond(bodies, 0, F, whole)
    assert_allclose(a, whole, rtol=1e-13, atol=1e-14)
    Q = turned(rng.normal(size=3))
    J = Q @ np.diag([1e-4, 1.0, 1.0]) @ Q.T
    assert_allclose(J @ rigid.solve_inertia(J, *F[:3]), F[:3], atol=1e-11)


def test_respond_of_a_spinning_body_is_about_its_axis(rng):
    bodies, y = spinning_body(rng)
    kinematics(0.0, y, bodies)
    n = bodies["R"][0] @ bodies["axis"][0]
    F, a = rng.normal(size=6), np.ones(6)
    rigid.respond(bodies, 0, F, a)
    assert_allclose(a[:3], 0.0)
    assert_allclose(a[3:], n * (n @ F[3:]) / bodies["J"][0], atol=1e-14)


def test_respond_of_a_driven_body_is_nothing():
    bodies = mdl.zeros("bodies", 1)
    a = np.ones(6)
    rigid.respond(bodies, 0, np.ones(6), a)
    assert_allclose(a, 0.0)


def test_a_free_body_left_alone_keeps_momentum_and_energy(rng):
    """The rates that are written are those of Euler's equations: d(I w)/dt = 0 in inertial axes."""
    bodies, y = free_body(rng)
    y[3:7] /= np.linalg.norm(y[3:7])
    kinematics(0.0, y, bodies)
    rigid.factorise(bodies)
    rigid.respond(bodies, 0, bodies["F"][0], bodies["a"][0])
    dy = np.zeros(13)
    assert rigid.write_rates(y, bodies, 0, dy) == 0.0

    def momentum(x):
        R = rotation_of(x)
        return R @ INERTIA @ x[10:13]

    h = 1e-6
    assert_allclose((momentum(y + h * dy) - momentum(y - h * dy)) / (2.0 * h), 0.0, atol=1e-8)
    assert_allclose(y[10:13] @ INERTIA @ dy[10:13], 0.0, atol=1e-13)
    assert_allclose(dy[:3], y[7:10])
    assert_allclose(dy[7:10], 0.0, atol=1e-14)


@pytest.mark.parametrize("make", [free_body, spinning_body])
def test_kick_changes_the_velocities_by_the_twist(rng, make):
    bodies, y = make(rng)
    kinematics(0.0, y, bodies)
    v, w = bodies["v"][0].copy(), bodies["w"][0].copy()
    jump = rng.normal(size=6)
    if make is spinning_body:
        n = bodies["R"][0] @ bodies["axis"][0]
        jump = np.concatenate([np.zeros(3), n * (n @ jump[3:])])
    rigid.kick(y, bodies, 0, jump)
    kinematics(0.0, y, bodies)
    assert_allclose(bodies["v"][0], v + jump[:3], atol=1e-13)
    assert_allclose(bodies["w"][0], w + jump[3:], atol=1e-13)


def test_the_drive_of_a_driven_body_delivers_the_power_taken_from_it(rng):
    bodies, _ = spinning_body(rng)
    bodies["motion"], bodies["rate"] = rigid.DRIVEN, 1.3
    kinematics(0.4, np.zeros(0), bodies)
    bodies["F"][0] = rng.normal(size=6)
    power = rigid.write_rates(np.zeros(0), bodies, 0, np.zeros(0))
    assert_allclose(power, -bodies["F"][0, 3:] @ bodies["w"][0], atol=1e-14)
