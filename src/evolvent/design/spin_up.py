"""The largest torque that spins up a body with deployed blades before they wind onto it, over the blades' length."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from evolvent import cases, closed_forms
from evolvent.base.errors import InputError, RunFailed
from evolvent.design import links
from evolvent.results.figures import Figure, Line, Panel, stacked

Array = np.ndarray
#: Relative width at which the bisection ends; times that its bracket is widened.
WIDTH, MOST_WIDENED = 1e-3, 6
#: Samples of a run.
SAMPLES = 400


@dataclasses.dataclass(frozen=True)
class Permissible:
    """Permissible torques over the length of the blades.

    Attributes
    ----------
    length, rate : (n,) float, m and rad/s, of the blades, and of body and blades before the torque acts
    thread, rigid : (n,) float, N m, of the whole thread and of rigid blades with the same course of the torque
    slow : (n,) float, N m, of rigid blades in equilibrium (`closed_forms.slow_torque_limit`)
    ramp : float, s, over which the torque grows
    nodes : int, of the thread
    """

    length: Array
    rate: Array
    thread: Array
    rigid: Array
    slow: Array
    ramp: float
    nodes: int


def permissible_torque(
    case: Any,
    lengths: Sequence[float],
    overrides: Mapping[str, Any] | None = None,
    *,
    rate: float | None = None,
    ramp: float = 0.0,
    progress: Callable[[int, int], None] | None = None,
) -> Permissible:
    """The largest torque on the body with which the lag at the spool stays below 90 degrees, for every length.

    Parameters
    ----------
    case : str or mapping, of the system `heliogyro`
    lengths : sequence of float, m, of blades that are wholly out, straight and radial
    overrides : mapping, keys of the case
    rate : float, rad/s, before the torque acts; left out: what pay-out leaves of `body.rate` by the angular momentum
    ramp : float, s, over which the torque grows; 0 applies it at once
    progress : function of the number of lengths done and of all

    Raises
    ------
    InputError
        For a case or values that cannot be used.
    RunFailed
        Where no torque up to 64 times the one of rigid blades makes a blade wind onto the body.
    """
    loaded = cases.load(case, dict(overrides or {}))
    _check(loaded, lengths, rate, ramp)
    body, blade = loaded.body, loaded.blade
    rotor = closed_forms.Rotor(body.spin_inertia, body.spool_offset, body.blades, blade.line_density, blade.tip_mass)
    rows = []
    for k, length in enumerate(lengths):
        if progress is not None:
            progress(k, len(lengths))
        left = abs(body.rate) * body.spin_inertia / closed_forms.rotor_inertia(rotor, length) if rate is None else rate
        slow = closed_forms.slow_torque_limit(rotor, length, left)
        rigid = closed_forms.step_torque_limit(rotor, length, left, ramp=ramp)
        until = ramp + 2.0 * math.pi / closed_forms.lag_frequency(rotor, length, left)
        thread = _thread_limit(loaded, length, left, ramp, until, rigid if math.isfinite(rigid) else slow)
        rows.append((length, left, thread, rigid, slow))
    columns = np.array(rows).T
    return Permissible(columns[0], columns[1], columns[2], columns[3], columns[4], ramp=ramp, nodes=blade.nodes)


def _check(case: Any, lengths: Sequence[float], rate: float | None, ramp: float) -> None:
    if case.system != "heliogyro":
        raise InputError(f"the case's system is {case.system!r}; permissible torques are those of 'heliogyro'")
    if case.spin_up is not None:
        raise InputError("spin_up is given in the case; leave it out, for its torque is what is sought")
    if case.body.motion == "driven":
        raise InputError("body.motion is 'driven', at a constant rate; use 'spin'")
    if not lengths or any(not (math.isfinite(x) and x > 0.0) for x in lengths):
        raise InputError(f"lengths are {', '.join(f'{x:g}' for x in lengths) or 'missing'}; each must be above 0 m")
    if rate is not None and not rate > 0.0:
        raise InputError(f"rate is {rate:g} rad/s; it must be above 0")
    if case.body.rate == 0.0 and rate is None:
        raise InputError("body.rate is 0; without spin no blade stays out; give a rate above 0")
    if not ramp >= 0.0:
        raise InputError(f"ramp is {ramp:g} s; it must be 0 or above")


def hub_lag(case: Any, length: float, rate: float, torque: float, *, ramp: float, until: float) -> Array:
    """Lag of the thread at the spool after a torque has been applied, rad, (nt,); up to 90 degrees and one sample."""
    from evolvent.results.observe import View
    from evolvent.results.observe.threads import observe_thread
    from evolvent.systems.heliogyro import derived

    given = {
        "body.rate": rate, "blade.length": length, "spool.start_length": length, "spool.start_lag": 0.0,
        "spool.rate": 0.0, "spool.ramp": 0.0, "spool.changes": [], "spool.table": None, "spool.free": None,
        "spin_up": {"torque": torque, "ramp": ramp}, "solver.duration": until, "output.every": until / SAMPLES,
    }  # fmt: skip
    solution = links.solve(case, given)
    lag = derived.hub_lag([observe_thread(View(solution), "blade-1").variables], 1)[:, 0]
    beyond = np.flatnonzero(lag >= 0.5 * math.pi)
    if not beyond.size and solution.status != "success":
        raise RunFailed(f"the run with a torque of {torque:.4g} N m at a length of {length:g} m: {solution.message}")
    found: Array = lag[: beyond[0] + 1] if beyond.size else lag
    return found


def _thread_limit(case: Any, length: float, rate: float, ramp: float, until: float, near: float) -> float:
    """The torque at which the lag of the thread just reaches 90 degrees, N m, by bisection about `near`."""

    def winds(torque: float) -> bool:
        return bool(hub_lag(case, length, rate, torque, ramp=ramp, until=until).max() >= 0.5 * math.pi)

    low = high = near
    for _ in range(MOST_WIDENED):
        if not winds(low):
            break
        high, low = low, 0.5 * low
    for _ in range(MOST_WIDENED):
        if high > low and winds(high):
            break
        high *= 2.0
    else:
        raise RunFailed(f"no torque up to {high:.3g} N m makes the blade of {length:g} m wind onto the body")
    while high - low > WIDTH * high:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if winds(middle) else (middle, high)
    return low


def figure(found: Permissible) -> Figure:
    """Permissible torques, and their ratio, over the length."""
    course = "at once" if found.ramp == 0.0 else f"over {found.ramp:g} s"
    lines = [
        Line(x=found.length, y=1e3 * found.thread, label=f"thread, torque {course}", marker="o"),
        Line(x=found.length, y=1e3 * found.rigid, label=f"rigid blade, torque {course}", color=1, marker="s"),
        Line(x=found.length, y=1e3 * found.slow, label="rigid blade, slow torque", color=2, style="--"),
    ]
    ratio = [Line(x=found.length, y=found.thread / found.rigid, marker="o")]
    panels = [
        Panel(x_label="length of the blades, m", y_label="permissible torque, mN m", lines=lines, log=True),
        Panel(x_label="length of the blades, m", y_label="thread over rigid blade", lines=ratio, y_zero=True),
    ]
    title = "Spin-up torque before the blades wind onto the body"
    return Figure(name="spin_up", title=title, panels=panels, height=stacked(2), columns=1)
