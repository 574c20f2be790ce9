"""Bounds of a drive, and what follows from the case that it is designed for."""

from __future__ import annotations

import dataclasses
import math
from typing import Annotated, Any

import numpy as np

from evolvent import closed_forms
from evolvent_base import units
from evolvent_base.errors import InputError
from evolvent_base.schema import Section, shown
from evolvent_papers.heliogyro import straight
from evolvent_papers.heliogyro.case import WAYS

#: Peak lag over the steady one, and time over that of the constant rate, where no bounds are given.
PEAK_SHARE, TIME_SHARE = 1.02, 1.1
#: Largest time of a drive, over that of the constant rate, and the inverse of the least.
MOST_TIME = 100.0
#: Share of the length by which a drive ends short of a whole blade: of rounded rates it must not unwind too much.
SHORT = 1e-6
#: Errors of inertia and spin are below this: the factor 1 - error of the smallest is that of a body that still spins.
MOST_ERROR = 0.9


class Bounds(Section):
    """What a drive has to keep; what is left out is not bounded, where nothing else is said.

    Parameters
    ----------
    peak_lag : float, rad
        Largest lag of the tip until the drive ends; left out: 1.02 times the steady lag at the case's rate.
    residual_swing : float, rad
        Largest lag after the drive has ended, of the tip and of the last segment at the spool, for two of its periods.
    lag_rate : float, rad/s
        Largest rate of the tip's lag.
    tension : float, N
        Largest tension at the spool.
    spool_torque : float, N m
        Largest torque of the thread on the spool.
    time : float, s
        Duration that the drive takes, neither more nor less; left out: 1.1 times that of the case's constant rate.
    length : float, m
        Deployed length at the end; left out: that of the blade. Below `spool.start_length` the drive reels in.
    error : float
        Relative error of inertia and spin at the corners of the search, which are no bounds.
    """

    peak_lag: units.PositiveAngle | None = None
    residual_swing: units.PositiveAngle = math.radians(0.2)
    lag_rate: units.PositiveRate | None = None
    tension: units.PositiveForce | None = None
    spool_torque: units.PositiveTorque | None = None
    time: units.Duration | None = None
    length: units.Length | None = None
    error: Annotated[
        float, units.Quantity(what="a plain number", unit="", example="0.1", least=0.0, below=MOST_ERROR)
    ] = 0.1


@dataclasses.dataclass(frozen=True)
class DriveTask:
    """A case with the bounds of its drive, all given.

    Attributes
    ----------
    case : the case of the heliogyro
    bounds : Bounds, with peak_lag, time and length
    rotor : closed_forms.Rotor
    rate : float, rad/s, constant rate of the case, below zero for reeling in
    constant_time : float, s, that it takes
    steady_lag : float, rad, size of the lag at that rate, by its closed form
    angles : (float, float), rad, of the spools at the start and at the end
    """

    case: Any
    bounds: Bounds
    rotor: closed_forms.Rotor
    rate: float
    constant_time: float
    steady_lag: float
    angles: tuple[float, float]

    @property
    def corners(self) -> list[tuple[float, float]]:
        """Factors of inertia and spin by which the drive does not know them; none without `Bounds.error`."""
        error = self.bounds.error
        each = (1.0 - error, 1.0 + error)
        return [(inertia, spin) for inertia in each for spin in each] if error > 0.0 else []

    def period(self, length: float) -> float:
        """Period of the lag of a straight blade, s; of a free body at the spin that its momentum leaves."""
        body = self.case.body
        length = max(length, 1e-3 * self.case.blade.length)
        if body.motion == "driven":
            rotor, spin = self.rotor._replace(inertia=1e12), abs(body.rate)
        else:
            rotor, lengths = self.rotor, np.full((1, body.blades), length)
            inertia = float(straight.straight_inertia(self.case, lengths, corrected=True)[0])
            spin = straight.start_momentum(self.case) / inertia
        return 2.0 * math.pi / closed_forms.lag_frequency(rotor, length, spin)


def task(case: Any, bounds: Bounds) -> DriveTask:
    """The bounds beside a checked case, completed.

    Raises
    ------
    InputError
        For a case whose spools cannot be driven by a design.
    """
    if case.system != "heliogyro":
        raise InputError(f"the case's system is {case.system!r}; drives are designed for the system 'heliogyro'")
    body, blade, spool = case.body, case.blade, case.spool
    for key in WAYS:
        if getattr(spool, key) is not None:
            raise InputError(f"spool.{key} is given; a design needs spool.rate, the constant rate that it improves on")
    if spool.ramp > 0.0 or spool.changes:
        key = "ramp" if spool.ramp > 0.0 else "changes"
        raise InputError(f"spool.{key} is given; the drive replaces it: leave it out")
    for key in ("spin_up", "sunlight"):
        if getattr(case, key) is not None:
            raise InputError(f"{key} is given; a design has no other load on body and blades: leave it out")
    if spool.rate is None:
        raise InputError("spool.rate is missing; a design needs the constant rate that it improves on")
    if isinstance(spool.rate, tuple):
        raise InputError(f"spool.rate is {shown(spool.rate)}; a design needs one rate for all blades")
    if spool.rate == 0.0 or body.rate == 0.0:
        key = "spool.rate" if spool.rate == 0.0 else "body.rate"
        raise InputError(f"{key} is 0; a design needs a rate other than 0")
    length = blade.length if bounds.length is None else bounds.length
    if length > blade.length:
        raise InputError(f"length is {length:g} m; it must be at most blade.length, {blade.length:g} m")
    if length == spool.start_length:
        raise InputError(f"length is {length:g} m, as spool.start_length; give another one, such as 50 cm")
    end = spool.angle_at(min(length, blade.length * (1.0 - SHORT)), "length")
    angles = (spool.start_angle, end)
    rate = math.copysign(spool.rate, angles[1] - angles[0])
    rotor = straight.rotor(case)
    momentum = body.spin_inertia * abs(body.rate) if body.motion == "driven" else straight.start_momentum(case)
    steady = closed_forms.payout_lag(rotor, spool.radius * abs(rate), momentum)
    if bounds.peak_lag is None and math.isnan(steady):
        raise InputError(
            f"spool.rate is {spool.rate:g} rad/s, at which there is no steady lag; use a slower one, or give peak_lag"
        )
    constant = (angles[1] - angles[0]) / rate
    if bounds.time is not None and not constant / MOST_TIME <= bounds.time <= constant * MOST_TIME:
        raise InputError(
            f"time is {bounds.time:g} s; it must be from {constant / MOST_TIME:.4g} to {constant * MOST_TIME:.6g} s, a "
            f"hundredth to a hundred times the time of the constant rate"
        )
    full = bounds.replaced(
        peak_lag=PEAK_SHARE * steady if bounds.peak_lag is None else bounds.peak_lag,
        time=TIME_SHARE * constant if bounds.time is None else bounds.time,
        length=length,
    )
    return DriveTask(case, full, rotor, rate, constant, steady, angles)
