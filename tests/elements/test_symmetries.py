"""What a rigid motion does to energy, force and damping; damping takes energy and keeps the momenta."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from elements.helpers import (
    CHANGES,
    WORK,
    damped_force,
    damped_tangent as damped_tangent_of,
    difference,
    energy,
    force,
    is_beam,
    rotation_by,
    skew,
    tangent,
    turn,
    vectors,
)
from evolvent.elements import (
    FORMULATIONS,
    STRAIGHT,
    Material,
    Rectangle,
    beam_form,
    cable_bending,
    cable_form,
    straight_beam,
    straight_cable,
)
from evolvent.families.beams import cable
from evolvent.kernels import ancf

LENGTH, B_TIME = 1.3, 0.4
MATERIAL = Material(young_modulus=2.1, poisson_ratio=0.3, density=1.7)
BAR = Rectangle(thickness=0.4, width=0.7)
BENDING = cable_bending(LENGTH, BAR, MATERIAL)
FORMS = {name: beam_form(name, LENGTH, BAR, MATERIAL) for name in FORMULATIONS}
FORMS["cable"] = cable_form(LENGTH, BAR, MATERIAL)
every_form = pytest.mark.parametrize("form", FORMS.values(), ids=FORMS)


def straight(form) -> np.ndarray:
    return straight_beam(LENGTH) if is_beam(form) else straight_cable(LENGTH)


def bent(form, rng) -> np.ndarray:
    e = straight(form)
    return e + rng.uniform(-0.3, 0.3, e.size)


def damped(form, e, u, b=B_TIME, *, paper=False) -> tuple[np.ndarray, float]:
    """Force with damping, of the cable's bending too, and the damping's power."""
    f = np.zeros(e.size)
    if paper:
        return f, ancf.paper_damped_force_of(e, u, b, form.H, form.h, vectors(form), WORK, f)
    power = damped_force(form, e, u, b, f)
    if not is_beam(form):
        power += cable.add_bending_damping(e, u, b, BENDING, f)
    return f, power


def damped_tangent(form, e, u, c, *, paper=False) -> np.ndarray:
    if paper:
        K = np.full((e.size, e.size), np.nan)
        ancf.paper_damped_tangent_of(e, u, B_TIME, c, form.H, form.h, vectors(form), WORK, K)
        return K
    K = damped_tangent_of(form, e, u, B_TIME, c)
    if not is_beam(form):
        cable.add_bending_damping_tangent(e, u, B_TIME, c, BENDING, K)
    return K


def spin(e: np.ndarray, omega: np.ndarray) -> np.ndarray:
    """Rates of a rigid rotation about the origin."""
    return (e.reshape(-1, 3) @ skew(omega).T).ravel()


def resultants(e: np.ndarray, f: np.ndarray) -> np.ndarray:
    """Net force and net moment about the origin."""
    x, F = e.reshape(-1, 3), f.reshape(-1, 3)
    return np.concatenate([F[0] + F[len(F) // 2], np.cross(x, F).sum(axis=0)])


# ------------------------------------------------------------------------------------------------ rigid motions


@every_form
def test_a_rigid_motion_turns_the_force_and_keeps_the_energy(form, rng):
    for _ in range(5):
        e, rotation, shift = bent(form, rng), rotation_by(rng.normal(size=3)), rng.normal(size=3)
        moved = turn(e, rotation, shift)
        f = force(form, e)
        assert_allclose(energy(form, moved), energy(form, e), rtol=1e-12)
        assert_allclose(force(form, moved), turn(f, rotation), rtol=0.0, atol=1e-12 * np.abs(f).max())


@every_form
def test_far_from_the_origin_the_force_stays(form, rng):
    e = bent(form, rng)
    f = force(form, e)
    far = turn(e, np.eye(3), np.array([1000.0, -1000.0, 1000.0]))
    assert_allclose(force(form, far), f, rtol=0.0, atol=1e-9 * np.abs(f).max())


@every_form
def test_forces_of_an_element_balance(form, rng):
    e, u = bent(form, rng), rng.normal(size=straight(form).size)
    scale = np.abs(damped(form, e, u)[0]).max()
    assert np.abs(resultants(e, force(form, e))).max() < 1e-13 * scale
    assert np.abs(resultants(e, damped(form, e, u)[0])).max() < 1e-13 * scale


# ------------------------------------------------------------------------------------------------ damping


@pytest.mark.parametrize("paper", [False, True], ids=["objective", "paper"])
@every_form
def test_damped_tangent_is_the_derivative(form, paper, rng):
    e, u, c = bent(form, rng), rng.normal(size=straight(form).size), 3.0
    K = damped_tangent(form, e, u, c, paper=paper)
    by_e = difference(lambda x: damped(form, x, u, paper=paper)[0], e, 1e-3)
    by_u = difference(lambda x: damped(form, e, x, paper=paper)[0], u, 1e-1)
    assert_allclose(K, by_e + c * by_u, rtol=0.0, atol=1e-8 * np.abs(K).max())


@pytest.mark.parametrize("paper", [False, True], ids=["objective", "paper"])
@every_form
def test_power_is_that_of_the_damping_force(form, paper, rng):
    e, u = bent(form, rng), rng.normal(size=straight(form).size)
    f, power = damped(form, e, u, paper=paper)
    assert_allclose(power, u @ (f - force(form, e)), rtol=1e-11)
    assert paper or power > 0.0


@every_form
def test_objective_damping_does_not_feel_a_rigid_motion(form, rng):
    e, omega, v = bent(form, rng), rng.normal(size=3), rng.normal(size=3)
    u = spin(e, omega)
    u.reshape(-1, 3)[[0, e.size // 6]] += v
    f, power = damped(form, e, u)
    scale = np.abs(damped(form, e, rng.normal(size=e.size))[0]).max()
    assert_allclose(f, force(form, e), rtol=0.0, atol=1e-14 * scale)
    assert abs(power) < 1e-26


@every_form
def test_the_papers_damping_feeds_a_spin_without_strain(form):
    e, omega = straight(form), np.array([0.0, 0.0, 1.0])
    f, power = damped(form, e, spin(e, omega), paper=True)
    # K1 is negative where nothing is strained: -1/2 (3 lam + 2 mu) int S,aa, and of a cable -EA/2 int S,x S,x
    assert power < -0.1 * B_TIME * MATERIAL.E * LENGTH * BAR.thickness * BAR.width
    assert np.abs(f).max() > 0.01


@every_form
def test_damping_turns_with_the_element(form, rng):
    e, u, rotation = bent(form, rng), rng.normal(size=straight(form).size), rotation_by(rng.normal(size=3))
    f, _ = damped(form, e, u)
    turned, _ = damped(form, turn(e, rotation), turn(u, rotation) + spin(turn(e, rotation), rng.normal(size=3)))
    assert_allclose(turned, turn(f, rotation), rtol=0.0, atol=1e-12 * np.abs(f).max())


@pytest.mark.parametrize("name", ["full", "assumed_strain"])
def test_near_the_rest_shape_damping_is_b_times_the_stiffness(name, rng):
    form, e = FORMS[name], straight_beam(LENGTH)
    u = rng.normal(size=24)
    K = tangent(form, e)
    assert_allclose(damped(form, e, u)[0], B_TIME * K @ u, rtol=0.0, atol=1e-12 * np.abs(K).max())


@pytest.mark.parametrize("angle", [1e-2, 0.3])
def test_bending_of_a_cable_is_damped_by_b_times_its_stiffness(angle):
    """An arc whose angle grows without stretch loses b EI k'^2 l."""
    rate, EI = 0.7, MATERIAL.E * BAR.properties(MATERIAL.nu).Iz

    def arc(angle: float) -> np.ndarray:
        a = 0.5 * angle
        chord = LENGTH * np.sin(a) / a
        return np.array([0, 0, 0, np.cos(a), -np.sin(a), 0, chord, 0, 0, np.cos(a), np.sin(a), 0])

    d = 1e-6
    u = rate * (arc(angle + d) - arc(angle - d)) / (2 * d)
    power = cable.add_bending_damping(arc(angle), u, B_TIME, BENDING, np.zeros(12))
    assert_allclose(power, B_TIME * EI * (rate / LENGTH) ** 2 * LENGTH, rtol=0.01 * max(angle, 0.1))


def test_bending_damping_fades_out_below_the_angle_of_a_straight_cable():
    def power(angle: float) -> float:
        a = 0.5 * angle
        e = np.array([0, 0, 0, 1, -a, 0, LENGTH, 0, 0, 1, a, 0])
        u = np.array([0, 0, 0, 0, -0.5, 0, 0, 0, 0, 0, 0.5, 0])
        return cable.add_bending_damping(e, u, 1.0, BENDING, np.zeros(12))

    assert_allclose(power(STRAIGHT), 0.5 * power(1e-2), rtol=1e-3)
    assert power(0.0) == 0.0


@every_form
def test_over_an_interval_the_work_is_the_change_of_energy(form, rng):
    e0, e1, h, f = bent(form, rng), bent(form, rng), 0.3, np.zeros(straight(form).size)
    damped_force(form, 0.5 * (e0 + e1), (e1 - e0) / h, 0.0, f, (h, 0.0, 0.0, 0.0))
    assert_allclose(f @ (e1 - e0), energy(form, e1) - energy(form, e0), rtol=1e-12)


@every_form
def test_over_an_interval_the_tangent_is_twice_the_derivative_by_the_end(form, rng):
    e0, e1, h = bent(form, rng), bent(form, rng), 0.3
    interval = (h, 0.2, 0.0, 0.7)
    CHANGES[: ancf.PRODUCTS] = 0.1 * rng.normal(size=ancf.PRODUCTS)

    def force_at(end: np.ndarray) -> np.ndarray:
        f = np.zeros(end.size)
        damped_force(form, 0.5 * (e0 + end), (end - e0) / h, B_TIME, f, interval)
        return f

    K = damped_tangent_of(form, 0.5 * (e0 + e1), (e1 - e0) / h, B_TIME, 2.0 / h, interval)
    assert_allclose(K, 2.0 * difference(force_at, e1, 1e-2), rtol=0.0, atol=1e-9 * np.abs(K).max())
