"""Methods of implicit steps: a row of data each, and the functions by which the loop and Newton's method call them.

Another method is its row here; with equations of its own a module like `alpha`, which has its code, and branches here.
Nothing else reads `options.method`. Without the flag `midpoint` it has the forces of the ends of steps, starts by
`alpha_start` with its constants alpha_m, alpha_f and beta, and is solved by `newton.solve_end`.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

from evolvent.compiled.jit import inlined
from evolvent.kernels.calls import longest_step_at
from evolvent.model import family, powers as eq
from evolvent.solvers.time.implicit import alpha, energy_step
from evolvent.solvers.time.implicit.alpha_tangent import factor_at
from evolvent.solvers.time.implicit.workspace import ALPHA, ENERGY

#: Folder of this module, without `evolvent.`
HERE = __name__.rpartition(".")[0].removeprefix("evolvent.")
#: Names of the methods.
NAME, HHT, ENERGY_MOMENTUM = "generalized-alpha", "hht", "energy-momentum"


class Method(NamedTuple):
    """A method as data.

    Attributes
    ----------
    code : int, of `workspace`; solver : key of `evolvent.assembly.families`
    radius, least_radius : float, spectral radius at infinite frequency where none is given, and the least; least : text
    tolerance : float, of `System.simulate` where none is given
    flags : dict of int, what the loop needs to know of it (`workspace.OPTIONS`)
    modules : names of the modules and functions that only its runs call, without `evolvent.`
    constants : function of the spectral radius to the fields of `workspace.OPTIONS` that are the method's own
    """

    code: int
    solver: str
    radius: float
    least_radius: float
    least: str
    tolerance: float
    flags: dict[str, int]
    modules: frozenset[str]
    constants: Callable[[float], dict[str, float]]


def _chung_hulbert(rho: float) -> dict[str, float]:
    """Constants of generalized-alpha (`evolvent.solvers.time.implicit.alpha`)."""
    return {
        "alpha_m": (2.0 * rho - 1.0) / (rho + 1.0), "alpha_f": rho / (rho + 1.0), "beta": 1.0 / (1.0 + rho) ** 2,
        "gamma": 2.0 / (1.0 + rho) - 0.5,
    }  # fmt: skip


def _hilber_hughes_taylor(rho: float) -> dict[str, float]:
    """Constants of HHT: generalized-alpha whose inertia is that of the end of a step.

    Notes
    -----
    Hilber, Hughes & Taylor (1977), for constraints of index 3 Negrut, Rampalli, Ottarsson & Sajdak (2007), with
    alpha = -(1 - rho)/(1 + rho) from -1/3 to 0:

        (1 + alpha) v1' - alpha v0' = a1,  beta = (1 - alpha)^2/4,  gamma = 1/2 - alpha
    """
    damps = (1.0 - rho) / (1.0 + rho)
    return {"alpha_m": 0.0, "alpha_f": damps, "beta": 0.25 * (1.0 + damps) ** 2, "gamma": 0.5 + damps}


def _filter(rho: float) -> dict[str, float]:
    """Constant of energy-momentum (`evolvent.equations.energy_momentum`)."""
    return {"chi": rho * (1.0 - rho) / (1.0 + rho) ** 2}


_ALPHA = Method(
    ALPHA, family.IMPLICIT, 0.3, 0.0, "0", 1e-6, {"midpoint": 0, "conserves": 0, "divides": 0, "corrects": 1},
    frozenset({f"{HERE}.alpha", f"{HERE}.alpha_start", f"{HERE}.alpha_tangent", f"{HERE}.newton.solve_end"}),
    _chung_hulbert,
)  # fmt: skip
#: Methods by name. One that is generalized-alpha with other constants is a row here.
METHODS = {
    NAME: _ALPHA,
    HHT: _ALPHA._replace(radius=0.9, least_radius=0.5 - 1e-9, least="1/2", constants=_hilber_hughes_taylor),
    ENERGY_MOMENTUM: Method(
        ENERGY, family.ENERGY, 1.0 / 3.0, 1.0 / 3.0 - 1e-9, "1/3", 1e-7,
        {"midpoint": 1, "conserves": 1, "divides": 1, "corrects": 0},
        frozenset({f"{HERE}.energy_step", "equations.energy_momentum", f"{HERE}.newton.solve_energy"}), _filter,
    ),
}  # fmt: skip


@inlined
def start_step(t, h, model, work):
    """Start a step of length h at t from work.y0."""
    if work.options.method == ENERGY:
        energy_step.start_step(t, h, model, work)
    else:
        alpha.start_step(h, model, work)


@inlined
def predict(h, coasts, model, work):
    """Increments from which Newton's method starts: of constant velocities (`coasts`), or of their last change."""
    if work.options.method == ENERGY:
        energy_step.predict(not coasts, model, work)
    else:
        alpha.predict(h, coasts, model, work)


@inlined
def evaluate(t1, h, model, work):
    """Residual of the present increments of a step of length h to t1."""
    if work.options.method == ENERGY:
        energy_step.evaluate(model, work)
    else:
        alpha.evaluate(t1, h, model, work)


@inlined
def scale_of(h, options):
    """Derivative of the forces of a typical mass by the increments, which scales the rows of constraints."""
    if options.method == ENERGY:
        return 4.0 * options.mass / (h * h)
    return alpha.rates(h, options)[0] * options.mass


@inlined
def factor_tangent(t1, h, scale, model, matrix, work):
    """Assemble and factor the tangent; returns what `sparse_lu.factor` returns."""
    if work.options.method == ENERGY:
        return energy_step.factor_tangent(scale, model, matrix, work)
    c_mass, c_rate = alpha.rates(h, work.options)
    return factor_at(t1, work.y, work.la, c_mass, c_rate, scale, model, matrix, work)


@inlined
def tangent_factor(options):
    """What the tangent is of the derivatives, but for constraints."""
    return 2.0 if options.method == ENERGY else 1.0


@inlined
def correct(t1, h, searches, model, work):
    """Add the correction to the increments, and evaluate; returns the part of it that is added.

    Parameters
    ----------
    searches : bool, whether the best part of it is looked for
    """
    if work.options.method != ENERGY:
        alpha.correct(h, model, work)
        alpha.evaluate(t1, h, model, work)
        return 1.0
    before = energy_step.along(work) if searches else 0.0
    if before < 0.0:
        return energy_step.search(before, model, work)
    energy_step.shift(1.0, model, work)
    return 1.0


@inlined
def local_error(h, model, work):
    """Estimated error of a step beside the tolerance."""
    return energy_step.local_error(model, work) if work.options.method == ENERGY else alpha.local_error(h, model, work)


@inlined
def restore_start(model, work):
    """Restore the start of a step that is rejected, but for its state."""
    if work.options.method != ENERGY:
        alpha.restore_start(model, work)


@inlined
def end_step(t, h, model, work):
    """What the next step needs of one of length h to t."""
    if work.options.method == ENERGY:
        energy_step.end_step(model, work)
    else:
        alpha.end_step(t, h, model, work)


@inlined
def coupled_energy(t, model, work):
    """Energy of penalties and joint coordinates at the end of the step, J."""
    if work.options.method == ENERGY:
        return energy_step.coupled_energy(t, model, work)
    return work.powers[0, eq.COUPLED_ENERGY]


@inlined
def longest_step(model, work):
    """Longest step by the motion of the parts, s."""
    if work.options.method == ENERGY:
        return energy_step.longest_turn(model.bodies)
    found, calls = math.inf, model.node_events_longest_step_calls
    if work.options.tolerance > 0.0:
        for k in range(calls.size):
            found = min(found, longest_step_at(model, calls[k])(work.y, model.switches, model))
    return found


@inlined
def restart(model, work):
    """Forget the step before, where loads or joints change at once, of a method that then starts by itself.

    Returns whether it does; generalized-alpha starts by `loop.restart`.
    """
    if work.options.method == ENERGY:
        energy_step.restart(model, work)
        return True
    return False
