"""The simulated motions of these tests: against SciPy's integrator, closed forms and the linear model."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.integrate
import scipy.special

from evolvent_massprops.inertia import Body, Stand, linear_model
from massprops import motions

ONE = np.ones(1)


def test_coulomb_friction_takes_the_same_from_every_half_swing() -> None:
    """The turning points fall by 2 M / kappa; the body rests where the wire cannot overcome the friction."""
    swing = motions.Swing(kind="torsion", inertia=0.02 * ONE, stiffness=0.35, dry=0.35 * 0.03)
    path = motions.swung(swing, np.array([0.3]), np.zeros(1), np.array([20.0]))
    half = np.pi / np.sqrt(0.35 / 0.02)
    turning = path.at(0, half * np.arange(8))[:, 0]
    expected = np.array([0.3, -0.24, 0.18, -0.12, 0.06, 0.0, 0.0, 0.0])
    np.testing.assert_allclose(turning, expected, atol=1e-6)  # of the kinks, cut by interpolation


@pytest.mark.parametrize("kind", ["compound", "trifilar"])
def test_pendulums_are_those_of_another_integrator(kind: str) -> None:
    fields = {"compound": {"mass": 8.0, "distance": 0.4}, "trifilar": {"mass": 8.0, "radius": 0.25, "above": 0.2}}[kind]
    swing = motions.Swing(kind=kind, inertia=1.5 * ONE, viscous=0.05, drag=0.1, **fields)
    path = motions.swung(swing, np.array([0.5]), np.array([-0.2]), np.array([10.0]))
    t = np.linspace(0.0, 10.0, 50)

    def rate(_: float, y: np.ndarray) -> list[float]:
        return [y[1], float(swing.acceleration(y[:1], y[1:], np.zeros(1))[0])]

    other = scipy.integrate.solve_ivp(rate, (0.0, 10.0), [0.5, -0.2], t_eval=t, rtol=1e-11, atol=1e-13)
    np.testing.assert_allclose(path.at(0, t)[:, 0], other.y[0], atol=5e-7)


def test_a_pivot_and_wires_conserve_their_energy() -> None:
    """The period of a pivot is the elliptic integral's; on wires the lift of the body is part of the energy."""
    swing = motions.Swing(kind="compound", inertia=2.0 * ONE, mass=8.0, distance=0.4)
    quarter = scipy.special.ellipk(np.sin(0.25) ** 2) / swing.frequency
    path = motions.swung(swing, np.array([0.5]), np.zeros(1), 4.2 * quarter)
    assert path.at(0, quarter)[0, 0] == pytest.approx(0.0, abs=1e-8)
    wires = motions.Swing(kind="bifilar", inertia=0.2 * ONE, mass=8.0, length=0.5, radius=0.25, above=0.25)
    path = motions.swung(wires, np.array([0.9]), np.zeros(1), np.array([5.0]))
    theta, rate = path.value[:, 0, 0], path.rate[:, 0, 0]
    H = np.sqrt(0.25 - 0.125 + 0.125 * np.cos(theta))
    lift = 0.0625 * np.sin(theta) / H * rate
    energy = 0.1 * rate**2 + 4.0 * lift**2 - 8.0 * motions.GRAVITY * H
    np.testing.assert_allclose(energy, energy[0], rtol=1e-7)


def test_a_body_on_springs_moves_little_as_the_linear_model_does() -> None:
    points = np.array([[2.0, 0, 0.87], [2.0, 0, -0.87], [-2.0, 0, -0.87], [-2.0, 0, 0.87]])
    body = motions.Hanging(
        points=points, stiffness=740250.0, length=0.5, mass=np.array([15190.0]), centre=np.array([[0.1, 0.0, 0.05]]),
        inertia=np.array([[3703.0, 43920.0, 43000.0]]),
    )  # fmt: skip
    model = linear_model(
        Stand(points=points, stiffness=740250.0, length=0.5),
        Body(mass=15190.0, centre=(0.1, 0.0, 0.05), inertia=(3703.0, 43920.0, 43000.0)),
    )
    rest = body.rest()
    np.testing.assert_allclose(rest[0, :3], model.pose.position, atol=1e-9)
    tiny = 1e-6
    J = np.empty((6, 6))
    for k in range(6):
        d = np.zeros((1, 6))
        d[0, k] = tiny
        J[:, k] = (body.rate(motions.moved(rest, d)) - body.rate(motions.moved(rest, -d)))[0, 7:] / (2.0 * tiny)
    w = np.sqrt(np.sort(-np.linalg.eigvals(J).real))
    np.testing.assert_allclose(w, np.sort(model.modes().natural_frequency), rtol=1e-6)
