"""Groups of parameters that change different equations: one evaluation gives the derivatives by a whole group."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from evolvent.equations.implicit import residual
from evolvent.kernels.blocks import displace
from evolvent.solvers.sensitivity import recorded_energy_steps
from evolvent.solvers.sensitivity.adjoint_events import Parameter
from evolvent.solvers.sensitivity.patches import Patch
from evolvent.solvers.time.implicit.run import ImplicitRun

Array = np.ndarray
#: Number of states at which the equations that a parameter changes are sought; error of linear equations, relative to
#: their change, and round-off, relative to the equations: equations that differ by more are not linear.
TRIALS, EVEN, ROUND_OFF = 3, 1e-8, 1e-15
#: Factor by which parameters in which the equations are linear are changed more, which reduces the effect of round-off.
WIDER = 256.0


def _is_nonlinear(both: Array, alone: Array, middle: Array, n_v: int) -> bool:
    """Whether equations are not linear in a parameter; forces and constraints are compared by their own scales."""
    for own in (slice(0, n_v), slice(n_v, None)):
        same = EVEN * np.abs(both[own]).max(initial=0.0) + ROUND_OFF * np.abs(middle[own]).max(initial=0.0)
        if np.any(np.abs(both[own] - alone[own]) > same):
            return True
    return False


def group_parameters(lead: ImplicitRun, middle: ImplicitRun, parameters: Sequence[Parameter]) -> None:
    """Put parameters that change different equations into one group, by tests at random states near the start."""
    rng, work, model, scratch = np.random.default_rng(0), lead.work, lead.model.copy(), middle.work
    n_q, n_v, h = int(model.info.nq), int(model.info.nv), float(lead.work.loop.step)
    wide = {}
    for one in parameters:
        wide[one.name] = Patch.along(*one.sides.patches, 0.5 * WIDER)
        one.patches, one.change_of_rows = (wide[one.name],), WIDER * one.change
    sets = [[one] for one in parameters]
    for t in np.linspace(float(lead.reached), float(work.samples[-1]), TRIALS).tolist():
        y, size = work.y.copy(), 1e-2 * work.weight[:n_v]
        displace(work.y, size * rng.uniform(-1, 1, n_v), False, lead.model, y)
        y[n_q : n_q + n_v] += 1e2 * size * rng.uniform(-1, 1, n_v) / float(work.options.span)
        scratch.y0[:], scratch.dq[:] = y, size * rng.uniform(-1, 1, n_v)
        a, la = rng.uniform(-1, 1, n_v), rng.uniform(-1, 1, work.la.size)
        own = _residual(t, h, y, a, la, model, middle)
        while sets:
            some, sides = sets.pop(), []
            for patches in zip(*((*one.sides.patches, wide[one.name]) for one in some), strict=True):
                for patch in patches:
                    patch.write(model)
                sides.append(_residual(t, h, y, a, la, model, middle))
                for patch in patches:
                    patch.undo(model)
            differ = sides[0] != sides[1]
            if len(some) > 1 and np.any(differ & ~np.any([one.rows for one in some], axis=0)):
                sets += [[one] for one in some]
                continue
            both, alone = 0.5 * (sides[0] - sides[1]), (sides[2] - own) / WIDER
            for one in some:
                mine = one.rows if len(some) > 1 else np.ones_like(differ)
                one.rows |= differ & mine
                if _is_nonlinear(both * mine, alone * mine, own, n_v):
                    one.patches, one.change_of_rows = one.sides.patches, one.change
        sets = _assign_groups(parameters)
    for first, *others in sets:
        if not np.any(first.rows):  # where it may change others later
            first.patches, first.change_of_rows = first.sides.patches, first.change
        if not others:
            first.rows[:] = True


def _assign_groups(parameters: Sequence[Parameter]) -> list[list[Parameter]]:
    """Assign parameters to groups that change disjoint sets of equations; returns the parameters of each group."""
    taken: list[tuple[int, Array]] = []
    found: list[list[Parameter]] = []
    for one in parameters:
        sides_of, own = len(one.patches), one.rows if np.any(one.rows) else np.ones_like(one.rows)
        alike = (k for k, (count, rows) in enumerate(taken) if count == sides_of and not np.any(rows & own))
        one.group = next(alike, len(taken))
        if one.group == len(taken):
            taken.append((sides_of, np.zeros_like(one.rows)))
            found.append([])
        taken[one.group][1][:] |= own
        found[one.group].append(one)
    return found


def _residual(t: float, h: float, y: Array, a: Array, la: Array, model: Any, middle: ImplicitRun) -> Array:
    """Residual of the equations at a state; under energy-momentum of a step by `dq` from `y0` of `middle.work`."""
    scratch = middle.work
    if middle.midpoint:
        scratch.la[:] = la
        recorded_energy_steps.evaluate(t, h, model, scratch)
    else:
        residual(t, y, a, la, 0.0, 1.0, model, scratch.r, scratch.powers[0])
    return np.array(scratch.r)
