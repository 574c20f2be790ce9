"""What families say of `AdjointSupport.mirrored`: over a step of energy-momentum in which nothing turns the tangent is
exact, and forces do not change where the ends of the step are exchanged. The adjoint then takes no differences.
"""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from evolvent.assembly.assembled import Assembly
from evolvent.equations import energy_momentum as flow
from evolvent.model.family import ENERGY
from evolvent.model.registry import whole
from evolvent.solvers.sensitivity.recorded_energy_steps import is_mirrored
from evolvent.solvers.time.implicit import energy_momentum
from families import test_tangents as tangents
from families.case import CASES
from families.rows import FAMILIES

Array = np.ndarray
#: Length of a step, s, and what forces that are exchanged and tangents may be off, of their largest entry.
STEP, EXCHANGED, EXACT = 0.5, 1e-12, 1e-10
#: Cases whose model states it.
MIRRORED = [
    row.name
    for row in FAMILIES
    if ENERGY in row.solvers
    and row.name in CASES
    and (row.name, ENERGY) not in tangents.NOT_SO
    and is_mirrored(CASES[row.name]().system().assemble().model)
]


def exchanged(assembly: Assembly, moved: float, rng: np.random.Generator) -> tuple[Array, Array]:
    """Forces of a step without change of velocities, and those with its ends exchanged."""
    n_q, n_v = int(assembly.model.info.nq), int(assembly.model.info.nv)
    still = assembly.y.copy()
    still[n_q : n_q + n_v] = 0.0  # which joints allow
    plan = energy_momentum.plan(dataclasses.replace(assembly, y=still), samples=[0.0, 1.0], step=STEP)
    model, work = plan.assembly.model, plan.workspace().step
    y, dq = tangents.disturbed(plan.assembly, rng, 0.0), moved * rng.standard_normal(n_v)
    la, found = rng.standard_normal(model.constraints.size), []
    for side in (1.0, -1.0):
        y[n_q : n_q + n_v] = dq / STEP
        work.y0[:], work.step.t, work.step.h, work.step.ratio = y, 0.1 + (0.5 - 0.5 * side) * STEP, side * STEP, 0.0
        flow.measure(0, model, work)
        work.dq[:], work.la[:] = side * dq, la
        flow.residual(model, work)
        found.append(work.r[:n_v].copy())
        y = work.y1.copy()
    return found[0], found[1]


@pytest.mark.parametrize("moved", [1e-3, 0.1])
@pytest.mark.parametrize("name", MIRRORED)
def test_tangents_are_exact_and_ends_may_be_exchanged(
    name: str, moved: float, rng: np.random.Generator, monkeypatch: pytest.MonkeyPatch
) -> None:
    assembly = CASES[name]().system().assemble()
    forth, back = exchanged(assembly, moved, rng)
    assert np.abs(forth - back).max() <= EXCHANGED * np.abs(forth).max()
    monkeypatch.setattr(tangents, "TURNED", moved)
    exact, found = tangents.of_step(assembly, rng)
    assert np.abs(found - exact).max() <= EXACT * np.abs(exact).max()


def test_every_family_that_says_so_is_among_the_cases() -> None:
    seen = set[str]()
    for name in MIRRORED:
        model = CASES[name]().system().assemble().model
        seen |= {family.name for family in whole() if family.records(model).size}
    says = {family.name for family in whole() if family.adjoint is not None and family.adjoint.mirrored is not False}
    assert says <= seen, says - seen


@pytest.mark.parametrize("name", ["a free body", "a rod", "a joint that is a constraint"])
def test_what_turns_and_lengths_that_are_kept_are_not(name: str) -> None:
    assert not is_mirrored(CASES[name]().system().assemble().model)
