"""Compiled function of the forces on bodies that stand still, by the states of a finished run."""

from __future__ import annotations

from typing import Any

from numba import types, void

from evolvent.compiled.jit import INTEGERS, MATRIX, REAL, VECTOR, indirect
from evolvent.equations.implicit import residual
from evolvent.kernels.calls import scale_at
from evolvent.model import MODEL

_3D = types.Array(REAL, 3, "C")
_INTEGERS_2D = types.Array(types.int64, 2, "C")


@indirect(
    void(VECTOR, MATRIX, _INTEGERS_2D, MATRIX, VECTOR, VECTOR, INTEGERS, VECTOR, VECTOR, VECTOR, MODEL, _3D)
)  # fmt: skip
def fill_wrenches(
    times: Any, Y: Any, S: Any, LA: Any, factors: Any, parameters: Any, bodies: Any, a: Any, r: Any, powers: Any,
    model: Any, out: Any,
) -> None:  # fmt: skip
    """Forces of all other parts on bodies in the states Y, S, LA at `times`, without weights and inertia.

    Parameters
    ----------
    factors : (nt,) float, of loads, which are `parameters` at 1
    bodies : (k,) int
    a : (nv,) float, zeros; r : (nu,) float, powers : (N_POWERS,) float, scratch
    out : (nt, k, 6) float, N and N m, inertial axes, output; moments about the bodies' origins
    """
    calls = model.statics_scale_calls
    for n in range(times.size):
        for i in range(model.switches.size):
            model.switches[i] = S[n, i]
        for k in range(calls.size):
            scale_at(model, calls[k])(factors[n], parameters, model)
        residual(times[n], Y[n], a, LA[n], 0.0, factors[n], model, r, powers)
        for k in range(bodies.size):
            for i in range(6):
                out[n, k, i] = model.bodies[bodies[k]].F[i]
