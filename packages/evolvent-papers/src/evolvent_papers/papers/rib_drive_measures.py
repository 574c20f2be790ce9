"""Numbers of the ledger on drives of the wrapped rib, computed again: torque, hub that turns, net of cords."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

import evolvent
from evolvent import cases, closed_forms

Values = dict[str, float]
#: A rib of carbon fibre, which is wound slowly.
STIFF: dict[str, Any] = {
    "rib.young_modulus": 50e9, "damping.alpha": 0.1, "solver.tolerance": 1e-4, "output.every": 20.0,
    "output.fine": False,
}  # fmt: skip
#: Torques, N m, and ends of the runs, s.
TORQUES = {"below": (0.002, 600.0), "weak": (0.0062, 4000.0), "mean": (0.025, 600.0), "strong": (0.06, 600.0)}
#: A rib that stretches and resists bending by less than a per cent of its tension, wound by a hub that turns.
TURNED: dict[str, Any] = {
    "drive": {"kind": "hub", "rate": 1.0, "ramp": 2.0}, "hub.motion": "driven", "rib.start_angle": 0.5 * math.pi,
    "rib.young_modulus": 50e6, "solver.duration": 120.0, "output.every": 1.0, "output.fine": False,
}  # fmt: skip
#: Rate of the hub, rad/s, and drag, 1/s.
RATES = {"slow": (0.5, 0.2), "fast": (2.0, 0.5)}


def _case_and_run(changes: dict[str, Any]) -> tuple[Any, Any]:
    return cases.load("wrapped-rib", changes), evolvent.run("wrapped-rib", changes)


def _turns(run: Any, variable: str) -> float:
    """An angle at the end, in turns."""
    return float(run[variable][-1, 0]) / (2.0 * math.pi)


def torque() -> Values:
    """Turns that touch the hub under several torques, those of the elastica at rest, and the torques over EI/(2R).

    `n_` are the turns by which the rib is wound as if its tail were straight.
    """
    found: Values = {}
    for name, (given, end) in TORQUES.items():
        case, run = _case_and_run(STIFF | {"drive.torque": given, "solver.duration": end})
        ratio = given / closed_forms.least_winding_torque(case.strip)
        found |= {f"x_{name}": ratio, f"w_{name}": _turns(run, "touching_angle")}
        if name in ("mean", "strong"):
            held = closed_forms.held_tails(case.strip)
            found[f"h_{name}"] = float(np.interp(-given, -held.torque, held.touching)) / (2.0 * math.pi)
            found[f"n_{name}"] = _turns(run, "wrap_angle")
    return found


def hub_speed() -> Values:
    """Turns that touch a hub that turns in drag, those of a string, and mean torque in winding, of alpha m v L R."""
    found: Values = {}
    for name, (rate, alpha) in RATES.items():
        case, run = _case_and_run(TURNED | {"drive.rate": rate, "damping.alpha": alpha})
        string = closed_forms.spun_tail(case.strip, rate, alpha)
        found[f"w_{name}"] = _turns(run, "touching_angle")
        found[f"s_{name}"] = string.touching / (2.0 * math.pi)
        strip, t = case.strip, run["time"].values
        winding = np.flatnonzero((t > 3.0) & (t < 0.8 * strip.length / (rate * strip.radius)))
        work, turned = (np.ptp(run[variable].values[winding[[0, -1]]]) for variable in ("work_drives", "hub_angle"))
        drag = alpha * strip.line_density * rate * strip.radius * strip.length
        found[f"n_{name}"] = float(work / turned) / (drag * strip.radius)
    return found


def reflector() -> Values:
    """Torque of a hinge's spring over that of the cords on its rib, tension at rest and largest in the opening, N."""
    run = evolvent.run("rib-reflector")
    rib, cord, spring = run["rib 1"], run["cord 1"].force.values, run["spring 1"]
    places = rib.position.values[-1]
    height = float(places[-1, 2] - places[0, 2])
    wanted = 2.0 * float(cord[-1]) * math.sin(math.pi / 6.0) * height
    return {
        "ratio": float(spring.torque.values[-1]) / wanted,
        "rest": float(cord[-1]),
        "most": float(cord.max()),
        "height": height,
    }
