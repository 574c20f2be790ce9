"""The built-in solar array against the equations of motion of a plane chain of four bodies, by SciPy."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import evolvent as ev
from book import Book

#: Masses, and moments of inertia about z, of the satellite and the panels.
MASS = np.array([300.0, 4.0, 4.0, 4.0])
INERTIA = np.array([70.0, *[4.0 * (1.0 + 0.02**2) / 12.0] * 3])
#: From each body's centre to its outer hinge, and from the inner hinge to its centre, body axes, as x + iy.
OUTER, INNER = np.array([0.55 - 0.5j, 0.5, 0.5, 0.0]), np.array([0.0, 0.5, 0.5, 0.5])
#: Share of body j in the way from the satellite's centre to that of body i.
WAYS = np.tril(np.ones((4, 4)), -1) * (OUTER + INNER) + np.diag(INNER)
STIFFNESS, DAMPING = np.array([0.2, 0.1, 0.05]), np.array([0.2, 0.1, 0.05])
REST = np.radians([-20.0, 20.0, -20.0])
LATCH = (2000.0, 40.0)


def acceleration(angles: np.ndarray, rates: np.ndarray, torques: np.ndarray) -> np.ndarray:
    """Second derivatives of the satellite's place and of the four attitudes (6,): Kane's equations.

    Centres r_i = r_0 + sum_j exp(i angle_j) d_ij; hinge k takes its torque from body k + 1 and gives it to body k.
    """
    arms = WAYS * np.exp(1j * angles)
    J = np.column_stack([np.ones(4), np.full(4, 1j), 1j * arms])
    weighted = (MASS[:, None] * J).conj().T
    M, force = (weighted @ J).real, (weighted @ (arms @ rates**2)).real
    M[range(2, 6), range(2, 6)] += INERTIA
    force[2:5] += torques
    force[3:6] -= torques
    return np.linalg.solve(M, force)


def reference(until: float, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Angles of the hinges at the times (nt, 3), and when each of them latches (3,)."""
    locked, caught = np.zeros(3, dtype=bool), np.full(3, np.nan)
    y = np.zeros(12)
    y[2:6] = 0.0, math.pi / 2, -math.pi / 2, math.pi / 2
    sides = np.sign([1.0, -1.0, 1.0])

    def f(_: float, y: np.ndarray) -> np.ndarray:
        angles, rates = np.diff(y[2:6]), np.diff(y[8:])
        torques = STIFFNESS * (angles - REST) + DAMPING * rates
        torques += np.where(locked, LATCH[0] * angles + LATCH[1] * rates, 0.0)
        return np.concatenate([y[6:], acceleration(y[2:6], y[8:], torques)])

    def catch(k: int) -> object:
        def event(_: float, y: np.ndarray) -> float:
            return 1.0 if locked[k] else float(sides[k] * np.diff(y[2:6])[k])

        event.terminal = True  # type: ignore[attr-defined]
        event.direction = -1.0  # type: ignore[attr-defined]
        return event

    t, found = 0.0, np.zeros((times.size, 3))
    while t < until:
        part = solve_ivp(
            f, (t, until), y, "DOP853", rtol=1e-8, atol=1e-10, events=[catch(k) for k in range(3)], dense_output=True
        )
        here = (times >= t) & (times <= part.t[-1])
        found[here] = np.diff(part.sol(times[here])[2:6], axis=0).T
        t, y = part.t[-1], part.y[:, -1]
        for k, when in enumerate(part.t_events):
            if when.size:
                locked[k], caught[k] = True, when[-1]
    return found, caught


@pytest.mark.slow
def test_solar_array(book: Book) -> None:
    """Angles of the hinges while it opens, times of the three latches, and the momenta, which stay at zero."""
    run = ev.run("solar-array")
    times = run.time.values
    wanted, caught = reference(times[-1], times)
    wanted += 2.0 * math.pi * np.round((np.array([0.5, -1.0, 1.0]) * math.pi - wanted[0]) / (2.0 * math.pi))
    found = np.stack([run[f"hinge {k}"].angle.values for k in (1, 2, 3)], axis=1)
    latched = np.array([run[f"hinge {k}"].latch_time.values[-1] for k in (1, 2, 3)])
    assert np.all(np.isfinite(caught))
    book(
        "Rigid bodies", "Solar array of three panels: times of the latches", reference="a plane chain of four bodies",
        source="Kane's equations, SciPy DOP853", error=np.abs(latched / caught - 1.0).max(), allowed=1e-3,
    )  # fmt: skip
    opening = times < caught.min()
    book(
        "Rigid bodies", "Solar array of three panels: hinges until the first latch",
        reference="a plane chain of four bodies", source="Kane's equations, SciPy DOP853",
        error=np.abs(found - wanted)[opening].max(), allowed=2e-3, unit="rad",
    )  # fmt: skip
    assert np.abs(found - wanted).max() < 0.02
    assert np.abs(run.momentum.values).max() < 1e-9
    assert np.abs(run.angular_momentum.values).max() < 1e-3
    assert np.abs(found[-1]).max() < 1e-3
