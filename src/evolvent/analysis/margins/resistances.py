"""Harnesses, tape-spring hinges and adhesions along a coordinate: their curves, and bristles that slip.

The elastic curve of a harness helps or resists; its bristles slip against the direction and resist in full, wherever
they stand. So they are two shares.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from evolvent.analysis.margins.shares import HYSTERESIS
from evolvent.kernels import resistance

if TYPE_CHECKING:
    from evolvent.analysis.margins.mechanism import Direction, Mechanism, Position
    from evolvent.analysis.margins.shares import Share

Array = np.ndarray
#: Rate of a coordinate, beside that of the direction, below which it does not move.
_OFF = 1e-7


def _row(mechanism: Mechanism, share: Share) -> Any:
    (row,) = (mechanism.whole.resistances[k] for k in share.rows)
    return row


def _curve(mechanism: Mechanism, row: Any) -> Any:
    """The curve of a resistance now."""
    return mechanism.whole.curves[int(row["curve"]) + int(mechanism.bare.switches[row["switch"]])]


def set_curve(mechanism: Mechanism, share: Share, at: Position, *, still: bool) -> None:
    """Let the curve of a resistance be that of a position: at rest that of the start, or the one behind its end."""
    row, switches = _row(mechanism, share), mechanism.bare.switches
    x = float(at.x[int(row["coordinate"])])
    if still:
        switches[row["switch"]] = mechanism.assembly.s[row["switch"]]
    curve = _curve(mechanism, row)
    if not curve["low"] <= x <= curve["high"]:
        switches[row["switch"]] = curve["below" if x < curve["low"] else "above"]


def force(mechanism: Mechanism, share: Share, at: Position, direction: Direction, model: Any) -> Array:
    """Generalised forces of a resistance's share on the left of the equations, with those of the bare model: (nv,).

    Parameters
    ----------
    model : the bare model with its record
    """
    row = _row(mechanism, share)
    k = int(row["coordinate"])
    own, rate = mechanism.bare.bristles[int(row["first"]) : int(row["last"])], float(direction.rates[k])
    if share.aspect == HYSTERESIS:
        limit = 0.0 if abs(rate) <= _OFF else math.copysign(math.fsum(own["limit"]), rate)
        return np.asarray(at.zero + limit * at.J[k])
    own["before"], own["force0"] = at.x[k], 0.0
    return mechanism.left(at.t, at.y, model)[: mechanism.n_v]


def before_breaking(mechanism: Mechanism, share: Share, at: Position, direction: Direction) -> float:
    """Power (N m or N) that an adhesion takes at most before it breaks in a direction; 0 of what does not hold."""
    row = _row(mechanism, share)
    curve, rate = _curve(mechanism, row), float(direction.rates[int(row["coordinate"])])
    end = float(curve["high" if rate > 0.0 else "low"])
    if row["kind"] != resistance.ADHESION or abs(rate) <= _OFF or not math.isfinite(end):
        return 0.0
    x, torque = mechanism.whole.parameters[int(curve["first"]) :][: 2 * int(curve["count"])].reshape(2, -1)
    return rate * float(np.interp(end, x, torque))
