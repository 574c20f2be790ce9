"""The cable with engineering strain: derivatives, energy, rigid motions, damping, and what it is in simple shapes."""

from __future__ import annotations

import re

import numpy as np
import pytest
from numpy.testing import assert_allclose

from elements import helpers
from elements.helpers import CHANGES, WORK, difference, points, rotation_by, skew, turn
from evolvent import System, parts
from evolvent.elements import (
    Form,
    Material,
    Rectangle,
    Taper,
    cable_bending,
    cable_parts,
    cable_stretch_form,
    cable_stretch_parts,
    straight_cable,
)
from evolvent.equations import implicit
from evolvent.families.beams import cable
from evolvent.kernels.ancf import GROUP, STATE
from evolvent.model.powers import N_POWERS
from evolvent_base.errors import InputError

LENGTH, B_TIME = 1.3, 0.4
MATERIAL = Material(young_modulus=2.1, poisson_ratio=0.3, density=1.7)
BAR = Rectangle(thickness=0.4, width=0.7)
TAPER = Taper(root=BAR, tip=Rectangle(thickness=0.6, width=0.3))
SECTIONS = pytest.mark.parametrize("section", [BAR, TAPER], ids=["prismatic", "tapered"])
FORM, B = cable_stretch_form(LENGTH, BAR, MATERIAL), cable_bending(LENGTH, BAR, MATERIAL)
EA = MATERIAL.E * 0.4 * 0.7
STILL = np.zeros(12)


def energy(form: Form, e: np.ndarray) -> float:
    return cable.stretch_energy(e, form.H, form.h, form.U0, WORK)


def damped(form: Form, e: np.ndarray, u: np.ndarray, b: float = B_TIME) -> tuple[np.ndarray, float]:
    f = np.zeros(12)
    power = cable.stretch_force(e, u, STATE, b, form.H, form.h, B, CHANGES, WORK, f)
    return f, power


def force(form: Form, e: np.ndarray) -> np.ndarray:
    f, power = damped(form, e, STILL, 0.0)
    assert power == 0.0
    return f


def tangent(form: Form, e: np.ndarray, u: np.ndarray = STILL, b: float = 0.0, c: float = 0.0) -> np.ndarray:
    K = np.full((12, 12), np.nan)
    cable.stretch_tangent(e, u, STATE, b, c, form.H, form.h, B, CHANGES, WORK, K)
    return K


def bent(rng: np.random.Generator, spread: float = 0.2) -> np.ndarray:
    return straight_cable(LENGTH) + rng.uniform(-spread, spread, 12)


def by_points(e: np.ndarray, section, rest: np.ndarray | None = None) -> tuple[float, float]:
    """Energy of membrane and bending, from shape functions written out once more."""
    membrane = bending = 0.0
    for x, w in points(3, 0.0, LENGTH):
        xi, s = x / LENGTH, section.at(x / LENGTH).properties(MATERIAL.nu)
        first = [6 * xi * (xi - 1) / LENGTH, 1 - 4 * xi + 3 * xi**2, 6 * xi * (1 - xi) / LENGTH, 3 * xi**2 - 2 * xi]
        second = [(12 * xi - 6) / LENGTH**2, (6 * xi - 4) / LENGTH, (6 - 12 * xi) / LENGTH**2, (6 * xi - 2) / LENGTH]
        a, q = np.array(first) @ e.reshape(4, 3), np.array(second) @ e.reshape(4, 3)
        without = 1.0 if rest is None else np.linalg.norm(np.array(first) @ rest.reshape(4, 3))
        membrane += 0.5 * w * MATERIAL.E * s.area * (np.linalg.norm(a) - without) ** 2
        bending += 0.5 * w * MATERIAL.E * s.Iz * np.sum(np.cross(a, q) ** 2) / np.sum(a**2) ** 2
    return membrane, bending


# ------------------------------------------------------------------------------------------------ energy, derivatives


@SECTIONS
@pytest.mark.parametrize("stretched_at_rest", [False, True])
def test_energy_is_what_the_points_give(section, stretched_at_rest, rng):
    rest = bent(rng) if stretched_at_rest else None
    form = cable_stretch_form(LENGTH, section, MATERIAL, rest=rest)
    parts = cable_stretch_parts(LENGTH, section, MATERIAL, rest=rest)
    for _ in range(3):
        e = bent(rng)
        membrane, bending = by_points(e, section, rest)
        assert_allclose(energy(form, e), membrane + bending, rtol=1e-12)
        assert_allclose([energy(parts[name], e) for name in ("membrane", "bending")], [membrane, bending], rtol=1e-12)
    if rest is not None:
        assert energy(parts["membrane"], rest) < 1e-30


@SECTIONS
def test_force_and_tangent_are_derivatives(section, rng):
    form = cable_stretch_form(LENGTH, section, MATERIAL)
    for _ in range(3):
        e = bent(rng)
        f, K = force(form, e), tangent(form, e)
        assert_allclose(f, difference(lambda x: energy(form, x), e, 1e-3), rtol=0.0, atol=1e-8 * np.abs(f).max())
        assert_allclose(K, difference(lambda x: force(form, x), e, 1e-3), rtol=0.0, atol=1e-8 * np.abs(K).max())
        assert_allclose(K, K.T, rtol=0.0, atol=1e-14 * np.abs(K).max())


def test_damped_tangent_is_the_derivative(rng):
    e, u, c = bent(rng), rng.normal(size=12), 3.0
    K = tangent(FORM, e, u, B_TIME, c)
    by_e = difference(lambda x: damped(FORM, x, u)[0], e, 1e-3)
    by_u = difference(lambda x: damped(FORM, e, x)[0], u, 0.1)
    assert_allclose(K, by_e + c * by_u, rtol=0.0, atol=1e-8 * np.abs(K).max())


def test_over_an_interval_the_work_is_the_change_of_energy(rng):
    e0, e1, h, f = bent(rng), bent(rng), 0.3, np.zeros(12)
    interval = (h, 0.0, 0.0, 0.0)
    cable.stretch_force(0.5 * (e0 + e1), (e1 - e0) / h, interval, 0.0, FORM.H, FORM.h, B, CHANGES, WORK, f)
    assert_allclose(f @ (e1 - e0), energy(FORM, e1) - energy(FORM, e0), rtol=1e-12)


def test_force_is_added(rng):
    e, u, f = bent(rng), rng.normal(size=12), np.ones(12)
    cable.stretch_force(e, u, STATE, B_TIME, FORM.H, FORM.h, B, CHANGES, WORK, f)
    assert_allclose(f, 1.0 + damped(FORM, e, u)[0], rtol=1e-13, atol=1e-14)


def test_no_force_in_the_rest_shape_and_five_motions_without_stiffness():
    straight = straight_cable(LENGTH)
    K = tangent(FORM, straight)
    assert abs(energy(FORM, straight)) < 1e-30
    assert np.abs(force(FORM, straight)).max() < 1e-14 * np.abs(K).max()
    values = np.linalg.eigvalsh(K)
    assert values.min() > -1e-13 * values.max()
    assert np.sum(values < 1e-11 * values.max()) == 5  # a cable does not feel a turn about its axis


# ------------------------------------------------------------------------------------------- rigid motions, damping


def test_a_rigid_motion_turns_the_force_and_keeps_the_energy(rng):
    for _ in range(5):
        e, u, rotation, shift = bent(rng), rng.normal(size=12), rotation_by(rng.normal(size=3)), rng.normal(size=3)
        moved = turn(e, rotation, shift)
        spin = (turn(e, rotation).reshape(4, 3) @ skew(rng.normal(size=3)).T).ravel()
        f, power = damped(FORM, e, u)
        assert_allclose(energy(FORM, moved), energy(FORM, e), rtol=1e-12)
        turned, same = damped(FORM, moved, turn(u, rotation) + spin)
        assert_allclose(turned, turn(f, rotation), rtol=0.0, atol=1e-12 * np.abs(f).max())
        assert_allclose(same, power, rtol=1e-11)


def test_forces_of_an_element_balance(rng):
    e, u = bent(rng), rng.normal(size=12)
    f, _ = damped(FORM, e, u)
    F = f.reshape(4, 3)
    assert np.abs(F[0] + F[2]).max() < 1e-13 * np.abs(f).max()
    assert np.abs(np.cross(e.reshape(4, 3), F).sum(axis=0)).max() < 1e-13 * np.abs(f).max()


def test_power_is_that_of_the_damping_force(rng):
    e, u = bent(rng), rng.normal(size=12)
    f, power = damped(FORM, e, u)
    assert power > 0.0
    assert_allclose(power, u @ (f - force(FORM, e)), rtol=1e-11)


# ------------------------------------------------------------------------------------------------ simple shapes


@pytest.mark.parametrize("stretch", [0.7, 1.0 + 1e-6, 1.05, 2.0])
def test_a_uniform_stretch_pulls_with_axial_stiffness_times_strain(stretch):
    e, rate = stretch * straight_cable(LENGTH), 0.3
    N = EA * (stretch - 1.0)
    expected = np.zeros((4, 3))
    expected[0, 0], expected[2, 0] = -N, N
    assert_allclose(force(FORM, e).reshape(4, 3), expected, rtol=1e-9, atol=1e-15)
    # and b EA |r,x|' more while it grows
    f, power = damped(cable_stretch_parts(LENGTH, BAR, MATERIAL)["membrane"], e, rate * straight_cable(LENGTH))
    expected *= (N + B_TIME * EA * rate) / N
    assert_allclose(f.reshape(4, 3), expected, rtol=1e-9, atol=1e-15)
    assert_allclose(power, B_TIME * EA * rate**2 * LENGTH, rtol=1e-12)


def test_bending_does_not_feel_a_uniform_stretch(rng):
    bending, e = cable_stretch_parts(LENGTH, BAR, MATERIAL)["bending"], bent(rng)
    assert_allclose(energy(bending, 1.3 * e), energy(bending, e), rtol=1e-12)


def test_at_small_strain_it_is_the_green_cable(rng):
    """Membrane to first order; in bending where an element is much longer than thick, or moves across its axis."""
    straight, d = straight_cable(LENGTH), rng.uniform(-1.0, 1.0, 12)
    green, ours = cable_parts(LENGTH, BAR, MATERIAL), cable_stretch_parts(LENGTH, BAR, MATERIAL)
    membrane = tangent(ours["membrane"], straight)
    assert_allclose(membrane, helpers.tangent(green["membrane"], straight), rtol=0.0, atol=1e-14 * membrane.max())
    across = np.flatnonzero(np.arange(12) % 3)
    block = np.ix_(across, across)
    bending = tangent(ours["bending"], straight)[block]
    assert_allclose(bending, helpers.tangent(green["bending"], straight)[block], rtol=0.0, atol=1e-13 * bending.max())

    def gap(size: float) -> float:
        e = straight + size * d
        return np.abs(force(ours["membrane"], e) - helpers.force(green["membrane"], e)).max()

    assert_allclose(gap(1e-3) / gap(5e-4), 4.0, rtol=0.01)


def test_stiffness_of_an_element_on_a_hub(book):
    """Energy over 1/2 EI l/R^2 with the ends' slopes along the circle, least in the chord and the slopes' length."""
    radius, section, material = (
        0.6,
        Rectangle(thickness=3e-4, width=0.03),
        Material(young_modulus=5e6, poisson_ratio=0.3, density=1600.0),
    )
    found = []
    for count in (10, 20, 40):
        length = 12.0 / count
        a, form = 0.5 * length / radius, cable_stretch_form(length, section, material)
        G = np.zeros((12, 2))
        G[6, 0] = length
        G[[3, 4, 9, 10], 1] = np.cos(a), -np.sin(a), np.cos(a), np.sin(a)
        p = np.array([np.sin(a) / a, 1.0])
        for _ in range(30):
            step = np.linalg.solve(G.T @ tangent(form, G @ p) @ G, G.T @ force(form, G @ p))
            p -= step
            if np.abs(step).max() < 1e-12:
                break
        else:
            pytest.fail(f"no equilibrium; last step {step}")
        found.append(energy(form, G @ p) / (0.5 * material.E * section.properties(0.3).Iz * length / radius**2))
    assert_allclose(found, [1.01549, 1.00125, 1.00008], atol=2e-5)
    book(
        "Statics of beams", "Bending stiffness on a hub (cable_stretch, 10 to 40 elements)",
        reference="1.01549, 1.00125, 1.00008", source="independent computation",
        error=np.abs(np.array(found) / [1.01549, 1.00125, 1.00008] - 1.0).max(), allowed=2e-5,
    )  # fmt: skip


@pytest.mark.parametrize("make", [cable_stretch_form, cable_stretch_parts])
def test_a_length_that_cannot_be_is_refused(make):
    with pytest.raises(InputError, match=re.escape("length of an element is 0.0; it must be above 0")):
        make(0.0, BAR, MATERIAL)


def test_a_group_of_elements_has_the_forces_of_single_elements(rng):
    """A beam with more elements than the largest group, one of them damped, and a second beam."""
    system = System(gravity=(0.0, -9.81, 0.0))
    for name, count, damping in (("long", GROUP + 6, 0.1), ("short", 1, 0.0)):
        system.add(
            parts.Beam(
                length=count * LENGTH, section=BAR, material=MATERIAL, elements=count, formulation="cable_stretch",
                stiffness_damping=damping, damped=(3,) if damping else None,
            ),
            name,
        )  # fmt: skip
    assembly = system.assemble()
    model = assembly.model.copy()
    y, a = assembly.y + rng.normal(0.0, 0.1, assembly.y.size), rng.normal(size=model.info.nv)
    found = []
    for _ in range(2):
        r, powers, energies = np.zeros(model.info.nv), np.zeros(N_POWERS), np.zeros(3)
        implicit.residual(0.0, y, a, np.zeros(0), 0.0, 1.0, model, r, powers)
        implicit.energies(0.0, y, model, energies)
        found.append((r, powers, energies))
        model.elements["group_forces"] = model.elements["group_energies"] = 0
    for together, alone in zip(*found, strict=True):
        assert_allclose(together, alone, rtol=0.0, atol=1e-13 * np.abs(alone).max())
