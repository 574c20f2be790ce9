"""Torques that depend on the attitude: a magnetic moment in a field, and laws under @law."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import evolvent
from evolvent import InputError, System, elements, parts
from families.case import swing

Array = np.ndarray
#: Moment (A m^2), field (T), moment of inertia (kg m^2), angle at the start (rad).
M, B, J, START = 2.0, 0.5, 0.25, 1.1
MAGNET = {"moment": (M, 0.0, 0.0), "field": (B, 0.0, 0.0)}


@evolvent.law
def magnetic(t: float, x: Array, R: Array, w: Array, p: Array) -> tuple[float, float, float]:
    """p[0] times the body's x axis, in a field p[1] along the inertial x axis."""
    return 0.0, p[0] * R[2, 0] * p[1], -p[0] * R[1, 0] * p[1]


def compass(load: parts.Part, start: float = START) -> System:
    """A free body, turned about z from the field's direction."""
    system = System()
    half = 0.5 * start
    turned = (math.cos(half), 0.0, 0.0, math.sin(half))
    system.add(parts.RigidBody(mass=1.0, inertia=(0.1, 0.2, J), orientation=turned), "needle")
    system.add(load, "field")
    return system


LOADS = {
    "part": parts.MagneticTorque(at="needle", **MAGNET),
    "law": parts.Load(at="needle", type="torque", law=magnetic, parameters=(M, B)),
}


@pytest.mark.slow
@pytest.mark.parametrize("form", LOADS)
@pytest.mark.parametrize("method", ["dopri5", "generalized-alpha", "energy-momentum"])
def test_a_compass_needle_swings_as_a_pendulum(form: str, method: str) -> None:
    """theta'' = -(m B/J) sin theta, by elliptic functions."""
    options: dict[str, Any] = {} if method == "dopri5" else {"step": 2e-3}
    found = compass(LOADS[form]).simulate(until=3.0, every=0.5, method=method, **options)
    angle = 2.0 * np.arctan2(found["needle/attitude"].values[:, 3], found["needle/attitude"].values[:, 0])
    np.testing.assert_allclose(angle, swing(found.time.values, START, math.sqrt(M * B / J)), atol=1e-5)
    if form == "part":
        energy = found["needle/energy_kinetic"].values + found["field/energy_magnetic"].values
        np.testing.assert_allclose(energy, -M * B * math.cos(START), atol=1e-5)


@pytest.mark.parametrize("form", LOADS)
def test_its_modes(form: str) -> None:
    """Frequencies sqrt(m B/J) about both axes across the field."""
    system = compass(LOADS[form], 0.0)
    found = system.modes(count=6)
    w = np.sort(found.frequency_hz)[-2:] * 2.0 * math.pi
    np.testing.assert_allclose(w, np.sort([math.sqrt(M * B / 0.2), math.sqrt(M * B / J)]), rtol=1e-9)


@pytest.mark.slow
def test_a_rate_and_an_attitude_in_the_axes_of_the_body() -> None:
    """A damper about the body's own axis and a spring towards an inertial direction, against the exact motion."""

    @evolvent.law
    def held(t: float, x: Array, R: Array, w: Array, p: Array) -> tuple[float, float, float]:
        return (
            0.0,
            0.0,
            -p[0] * math.atan2(R[1, 0], R[0, 0]) - p[1] * (R[0, 2] * w[0] + R[1, 2] * w[1] + R[2, 2] * w[2]),
        )

    k, c, start = 1.0, 0.1, 0.4
    system = compass(parts.Load(at="needle", type="torque", law=held, parameters=(k, c), frame="body"), start)
    found = system.simulate(until=2.0, every=0.5, method="energy-momentum", step=1e-3)
    t, decay = found.time.values, c / (2.0 * J)
    w = math.sqrt(k / J - decay**2)
    angle = 2.0 * np.arctan2(found["needle/attitude"].values[:, 3], found["needle/attitude"].values[:, 0])
    exact = start * np.exp(-decay * t) * (np.cos(w * t) + decay / w * np.sin(w * t))
    np.testing.assert_allclose(angle, exact, atol=2e-6)


def test_a_law_of_the_attitude_is_refused_where_there_is_none() -> None:
    material = elements.Material(young_modulus=1e9, poisson_ratio=0.3, density=1000.0)
    section = elements.Rectangle(width=0.02, thickness=0.01)
    system = System()
    system.add(parts.Beam(length=1.0, section=section, material=material, elements=2), "boom")
    system.add(parts.Load(at="boom.tip", type="torque", law=magnetic, parameters=(M, B)), "turn")
    with pytest.raises(InputError, match=r"turn\.law is the law 'magnetic' .*takes 5 arguments; it must be law\(x, "):
        system.assemble()

    @evolvent.law
    def short(t: float, R: Array) -> float:
        return 0.0

    free = System()
    free.add(parts.RigidBody(mass=1.0, inertia=0.1), "body")
    free.add(parts.Load(at="body", type="torque", law=short), "turn")
    with pytest.raises(InputError, match=r"takes 2 arguments; it must be law\(t, x, R, w, parameters\) -> "):
        free.assemble()
