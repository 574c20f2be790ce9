"""The tangent of springs over a step of energy-momentum, and what it does for stiff springs that turn."""

from __future__ import annotations

import numpy as np
import pytest

from evolvent import System, law, parts
from evolvent.equations import energy_momentum as flow
from evolvent.solvers.common.matrices import matrix_of
from evolvent.solvers.static.work import sparse_of
from evolvent.solvers.time.implicit import energy_momentum
from evolvent.solvers.time.implicit.energy_momentum import solve_energy


@law
def damped(extension, rate, t, p):
    return p[0] * extension + p[1] * extension**3 + p[2] * rate


LAWS: dict[str, dict] = {
    "plain": {"stiffness": 50.0, "damping": 0.7},
    "law": {"law": damped, "parameters": (50.0, 200.0, 0.7)},
    "expression": {"law": "50*x + 200*x**3 + 0.7*v"},
}


def chain(count: int = 3, rate: float = 0.0, **fields: object) -> System:
    """Point masses in a row along x, the first on the ground, that swing about it."""
    system, last = System(), (0.0, 0.0, 0.0)
    for i in range(count):
        x = 0.1 * (i + 1)
        system.add(parts.Point(mass=0.1, position=(x, 0.0, 0.0), velocity=(0.0, rate * x, 0.0)), f"mass {i}")
        system.add(parts.Spring(a=last, b=f"mass {i}", length=0.1, **fields))  # type: ignore[arg-type]
        last = f"mass {i}"  # type: ignore[assignment]
    return system


@pytest.mark.parametrize("fields", LAWS.values(), ids=LAWS)
def test_it_is_exact_over_a_long_step(fields: dict, rng: np.random.Generator) -> None:
    """Of points, whatever they move by; the residual is differentiated by differences of sixth order."""
    assembly = chain(**fields).assemble()
    n = int(assembly.model.info.nv)
    assembly.y[:n] += 0.03 * rng.standard_normal(n)
    plan = energy_momentum.plan(assembly, samples=[0.0, 1.0], step=0.1)
    model, work = plan.assembly.model, plan.workspace().step
    work.step.t, work.step.h, work.step.ratio = 0.0, 0.1, 0.0
    flow.measure(0, model, work)
    dq = 0.1 * rng.standard_normal(n)

    def residual(d: np.ndarray) -> np.ndarray:
        work.dq[:] = dq + d
        flow.residual(model, work)
        return 2.0 * np.array(work.r)

    columns = []
    for e in 1e-3 * np.eye(n):
        pairs = ((1, 45.0), (2, -9.0), (3, 1.0))
        columns.append(sum(w * (residual(i * e) - residual(-i * e)) for i, w in pairs) / 60e-3)
    residual(np.zeros(n))
    matrix = matrix_of(model)
    flow.tangent(1.0, model, work, matrix)
    exact = np.array(columns).T
    np.testing.assert_allclose(sparse_of(matrix).toarray(), exact, atol=1e-7 * np.abs(exact).max())


def test_stiff_springs_that_turn_take_few_iterations() -> None:
    """A step turns them by 0.12 rad; with the direction of the middle the step was divided 35 times."""
    found = solve_energy(chain(rate=3.0, stiffness=1e6).assemble(), samples=[0.0, 0.4], step=0.04, spectral_radius=1.0)
    assert found.success, found.message
    assert found.statistics["steps"] == 10
    assert found.statistics["divided_steps"] == 0
    assert found.statistics["iterations"] < 100
    np.testing.assert_allclose(found.energy, found.energy[0], rtol=1e-8)
