"""Measurements for Tenenbaum (2014) on steps, contact, spin and symmetry: what the model rests on."""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping
from typing import Any

import numpy as np

import evolvent
from evolvent import cases
from evolvent_papers.papers.thread_runs import RIGID, means, read, tree
from evolvent_papers.papers.thread_variants import Data, hold

Array = np.ndarray
Numbers = Mapping[str, float]
#: Film of the paper's line density at 1400 kg/m3 and 20 um: modulus, N/m2, width and thickness, m; largest tension, N.
MODULUS, WIDTH, THICKNESS, TENSION = 1e9, 0.02625, 20e-6, 0.03
#: Largest step of RK4 times the largest circular frequency.
RK4 = 2.0 * math.sqrt(2.0)
#: A run at rest grows by less than this where its step is stable.
GROWTH = 1e3


@functools.cache
def longest_step(stiffness: float, damping: float = 1e-3, nodes: int = 20) -> float:
    """Longest step of RK4, s, at which a straight thread of nodes at rest does not grow a disturbance: of runs."""
    data = Data(nodes=nodes, stiffness=stiffness, damping=damping, rate=0.0, spool_rate=0.0)
    low, high = 0.0, 2.0 * data.stable_step("departure")
    while high - low > 1e-3 * high:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if hold(data, middle, 4000) < GROWTH else (low, middle)
    return low


def stiffness_step() -> Numbers:
    """Longest stable step of RK4 at 1e8 and 1e9 N/m by runs, 1e-6 s."""
    return {"c8": 1e6 * longest_step(1e8), "c9": 1e6 * longest_step(1e9)}


def damping_limits() -> Numbers:
    """Longest stable step of RK4 with the least and the largest damping by runs, 1e-6 s, at 1e7 and at 2.1e3 N/m."""
    return {
        f"{name}_{which}": 1e6 * longest_step(c, d)
        for name, c in (("stiff", 1e7), ("film", 2.1e3))
        for which, d in (("least", 1e-6), ("most", 1.0))
    }


def contact() -> Numbers:
    """Longest stable step of RK4, 1e-6 s: the paper's 20 nodes, and a turn of nodes that is held by contact.

    Six and 64 nodes on a turn, without contact, with contact so soft that the largest tension presses a node in by the
    film's thickness, and with that of the film across its thickness.
    """
    film = MODULUS * WIDTH * THICKNESS
    found = {"paper": 1e6 * longest_step(film / 0.25)}
    for per in (6, 64):
        segment = 2.0 * math.pi * 0.01 / per
        soft = TENSION * segment / 0.01 / THICKNESS
        for name, stiffness in (("none", 0.0), ("soft", soft), ("film", MODULUS * WIDTH * segment / THICKNESS)):
            found[f"{name}_{per}"] = 1e6 * _step_of_a_turn(per, film / segment, stiffness)
    return found


def _step_of_a_turn(count: int, spring: float, contact: float) -> float:
    """Longest stable step of RK4 of nodes on one turn of the spool, s, from their largest frequency."""
    angle = 2.0 * math.pi * np.arange(count) / count
    out = np.column_stack([np.cos(angle), np.sin(angle)])
    x = 0.01 * out
    stiffness = np.zeros((2 * count, 2 * count))
    for i in range(count - 1):
        apart = x[i + 1] - x[i]
        length = float(np.linalg.norm(apart))
        along = np.outer(apart, apart) / length**2
        block = spring * along + TENSION / length * (np.eye(2) - along)
        a, b = slice(2 * i, 2 * i + 2), slice(2 * i + 2, 2 * i + 4)
        stiffness[a, a] += block
        stiffness[b, b] += block
        stiffness[a, b] -= block
        stiffness[b, a] -= block
    for i in range(count):
        at = slice(2 * i, 2 * i + 2)
        stiffness[at, at] += contact * np.outer(out[i], out[i])
    mass = Data().line_density * 2.0 * math.pi * 0.01 / count
    return RK4 / math.sqrt(float(np.linalg.eigvalsh(stiffness)[-1]) / mass)


def spin() -> Numbers:
    """What deploys and holds the blade: length pulled off a free spool in 60 s, m, and angle that light turns it, deg.

    With the spin of the paper, a hundredth of it, and none; the light falls along Z on 4 m of 5 nodes for 200 s.
    """
    found = {}
    free = {"inertia": 1e-6, "viscous_damping": 2e-5, "rate": 0.0}
    for name, rate in (("full", 6.0), ("hundredth", 0.06)):
        given: dict[str, Any] = {"spool.rate": None, "spool.free": free, "spool.start_length": 0.1, "body.rate": rate}
        run = _whole(given | {"solver.duration": 60.0})
        found[f"length_{name}"] = float(run.deployed_length.values[-1, 0]) - 0.1
    light: dict[str, Any] = {
        "body.motion": "driven", "spool.start_length": 4.0, "spool.rate": 1e-9, "blade.width": WIDTH,
        "sunlight.direction": (0.0, 0.0, 1.0), "solver.duration": 200.0, "blade.segments": "springs",
        "blade.stiffness": 100.0, "blade.nodes": 5, "solver.method": "rk4",
    }  # fmt: skip
    for name, rate in (("full", 6.0), ("none", 0.0)):
        run = _whole(light | {"body.rate": rate})
        x = run["blade-1"].position.values[:, 0]
        across = np.degrees(np.arctan2(x[:, 2] - 0.01, np.hypot(x[:, 0], x[:, 1]) - 0.05))
        found[f"turned_{name}"] = float(np.abs(across).max())
    return found


def _whole(given: dict[str, Any]) -> Any:
    shared: dict[str, Any] = {"output.every": 1.0, "output.fine": False}
    return evolvent.run("heliogyro", RIGID | shared | given)


def both_blades() -> Numbers:
    """Two blades whose spools differ by 1 %, both computed, beside one blade that stands for both.

    Largest difference of the mean lags over the paper's windows, deg and percent, and of the body's rate, rad/s.
    """
    one = read(tree(RIGID))
    run = tree(RIGID | {"spool.rate": (3.5175, 3.4825), "solver.duration": 142.1})
    t, lags = run.time.values, np.degrees(run.tip_lag.values)
    rate = np.interp(t, one.t, one.rate)
    both = [means(read(run)._replace(lag=lag)) for lag in lags.T]
    apart = np.abs(np.array(both) - means(one))
    return {
        "lag": float(apart.max()),
        "percent": 100.0 * float((apart / means(one)).max()),
        "rate": float(np.abs(run.body_rate.values - rate).max()),
    }


def one_rotation() -> Numbers:
    """Largest tilt of the axis of a free body of 2.4 kg, deg: balanced, unbalanced and with rates 1 % apart.

    Unbalanced: its principal axes are turned by 1 deg about the axis across the blades or along them; the larger tilt.
    `round` is that of a body of the same moment about all axes where the rates differ.
    """
    block = (0.00328, 0.00328, 0.004)
    apart = [3.5175, 3.4825]
    return {
        "balanced": _tilt(block),
        "unbalanced": max(_tilt(block, math.radians(1.0), axis) for axis in (0, 1)),
        "uneven": _tilt(block, rates=apart),
        "round": _tilt((0.004, 0.004, 0.004), rates=apart),
    }


def _tilt(
    inertia: tuple[float, float, float], turn: float = 0.0, axis: int = 0, rates: list[float] | float = 3.5
) -> float:
    """Largest angle of the body's axis from Z over 140 s, deg, with principal axes turned about the body's x or y."""
    case = cases.load("heliogyro-unequal", {"spool.rate": rates, "body.inertia": list(inertia)})
    system = cases.system("heliogyro").build(case)
    c, s = math.cos(turn), math.sin(turn)
    Q = np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]] if axis == 0 else [[c, 0, s], [0, 1.0, 0], [-s, 0, c]])
    tensor = tuple(map(tuple, Q @ np.diag(inertia) @ Q.T))
    system.replace("body", system.parts["body"].model_copy(update={"inertia": tensor}))
    run = system.simulate(until=140.0, every=0.5, fine=False, method="dopri5", tolerance=1e-8)
    attitude = run["body"].attitude.values  # quaternion, scalar first
    return float(2.0 * np.degrees(np.arcsin(np.hypot(attitude[:, 1], attitude[:, 2]))).max())
