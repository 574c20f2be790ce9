"""Length of threads and rods that drives pay out: found before a run, since it follows from the drives alone."""

from __future__ import annotations

import numpy as np
import scipy

from evolvent.assembly.assembled import Assembly
from evolvent.kernels.drive import FREE, LEAST_OUT, drive_angles
from evolvent.kernels.thread import MOVING
from evolvent.model import Model
from evolvent_base.errors import InputError

#: Times at which a drive is evaluated over a run.
_TIMES = 2001
#: Share of a thread's length by which a drive may run past its ends.
_ROUND_OFF = 1e-9


def angles_of(row: np.void, model: Model, times: np.ndarray, take_up: str = "") -> np.ndarray:
    """Angles of the driven spool of a thread's row, or with the prefix "take_" of its take-up reel, rad : (nt,)."""
    angles = np.empty(times.size)
    first, last, law = (int(row[take_up + key]) for key in ("first", "last", "law"))
    drive_angles(int(row[take_up + "drive"]), model.parameters[first:last], law, times, angles)
    return angles


def taken_lengths(model: Model, times: np.ndarray) -> np.ndarray:
    """Length of each thread on its take-up reel, m : (nt, threads); 0 without one."""
    found = np.zeros((model.threads.size, times.size))
    for row, taken in zip(model.threads, found, strict=True):
        if row["take_drive"] >= 0:
            taken[:] = -row["take_radius"] * angles_of(row, model, times, "take_")
    return found.T


def deployed_lengths(assembly: Assembly, times: np.ndarray) -> np.ndarray:
    """Length of each thread that is off its spool, m : (nt, threads); NaN of a free spool.

    Parameters
    ----------
    times : (nt,) float, s
    """
    model = assembly.model
    found = np.full((model.threads.size, times.size), np.nan)
    for row, angles in zip(model.threads, found, strict=True):
        if row["drive"] != FREE:
            angles[:] = angles_of(row, model, times)
            angles *= row["radius"] - 0.5 * row["coiling"] * angles
    return found.T


def lengths(assembly: Assembly) -> np.ndarray:
    """Whole length of each thread, m : (threads,)."""
    found: np.ndarray = assembly.model.threads["n"] * assembly.model.threads["segment"]
    return found


def all_deployed(assembly: Assembly) -> float | None:
    """Time at which the first thread is all off its spool, s; None if that does not happen after t = 0.

    Notes
    -----
    After the last change of the drives (`model.breaks`) they turn at constant rates.
    """
    whole = lengths(assembly)
    last = float(assembly.model.breaks.max(initial=0.0))
    times = np.linspace(0.0, last, _TIMES) if last > 0.0 else np.zeros(1)

    def left(at: np.ndarray) -> np.ndarray:
        """Length still wound, m : (nt, threads)."""
        found: np.ndarray = whole - deployed_lengths(assembly, at)
        return found

    beyond = np.flatnonzero(left(times).min(axis=1) <= 0.0)
    if beyond.size:
        k = int(beyond[0])
        if k == 0:
            return None
        return float(scipy.optimize.brentq(lambda t: left(np.array([t])).min(), times[k - 1], times[k]))
    rest = np.inf
    for row, length in zip(assembly.model.threads, whole, strict=True):
        if row["drive"] == FREE:
            continue
        r, c = float(row["radius"]), float(row["coiling"])
        full = 2.0 * length / (r + np.sqrt(max(r * r - 2.0 * c * length, 0.0)))  # r full - c full^2/2 = length
        now, later = angles_of(row, assembly.model, np.array([last, last + 1.0]))
        if later > now:
            rest = min(rest, (full - now) / (later - now))
    return last + float(rest) if np.isfinite(rest) else None


def check(assembly: Assembly, end: float) -> None:
    """Refuse a drive that pays out more than its thread's length by `end` (s), or reels in more than is out.

    Raises
    ------
    InputError
    """
    model = assembly.model
    breaks = model.breaks
    times = np.union1d(np.linspace(0.0, end, _TIMES), breaks[(breaks > 0.0) & (breaks < end)])
    _check_rods(assembly, times)
    if not np.any(model.threads["drive"] != FREE):
        return
    out, whole = deployed_lengths(assembly, times), lengths(assembly)
    names = {index: name for name, (family, index) in assembly.names.items() if family == "threads"}
    for p, row in enumerate(model.threads):
        thread = names.get(p, f"thread {p}")
        beyond = np.flatnonzero(out[:, p] > whole[p] * (1.0 + _ROUND_OFF))
        if beyond.size and not row["separates"]:
            raise InputError(
                f"the drive outruns the thread {thread!r}: it has paid out {out[:, p].max():.6g} m by t = {end:.6g} s, "
                f"but `length` is {whole[p]:g} m, all out at about {times[beyond[0]]:.6g} s; shorten `until`, slow "
                f"down the `drive`, or set `separates`"
            )
        if row["kind"] == MOVING:
            taken = taken_lengths(model, times)[:, p]
            pulled = np.flatnonzero(taken < -_ROUND_OFF * whole[p])
            if pulled.size:
                raise InputError(
                    f"the take-up reel of the thread {thread!r} has paid out more than it has taken up at about "
                    f"{times[pulled[0]]:.6g} s; shorten `until`, or end the pay-out in its `drive` before"
                )
            short = np.flatnonzero(out[:, p] - taken < whole[p] * (LEAST_OUT - _ROUND_OFF))
            if short.size:
                raise InputError(
                    f"the drive leaves too little of the thread {thread!r} out at about {times[short[0]]:.6g} s: its "
                    f"`mesh` 'moving' needs {LEAST_OUT * whole[p]:g} m ({LEAST_OUT:g} of `length`); shorten "
                    f"`until`, or end the reeling in `drive` before"
                )
        below = np.flatnonzero(out[:, p] < -_ROUND_OFF * whole[p])
        if below.size:
            raise InputError(
                f"the drive reels in more of the thread {thread!r} than is out: none is left at about "
                f"{times[below[0]]:.6g} s; shorten `until`, end the reeling in `drive` before, or "
                f"start with more thread out (`angle`)"
            )


def _check_rods(assembly: Assembly, times: np.ndarray) -> None:
    """Refuse a drive that pays out more than its rod's length, or leaves too little of it."""
    model = assembly.model
    for name, (family, index) in assembly.names.items():
        if family != "rods" or model.rods["payout"][index] == 0:
            continue
        row, out = model.rods[index], angles_of(model.rods[index], model, times)
        whole = float(row["length"])
        wrong = np.flatnonzero((out > whole * (1.0 + _ROUND_OFF)) | (out < whole * (LEAST_OUT - _ROUND_OFF)))
        if wrong.size:
            k = int(wrong[0])
            raise InputError(
                f"{name}.payout has {out[k]:.6g} m out at about {times[k]:.6g} s; it must be from "
                f"{LEAST_OUT * whole:g} m ({LEAST_OUT:g} of `length`) to {whole:g} m; shorten `until`, or change the "
                f"drive"
            )
