"""The tangent of every family under every implicit method against differences of its equations.

States are deformed and turned, with velocities under generalized-alpha, and in the midst of a step of energy-momentum.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np
import pytest

import families.plain  # noqa: F401  (all cases are entered)
from evolvent import System
from evolvent.assembly.assembled import Assembly
from evolvent.equations import energy_momentum as flow
from evolvent.families.attitude import attitude, attitude_tangent
from evolvent.kernels import blocks
from evolvent.model.family import ENERGY, IMPLICIT, STATIC
from evolvent.solvers.common.coordinates import with_positions
from evolvent.solvers.common.matrices import matrix_of
from evolvent.solvers.common.standing import idle_nodes
from evolvent.solvers.static.work import sparse_of
from evolvent.solvers.time.implicit import energy_momentum
from families.case import CASES
from families.moving import SYSTEMS
from families.rows import FAMILIES
from implicit.rigs import Equations

Array = np.ndarray
#: Factors of accelerations and velocities, the step of differences, s and length of a step of energy-momentum, s.
C_MASS, C_RATE, H, STEP = 20.0, 3.0, 1e-4, 0.5
#: Increments of a step, so angles turned in it.
TURNED = 1e-3
#: What the tangent may be off, of its largest entry: round-off of the differences; under energy-momentum, what the
#: angle turned in a step changes (see `equations.energy_momentum.tangent`).
OFF = {STATIC: 1e-7, IMPLICIT: 1e-8, ENERGY: TURNED}
#: The direction of friction on beams follows that of the normal.
KNOWN = {("a contact with friction", method): 1e-5 for method in (STATIC, IMPLICIT)}
#: Differences reach over the kink of a segment that is about to go slack.
KNOWN |= {("threads that go slack", method): 0.05 for method in (STATIC, IMPLICIT)}
#: Momentum of wound thread that is paid out, and inertia by the rate of a free spool.
KNOWN |= {("threads on a moving mesh", IMPLICIT): 1e-4}
KNOWN |= {("loads on threads on a moving mesh", method): 1e-4 for method in (STATIC, IMPLICIT)}
KNOWN |= {
    ("free spools of threads on a moving mesh", IMPLICIT): 5e-3,
    ("a thread on a moving mesh and a free spool", IMPLICIT): 1e-3,
}
#: What takes the moment from the mean forces of a balanced law, of the third order in the step (0.3 % at 0.25 s).
KNOWN |= {("custom forces", ENERGY): 0.05}
#: Shells whose closest point passes on to another face in the step; friction across a normal that turns in it.
KNOWN |= {("a contact of shells", ENERGY): 0.01, ("a contact of shells with friction", ENERGY): 0.1}
#: The flow of material.
KNOWN |= {("a rod that pays out", method): 1e-5 for method in (STATIC, IMPLICIT)}


#: A path whose body cannot be at rest; friction without a step, over which bristles bend.
NOT_SO = {("a joint driven along a path", ENERGY), ("a contact between bodies with friction", STATIC)}


def cells() -> list[tuple[str, Callable[[], System], str]]:
    """Names, systems and methods."""
    found = []
    for row in FAMILIES:
        for method in (STATIC, IMPLICIT, ENERGY):
            if method in row.solvers and (row.name, method) not in NOT_SO:
                found.append((row.name, CASES[row.name]().system, method))
    for name, system in SYSTEMS.items():
        for method in (STATIC, IMPLICIT, ENERGY):
            if not (method == STATIC and "spool" in name) and not (method == ENERGY and "moving mesh" in name):
                found.append((name, system, method))
    return found


CELLS = [pytest.param(*cell, id=f"{cell[0]}-{cell[2]}") for cell in cells()]


def disturbed(assembly: Assembly, rng: np.random.Generator, rates: float) -> Array:
    """The start of an assembly, deformed and turned, with other velocities; 0 leaves wheels alone turning."""
    model = assembly.model
    n_q, n_v = int(model.info.nq), int(model.info.nv)
    y = assembly.y.copy()
    blocks.displace(assembly.y, 0.02 * rng.standard_normal(n_v), False, model, y)
    wheels = y[model.wheels["iv"]].copy()
    y[n_q : n_q + n_v] += rates * rng.standard_normal(n_v)
    if rates == 0.0:
        y[n_q : n_q + n_v] = 0.0
        y[model.wheels["iv"]] = wheels
    return y


def differences(residual: Callable[[Array], Array], n: int) -> Array:
    """Central differences of sixth order."""
    columns = []
    for e in H * np.eye(n):
        pairs = ((1, 45.0), (2, -9.0), (3, 1.0))
        columns.append(sum(w * (residual(i * e) - residual(-i * e)) for i, w in pairs) / (60.0 * H))
    return np.array(columns).T


def of_state(assembly: Assembly, method: str, rng: np.random.Generator) -> tuple[Array, Array]:
    """Differences and tangent of the equations of generalized-alpha, or of an equilibrium."""
    assembly = with_positions(assembly)
    model = assembly.model
    model.switches[:] = assembly.s
    n, m = int(model.info.nv), model.joints.size
    moves = 1.0 if method == IMPLICIT else 0.0
    y, a = disturbed(assembly, rng, 0.5 * moves), moves * rng.standard_normal(n)
    rubs = np.any(model.body_contacts["friction"] > 0.0)
    step = moves / C_RATE if rubs else 0.0  # over which friction slips
    equations, la = Equations(assembly, 0.37, y, a, moves * C_MASS, moves * C_RATE, step), rng.standard_normal(m)
    exact = differences(lambda d: equations.residual(d[:n], la + d[n:]), n + m)
    found = equations.tangent(la)
    return exact, found


def of_step(assembly: Assembly, rng: np.random.Generator) -> tuple[Array, Array]:
    """Of a step of energy-momentum, twice the residual by increments and twice the multipliers."""
    n_q, n_v = int(assembly.model.info.nq), int(assembly.model.info.nv)
    still = assembly.y.copy()
    still[n_q : n_q + n_v] = 0.0  # which joints allow
    plan = energy_momentum.plan(dataclasses.replace(assembly, y=still), samples=[0.0, 1.0], step=STEP)
    model, work = plan.assembly.model, plan.workspace().step
    work.y0[:] = disturbed(plan.assembly, rng, 0.0)
    work.step.t, work.step.h, work.step.ratio = 0.0, STEP, 0.0
    flow.measure(0, model, work)
    n, m = int(model.info.nv), model.joints.size
    dq, la = TURNED * rng.standard_normal(n), rng.standard_normal(m)

    def residual(d: Array) -> Array:
        work.dq[:], work.la[:] = dq + d[:n], la + 0.5 * d[n:]
        flow.residual(model, work)
        return np.concatenate([2.0 * work.r[:n], work.r[n:] * np.where(model.constraints["stiffness"] > 0.0, 2.0, 1.0)])

    exact = differences(residual, n + m)
    residual(np.zeros(n + m))
    matrix = matrix_of(model)
    flow.tangent(1.0, model, work, matrix)
    found, open_ = sparse_of(matrix).toarray(), n + np.flatnonzero(model.constraints["until"] < STEP)
    found[open_, open_] = 0.0  # of joints that do not hold
    return exact, found


def off(system: Callable[[], System], method: str, rng: np.random.Generator) -> float:
    """Largest difference of the tangent, beside its largest entry."""
    assembly = system().assemble()
    exact, found = of_step(assembly, rng) if method == ENERGY else of_state(assembly, method, rng)
    assembly.model.switches[:] = assembly.s
    still = unmoved(assembly)
    found[still, still] = exact[still, still]
    return float(np.abs(found - exact).max() / max(np.abs(exact).max(), 1.0))


def unmoved(assembly: Assembly) -> Array:
    """Unknowns that no force moves, whose diagonal entries are any positive numbers."""
    model = assembly.model
    return np.concatenate([idle_nodes(model), model.thrusters["iv"] - int(model.info.nq)]).astype(int)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "system", "method"), CELLS)
def test_tangent(name: str, system: Callable[[], System], method: str, rng: np.random.Generator) -> None:
    assert off(system, method, rng) < KNOWN.get((name, method), OFF[method])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "system"), [cell[:2] for cell in cells() if cell[2] == IMPLICIT and "layer" not in cell[0]]
)
def test_stiffness_damping_and_mass_are_parts_of_it(name: str, system: Callable[[], System]) -> None:
    """c_mass M + c_rate C + K at a state that moves: K alone, of which the adjoint makes use, is whole."""
    assembly = with_positions(system().assemble())
    model, rng = assembly.model, np.random.default_rng(0)
    model.switches[:] = assembly.s
    n = int(model.info.nv)
    y, a, la = disturbed(assembly, rng, 0.5), rng.standard_normal(n), rng.standard_normal(model.joints.size)
    step = 1.0 / C_RATE if np.any(model.body_contacts["friction"] > 0.0) else 0.0

    def tangent(c_mass: float, c_rate: float) -> Array:
        found = Equations(assembly, 0.37, y, a, c_mass, c_rate, step).tangent(la)
        found[unmoved(assembly), unmoved(assembly)] = 0.0
        return found

    whole, K, C = tangent(C_MASS, C_RATE), tangent(0.0, 0.0), tangent(0.0, C_RATE)
    M = tangent(2.0 * C_MASS, C_RATE) - whole
    assert np.abs(whole - C - M).max() <= 1e-12 * np.abs(whole).max()
    assert np.abs(tangent(0.0, 2.0 * C_RATE) - 2.0 * C + K).max() <= 1e-12 * np.abs(whole).max()


@pytest.mark.parametrize("torque", [-0.7, 0.3, 0.9])
@pytest.mark.parametrize("rate", [-2.98, -1.0, 0.2, 2.98, 3.5])
def test_slopes_of_a_wheel(torque: float, rate: float) -> None:
    """Of its motor below and at its limits, and of its drag."""
    kind = [(key, float) for key in ("torque_limit", "rate_limit", "viscous", "friction", "slip")]
    wheel, d = np.array([(0.8, 3.0, 0.1, 0.3, 0.5)], dtype=kind).view(np.recarray), 1e-6
    by_torque, by_rate = attitude_tangent.limited_slopes.py_func(torque, rate, wheel, 0)

    def motor(u: float, v: float) -> float:
        return float(attitude.limited_torque.py_func(u, v, wheel, 0))

    def drag(v: float) -> float:
        return float(attitude.drag_torque.py_func(wheel, 0, v))

    assert by_torque == pytest.approx((motor(torque + d, rate) - motor(torque - d, rate)) / (2.0 * d), abs=1e-8)
    assert by_rate == pytest.approx((motor(torque, rate + d) - motor(torque, rate - d)) / (2.0 * d), abs=1e-7)
    slope = attitude_tangent.drag_slope.py_func(wheel, 0, rate)
    assert slope == pytest.approx((drag(rate + d) - drag(rate - d)) / (2.0 * d), abs=1e-8)
