"""Compiled loops over copies of an explicit run, which share no memory that they write to."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import types, void

from evolvent.compiled.jit import CUBE, INTEGERS, MATRIX, REAL, VECTOR, indirect
from evolvent.compiled.pointer import Struct, array, at_address
from evolvent.equations.inventory import inventory
from evolvent.equations.rhs import rhs
from evolvent.kernels.blocks import displace
from evolvent.model import MODEL
from evolvent.solvers.time.explicit.events import WORKSPACE
from evolvent.solvers.time.explicit.fastest_modes import STEP
from evolvent.solvers.time.explicit.loop import advance

_INTEGERS_3D = types.int64[:, :, ::1]
#: Natural logarithm of a normal deviate that is smaller only once in a million draws, with its sign changed.
UNLIKELY = 14.0
#: Products of the matrices by a vector after which the plan finds the frequency.
MOST = 24


class Tableau(Struct):
    """Numbers of a method, as arguments of `loop.advance`; tolerances: relative and absolute."""

    A: np.ndarray = array(2)
    b: np.ndarray = array(1)
    c: np.ndarray = array(1)
    error: np.ndarray = array(1)
    dense: np.ndarray = array(2)
    inner: np.ndarray = array(2)
    tolerances: np.ndarray = array(1)


def tableau_of(run: Any) -> Tableau:
    """Numbers of the method of a run."""
    own = run.tableau
    values = {name: getattr(own, name) for name in ("A", "b", "c", "error", "dense", "inner")}
    return Tableau(tolerances=np.array([run.plan.rtol, run.plan.atol]), **values)


TABLEAU = Tableau._numba_type_
_model_at, _work_at = at_address(MODEL), at_address(WORKSPACE)


@indirect(void(TABLEAU, INTEGERS, INTEGERS, INTEGERS, INTEGERS, INTEGERS))
def advance_many(tableau, which, models, works, codes, budgets):
    """Go on with some copies.

    Parameters
    ----------
    which : (k,) int, numbers of the copies
    models, works : (n,) int, addresses of the structs of all copies
    codes : (n,) int, output: what `advance` returns
    budgets : (n,) int, steps
    """
    A, b, c, E, P, Q = tableau.A, tableau.b, tableau.c, tableau.error, tableau.dense, tableau.inner
    rtol, atol = tableau.tolerances[0], tableau.tolerances[1]
    for k in which:
        model = _model_at(models[k])
        model.info.stepping = 1
        codes[k] = advance(A, b, c, E, P, Q, rtol, atol, model, _work_at(works[k]), budgets[k])
        model.info.stepping = 0


@indirect(void(INTEGERS, INTEGERS, MATRIX, CUBE, _INTEGERS_3D, CUBE))
def inventories_many(which, models, times, Y, S, sums):
    """Write energies and momenta (`equations.inventory`) of several states of several copies to `sums`.

    Parameters
    ----------
    which : (k,) int, numbers of the copies
    models : (n,) int, addresses of the models of all copies
    times : (k, nt) float, s
    Y, S : (k, nt, ny) float and (k, nt, ns) int, states and switches
    sums : (k, nt, N_INVENTORY) float, output
    """
    for i in range(which.size):
        model = _model_at(models[which[i]])
        for n in range(times.shape[1]):
            inventory(times[i, n], Y[i, n], S[i, n], model, sums[i, n])


@indirect(void(INTEGERS, INTEGERS, VECTOR, INTEGERS, MATRIX, VECTOR, VECTOR, MATRIX, MATRIX, REAL, INTEGERS))
def bound_many(which, models, y, s, moves, scale, start, rates, states, most, codes):
    """Whether the frequencies and damping rates of some copies are surely below `most`, rad/s, 1 or 0 to `codes`.

    Parameters
    ----------
    models : (n,) int, addresses of the models of all copies
    y, s : (ny,) float and (ns,) int, state at the start
    moves : (2, nv) float, 1 where coordinates are displaced, and where rates are; else 0
    scale : (nv,) float, factors of the rates by which their sizes are comparable
    start : (nv,) float, normal deviates
    rates, states : (3, nv) and (2, ny) float, scratch
    """
    n_v = start.size
    x, d, a, moved, dy = rates[0], rates[1], rates[2], states[0], states[1]
    for k in which:
        model = _model_at(models[k])
        n_q = model.info.nq
        codes[k] = 1
        for what in range(2):  # M^-1 K, M^-1 C
            goal = (2.0 - what) * math.log(most)
            for i in range(n_v):
                x[i] = start[i] / scale[i]
            grown, is_below = 0.0, False
            for j in range(1, MOST + 1):
                largest = 0.0
                for i in range(n_v):
                    x[i] *= moves[1, i]
                    largest = max(largest, abs(x[i]))
                for sign in (-1.0, 1.0):
                    for i in range(n_v):
                        d[i] = sign * STEP * x[i] / largest
                    for i in range(y.size):
                        moved[i] = y[i]
                    if what == 0:
                        for i in range(n_v):
                            d[i] *= moves[0, i]
                        displace(y, d, False, model, moved)
                    else:
                        for i in range(n_v):
                            moved[n_q + i] += d[i]
                    rhs(0.0, moved, s, model, dy)
                    for i in range(n_v):
                        a[i] = -dy[n_q + i] if sign < 0.0 else 0.5 * largest / STEP * (a[i] + dy[n_q + i])
                total = 0.0
                for i in range(n_v):
                    x[i] = moves[1, i] * a[i]
                    total += (scale[i] * x[i]) ** 2
                if total == 0.0:
                    is_below = True
                    break
                total = math.sqrt(total)
                grown += math.log(total)
                if not math.isfinite(grown):
                    break
                if grown + UNLIKELY <= j * goal:
                    is_below = True
                    break
                for i in range(n_v):
                    x[i] /= total
            if not is_below:
                codes[k] = 0
                break
