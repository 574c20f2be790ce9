"""Quantities of the field, from what the parts of a run observe, and warnings about the run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from evolvent import model as mdl
from evolvent.families.bodies.observer import observe_body
from evolvent.families.threads.observer import observe_thread
from evolvent.results.observe import View
from evolvent.results.observe.variables import unwrapped
from evolvent.solvers.common import balance as eb
from evolvent.solvers.common.limits import pushing
from evolvent_papers.heliogyro import free_body
from evolvent_papers.heliogyro.case import Case
from evolvent_papers.heliogyro.straight import straight_inertia

if TYPE_CHECKING:
    from evolvent.solvers import Solution

Array = np.ndarray
#: Share of the energy at the start that its balance may lack without a warning.
LARGEST_DEFECT = 1e-5
#: Share of the largest rate of the spools below which they stand still.
STILL = 1e-9


def derived(case: Case, solution: Solution) -> dict[str, tuple[tuple[str, ...], Array, str, str]]:
    """Rate and angle of the body beside both formulas, what blades reach, and parts of the angular momentum."""
    view, N, time, H = View(solution), case.body.blades, ("time",), "kg m2 s-1"
    names = [name for name in (f"blade-{k + 1}" for k in range(N)) if name in solution.assembly.names]
    blades = [observe_thread(view, name).variables for name in names]

    def over_blades(name: str) -> Array:
        values = np.stack([blade[name].values for blade in blades], axis=1)
        return np.broadcast_to(values, (values.shape[0], N)).copy()  # one blade may stand for all

    R = view.pose(view.index("body")).R
    rate = observe_body(view, "body").variables["rate"].values[:, 2]
    deployed, gone = over_blades("deployed_length"), over_blades("separated") > 0.0
    angle = unwrapped(solution.t, np.arctan2(R[:, 1, 0], R[:, 0, 0]), rate)
    found: dict[str, tuple[tuple[str, ...], Array, str, str]] = {
        "blade": (("blade",), np.arange(1, N + 1), "1", "blade"),
        "body_rate": (time, rate, "rad s-1", "rate of the body about its spin axis"),
        "body_angle": (time, angle, "rad", "angle of the body about Z, over any number of turns"),
    }
    for name in ("tip_lag", "deployed_length", "hub_tension"):
        found[name] = (("time", "blade"), over_blades(name), blades[0][name].units, blades[0][name].long_name)
    for key, lag, where in (
        ("tip", found["tip_lag"][1], "of the tip"), ("hub", hub_lag(blades, N), "at the spool"),
    ):  # fmt: skip
        found[f"residual_swing_{key}"] = (
            (), np.array(residual(solution, lag)), "rad", f"largest lag {where} since the spools stand still",
        )  # fmt: skip
    if case.spin_up is not None:
        found["hub_lag"] = (("time", "blade"), hub_lag(blades, N), "rad", "lag of the blade where it leaves the spool")
    if case.body.motion != "driven" and case.spin_up is None:
        for name, corrected, what in (
            ("body_rate_paper", False, "rate of the body by (18)"),
            ("body_rate_corrected", True, "rate of the body by (18) with the offset of the spools"),
        ):
            inertia = straight_inertia(case, deployed, corrected=corrected)
            formula = np.where(gone.any(axis=1), np.nan, case.body.rate * inertia[0] / inertia)
            found[name] = (time, formula, "rad s-1", what)
    if case.body.motion == "free":
        found |= free_body.variables(case, view, blades)
    jumps = solution.momentum.jumps_angular - solution.momentum.jumps_angular[:1]
    ignored = "" if case.carried else " (ignored by the model)"
    for name, values, what in (
        ("body", solution.sums[:, mdl.H_BODY :], "of the body"),
        ("released", solution.sums[:, mdl.H_RELEASED :], "of the released thread"),
        ("wound", solution.sums[:, mdl.H_WOUND :], f"of the wound thread{ignored}"),
        ("jumps", jumps, "that releases brought in"),
    ):
        found[f"angular_momentum_{name}"] = (time, values[:, 2], H, f"angular momentum about Z {what}")
    has_force = "loads" in {family for family, _ in solution.assembly.names.values()}
    if case.body.motion != "driven" and not has_force:
        first = 0 if case.body.motion == "free" else 2
        lost = np.linalg.norm(solution.momentum.drift_angular[:, first:], axis=1)
        scale = float(np.linalg.norm(solution.momentum.angular[0]))
        text = "defect of the angular momentum balance, relative to its initial value"
        found["momentum_balance"] = (time, lost / scale if scale > 0.0 else lost, "1", text)
    return found


def residual(solution: Solution, lag: Array) -> float:
    """Largest size of lags (nt, blades) since the time from which all spools stand still, rad; NaN while one turns."""
    rates = np.abs(solution.observations.spool[:, :, 1]).max(axis=1)
    turning = np.flatnonzero(rates > STILL * rates.max(initial=0.0))
    after = lag[turning[-1] + 1 if turning.size else 0 :]
    return float(np.abs(after).max()) if after.size else np.nan


def hub_lag(blades: Sequence[Mapping[str, Any]], count: int) -> Array:
    """Lag at the spool of the node that left last, rad, (nt, count); NaN of a blade that has separated.

    At the moment of its release a node has no direction: the lag is that of the node before it then.
    """
    found = []
    for blade in blades:
        lags, released = blade["signed_lag"].values, blade["released"].values > 0.0
        last = np.maximum(released.sum(axis=1) - 1, 0)
        values, before = (np.take_along_axis(lags, np.maximum(last - k, 0)[:, None], axis=1)[:, 0] for k in (0, 1))
        values = np.where(np.isfinite(values), values, before)
        found.append(np.where(blade["separated"].values > 0.0, np.nan, values))
    return np.broadcast_to(np.stack(found, axis=1), (found[0].size, count)).copy()


def findings(case: Case, solution: Solution) -> tuple[dict[str, tuple[tuple[str, ...], Array, str, str]], str]:
    """What `derived` returns, and sentences of warning.

    They are on tensions below zero, pay-out or spin-up too fast for a steady lag, and an energy balance that is off.
    """
    found = derived(case, solution)
    lag = found["hub_lag"][1] if "hub_lag" in found else None
    texts = [pushing(solution, 0.0), _wraps(case, solution), _winds(lag, solution), _lacks(solution)]
    return found, "; ".join(text for text in texts if text)


def _wraps(case: Case, solution: Solution) -> str:
    fastest = case.spool.radius * float(solution.observations.spool[:, :, 1].max())
    limit = 0.5 * case.body.spool_offset * abs(case.body.rate)
    if fastest < limit or limit == 0.0:
        return ""
    return (
        f"the pay-out speed of {fastest:.4g} m/s is not below L0 W0 / 2 = {limit:.4g} m/s: no steady lag exists, "
        f"the blade may wrap back onto the body, which the model does not see"
    )


def _winds(lag: Array | None, solution: Solution) -> str:
    """Whether a spin-up torque makes a blade wind onto the body: lags at the spools, None without a torque."""
    if lag is None:
        return ""
    beyond = np.flatnonzero((np.abs(lag) >= 0.5 * np.pi).any(axis=1))
    if not beyond.size:
        return ""
    return (
        f"the lag at the spool reaches 90 deg at {solution.t[beyond[0]]:.4g} s: the blade winds onto the body, which "
        f"the model does not see"
    )


def _lacks(solution: Solution) -> str:
    balance = solution.balance
    values = (eb.energy(balance), eb.dissipated(balance), *(balance[name] for name in eb.WORK))
    largest = max(1e-300, *(float(np.abs(v).max()) for v in values))
    lacks = float(np.abs(solution.energy_defect).max()) / (float(solution.energy[0]) or largest)
    if lacks <= LARGEST_DEFECT:
        return ""
    smaller = "solver.rtol" if solution.method == "dopri5" else "solver.step"
    return f"the energy balance is off by up to {lacks:.2g} of the energy at the start; use a smaller {smaller}"
