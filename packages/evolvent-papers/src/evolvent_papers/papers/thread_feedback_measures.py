"""Measurements on the drive of the thread's spools that reacts to the measured lag."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from typing import Any

import evolvent
from evolvent import cases

Numbers = Mapping[str, float]
CASE = "heliogyro-feedback"
#: Relative errors of inertia and spin at the corners, of which the law does not know.
ERROR = 0.1
CORNERS = tuple(itertools.product((1.0 - ERROR, 1.0 + ERROR), repeat=2))


def _swings(case: str, corners: Any, changes: Mapping[str, Any]) -> tuple[float, float, float]:
    """Largest lags of the tip and at the spool after the drive has ended, deg, and length that is wound then, m."""
    tip, hub, wound = [], [], []
    for inertia, spin in corners:
        given = {"body.inertia": 0.004 * inertia, "body.rate": 6.0 * spin, **changes}
        run = evolvent.run(case, given)
        tip.append(math.degrees(float(run.residual_swing_tip)))
        hub.append(math.degrees(float(run.residual_swing_hub)))
        wound.append(5.0 - float(run.deployed_length[-1, 0]))
    return max(tip), max(hub), max(wound)


def drive() -> Numbers:
    """The case `heliogyro-feedback`: swings in degrees, with noise and delay, on two meshes, and without them."""
    given = cases.load(CASE).spool.feedback
    quiet = {"spool.feedback.sensor.noise": {}, "spool.feedback.sensor.delay": 0.0}
    links = {"blade.segments": "inextensible", "solver.method": "dopri5"}
    nominal = _swings(CASE, [(1.0, 1.0)], {})
    coarse, fine = (_swings(CASE, CORNERS, {"blade.nodes": nodes}) for nodes in (20, 40))
    clean, clean_nominal = _swings(CASE, CORNERS, quiet), _swings(CASE, [(1.0, 1.0)], quiet)
    opened = _swings("heliogyro-designed", CORNERS, links)
    return {
        "end": given.constants["end"],
        "nominal": nominal[0],
        "nominal_hub": nominal[1],
        "worst": coarse[0],
        "worst_hub": coarse[1],
        "refined": fine[0],
        "refined_hub": fine[1],
        "clean": clean[0],
        "clean_hub": clean[1],
        "clean_nominal": clean_nominal[0],
        "open": opened[0],
        "open_hub": opened[1],
        "wound": 1e3 * max(coarse[2], fine[2], clean[2]),
    }


def stability() -> Numbers:
    """Modes of its closed loop at 4.875 m and along the pay-out; growth in 1/s."""
    system = cases.system("heliogyro")
    found = system.modes(cases.load(CASE), count=12)
    late = cases.load(CASE, {"spool.feedback.sensor.delay": 5.0})
    constants = cases.load(CASE).spool.feedback.constants
    # the gains grow with the eighth power of the length
    strong = constants["end"] - 0.5**0.125 * constants["L"] / (constants["r"] * constants["rate"])
    last, delayed = found.modes[-1], system.modes(late, count=12).modes[-1]
    swings = [k for k, pole in enumerate(last.pole) if 0.01 < pole.imag < 0.5]
    slowest = min(swings, key=lambda k: float(last.damping_ratio[k]))
    waves = [float(pole.real) for of in found.modes for pole in of.pole if pole.imag > 0.5]
    growth = max(waves)
    return {
        "length": float(found.length[-1]),
        "frequency": float(last.frequency[slowest]),
        "damping": float(last.damping_ratio[slowest]),
        "decay": -max(float(pole.real) for pole in last.pole if abs(pole) < 0.5),
        "growth": growth,
        "share": 100.0 * math.expm1(max(growth, 0.0) * strong),
        "late": max(float(pole.real) for pole in delayed.pole if abs(pole) < 0.5),
    }
