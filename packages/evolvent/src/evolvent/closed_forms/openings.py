"""How a rib that springs off its hub opens its hinge: a straight tail with drag, then a damper, then a latch."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import scipy

from evolvent.closed_forms.strips import Strip, deployment_speed

#: Length of the tail, of the rib's, from which on its motion is integrated; before it drag has done nothing.
FIRST = 1e-3


class Opening(NamedTuple):
    """The motion of a rib up to its latch.

    Attributes
    ----------
    unwound, latched : float, s, when all of it has left the hub, and when the hinge reaches its latch; infinite for
        never
    tip_speed, rate : float, m/s and rad/s, of the tip when all has left the hub, and of the rib at its latch
    """

    unwound: float
    latched: float
    tip_speed: float
    rate: float

    def moment(self, rib: Strip, turned: float) -> float:
        """Moment of a latched hinge, N m, once the rib has turned on by an angle, rad, up to half a turn.

        Parameters
        ----------
        rib : Strip, the rib and its hub
        turned : float, rad, from the latch on, up to pi

        Returns
        -------
        float, N m

        Notes
        -----
        The rib, long beside R, is a tail under the tension N = m L^2 W^2/2 that bends at its root as an elastica:
        EI k^2/2 = N (1 - cos turned) there, M = EI k = 2 sqrt(EI N) sin(turned/2). It turns on without losing much of
        its rate W: the moment takes 2 sqrt(6) (R/L)(1 - cos(turned/2)) of the rate of a rib without damping, for which
        it is sqrt(6) sin(turned/2) in units of the wound rib's EI/R, whatever length, mass and stiffness are.
        """
        tension = 0.5 * rib.line_density * (rib.length * self.rate) ** 2
        return 2.0 * math.sqrt(rib.bending_stiffness * tension) * math.sin(0.5 * turned)


def opening(rib: Strip, *, alpha: float = 0.0, damping: float = 0.0, turn: float = 0.5 * math.pi) -> Opening:
    """A rib that springs off its hub and turns in its hinge, by `turn`, until it latches.

    Parameters
    ----------
    rib : Strip, the rib and its hub
    alpha : float, 1/s, of drag on the whole rib
    damping : float, N m s, of a damper in the hinge; light, so that the root follows the rib
    turn : float, rad, from the tangent of the hub to the latch

    Returns
    -------
    Opening
        Times of the unwinding and of the latch, and the speeds then.

    Notes
    -----
    The straight tail of the length l, whose tip has the speed w, loses m l w^2/3 alpha by drag while it grows by
    R w/l: (l w^2)' = v^2 - 2 alpha l^2 w/R over l, v without drag (`deployment_speed`). When all has left the hub, the
    rib turns about its root with the inertia I = m L^3/3. Drag takes alpha of its rate in each radian and the damper
    damping/I, for its angular impulse is damping times the angle by which the root turns, whatever the rib's shape.
    """
    v, R, L = deployment_speed(rib), rib.radius, rib.length

    def rates(length: float, state: np.ndarray) -> list[float]:
        speed = math.sqrt(max(state[0] / length, 0.0))
        return [v * v - 2.0 * alpha * length**2 * speed / R, length / (R * speed)]

    first = FIRST * L
    start = [first * v * v, 0.5 * first**2 / (R * v)]
    found = scipy.integrate.solve_ivp(rates, (first, L), start, method="LSODA", rtol=1e-9, atol=1e-12 * L * v * v)
    unwound, tip_speed = float(found.y[1, -1]), math.sqrt(max(float(found.y[0, -1]) / L, 0.0))
    taken = alpha + damping / (rib.line_density * L**3 / 3.0)  # of the rate, in each radian
    rate, began = tip_speed / L - taken * turn, tip_speed / L
    if rate <= 0.0:
        return Opening(unwound, math.inf, tip_speed, 0.0)
    swing = turn / began if taken == 0.0 else math.log(began / rate) / taken
    return Opening(unwound, unwound + swing, tip_speed, rate)
