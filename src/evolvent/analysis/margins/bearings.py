"""Friction of bearings along a coordinate: by the reactions at a station, or by those of a simulated motion.

Notes
-----
At a station the mechanism stands: its coordinates are held by torques, what nothing holds is accelerated. Of all forces
Q, on the left of the equations, the multipliers la of the joints and the torques are those that leave the least force,
beside the mass matrix M: with the gradients A of joints, loops of cables and held coordinates, |Q + A^T la| in M^-1 is
least. Friction at its limit, the static one, against the direction is among Q, so it is found by iteration.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from evolvent.base.errors import InputError
from evolvent.kernels.bearing import measure_load

if TYPE_CHECKING:
    from evolvent.analysis.margins.mechanism import Direction, Mechanism, Position
    from evolvent.analysis.margins.shares import Share

Array = np.ndarray

#: Rate of a bearing, beside that of the coordinate, below which it does not move; what friction may be off in the end.
_STILL, _OFF = 1e-7, 1e-12
#: Rank of what holds the mechanism, beside the largest singular value.
_RANK = 1e-10
#: Iterations to the friction at a station.
_MOST = 500


def powers(
    mechanism: Mechanism, shares: list[Share], direction: Direction, at: Position, rows: list[int], la: Array | None
) -> dict[str, float]:
    """Virtual power of friction in each bearing, by the label of its share: N m or N, below 0.

    Parameters
    ----------
    rows : coordinates that are held at a station, the one with the margin among them
    la : (nj,) float, multipliers of the joints in a motion; None at a station

    Raises
    ------
    InputError
        Where bearings lock themselves: friction makes reactions that make more friction.
    """
    own = [share for share in shares if share.family == "bearings"]
    if not own:
        return {}
    rates = direction.rates[mechanism.whole.bearings["coordinate"]]
    rates = np.where(np.abs(rates) > _STILL, rates, 0.0)
    if la is None:
        torques = _at_rest(mechanism, shares, direction, at, rows, rates)
    else:
        torques = mechanism.whole.bearings["coefficient"] * _loads(mechanism, at, la)
    found = -np.abs(rates) * torques
    return {share.label: math.fsum(found[list(share.rows)]) for share in own}


def _loads(mechanism: Mechanism, at: Position, la: Array) -> Array:
    """Loads of all bearings with the multipliers la: (n,), m N or N."""
    model = mechanism.bare._replace(bearings=mechanism.whole.bearings.copy())
    la = np.ascontiguousarray(la, dtype=float)
    mechanism.left(at.t, at.y, mechanism.bare, la=la)
    for k in range(model.bearings.size):
        measure_load(k, la, model)
    return np.array(model.bearings["load"])


def _at_rest(
    mechanism: Mechanism, shares: list[Share], direction: Direction, at: Position, rows: list[int], rates: Array
) -> Array:
    """Torques or forces of all bearings at the limit of sticking, where the mechanism stands: (n,)."""
    bearings, n_j = mechanism.whole.bearings, mechanism.n_j
    others = [share for share in shares if share.family != "bearings"]
    Q = sum((mechanism.force(share, at, direction, still=True) for share in others), np.zeros(mechanism.n_v))
    A = np.vstack([at.G, mechanism.tied(at.J), at.J[rows]])
    L = np.linalg.cholesky(at.mass)
    gradients, J = np.linalg.pinv(np.linalg.solve(L, A.T), rcond=_RANK), at.J[bearings["coordinate"]]
    torques = np.zeros(bearings.size)
    for _ in range(_MOST):
        la = -gradients @ np.linalg.solve(L, Q + (np.sign(rates) * torques) @ J)
        before, torques = torques, bearings["static"] * _loads(mechanism, at, la[:n_j])
        if not np.all(np.isfinite(torques)):
            break
        if np.abs(torques - before).max() <= _OFF * np.abs(torques).max():
            return torques
    name = next(share.part for share in shares if share.family == "bearings")
    raise InputError(
        f"the friction of {name!r} and the reactions that it makes grow without an end: the mechanism locks itself at "
        f"{float(at.x[rows[0]]):.6g} {mechanism.unit(rows[0])}"
    )
