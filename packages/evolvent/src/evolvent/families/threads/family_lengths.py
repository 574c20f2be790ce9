"""Length of threads that drives pay out: found before a run, since it follows from the drives alone."""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy

from evolvent.kernels.drive import FREE, LEAST_OUT, ROUND_OFF, angles_of
from evolvent.kernels.thread import MOVING
from evolvent_base.errors import InputError

#: Times at which a drive is evaluated up to its last change.
_TIMES = 2001


def taken_lengths(model: Any, times: np.ndarray) -> np.ndarray:
    """Length of each thread on its take-up reel, m : (nt, threads); 0 without one."""
    found = np.zeros((model.threads.size, times.size))
    for row, taken in zip(model.threads, found, strict=True):
        if row["take_drive"] >= 0:
            taken[:] = -row["take_radius"] * angles_of(row, model, times, "take_")
    return found.T


def deployed_lengths(model: Any, times: np.ndarray) -> np.ndarray:
    """Length of each thread that is off its spool, m : (nt, threads); NaN of a free spool.

    Parameters
    ----------
    times : (nt,) float, s
    """
    found = np.full((model.threads.size, times.size), np.nan)
    for row, angles in zip(model.threads, found, strict=True):
        if row["drive"] != FREE:
            angles[:] = angles_of(row, model, times)
            angles *= row["radius"] - 0.5 * row["coiling"] * angles
    return found.T


def lengths(model: Any) -> np.ndarray:
    """Whole length of each thread, m : (threads,)."""
    found: np.ndarray = model.threads["n"] * model.threads["segment"]
    return found


def all_deployed(model: Any) -> float | None:
    """Time at which the first thread is all off its spool, s; None if that does not happen after t = 0.

    Notes
    -----
    After the last change of the drives (`model.breaks`) they turn at constant rates.
    """
    whole = lengths(model)
    last = float(model.breaks.max(initial=0.0))
    times = np.linspace(0.0, last, _TIMES) if last > 0.0 else np.zeros(1)

    def left(at: np.ndarray) -> np.ndarray:
        """Length still wound, m : (nt, threads)."""
        found: np.ndarray = whole - deployed_lengths(model, at)
        return found

    beyond = np.flatnonzero(left(times).min(axis=1) <= 0.0)
    if beyond.size:
        k = int(beyond[0])
        if k == 0:
            return None
        return float(scipy.optimize.brentq(lambda t: left(np.array([t])).min(), times[k - 1], times[k]))
    rest = np.inf
    for row, length in zip(model.threads, whole, strict=True):
        if row["drive"] == FREE:
            continue
        r, c = float(row["radius"]), float(row["coiling"])
        full = 2.0 * length / (r + np.sqrt(max(r * r - 2.0 * c * length, 0.0)))  # r full - c full^2/2 = length
        now, later = angles_of(row, model, np.array([last, last + 1.0]))
        if later > now:
            rest = min(rest, (full - now) / (later - now))
    return last + float(rest) if np.isfinite(rest) else None


def check_lengths(assembly: Any, times: np.ndarray) -> None:
    """Refuse drives that pay out more than their threads' lengths, or reel in more than is out (`Drives.check`)."""
    model, end = assembly.model, float(times[-1])
    if not np.any(model.threads["drive"] != FREE):
        return
    out, whole = deployed_lengths(model, times), lengths(model)
    names = {index: name for name, (family, index) in assembly.names.items() if family == "threads"}
    for p, row in enumerate(model.threads):
        thread = names.get(p, f"thread {p}")
        beyond = np.flatnonzero(out[:, p] > whole[p] * (1.0 + ROUND_OFF))
        if beyond.size and not row["separates"]:
            raise InputError(
                f"the drive outruns the thread {thread!r}: it has paid out {out[:, p].max():.6g} m by t = {end:.6g} s, "
                f"but `length` is {whole[p]:g} m, all out at about {times[beyond[0]]:.6g} s; shorten `until`, slow "
                f"down the `drive`, or set `separates`"
            )
        if row["kind"] == MOVING:
            taken = taken_lengths(model, times)[:, p]
            pulled = np.flatnonzero(taken < -ROUND_OFF * whole[p])
            if pulled.size:
                raise InputError(
                    f"the take-up reel of the thread {thread!r} has paid out more than it has taken up at about "
                    f"{times[pulled[0]]:.6g} s; shorten `until`, or end the pay-out in its `drive` before"
                )
            short = np.flatnonzero(out[:, p] - taken < whole[p] * (LEAST_OUT - ROUND_OFF))
            if short.size:
                raise InputError(
                    f"the drive leaves too little of the thread {thread!r} out at about {times[short[0]]:.6g} s: its "
                    f"`mesh` 'moving' needs {LEAST_OUT * whole[p]:g} m ({LEAST_OUT:g} of `length`); shorten "
                    f"`until`, or end the reeling in `drive` before"
                )
        below = np.flatnonzero(out[:, p] < -ROUND_OFF * whole[p])
        if below.size:
            raise InputError(
                f"the drive reels in more of the thread {thread!r} than is out: none is left at about "
                f"{times[below[0]]:.6g} s; shorten `until`, end the reeling in `drive` before, or "
                f"start with more thread out (`angle`)"
            )
