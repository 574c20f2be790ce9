"""Explicit Runge-Kutta methods as data."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class Method(NamedTuple):
    """A Runge-Kutta method as data.

    Attributes
    ----------
    A, b, c : tableau
    error : (s,) float, b - b_hat, by which steps adapt; (0,) of methods with fixed steps
    dense : (s, 4) float, continuous extension y(t + th h) = y + h sum_i P_i(th) k_i, th^1 .. th^4; (0, 4) without
    inner : (s, 4) float, one in which events are looked for, of a lower order in methods with fixed steps
    safety : float, share of the stability limit that an automatic step takes. RK4 damps the ringing that every release
        leaves in a thread: at 0.42 that costs the heliogyro 0.92e-6 of its energy, at 0.8 1.5e-6
    """

    name: str
    A: np.ndarray
    b: np.ndarray
    c: np.ndarray
    order: int
    error: np.ndarray = np.zeros(0)
    dense: np.ndarray = np.zeros((0, 4))
    inner: np.ndarray = np.zeros((0, 4))
    safety: float = 0.42

    @property
    def is_adaptive(self) -> bool:
        """Whether it chooses its steps by their error."""
        return bool(self.error.size)


def _method(name: str, order: int, rows: list[list[float]], b: list[float], inner: list[list[float]]) -> Method:
    A = np.zeros((len(b), len(b)))
    for i, row in enumerate(rows):
        A[i + 1, : len(row)] = row
    return Method(name, A, np.array(b), A.sum(axis=1), order, inner=np.array(inner))


#: Heun's method, the explicit trapezoid (Hairer, Norsett, Wanner, Solving ODEs I, II.1).
HEUN = _method("heun", 2, [[1.0]], [0.5, 0.5], [[1.0, -0.5, 0.0, 0.0], [0.0, 0.5, 0.0, 0.0]])._replace(safety=0.5)
#: The classical fourth-order method (ibid., table 1.2); its continuous extension has the third order (ibid., II.6).
RK4 = _method(
    "rk4", 4, [[0.5], [0.0, 0.5], [0.0, 0.0, 1.0]], [1 / 6, 1 / 3, 1 / 3, 1 / 6],
    [[1.0, -3 / 2, 2 / 3, 0.0], [0.0, 1.0, -2 / 3, 0.0], [0.0, 1.0, -2 / 3, 0.0], [0.0, -1 / 2, 2 / 3, 0.0]],
)  # fmt: skip
#: b - b_hat of the Dormand-Prince pair.
_ERROR = np.array([71 / 57600, 0.0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40])
#: Continuous extension of order 4 of that pair (ibid., II.6, eq. 6.12).
_DENSE = np.array(
    [
        [1.0, -8048581381 / 2820520608, 8663915743 / 2820520608, -12715105075 / 11282082432],
        [0.0, 0.0, 0.0, 0.0],
        [0.0, 131558114200 / 32700410799, -68118460800 / 10900136933, 87487479700 / 32700410799],
        [0.0, -1754552775 / 470086768, 14199869525 / 1410260304, -10690763975 / 1880347072],
        [0.0, 127303824393 / 49829197408, -318862633887 / 49829197408, 701980252875 / 199316789632],
        [0.0, -282668133 / 205662961, 2019193451 / 616988883, -1453857185 / 822651844],
        [0.0, 40617522 / 29380423, -110615467 / 29380423, 69997945 / 29380423],
    ]
)
#: Dormand and Prince (1980), fifth order with an embedded fourth (ibid., table 5.2).
DOPRI5 = _method(
    "dopri5",
    5,
    [
        [1 / 5],
        [3 / 40, 9 / 40],
        [44 / 45, -56 / 15, 32 / 9],
        [19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729],
        [9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656],
        [35 / 384, 0.0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84],
    ],
    [35 / 384, 0.0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84, 0.0],
    _DENSE.tolist(),
)._replace(error=_ERROR, dense=_DENSE)
#: Methods by name.
METHODS = {method.name: method for method in (HEUN, RK4, DOPRI5)}
