"""Parameters of a hysteresis from a measured loop: its elastic curve and its bristles, by least squares."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import scipy

from evolvent.kernels.bristle import DAHL, SLIP, bristle_between
from evolvent_base.errors import InputError

Array = np.ndarray
#: Ways after which the bristles of an identification slip, of the loop's whole range: places that they may take.
DEFLECTIONS = 0.25 * np.geomspace(0.02, 1.0, 12)
#: Rows of an identified elastic curve.
ROWS = 9
#: What the ends of a loop may be apart, of its range; stiffness of a bristle, of the sum, that is left out.
_CLOSED, _LEAST = 0.01, 1e-6
#: Weight of the bristles' largest forces beside the misfit of all rows: of what rows do not tell apart, the smaller.
_SMALL = 1e-3


@dataclasses.dataclass(frozen=True)
class Hysteresis:
    """An identified loop.

    Attributes
    ----------
    x, torque : (n,) float, elastic curve
    bristles : list of (stiffness, largest force)
    misfit : float, root mean square of the difference, of the range of the torques
    """

    x: Array
    torque: Array
    bristles: list[tuple[float, float]]
    misfit: float


def bristle(kind: int, stick: float, limit: float, start: float, moved: float) -> float:
    """Force of a bristle behind a way that goes one way."""
    law: Any = bristle_between
    return float(getattr(law, "py_func", law)(kind, stick, limit, start, moved)[0])


def identified(key: str, loop: Array, law: str, misfit: float) -> Hysteresis:
    """Elastic curve and bristles whose loop is nearest to a measured one.

    Parameters
    ----------
    key : str, for messages
    loop : (n, 2) float, coordinate and torque, in the order of the measurement, round a closed loop
    law : "slip" or "dahl", of the bristles
    misfit : float, the largest that is accepted

    Raises
    ------
    InputError
        If the loop is not closed, does not turn back, or is not met.

    Notes
    -----
    The torque is linear in the rows of the elastic curve and, for given ways after which they slip, in the bristles'
    stiffnesses, which are not negative. The ways are those of a grid (`DEFLECTIONS`), so that this is a linear problem
    with bounds; a small weight on the bristles' forces chooses among what the rows do not tell apart. Bristles without
    torque go round the loop twice; the second time counts.
    """
    x, torque = loop.T
    span = float(np.ptp(x))
    if span == 0.0 or abs(x[-1] - x[0]) > _CLOSED * span:
        raise InputError(f"{key} starts at {x[0]:.6g} and ends at {x[-1]:.6g}; a loop ends where it starts")
    ways = np.append(np.diff(x), 0.0)
    if np.all(ways >= 0.0) or np.all(ways <= 0.0):
        raise InputError(f"{key} goes one way; a loop has a way there and one back")
    kind = {"slip": SLIP, "dahl": DAHL}[law]
    found = np.zeros((x.size, DEFLECTIONS.size))
    for i, way in enumerate(span * DEFLECTIONS):
        force = 0.0
        for _ in range(2):
            for n in range(x.size):
                found[n, i] = force
                force = bristle(kind, 1.0, way, force, float(ways[n]))
    rows = np.linspace(x.min(), x.max(), min(ROWS, np.unique(x).size))
    hats = np.array([np.interp(x, rows, e) for e in np.eye(rows.size)]).T
    least = np.concatenate([np.full(rows.size, -np.inf), np.zeros(DEFLECTIONS.size)])
    small = np.hstack([np.zeros((DEFLECTIONS.size, rows.size)), np.diag(_SMALL * np.sqrt(x.size) * span * DEFLECTIONS)])
    A, b = np.vstack([np.hstack([hats, found]), small]), np.append(torque, np.zeros(DEFLECTIONS.size))
    solved = scipy.optimize.lsq_linear(A, b, bounds=(least, np.inf), tol=1e-14).x
    stiffness = solved[rows.size :]
    kept = stiffness > _LEAST * stiffness.sum()
    off = float(np.sqrt(np.mean((hats @ solved[: rows.size] + found @ stiffness - torque) ** 2)))
    part = off / max(float(np.ptp(torque)), 1e-300)
    if not part <= misfit:
        raise InputError(
            f"{key} is met to {part:.3g} of its height, the range of its torques, by the law {law!r}, not to "
            f"{misfit:g}; give bristles, or a larger misfit"
        )
    pairs = [(float(k), float(k * span * d)) for k, d in zip(stiffness[kept], DEFLECTIONS[kept], strict=True)]
    return Hysteresis(rows, solved[: rows.size], pairs, part)
