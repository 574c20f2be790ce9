"""Checks of a start: sample times, joints that it must meet, redundant joints; and what acts from outside."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from evolvent import model as mdl
from evolvent.assembly import needs
from evolvent.assembly.assembled import Assembly
from evolvent.assembly.checks import redundant_part
from evolvent.assembly.families import row_owner
from evolvent.equations.implicit import measure_constraints
from evolvent.model.family import EXPLICIT, SOLVERS
from evolvent.model.registry import families
from evolvent_base.errors import InputError

#: What a joint may be off at the start, beside the size of the system and its speed.
_FITS = 1e-6


def misfits(assembly: Assembly) -> np.ndarray:
    """Most that the gap and the rate of a constraint may be at the start, (2,) float."""
    y, n_q, n_v = assembly.y, int(assembly.model.info.nq), int(assembly.model.info.nv)
    length = max(1.0, float(np.abs(y[:n_q]).max(initial=0.0)))
    speed = max(1.0, float(np.abs(y[n_q : n_q + n_v]).max(initial=0.0)))
    return np.array([_FITS * length, _FITS * speed])


def check_start(assembly: Assembly, t: float) -> None:
    """Refuse constraints that the start does not meet, by name: positions or velocities that contradict them."""
    model, y, (most_gap, most_rate) = assembly.model, assembly.y.copy(), misfits(assembly)
    rows = model.constraints
    needs.load(model, measure_constraints)
    measure_constraints(t, y, model)
    held = (rows["stiffness"] == 0.0) & (t <= rows["until"])
    off = ~(np.abs(rows["gap"]) <= most_gap) | ~(np.abs(rows["rate"]) <= most_rate)
    for k in np.flatnonzero(held & off).tolist():
        gap, rate = float(rows["gap"][k]), float(rows["rate"][k])
        unit = "" if rows["turns"][k] else " m"
        if not abs(gap) <= most_gap:
            raise InputError(
                f"{row_owner(assembly, k)!r} does not fit the start at t = {t:g} s: it is {gap:.6g}{unit} off; "
                f"move the parts that it joins, or its drive"
            )
        if not abs(rate) <= most_rate:
            if rows["drives"][k]:
                raise InputError(_unlike_its_drive(row_owner(assembly, k), rows[k], t))
            raise InputError(
                f"{row_owner(assembly, k)!r} does not fit the velocities at the start: its two points separate "
                f"at {rate:.6g}{unit}/s; give velocities that keep it"
            )


def _unlike_its_drive(name: str, row: Any, t: float) -> str:
    """What to say of a drive that begins with another rate than what it moves."""
    drive, own = -float(row["driven"]), float(row["rate"] - row["driven"])
    unit = "rad/s" if row["turns"] else "m/s"
    return (
        f"{name!r} does not fit the velocities at the start: at t = {t:g} s its drive has {drive:.6g} {unit}, and what "
        f"it moves has {own:.6g} {unit}; give what it moves {drive:.6g} {unit}, or a drive that begins with {own:.6g} "
        f"{unit}, such as a ramp"
    )


def acts_from_outside(model: mdl.Model, t: float = -math.inf) -> bool:
    """Whether something joins, pushes or pulls on the system from outside at t, beside gravity and loads."""
    if model.info.outside:
        return True
    rows = model.constraints
    if np.any((rows["outside"] != 0) & (t <= rows["until"])):
        return True
    for family in families().values():
        names, found = family.record.names or (), family.records(model)
        if "outside" in names:
            acts = found["outside"] != 0
            if np.any(acts & (t <= found["until"]) if "until" in names else acts):
                return True
    return False


def check_redundancy(assembly: Assembly, t: float) -> None:
    """Refuse joints that others imply at the start t, by name, which explicit methods do not support."""
    if assembly.model.rows.size and (redundant := redundant_part(assembly, t)):
        raise InputError(
            f"{redundant!r} is redundant: the other constraints already imply it, which {SOLVERS[EXPLICIT]} do not "
            "support; use energy-momentum or generalized-alpha"
        )


#: What a step may be, in messages.
STEP_ALLOWED = "a finite time above 0, or None"


def sample_times(samples: Any) -> np.ndarray:
    """`samples` as an array of times, s; refused unless two or more that increase."""
    try:
        times = np.array(samples, dtype=float)
    except (TypeError, ValueError):
        times = np.zeros(0)
    if times.ndim != 1 or times.size < 2 or not np.all(np.isfinite(times)) or not np.all(np.diff(times) > 0.0):
        raise InputError(f"samples is {_short(samples)}; it must be two or more finite times that increase, s")
    return times


def _short(value: Any) -> str:
    text = " ".join(repr(value).split())
    return text if len(text) <= 60 else f"{text[:50]} ... {text[-6:]}"
