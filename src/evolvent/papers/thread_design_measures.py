"""Measurements on designs for the thread: the drive of its spools, and the torque that spins it up."""

from __future__ import annotations

import math
from collections.abc import Mapping

Numbers = Mapping[str, float]


def drive() -> Numbers:
    """The drive of the case `heliogyro-designed`: lags in degrees, of the case's and of twice the nodes; time, s."""
    from evolvent import cases
    from evolvent.design.drives import motion
    from evolvent.design.drives.bounds import Bounds, task

    asked = task(cases.load("heliogyro"), Bounds())
    table = cases.load("heliogyro-designed").spool.table
    end = float(table[-1][0])
    found = motion.run(asked, table, end=end).measures()
    refined = motion.run(asked, table, end=end, nodes=2 * asked.case.blade.nodes).measures()
    constant = motion.run(asked, motion.constant_table(asked), end=asked.constant_time).measures()
    swings = [
        motion.run(asked, table, end=end, inertia=inertia, spin=spin).measures().residual_swing
        for inertia, spin in asked.corners
    ]
    return {
        "time": end,
        "longer": 100.0 * (end / asked.constant_time - 1.0),
        "peak": math.degrees(found.peak_lag),
        "above": 100.0 * (found.peak_lag / asked.steady_lag - 1.0),
        "swing": math.degrees(found.residual_swing),
        "refined": math.degrees(refined.residual_swing),
        "constant": math.degrees(constant.residual_swing),
        "worst": math.degrees(max(swings)),
    }


def spin_up() -> Numbers:
    """Permissible torques of blades of 5 m at the spin that pay-out leaves, 1e-5 N m."""
    from evolvent.design import spin_up as design

    found = design.permissible_torque("heliogyro", [5.0])
    return {name: 1e5 * float(getattr(found, name)[0]) for name in ("thread", "rigid", "slow")}
