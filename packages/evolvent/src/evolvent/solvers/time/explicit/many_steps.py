"""Compiled loop over copies of an explicit run, which share no memory that they write to."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import void

from evolvent.compiled.jit import INTEGERS, indirect
from evolvent.compiled.pointer import Struct, array, at_address
from evolvent.model import MODEL
from evolvent.solvers.time.explicit.events import WORKSPACE
from evolvent.solvers.time.explicit.loop import advance


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
