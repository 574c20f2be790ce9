"""What all drives are: a row of a thread or joint, and the angle over time."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, ClassVar, NamedTuple

import numpy as np

from evolvent.assembly.builder import Builder
from evolvent.kernels import drive as kernels
from evolvent_base.errors import InputError
from evolvent_base.schema import Section


class DriveRow(NamedTuple):
    """What a drive writes into its thread's or joint's row."""

    kind: int
    first: int
    last: int
    law: int = 0
    spool_q: int = -1
    spool_v: int = -1
    inertia: float = 0.0
    torque: float = 0.0
    friction: float = 0.0
    viscous: float = 0.0
    profile: int = -1
    motor: int = 0
    motor_first: int = 0
    motor_last: int = 0


class DriveKind(Section):
    """What all drives are."""

    def write(self, builder: Builder, name: str) -> DriveRow:
        """Store parameters; returns the row's fields."""
        raise NotImplementedError

    #: What to do about a jump, as the end of a sentence.
    remedy: ClassVar[str] = "give a drive that does not jump"

    def corners(self) -> Iterable[float]:
        """Times, s, at which the rate or the angle may jump; none where both never do."""
        return ()

    def at(self, builder: Builder, row: DriveRow, time: float) -> tuple[float, float, float]:
        """Angle, rate and acceleration at `time` (rad, rad/s, rad/s2)."""
        parameters = np.array(builder.values[row.first : row.last])
        angle, rate, acceleration = kernels.drive(row.kind, parameters, row.law, time)
        return float(angle), float(rate), float(acceleration)


def check_start(name: str, angle: Any) -> None:
    """Refuse a spool that would have more wound than there is."""
    if angle < 0.0:
        raise InputError(f"{name}.angle is {angle!r}; it must be 0 or above")
