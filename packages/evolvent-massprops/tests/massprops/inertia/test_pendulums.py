"""Pendulums: closed forms, exact motions at large swings and budget."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from evolvent_base.errors import InputError
from evolvent_massprops.inertia import bifilar, compound, multifilar, pendulums, torsion, trifilar

G = 9.80665


def test_torsion():
    assert torsion(np.sqrt(0.7 / 0.02), stiffness=0.7) == pytest.approx(0.02, rel=1e-12)


def quarter(acceleration, amplitude):
    """Frequency, rad/s, of an exact swing let go at `amplitude`."""

    def through(t, y):
        return y[0]

    through.terminal, through.direction = True, -1
    run = solve_ivp(acceleration, (0.0, 100.0), [amplitude, 0.0], events=through, rtol=1e-12, atol=1e-13)
    return 2.0 * np.pi / (4.0 * run.t[-1])


@pytest.mark.parametrize("amplitude", [1e-3, 0.1, 0.5, 1.5])
def test_multifilar_against_the_exact_motion(amplitude, book):
    M, L, R, r, inertia, kappa = 12.0, 0.8, 0.3, 0.4, 0.5, 0.4

    def acceleration(t, y):
        theta, rate = y
        H = np.sqrt(L * L - R * R - r * r + 2 * R * r * np.cos(theta))
        slope = -R * r * np.sin(theta) / H
        bend = -(R * r * np.cos(theta) + slope**2) / H
        return [rate, (M * G * slope - kappa * theta - M * slope * bend * rate**2) / (inertia + M * slope**2)]

    w = quarter(acceleration, amplitude)
    given = {"mass": M, "length": L, "radius": r, "radius_above": R, "wire_stiffness": kappa}
    assert multifilar(w, amplitude=amplitude, **given) == pytest.approx(inertia, rel=1e-8)
    error = multifilar(w, **given) / inertia - 1
    assert 0.0 < error
    assert error < 0.7 * amplitude**2
    book(
        "Inertia stand and identification", f"Multifilar pendulum, swing of {amplitude:g} rad",
        reference="moment put in", source="SciPy DOP853, 1e-12",
        error=abs(multifilar(w, amplitude=amplitude, **given) / inertia - 1.0), allowed=1e-8,
    )  # fmt: skip


def test_compound_against_the_exact_motion(book):
    M, r, inertia, amplitude = 3.0, 0.4, 0.2, 1.0
    w = quarter(lambda t, y: [y[1], -M * G * r * np.sin(y[0]) / (inertia + M * r * r)], amplitude)
    assert compound(w, mass=M, distance=r, amplitude=amplitude) == pytest.approx(inertia, rel=1e-9)
    book(
        "Inertia stand and identification", "Compound pendulum, swing of 1 rad", reference="moment put in",
        source="SciPy DOP853, 1e-12", error=abs(compound(w, mass=M, distance=r, amplitude=amplitude) / inertia - 1.0),
        allowed=1e-9,
    )  # fmt: skip
    with pytest.raises(InputError, match="above that of a point mass"):
        compound(10.0, mass=M, distance=1.0)


def test_difference_of_near_equal_numbers():
    """Why the stand beats the compound pendulum: with M r^2 thirty times I its error is thirty times larger."""
    values = {"frequency": np.sqrt(3.0 * G * 1.0 / (0.1 + 3.0)), "mass": 3.0, "distance": 1.0}
    b = pendulums.budget(compound, values, {"frequency": 1e-4})
    assert b.value[0] == pytest.approx(0.1, rel=1e-9)
    assert b.std[0] / b.value[0] == pytest.approx(2 * (1e-4 / values["frequency"]) * 31.0, rel=1e-3)


def test_bifilar_is_a_multifilar_of_half_the_spacing():
    w = 2.0
    assert bifilar(w, mass=5.0, length=1.2, spacing=0.6) == pytest.approx(5.0 * G * 0.3**2 / (1.2 * w**2))
    assert trifilar(w, mass=5.0, length=1.2, radius=0.3) == pytest.approx(bifilar(w, mass=5.0, length=1.2, spacing=0.6))


def test_arrays_go_through():
    A = np.array([0.0, 0.1, 0.2])
    together = trifilar(3.0, mass=2.0, length=1.0, radius=0.5, amplitude=A)
    one = [float(trifilar(3.0, mass=2.0, length=1.0, radius=0.5, amplitude=a)) for a in A]
    np.testing.assert_allclose(together, one, rtol=1e-11)


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"length": 0.0}, "length"),
        ({"length": 0.1, "radius_above": 0.7}, "too short"),
        ({"amplitude": 4.0}, "amplitude"),
        ({"wire_stiffness": -1.0}, "wire_stiffness"),
        ({"mass": float("nan")}, "mass"),
    ],
)
def test_pendulums_that_are_refused(fields, message):
    with pytest.raises(InputError, match=message):
        trifilar(3.0, **{"mass": 2.0, "length": 1.0, "radius": 0.5, **fields})
