"""What the compiled functions return for every case, as JSON: to compare it with that of plain Python."""

from __future__ import annotations

import json
from collections.abc import Callable
from unittest import mock

import numpy as np

import families.beams
import families.contacts
import families.coordinates
import families.loads
import families.lumped
import families.reduced
import families.relaxing
import families.rods
import families.shells  # noqa: F401  (all enter their cases)
from evolvent import model as mdl
from evolvent.assembly.assembled import Assembly
from evolvent.equations import implicit, inventory
from evolvent.model.family import EXPLICIT, IMPLICIT
from evolvent.solvers import solve
from evolvent.solvers.common.coordinates import with_positions
from evolvent.solvers.time.explicit import fastest_modes as explicit_modes
from evolvent.solvers.time.implicit.plan import solve_implicit
from families.case import CASES, Array
from families.rows import FAMILIES
from helpers import derivative
from implicit.rigs import Equations

#: Coordinates from which on plain Python takes one step, not two: a step of a shell takes it a second.
LARGE = 40


def disturbed(assembly: Assembly) -> Array:
    """The start, a little off it everywhere."""
    y, n = assembly.y.copy(), int(assembly.model.info.nq + assembly.model.info.nv)
    y[:n] += 1e-3 * np.sin(1.0 + np.arange(n))
    return y


def one_product(product: Callable[[Array], Array], n: int) -> tuple[float, Array]:
    """In place of the largest eigenvalue of a matrix, whose `n` products take longer than all else: one of them."""
    return 0.0, product(np.ones(n))


def numbers(name: str) -> dict[str, list[float]]:
    """Rates, residual and energies of a case's disturbed start, and where a step or two lead from its start."""
    case = CASES[name]()
    row = next(family for family in FAMILIES if family.name == name)
    assembly, found = case.system().assemble(), {}
    y, model = disturbed(assembly), assembly.model
    steps = 2.0 if int(model.info.nv) < LARGE else 1.0
    samples = np.array([0.0, steps * case.step])
    if EXPLICIT in row.solvers:
        sums = np.zeros(mdl.N_INVENTORY)
        inventory.inventory(0.0, y, assembly.s, model, sums)
        found["rates"], found["sums"] = derivative(assembly)(0.0, y).tolist(), sums.tolist()
        with mock.patch.object(explicit_modes, "_largest", one_product):
            found["explicit"] = solve(assembly, samples=samples, step=case.step, method="rk4").y[-1].tolist()
    if IMPLICIT in row.solvers:
        assembly = with_positions(assembly)
        model, y = assembly.model, disturbed(assembly)
        model.switches[:] = assembly.s
        n_v, n_j, energies = int(model.info.nv), model.joints.size, np.zeros(5)
        equations = Equations(assembly, 0.0, y, 0.1 * np.cos(np.arange(n_v)), 0.0, 0.0)
        found["residual"] = equations.residual(np.zeros(n_v), np.sin(np.arange(n_j))).tolist()
        implicit.energies(0.0, y, model, energies)
        found["energies"] = energies.tolist()
        found["implicit"] = solve_implicit(assembly, samples=samples, step=case.step).y[-1].tolist()
    return found


def print_numbers() -> None:
    """Print the `numbers` of all cases as JSON."""
    print(json.dumps({name: numbers(name) for name in CASES}))
