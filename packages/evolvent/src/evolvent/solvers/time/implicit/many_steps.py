"""Compiled loops over copies of an implicit run, which share no memory that they write to."""

from __future__ import annotations

from numba import types, void

from evolvent.algebra.sparse import SPARSE
from evolvent.algebra.sparse_lu import factor
from evolvent.compiled.jit import INTEGERS, MATRIX, REAL, VECTOR, indirect
from evolvent.compiled.pointer import at_address, number_at, put_number_at
from evolvent.equations.implicit import measure_constraints, residual, tangent
from evolvent.model import MODEL
from evolvent.solvers.time.implicit.alpha_tangent import SHORT
from evolvent.solvers.time.implicit.loop import advance, begin, restart
from evolvent.solvers.time.implicit.workspace import WORKSPACE

_I, _INTEGERS_2D = types.int64, types.Array(types.int64, 2, "C")
_model_at, _matrix_at, _work_at = at_address(MODEL), at_address(SPARSE), at_address(WORKSPACE)


@indirect(void(INTEGERS, INTEGERS, INTEGERS, INTEGERS, INTEGERS))
def begin_many(which, models, matrices, works, codes):
    """Start the loops of some copies; `codes` get what `begin` returns.

    Parameters
    ----------
    which : (k,) int, numbers of the copies
    models, matrices, works : (n,) int, addresses of the structs of all copies
    codes : (n,) int, output
    """
    for k in which:
        codes[k] = begin(_model_at(models[k]), _matrix_at(matrices[k]), _work_at(works[k]))


@indirect(void(INTEGERS, INTEGERS, INTEGERS, INTEGERS, INTEGERS, _I))
def advance_many(which, models, matrices, works, codes, budget):
    """Go on with some copies for `budget` steps each; `codes` get what `advance` returns (see `begin_many`)."""
    for k in which:
        codes[k] = advance(_model_at(models[k]), _matrix_at(matrices[k]), _work_at(works[k]), budget)


@indirect(
    void(INTEGERS, VECTOR, INTEGERS, INTEGERS, INTEGERS, _INTEGERS_2D, _I, MODEL, VECTOR, VECTOR, VECTOR, INTEGERS)
)
def count_open(which, after, models, matrices, works, moves, origin, apart, la, dv, r, codes):
    """Number of unknowns that the constraints of some copies leave open (`redundancy.undetermined`), to `codes`.

    Parameters
    ----------
    after : (n,) float, s, times just after those reached
    moves : (m, 3) int, address in `apart`, address in a placed copy, and words of what a model that may be evaluated
        takes over; origin : address of that copy's model
    apart : that model
    la, dv, r : (nj,), (nv,) and (nv + nj,) float, zeros and scratch
    """
    for k in which:
        model, matrix, work = _model_at(models[k]), _matrix_at(matrices[k]), _work_at(works[k])
        for j in range(model.constraints.size):
            model.constraints[j].slack = 0.0
        model.info.redundant, model.info.exact = 0, 1
        for i in range(moves.shape[0]):
            to, of = moves[i, 0], moves[i, 1] + models[k] - origin
            for w in range(moves[i, 2]):
                put_number_at(to + 8 * w, number_at(of + 8 * w))
        c_mass = SHORT / (work.options.span * work.options.span)
        powers = apart.powers
        residual(after[k], work.y, dv, la, 0.0, 1.0, apart, r, powers)
        tangent(after[k], work.y, la, c_mass, 0.0, c_mass * work.options.mass, apart, matrix)
        codes[k] = factor(matrix)


@indirect(void(INTEGERS, REAL, VECTOR, VECTOR, _INTEGERS_2D, INTEGERS, MATRIX, MODEL, INTEGERS))
def misfit_many(which, t, y, most, moves, places, numbers, apart, codes):
    """Number of constraints that the start of some copies does not meet (`start.check_start`), to `codes`.

    Parameters
    ----------
    t : float, s; y : (ny,) float, the start
    most : (2,) float, as of `start.misfits`
    moves : (m, 3) int, address in `apart`, address in the model of all copies, and words of what the former takes over
    places : (p,) int, addresses in `apart`; numbers : (n, p) float, what each copy has there, integers by their bits
    apart : model that may be evaluated
    """
    for k in which:
        for i in range(moves.shape[0]):
            for w in range(moves[i, 2]):
                put_number_at(moves[i, 0] + 8 * w, number_at(moves[i, 1] + 8 * w))
        for i in range(places.size):
            put_number_at(places[i], numbers[k, i])
        measure_constraints(t, y, apart)
        codes[k] = 0
        for j in range(apart.constraints.size):
            row = apart.constraints[j]
            if row.stiffness == 0.0 and t <= row.until and not (abs(row.gap) <= most[0] and abs(row.rate) <= most[1]):
                codes[k] += 1


@indirect(void(INTEGERS, VECTOR, INTEGERS, INTEGERS, INTEGERS, INTEGERS))
def restart_many(which, after, models, matrices, works, codes):
    """Start some copies of generalized-alpha again just `after` the time reached, (n,) s (see `begin_many`)."""
    for k in which:
        codes[k] = restart(after[k], _model_at(models[k]), _matrix_at(matrices[k]), _work_at(works[k]))
