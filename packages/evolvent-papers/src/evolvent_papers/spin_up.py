"""The largest torque that spins up a body with deployed blades before they wind onto it, over the blades' length."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from evolvent import cases, closed_forms
from evolvent.families.threads.observer import observe_thread
from evolvent.results.observe import View
from evolvent_base.answer import Answer, Block, Section, Table
from evolvent_base.errors import InputError, RunFailed
from evolvent_base.figures import Figure, Line, Panel, stacked
from evolvent_base.showing import Shown
from evolvent_papers import links
from evolvent_papers.heliogyro import derived, straight

Array = np.ndarray
#: Relative width at which the bisection ends; times that its bracket is widened.
WIDTH, MOST_WIDENED = 1e-3, 6
#: Longest ramp, over the period of the lag.
MOST_PERIODS = 100.0
#: Samples of a run.
SAMPLES = 400


@dataclasses.dataclass(frozen=True)
class Permissible(Shown):
    """Permissible torques over the length of the blades.

    Attributes
    ----------
    length, rate : (n,) float, m and rad/s, of the blades, and of body and blades before the torque acts
    thread, rigid : (n,) float, N m, of the whole thread and of rigid blades with the same course of the torque
    slow : (n,) float, N m, of rigid blades in equilibrium (`closed_forms.slow_torque_limit`)
    ramp : float, s, over which the torque grows
    nodes : int, of the thread
    failed : tuple of str, why a torque of the thread is not found, which is then NaN
    """

    length: Array
    rate: Array
    thread: Array
    rigid: Array
    slow: Array
    ramp: float
    nodes: int
    failed: tuple[str, ...] = ()

    named = "torques"

    def answer(self) -> Answer:
        """A row a length, and a figure."""
        rows = []
        for length, *of in zip(self.length, self.rate, self.thread, self.rigid, self.slow, strict=True):
            rate, thread, rigid, slow = of
            ratio = thread / rigid if math.isfinite(rigid) else math.nan
            shown = ("-" if math.isnan(value) else f"{value:.4g}" for value in (rate, thread, rigid, ratio, slow))
            rows.append((f"{length:g}", *shown))
        heads = ("length m", "spin rad/s", "thread N m", "rigid blade N m", "thread / rigid", "rigid, slow torque N m")
        blocks: list[Block] = [Table(heads=heads, rows=rows), figure(self)]
        title = "Permissible torque"
        return Answer(title=title, sections=[Section(title=title, blocks=blocks)])


def permissible_torque(
    case: Any,
    lengths: Sequence[float] | None = None,
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
    lengths : sequence of float, m, of blades that are wholly out, straight and radial; `blade.length` if left out
    overrides : mapping, keys of the case
    rate : float, rad/s, before the torque acts; left out: what pay-out leaves of `body.rate` by the angular momentum
    ramp : float, s, over which the torque grows; 0 applies it at once
    progress : function of the number of lengths done and of all

    Raises
    ------
    InputError
        For a case or values that cannot be used.

    Notes
    -----
    The thread's torque is sought from that of rigid blades, or from their slow one where that is infinite, over halves
    down to 1/64 and doubles up to 64 times.
    """
    loaded = cases.load(case, dict(overrides or {}))
    _check(loaded, lengths, rate, ramp)
    lengths = (loaded.blade.length,) if lengths is None else lengths
    rotor, momentum = straight.rotor(loaded), straight.start_momentum(loaded)
    rows, failed = [], []
    for k, length in enumerate(lengths):
        if progress is not None:
            progress(k, len(lengths))
        left = momentum / closed_forms.rotor_inertia(rotor, float(length)) if rate is None else rate
        period = 2.0 * math.pi / closed_forms.lag_frequency(rotor, length, left)
        if ramp > MOST_PERIODS * period:
            most = MOST_PERIODS * period
            raise InputError(f"ramp is {ramp:g} s; with blades of {length:g} m it must be at most {most:.6g} s, "
                             f"{MOST_PERIODS:g} periods of the lag")  # fmt: skip
        slow = closed_forms.slow_torque_limit(rotor, length, left)
        rigid = closed_forms.step_torque_limit(rotor, length, left, ramp=ramp)
        until = ramp + period
        try:
            thread = _thread_limit(loaded, length, left, ramp, until, rigid if math.isfinite(rigid) else slow)
        except RunFailed as error:
            thread = math.nan
            failed.append(str(error))
        rows.append((length, left, thread, rigid, slow))
    found = np.array(rows).T
    return Permissible(
        found[0], found[1], found[2], found[3], found[4], ramp=ramp, nodes=loaded.blade.nodes, failed=tuple(failed)
    )


def _check(case: Any, lengths: Sequence[float] | None, rate: float | None, ramp: float) -> None:
    if case.system != "heliogyro":
        raise InputError(f"the case's system is {case.system!r}; permissible torques are those of 'heliogyro'")
    if case.spin_up is not None:
        raise InputError("spin_up is given in the case; leave it out, for its torque is what is sought")
    if case.body.motion == "driven":
        raise InputError("body.motion is 'driven', at a constant rate; use 'spin'")
    if lengths is not None and (not lengths or any(not (math.isfinite(x) and x > 0.0) for x in lengths)):
        raise InputError(f"lengths are {', '.join(f'{x:g}' for x in lengths) or 'missing'}; each must be above 0 m")
    if rate is not None and not rate > 0.0:
        raise InputError(f"rate is {rate:g} rad/s; it must be above 0")
    if case.body.rate == 0.0 and rate is None:
        raise InputError("body.rate is 0; without spin no blade stays out; give a rate above 0")
    if not ramp >= 0.0:
        raise InputError(f"ramp is {ramp:g} s; it must be 0 or above")


def hub_lag(case: Any, length: float, rate: float, torque: float, *, ramp: float, until: float) -> Array:
    """Lag of the thread at the spool after a torque has been applied, rad, (nt,); up to 90 degrees and one sample."""
    given = {
        "body.rate": rate, "blade.length": length, "blade.separates": False,
        "spool.start_length": length, "spool.start_lag": 0.0,
        "spin_up": {"torque": torque, "ramp": ramp}, "solver.duration": until, "output.every": until / SAMPLES,
    }  # fmt: skip
    solution = links.solve(case, given | links.spool_keys(rate=0.0))
    lag = derived.hub_lag([observe_thread(View(solution), "blade-1").variables], 1)[:, 0]
    beyond = np.flatnonzero(lag >= 0.5 * math.pi)
    if not beyond.size and solution.status != "success":
        raise RunFailed(f"the run with a torque of {torque:.4g} N m at a length of {length:g} m: {solution.message}")
    found: Array = lag[: beyond[0] + 1] if beyond.size else lag
    return found


def _thread_limit(case: Any, length: float, rate: float, ramp: float, until: float, near: float) -> float:
    """The torque at which the lag of the thread just reaches 90 degrees, N m, by bisection about `near`."""

    def winds(torque: float) -> bool:
        try:
            return bool(hub_lag(case, length, rate, torque, ramp=ramp, until=until).max() >= 0.5 * math.pi)
        except InputError as error:
            raise InputError(f"a blade of {length:g} m at {rate:.4g} rad/s cannot be run: {error}") from None

    low = high = near
    begins = winds(near)
    for _ in range(MOST_WIDENED):
        low, high = (0.5 * low, low) if begins else (high, 2.0 * high)
        if winds(low if begins else high) != begins:
            break
    else:
        sentence = f"the blade of {length:g} m winds onto the body with every torque down to {low:.3g} N m"
        if not begins:
            sentence = f"no torque up to {high:.3g} N m makes the blade of {length:g} m wind onto the body"
        raise RunFailed(sentence)
    while high - low > WIDTH * high:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if winds(middle) else (middle, high)
    return low


def figure(found: Permissible) -> Figure:
    """Permissible torques, and their ratio, over the length; lengths that were not computed are left out."""
    course = "at once" if found.ramp == 0.0 else f"over {found.ramp:g} s"
    rigid = np.where(np.isfinite(found.rigid), found.rigid, np.nan)
    lines = [
        Line(x=found.length, y=1e3 * found.thread, label=f"thread, torque {course}", style=" ", marker="o"),
        Line(x=found.length, y=1e3 * rigid, label=f"rigid blade, torque {course}", color=1, style=" ", marker="x"),
        Line(x=found.length, y=1e3 * found.slow, label="rigid blade, slow torque", color=2, style=" ", marker="^"),
    ]
    above = [Line(x=found.length, y=100.0 * (found.thread / rigid - 1.0), style=" ", marker="o")]
    panels = [
        Panel(x_label="length of the blades, m", y_label="permissible torque, mN m", lines=lines, log=True),
        Panel(x_label="length of the blades, m", y_label="thread above rigid blade, %", lines=above, y_zero=True),
    ]
    title = "Spin-up torque before the blades wind onto the body"
    return Figure(name="spin_up", title=title, panels=panels, height=stacked(2), columns=1)
