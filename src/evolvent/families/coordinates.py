"""Coordinates."""

from __future__ import annotations

from typing import Any

import numpy as np

from evolvent.kernels import axial, coordinate
from evolvent.kernels.ends import of_coordinate
from evolvent.model import COORDINATE_ACCOUNTS
from evolvent.model.family import Family, Kind, record
from evolvent.model.layout import LATCHED, Accounts, Events, Switches

Array = np.ndarray
_3 = (3,)


def _is_angle(found: Array) -> Array:
    return np.asarray(found["kind"] == axial.ANGLE)


def _turns_and_latch(found: Array, _: Any) -> Array:
    """Quarter turns of an angle, and whether the latch has locked: (2 n,) int."""
    turns = [round(float(row["angle"]) / axial.QUARTER) if row["kind"] == axial.ANGLE else 0 for row in found]
    return np.stack([turns, np.abs(found["angle"] - found["latch"]) <= coordinate.REACHED], axis=1).astype(int).ravel()


# coordinates of joints. kind 0: angle about the body's `axis` from its direction `zero` to a second direction, a
# beam's slope (on 1, at iq, iv) or `local` of the body `other` (on 0); kind 1: travel along the body's `axis` from
# its point `zero` to a second point. switch: the first of two switches, the angle in quarter turns, rounded, and 1
# once latched. account: index of its accounts in the state (`COORDINATE_ACCOUNTS`).
# Of the last forces: torque of the joint, with derivatives slope and damper of all torques but for those of motors,
# which the tangent finds; applied: torque of motors and synchronizations, with derivatives of the latter; u, g:
# second side, and direction of the force on it; p, q: parts of a second direction at the start and the end of an
# interval; leaves, comes: how far it would move in a step at its rates at both ends; bristle: deflection of the
# friction, slips: the sense in which it slips, rubs: its force, relax: of its numerical damping; stored: J; lost,
# latch_lost: powers, W. Of the last step: before, pace, bristle0, rubs0, lost0, latch_lost0, and anchor, the
# coordinate at which the bristle has no force. caught: rate at which the latch has locked; peak: its largest
# torque; start_rate, end_rate: in the states at both ends of a step (`kernels.turning`)
COORDINATES = Family(
    "coordinates",
    record(
        "kind body on other iq iv switch account",
        "axis zero local stiffness damping rest low high stop latch latch_stiffness latch_damping side friction stick",
        "angle rate torque before pace leaves comes slope damper applied applied_slope applied_damper motor_slope "
        "motor_damper u g p0 q0 p1 q1 bristle slips rubs relax stored lost latch_lost latch_torque bristle0 rubs0 "
        "lost0 latch_lost0 anchor caught peak start_rate end_rate",
        axis=_3, zero=_3, local=_3, u=_3, g=_3,
    ),
    order=250,
    results={
        "angle": ("angle", "rad", "angle of the second side as seen from the first, any number of turns"),
        "rate": ("rate", "rad s-1", "rate of the angle"),
        "torque": ("torque", "N m", "torque of the joint, sum of {parts}, positive against the angle"),
        "stored": ("energy_elastic", "J", "elastic energy of spring, stops and latch"),
        "lost": ("dissipation", "W", "power dissipated by the dampers of spring and latch"),
        "rubs": ("friction_torque", "N m", "torque of friction, part of that of the joint"),
        "latch_torque": ("latch_torque", "N m", "torque in the latch, part of that of the joint"),
        "u": ("ends", "m", "point of travel 0 on the first part, and the second end, inertial axes"),
    },
    kinds=(
        Kind(
            "a rotational spring",
            which=lambda found: _is_angle(found) & ~np.isfinite(found["latch"]) & (found["friction"] == 0.0),
            symmetric=True,
        ),
        Kind(
            "a rotational spring with a latch",
            which=lambda found: _is_angle(found) & np.isfinite(found["latch"]) & (found["friction"] == 0.0),
            symmetric=True,
        ),
        Kind(
            "a translational spring",
            which=lambda found: ~_is_angle(found) & (found["friction"] == 0.0),
            symmetric=True,
        ),
        Kind(
            "a joint coordinate with friction",
            which=lambda found: found["friction"] > 0.0,
            symmetric=True,
        ),
    ),
    ends=of_coordinate,
    accounts=(Accounts(COORDINATE_ACCOUNTS),),
    switches=(Switches(2, _turns_and_latch),),
    rubs=lambda found: found["friction"] > 0.0,
    events=(
        Events(
            lambda found: found.size if np.any(np.isfinite(found["latch"])) else 0, lambda _, k: (k, LATCHED)
        ),
    ),
)  # fmt: skip
