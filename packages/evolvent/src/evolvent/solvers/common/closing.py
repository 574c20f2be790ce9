"""Projection of the positions and velocities at the start onto the constraints.

Parts are placed by numbers with a few digits: a gap of 1e-9 m is no error of a model, but a step of 1e-8 s that ends on
the constraints closes it at 0.1 m/s. Velocities at the end of a run by midpoints miss the constraints by an error of
second order in its step.
"""

from __future__ import annotations

import dataclasses

import numpy as np
import scipy

from evolvent import model as mdl
from evolvent.algebra import sparse_lu
from evolvent.algebra.sparse import SparseBlocks
from evolvent.assembly import needs
from evolvent.assembly.assembled import Assembly
from evolvent.equations.implicit import measure_constraints
from evolvent.kernels.blocks import displace
from evolvent.solvers.common.redundancy import is_held, write_tangent

Array = np.ndarray
#: Gap beside the size of the system that is round-off, and most corrections.
_ROUND_OFF, _MOST = 1e-13, 3


def closed(model: mdl.Model, matrix: SparseBlocks, t: float, y: Array, inertia: tuple[float, float]) -> Array:
    """The nearest state by the masses whose positions meet the constraints at t; `y` itself where they do to round-off.

    Parameters
    ----------
    model : which may be evaluated
    matrix : its tangent's room; the entries are lost
    y : (ny,) float, state, whose gaps are those that `start.check_start` allows
    inertia : c_mass (1/s2) so great that stiffness does not count, and a typical mass (kg)
    """
    n_q, n_v = int(model.info.nq), int(model.info.nv)
    rows, (c_mass, mass) = model.constraints, inertia
    held, scale = is_held(rows, t), c_mass * mass
    length = max(1.0, float(np.abs(y[:n_q]).max(initial=0.0)))
    best, now, least = y, y, np.inf
    model.info.compliance = 1.0 / scale
    for k in range(_MOST + 1):
        write_tangent(model, matrix, t, now, c_mass, scale)
        gaps = np.where(held, rows["gap"], 0.0)
        off = float(np.abs(gaps).max(initial=0.0))
        if not off < 0.5 * least:
            break
        best, least = now, off
        if off <= _ROUND_OFF * length or k == _MOST or sparse_lu.factor(matrix) != 0:
            break
        x = np.concatenate([np.zeros(n_v), -scale * gaps])
        sparse_lu.solve(matrix, x)
        now = best.copy()
        displace(best, x[:n_v].copy(), False, model, now)
    return best


def project_velocities(assembly: Assembly, most: float) -> Assembly:
    """The assembly with velocities that satisfy the constraints at the start: the smallest change by least squares.

    Parameters
    ----------
    assembly : Assembly; released constraint rows end before the start
    most : float, largest violation that is corrected, relative to the larger of 1 and the largest velocity; larger
        ones stay, and the methods refuse them by name
    """
    model, y, rows = assembly.model, assembly.y.copy(), assembly.model.constraints
    held = np.flatnonzero((rows["stiffness"] == 0.0) & (rows["until"] >= 0.0))
    if not held.size:
        return assembly
    v = y[int(model.info.nq) :][: int(model.info.nv)]
    needs.load(model, measure_constraints)

    def rates() -> Array:
        measure_constraints(0.0, y, model)
        return np.array(rows["rate"][held])

    missed, columns = rates(), []
    if np.abs(missed).max() > most * max(1.0, np.abs(v).max()):
        return assembly
    for k in range(v.size):
        kept = v[k]
        v[k] = kept + 1.0
        columns.append(scipy.sparse.csc_array((rates() - missed)[:, None]))
        v[k] = kept
    found = scipy.sparse.linalg.lsqr(scipy.sparse.hstack(columns).tocsr(), -missed, atol=1e-14, btol=1e-14)
    v += found[0]
    return dataclasses.replace(assembly, y=y)
