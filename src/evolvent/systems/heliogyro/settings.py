"""How a case is run: the end of the run, method and steps, and what is refused before it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from evolvent.errors import InputError
from evolvent.systems.heliogyro.case import Case

if TYPE_CHECKING:
    from evolvent.builder import Assembly

#: Step of generalized-alpha where none is given, s, and its tolerance and spectral radius.
IMPLICIT_STEP, IMPLICIT = 2.5e-3, {"tolerance": 1e-4, "spectral_radius": 0.3}
#: Largest number of steps that a run may take: some minutes to an hour.
MOST_STEPS = 100_000_000


def settings_of(case: Case, assembly: Assembly, *, by_law: bool) -> dict[str, Any]:
    """Arguments of `System.simulate`.

    Parameters
    ----------
    assembly : Assembly, of the case
    by_law : bool, whether a law in Python turns the spools

    Raises
    ------
    InputError
        For a drive that pays out more than there is, or less than nothing; a run without an end, or of too many steps.
    """
    solver, step = case.solver, case.solver.step if isinstance(case.solver.step, float) else None
    end = _end(case, assembly, by_law=by_law)
    _check_steps(case, step, end)
    found: dict[str, Any] = {"until": end, "every": case.output.every, "method": solver.method}
    if solver.method == "dopri5":
        return found | {"tolerance": solver.rtol, "absolute_tolerance": solver.atol}
    if solver.method == "generalized-alpha":
        return found | {"step": IMPLICIT_STEP if step is None else step, **IMPLICIT}
    return found if step is None else found | {"step": step}


def _check_steps(case: Case, step: float | None, end: float) -> None:
    """Refuse a run of too many steps."""
    blade = case.blade
    which, change = "solver.step", "take a longer solver.step"
    if step is None:
        if case.solver.method == "generalized-alpha" or blade.segments == "inextensible":  # no step is known before
            return
        frequency = 2.0 * np.sqrt(blade.stiffness * blade.nodes / (blade.line_density * blade.length))
        step = float(2.8 / frequency)
        which, change = "the largest stable step", "lower blade.stiffness or blade.nodes"
    if end > MOST_STEPS * step:
        raise InputError(
            f"{which} is {step:.3g} s; that makes {end / step:.2g} steps over {end:.6g} s, more than {MOST_STEPS:.0e}; "
            f"{change}, or shorten solver.duration"
        )


def _end(case: Case, assembly: Assembly, *, by_law: bool) -> float:
    """End of the run, s; refuses a drive that pays out more than there is, or less than nothing."""
    length, radius = case.blade.length, case.spool.radius
    end = _all_out(case, assembly) if case.solver.duration == "auto" else float(case.solver.duration)
    if end is None or (by_law and case.solver.duration == "auto"):
        raise InputError(f"solver.duration is auto, but {_never_out(case, by_law)}; give it, such as '60 s'")
    breaks = assembly.model.breaks
    times = np.union1d(np.linspace(0.0, end, 2001), breaks[(breaks > 0.0) & (breaks < end)])
    out = radius * _turned(assembly, times)
    if not case.blade.lets_go and out.max() > length * (1.0 + 1e-9):
        k = int(np.flatnonzero(out.max(axis=1) > length * (1.0 + 1e-9))[0])
        raise InputError(
            f"the drive outruns the thread: it has paid out {out.max():.6g} m by t = {end:.6g} s, but blade.length is "
            f"{length:g} m, all out at about {times[k]:.6g} s; shorten solver.duration, slow spool.rate, "
            f"or set blade.lets_go"
        )
    if out.min() < -1e-9 * length:
        k = int(np.flatnonzero(out.min(axis=1) < -1e-9 * length)[0])
        raise InputError(
            f"{_drive_keys(case, by_law)} reels in more than is out: nothing is left at about {times[k]:.6g} s; "
            f"end that before, shorten solver.duration, or give a longer spool.start_length"
        )
    return end


def _turned(assembly: Assembly, times: np.ndarray) -> np.ndarray:
    """Angles of all spools, rad, (nt, threads)."""
    from evolvent.kernels.drive import drive_angles

    model = assembly.model
    angles = np.empty((model.threads.size, times.size))
    for row, found in zip(model.threads, angles, strict=True):
        parameters = model.parameters[int(row["first"]) : int(row["last"])]
        drive_angles(int(row["drive"]), parameters, int(row["law"]), times, found)
    return angles.T


def _all_out(case: Case, assembly: Assembly) -> float | None:
    """Time at which the first blade is all out, s; None if that does not happen."""
    angle = case.blade.length / case.spool.radius
    last = float(assembly.model.breaks.max(initial=0.0))
    times = np.linspace(0.0, last, 2001) if last > 0.0 else np.zeros(1)
    turned = _turned(assembly, times).max(axis=1)
    beyond = np.flatnonzero(turned >= angle)
    if beyond.size:
        k = int(beyond[0])
        if k == 0:
            return None
        from scipy.optimize import brentq  # 0.2 s that most runs do not need

        return float(brentq(lambda t: _turned(assembly, np.array([t])).max() - angle, times[k - 1], times[k]))
    end = _turned(assembly, np.array([last, last + 1.0]))
    rates = end[1] - end[0]
    with np.errstate(divide="ignore"):
        left = np.where(rates > 0.0, (angle - end[0]) / rates, np.inf)
    return last + float(left.min()) if np.isfinite(left.min()) else None


def _never_out(case: Case, by_law: bool) -> str:
    """Why no time at which a blade is all out can be found."""
    if by_law:
        return "laws['drive'] does not tell when a blade is all out"
    if case.spool.start_length >= case.blade.length:
        return f"spool.start_length is {case.spool.start_length:g} m, and so the blade is all out at the start"
    return f"{_drive_keys(case, by_law)} never pays a blade all out".replace(",,", ",")


def _drive_keys(case: Case, by_law: bool) -> str:
    """The keys that say how the spools turn, with what stands there."""
    if by_law:
        return "laws['drive']"
    if case.spool.table is not None:
        return "spool.table"
    rates = np.atleast_1d(np.array(case.spool.rate))
    text = f"spool.rate, {' / '.join(f'{rate:g}' for rate in rates)} rad/s"
    return text + (", with spool.changes," if case.spool.changes else ",")
