"""Turns on one another by the energy-momentum method: energy, momenta, tangent, and the wrapped rib."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

from evolvent import System, cases, elements, parts
from evolvent.algebra import sparse
from evolvent.assembly.assembled import Assembly
from evolvent.equations import energy_momentum as flow
from evolvent.kernels import contact
from evolvent.solvers.common.matrices import matrix_of
from evolvent.solvers.common.solution import Solution
from evolvent.solvers.static.work import sparse_of
from evolvent.solvers.time.implicit import energy_momentum
from evolvent.solvers.time.implicit.energy_momentum import solve_energy
from implicit.rigs import RUBBER
from implicit.test_layers import N, wound

Array = np.ndarray


def ran(assembly: Assembly, end: float, step: float, rho: float = 1.0) -> Solution:
    found = solve_energy(assembly, samples=np.linspace(0.0, end, 11), step=step, spectral_radius=rho)
    assert found.success, found.message
    return found


def turning(assembly: Assembly, rate: float) -> Assembly:
    """The same with its beams turning about z."""
    y, n_q = assembly.y.copy(), int(assembly.model.info.nq)
    for row in assembly.model.beams:
        size = 6 * row["nodes"]
        x = y[row["iq"] :][:size].reshape(-1, 3)
        y[row["iv"] :][:size] += np.cross([0.0, 0.0, rate], x).ravel()
    assert n_q > 0
    return dataclasses.replace(assembly, y=y)


@pytest.mark.parametrize("step", [2e-2, 2e-3])
@pytest.mark.parametrize("count", [1, 2])
def test_pressed_turns_spring_apart_and_keep_energy_and_momenta(count: int, step: float) -> None:
    """Free coils that turn and rise along the axis, whose turns are pressed into one another, round a free hub."""
    pitch = 0.0015 * count
    assembly = turning(wound(pitch, count=count, rise=1e-3, points=3), 2.0)
    found = ran(assembly, 10.0 * step, step)
    scale, momentum = found.energy[0], found.momentum
    assert found.balance.contact[0] > 1e-3  # of the pressed turns
    assert found.forces["contact_surfaces"]["normal"].max() > 0.1
    assert np.abs(found.energy_defect).max() < 1e-10 * scale
    assert np.diff(found.balance.by_contact).min() > -1e-12 * scale  # of turns that touch newly
    assert found.balance.by_contact[1] < 1e-12 * scale  # those pressed at the start give back all
    assert np.abs(momentum.drift_linear).max() < 1e-12 * np.abs(momentum.angular).max()
    assert np.abs(momentum.drift_angular).max() < 1e-9 * np.abs(momentum.angular).max()


@pytest.mark.slow
@pytest.mark.parametrize("step", [1e-2, 1e-3])
def test_friction_between_turns_takes_energy_and_keeps_momenta(step: float) -> None:
    given = {"friction": 0.4, "bristle_stiffness": 100.0, "damping": 0.5, "points": 3}
    assembly = turning(wound(0.0030, count=2, rise=1e-3, **given), 2.0)
    beam = assembly.model.beams[1]  # slides against the other
    assembly.y[beam["iv"] :][: 6 * beam["nodes"]] *= 1.05
    found = ran(assembly, 20.0 * step, step)
    scale, balance, momentum = found.energy[0], found.balance, found.momentum
    assert balance.by_friction[-1] > 1e-7
    for losses in (balance.by_friction, balance.by_contact):
        assert np.diff(losses).min() > -1e-12 * scale
    assert np.abs(found.energy_defect).max() < 1e-10 * scale
    assert np.abs(momentum.drift_linear).max() < 1e-12 * np.abs(momentum.angular).max()
    assert np.abs(momentum.drift_angular).max() < 1e-9 * np.abs(momentum.angular).max()


def stepped(assembly: Assembly, h: float, rng: np.random.Generator) -> tuple[Any, Any, Array]:
    """Model and workspace of a step that has begun, and increments of its unknowns."""
    plan = energy_momentum.plan(assembly, samples=[0.0, 1.0], step=h)
    model, step = plan.assembly.model, plan.workspace().step
    step.step.t, step.step.h, step.step.ratio = 0.0, h, 0.0
    flow.measure(0, model, step)
    size = np.where(np.arange(int(model.info.nv)) < 6, 0.0, 1e-5)  # all but the hub
    return model, step, size * rng.standard_normal(size.size)


@pytest.mark.parametrize("friction", [0.0, 0.4])
@pytest.mark.parametrize("coupled", [True, False])
def test_tangent(friction: float, coupled: bool, rng: np.random.Generator) -> None:
    """Twice the derivative, within the pattern and by inner unknowns, but for force by its element's length."""
    assembly = wound(0.0015, friction=friction, bristle_stiffness=100.0)
    model, step, dq = stepped(assembly, 0.05, rng)
    found, exact, beam = [], [], model.beams[0]
    first = int(beam["iv"]) - int(model.info.nq)
    own = slice(first, first + 6 * (N + 1))
    for stiffness in (500.0, 0.0):
        model.contact_surfaces["stiffness"] = stiffness
        step.dq[:] = dq
        flow.residual(model, step)
        matrix = matrix_of(model, layers=coupled)
        flow.tangent(1.0, model, step, matrix)
        assert (matrix.counts[sparse.INNER] > 0) == (stiffness > 0.0 and not coupled)
        found.append(sparse_of(matrix).toarray()[own, own])
        columns = []
        for k in range(own.start, own.stop):
            both = []
            for s in (1e-8, -1e-8):
                step.dq[:] = dq
                step.dq[k] += s
                flow.residual(model, step)
                both.append(step.r[own].copy())
            columns.append((both[0] - both[1]) / 1e-8)
        exact.append(np.array(columns).T)
    tangent, differences = found[0] - found[1], exact[0] - exact[1]
    assert np.abs(differences).max() > 100.0
    assert np.abs(tangent - differences).max() < 0.02 * np.abs(differences).max()


def test_the_gap_changes_by_the_work_of_a_unit_force(rng: np.random.Generator) -> None:
    """Of a step in which turns slide along one another by a tenth of an element: to round-off."""
    assembly = wound(0.0015)
    model, step, dq = stepped(assembly, 0.05, rng)
    x = assembly.y[model.beams[0]["iq"] :][: 6 * (N + 1)].reshape(-1, 3)
    moved = 0.02 * np.linspace(0.0, 1.0, N + 1)[:, None] * x[1::2]  # along the coil, the more the farther out
    dq[6:].reshape(-1, 2, 3)[:, 0] += moved
    step.dq[:] = dq
    flow.residual(model, step)
    points = model.contact_points
    pressed = points["force"] > 0.0
    slid = np.abs(points["xi1"] + points["carrier1"] - points["xi"] - points["carrier"])[pressed]
    assert slid.max() > 0.05
    F = np.zeros(int(model.info.nv))
    lost, _ = contact.add_points(step.y0, step.y1, 0.05, 0.05, 1.0, 0.0, 0.0, model, F)
    changes = points["gap1"][pressed] - points["gap"][pressed]
    expected = float(points["force"][pressed] @ changes)
    assert -F @ step.dq == pytest.approx(expected, rel=1e-9)
    assert abs(expected) > 1e-4
    assert lost == pytest.approx(0.0, abs=1e-12)  # a contact that lasts gives back all


def test_points_that_come_over_a_side_bring_no_energy() -> None:
    """A rod slides along the axis over another, deeper than its surface: nothing pushes it."""
    system, depth, speed = System(), 2e-3, 0.5
    given: dict[str, Any] = {"section": elements.Rectangle(thickness=0.01, width=0.02), "material": RUBBER}
    given |= {"elements": 2, "length": 0.4, "formulation": "cable"}
    nodes, rates = np.zeros((2, 3, 2, 3))
    nodes[:, 0, 0], nodes[:, 1, 0] = np.linspace(0.0, -0.4, 3), -1.0
    nodes[:, 0, 1], nodes[:, 0, 2], rates[:, 0, 2] = 0.01 - depth, 0.05, -speed
    system.add(parts.Beam(nodes=nodes, rates=rates, **given), "over")
    system.add(parts.Beam(position=(-0.2, 0.0, 0.0), direction=(-1.0, 0.0, 0.0), **given), "under")
    layer = {"thickness": 0.01, "width": 0.02, "stiffness": 1e3}
    system.add(parts.Contact(a="over", b="under", around=(0.2, -3.0, 0.0), **layer), "layer")
    found = ran(system.assemble(), 0.1, 2e-3)
    x = found.y[-1][int(found.assembly.model.beams[0]["iq"]) :][:3]
    assert x == pytest.approx([0.0, 0.01 - depth, 0.05 - speed * 0.1], abs=1e-9)
    assert found.assembly.model.contact_points["rest"].max() == pytest.approx(depth, rel=1e-2)
    assert np.all(found.forces["contact_surfaces"]["normal"][:, 0] == 0.0)
    assert np.abs(found.balance.by_contact).max() == 0.0


def rib(name: str, own: bool) -> tuple[Any, Assembly]:
    """A built-in case of a wrapped rib, with its turns on one another or without."""
    case = cases.load(name)
    case = case.model_copy(update={"contact": case.contact.model_copy(update={"self": own})})
    return case, cases.system("wrapped-rib").build(case).assemble()


@pytest.mark.slow
def test_hold_in_steps_of_half_a_second() -> None:
    """The force on the hub is that of the tension, T L/(2 R^2), and that of a rib without turns on one another."""
    forces = []
    for own in (True, False):
        case, assembly = rib("wrapped-rib-hold", own)
        found = solve_energy(assembly, samples=np.arange(0.0, 61.0, 5.0), step=0.5)
        assert found.success, found.message
        largest = np.abs(found.balance.loads).max()
        assert found.energy_defect.max() < 1e-6 * largest
        assert np.ptp(found.forces["contact_surfaces"]["normal"][8:, 0]) < 1e-4
        forces.append(float(found.forces["contact_surfaces"]["normal"][-1, 0]))
    theory = 0.2 * case.rib.length / (2.0 * case.hub.radius**2)
    assert forces[0] == pytest.approx(forces[1], rel=3e-3)
    assert forces[0] == pytest.approx(theory, rel=3e-3)


@pytest.mark.slow
@pytest.mark.parametrize(("friction", "elements", "touching"), [(0.0, 40, 20.0), (0.2, 20, 5.0)])
def test_winding_never_gains_energy(friction: float, elements: int, touching: float) -> None:
    case, _ = rib("wrapped-rib", True)
    own = {"contact": case.contact.model_copy(update={"friction": friction})}
    case = case.model_copy(update=own | {"rib": case.rib.model_copy(update={"elements": elements})})
    assembly = cases.system("wrapped-rib").build(case).assemble()
    found = solve_energy(assembly, samples=np.arange(0.0, 70.1, 0.1), step=0.05, newton=1e-9)
    assert found.success, found.message
    largest = max(np.abs(found.energy).max(), np.abs(found.balance.loads).max())
    assert found.forces["contact_surfaces"]["touching"][-1, 1] > touching
    assert found.energy_defect.max() < 1e-6 * largest
    for losses in (found.balance.by_contact, found.balance.by_friction):
        assert np.diff(losses).min() > -1e-9 * largest
    if friction == 0.0:
        assert found.t[np.linalg.norm(tip_velocity(found), axis=1).argmax()] == pytest.approx(66.79, abs=0.15)


def tip_velocity(found: Solution) -> Array:
    beam = found.assembly.model.beams[0]
    at = int(beam["iv"]) + 6 * (int(beam["nodes"]) - 1)
    return found.y[:, at : at + 3]
