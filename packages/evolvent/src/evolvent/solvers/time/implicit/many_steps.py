"""Compiled loops over copies of an implicit run, which share no memory that they write to."""

from __future__ import annotations

from numba import types, void

from evolvent.algebra.sparse import SPARSE
from evolvent.compiled.jit import INTEGERS, VECTOR, indirect
from evolvent.compiled.pointer import at_address
from evolvent.model import MODEL
from evolvent.solvers.time.implicit.loop import advance, begin, restart
from evolvent.solvers.time.implicit.workspace import WORKSPACE

_I = types.int64
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


@indirect(void(INTEGERS, VECTOR, INTEGERS, INTEGERS, INTEGERS, INTEGERS))
def restart_many(which, after, models, matrices, works, codes):
    """Start some copies of generalized-alpha again just `after` the time reached, (n,) s (see `begin_many`)."""
    for k in which:
        codes[k] = restart(after[k], _model_at(models[k]), _matrix_at(matrices[k]), _work_at(works[k]))
