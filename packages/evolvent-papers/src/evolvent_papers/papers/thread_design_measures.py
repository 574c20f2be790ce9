"""Measurements on designs for the thread: the drive of its spools, and the torque that spins it up."""

from __future__ import annotations

import math
from collections.abc import Mapping

from evolvent import cases
from evolvent_papers import spin_up as design
from evolvent_papers.drives import motion
from evolvent_papers.drives.bounds import Bounds, task

Numbers = Mapping[str, float]


def drive() -> Numbers:
    """The drive of the case `heliogyro-designed`: lags in degrees over models of the blade; time, s.

    Models: 20, 40 and 80 links of fixed length (`links_N`), 20 and 40 springs (`springs_N`); swings of the tip and at
    the spool, over two periods. `worst`: the larger one at the worst corner, of 20 links.
    """
    asked = task(cases.load("heliogyro"), Bounds())
    table = cases.load("heliogyro-designed").spool.table
    end = float(table[-1][0])
    runs = {
        f"{asked.case.blade.nodes} links": motion.run(asked, table, end=end),
        **motion.others(asked, table, end=end),
    }
    models = {"_".join(reversed(name.split())): one.measures() for name, one in runs.items()}
    constant = motion.run(asked, motion.constant_table(asked), end=asked.constant_time).measures()
    corners = [
        motion.run(asked, table, end=end, inertia=inertia, spin=spin).measures() for inertia, spin in asked.corners
    ]
    peak = max(one.peak_lag for one in models.values())
    found = {
        "time": end,
        "longer": 100.0 * (end / asked.constant_time - 1.0),
        "peak": math.degrees(peak),
        "above": 100.0 * (peak / asked.steady_lag - 1.0),
        "constant": math.degrees(constant.residual_swing),
        "worst": math.degrees(max(one.residual_swing for one in corners)),
    }
    for name, one in models.items():
        found |= {f"tip_{name}": math.degrees(one.tip_swing), f"spool_{name}": math.degrees(one.spool_swing)}
    return found


def spin_up() -> Numbers:
    """Permissible torques of blades of 5 m at the spin that pay-out leaves, 1e-5 N m."""
    found = design.permissible_torque("heliogyro", [5.0])
    return {name: 1e5 * float(getattr(found, name)[0]) for name in ("thread", "rigid", "slow")}
