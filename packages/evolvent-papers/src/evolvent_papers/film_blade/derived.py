"""Quantities of the field: length and spin, lag, twist and edgewise moment, and the limits of the pay-out rate."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from evolvent.closed_forms import payout_buckling, payout_buckling_modes, payout_slack
from evolvent.families.bodies.observer import observe_body
from evolvent.families.rods.observer import observe_rod
from evolvent.results.observe import View
from evolvent_papers.film_blade.case import BUCKLED, Case

if TYPE_CHECKING:
    from evolvent.solvers.common.solution import Solution

Array = np.ndarray


def derived(case: Case, solution: Solution) -> dict[str, tuple[tuple[str, ...], Array, str, str]]:
    """Variables over time, the length at which the blade buckles, and the closed forms at the last length."""
    view = View.of(solution)
    rate = observe_body(view, "body").variables["rate"].values[:, 2]
    blade = {name: one.values for name, one in observe_rod(view, "blade").variables.items()}
    out, twist = blade["deployed_length"], np.ptp(blade["twist_angle"], axis=1)
    x = blade["position"]
    radial, along = x[:, 0, :2], x[:, -1, :2] - x[:, 0, :2]
    across = radial[:, 0] * along[:, 1] - radial[:, 1] * along[:, 0]
    lag = -np.arctan2(across, np.sum(radial * along, axis=1))
    force = np.maximum(blade["axial_force"], 1e-12)
    moment = np.abs(blade["bending_moment_y"])
    share = np.where(blade["axial_force"] > 0.0, 6.0 * moment / (force * case.blade.width), 0.0).max(axis=1)
    share[:1] = 0.0  # the run starts without strain
    over = np.flatnonzero(twist > BUCKLED)
    first = float(out[over[0]]) if over.size else math.nan
    film, rotor, length, H, root = case.film, case.rotor, case.payout.length, case.momentum, case.blade.root
    modes = payout_buckling_modes(film, rotor, length, H, root=root)
    at_end = f"with {length:g} m out"
    fastest = 0.5 * H * rotor.offset / rotor.inertia

    def number(value: float) -> Array:
        return np.array(value, dtype=float)

    return {
        "deployed_length": (("time",), out, "m", "length of the blade that is out"),
        "body_rate": (("time",), rate, "rad s-1", "spin rate of the body"),
        "tip_lag": (("time",), lag, "rad", "lag of the tip, seen from the root"),
        "twist": (("time",), twist, "rad", "largest twist between two sections of the blade"),
        "edge_share": (("time",), share, "1", "largest edgewise moment over N w/6, from which on an edge is slack"),
        "buckled_length": ((), number(first), "m", "length out at which the twist passes 5 deg; NaN: it does not"),
        "limit_estimate": (
            (),
            number(payout_buckling(film, rotor, length, H, root=root)),
            "m s-1",
            f"largest pay-out rate without buckling {at_end}, closed form",
        ),
        "limit_modes": ((), number(modes), "m s-1", f"the same by Ritz's method {at_end}"),
        "limit_slack": (
            (),
            number(payout_slack(film, rotor, length, H, root=root)),
            "m s-1",
            f"largest pay-out rate without a slack edge {at_end}, closed form",
        ),
        "thread_lag": ((), number(case.steady_lag), "rad", "lag of a thread in steady pay-out at the rate"),
        "thread_limit": ((), number(fastest), "m s-1", "rate from which on a thread has no steady lag"),
    }
