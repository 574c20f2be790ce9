"""The factored tangent of a step."""

from __future__ import annotations

from numba import types

from evolvent.algebra.sparse import SPARSE
from evolvent.compiled.jit import REAL, VECTOR, indirect, inlined
from evolvent.equations.implicit import tangent
from evolvent.model import MODEL
from evolvent.solvers.time.implicit.workspace import WORKSPACE, factor

_I = types.int64


@indirect(_I(REAL, VECTOR, VECTOR, REAL, REAL, REAL, MODEL, SPARSE, WORKSPACE))
def factor_at(t, y, la, c_mass, c_rate, scale, model, matrix, work):
    """Assemble and factor the matrix; returns what `sparse_lu.factor` returns."""
    info = model.info
    info.compliance = 1.0 / scale
    tangent(t, y, la, c_mass, c_rate, scale, model, matrix)
    return factor(matrix, work)


#: c_mass of a step too short to feel stiffness, times the square of a run's span.
SHORT = 1e16


@inlined
def short_c_mass(options):
    """c_mass of a step too short to feel stiffness."""
    return SHORT / (options.span * options.span)
