"""The swing of a rigid body on springs in compiled code: against SciPy's integrator, and the constraints of guides."""

from __future__ import annotations

import numpy as np
import scipy.integrate

from evolvent_massprops import amplitude
from evolvent_massprops.inertia import Body, Stand
from evolvent_massprops.inertia.stand import setup
from evolvent_massprops.inertia.statics import skew, wrench

POINTS = np.array([[0.5, 0.1, 0.4], [-0.5, 0.1, 0.4], [0.5, 0.1, -0.4], [-0.5, 0.1, -0.4]])
CENTRE = np.array([0.02, -0.1, 0.01])
BODY = Body(mass=10.0, centre=CENTRE, inertia=np.array([[1.1, 0.1, 0.05], [0.1, 2.1, 0.1], [0.05, 0.1, 1.6]]))
DAMPING = np.diag([0.5, 0.4, 0.3, 0.2, 0.1, 0.2])
STEP, COUNT = 5e-3, 300


def swung(support: str, displaced: np.ndarray, rate: np.ndarray, sensors: np.ndarray, along: np.ndarray) -> np.ndarray:
    """(COUNT, c) displacements of the sensors, m."""
    stand = Stand(points=POINTS, stiffness=[900.0, 1000.0, 1100.0, 950.0], length=0.8, support=support)
    state = displaced, rate
    return amplitude._motion(
        setup(stand, BODY), DAMPING, CENTRE, np.eye(3), state, STEP, COUNT, sensors, along
    )[0]  # fmt: skip


def test_a_free_body_moves_as_another_integrator_finds() -> None:
    """With rotation matrices as coordinates, forces by the potential energy of the stand."""
    stand = Stand(points=POINTS, stiffness=[900.0, 1000.0, 1100.0, 950.0], length=0.8, support="hanging")
    displaced, rate = np.array([0.02, 0.05, 0.01, 0.1, 0.05, -0.08]), np.array([0.1, 0.3, 0.1, 0.5, -0.3, 0.6])
    sensors = CENTRE + np.array([[0.3, 0.0, 0.2], [-0.2, 0.4, 0.1], [0.1, -0.3, 0.5]])
    found = swung("hanging", displaced, rate, sensors, np.eye(3))

    def derivative(_: float, y: np.ndarray) -> np.ndarray:
        place, R, v = y[:3], y[3:12].reshape(3, 3), y[12:]
        force = wrench(stand, BODY, place, R) - DAMPING @ v
        inertia = R @ BODY.inertia @ R.T
        turned = np.linalg.solve(inertia, force[3:] - np.cross(v[3:], inertia @ v[3:]))
        return np.concatenate([v[:3], (skew(v[3:]) @ R).ravel(), force[:3] / BODY.mass, turned])

    turn = scipy.spatial.transform.Rotation.from_rotvec(displaced[3:]).as_matrix()
    start = np.concatenate([CENTRE + displaced[:3], turn.ravel(), rate])
    times = STEP * np.arange(COUNT)
    path = scipy.integrate.solve_ivp(derivative, (0.0, times[-1]), start, "DOP853", times, rtol=1e-9, atol=1e-10).y
    places, turns = path[:3].T, path[3:12].T.reshape(-1, 3, 3)
    exact = places[:, None] + np.einsum("nij,cj->nci", turns, sensors - CENTRE) - sensors
    # the rate of the rotation vector is of the second order
    np.testing.assert_allclose(found, np.einsum("ncc->nc", exact), atol=2e-3 * np.ptp(exact))


def test_guides_hold_the_centre_of_mass_and_the_yaw() -> None:
    displaced, rate = np.array([0.0, 0.05, 0.0, 0.0, 0.0, 0.0]), np.array([0.0, 0.3, 0.0, 0.4, 0.0, -0.3])
    ahead = CENTRE + np.array([1.0, 0.0, 0.0])
    sensors, along = np.array([CENTRE, CENTRE, ahead, CENTRE]), np.array([[1.0, 0, 0], [0, 0, 1], [0, 0, 1], [0, 1, 0]])
    found = swung("guided", displaced, rate, sensors, along)
    assert np.ptp(found[:, 3]) > 0.1
    assert np.abs(found[:, :2]).max() < 1e-12
    assert np.ptp(found[:, 2]) < 1e-3 * np.ptp(found[:, 3])


def test_a_motion_without_bound_ends_in_nan() -> None:
    away = np.array([0.0, 1e5, 0.0, 0.0, 0.0, 0.0])
    found = swung("hanging", np.zeros(6), away, CENTRE[None], np.eye(3)[1:2])
    assert found[0, 0] == 0.0
    assert np.isnan(found[-1, 0])
