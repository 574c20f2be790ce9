"""Numbers of own findings on the stand: several mountings, air that moves along, limiters with friction."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

import evolvent
from evolvent import cases
from evolvent_massprops.inertia import Body, Stand, air, from_three_frequencies, linear_model
from evolvent_massprops.inertia.combined import Combined
from evolvent_massprops.inertia.problem import problem, undetermined
from evolvent_massprops.inertia.stand import Mounting, setup
from evolvent_massprops.inertia.statics import rotation_matrix
from evolvent_massprops.inertia.vibration import linearise

Values = Mapping[str, float]
#: Standard deviations of a frequency, relative, and of a shape's largest amplitude, as a recording with 1 % noise has.
FREQUENCY, SHAPE = 1e-5, 1e-3
#: Density of air, kg/m3.
AIR = 1.204


def _paper() -> tuple[Stand, Body]:
    """The paper's stand, guided, and its body."""
    case = cases.load("inertia-stand", {"stand.support": "guided"})
    s = case.stand
    stand = Stand(points=s.springs, stiffness=s.stiffness, length=s.natural_length, support="guided")
    return stand, Body(mass=case.body.mass, centre=(0.1, -0.05, 0.08), inertia=case.body.tensor)


def _combined(turns: list[tuple[float, float, float]]) -> Combined:
    """Exact modes of four vertical sensors in mountings, all ten numbers of the body unknown."""
    stand, body = _paper()
    names = ("mass", "ex", "h", "ez", "Ixx", "Iyy", "Izz", "Ixy", "Ixz", "Iyz")
    found = []
    for turn in turns:
        mounting = Mounting(rotation=rotation_matrix(0.5 * math.pi * np.array(turn)))
        modes = linearise(setup(stand, body)._replace(mounting=mounting)).modes()
        w, v = modes.natural_frequency, modes.at(stand.points)
        v = v / np.abs(v).max(axis=1)[:, None]
        found.append(
            problem(
                stand, body, names, w, frequency_covariance=np.diag((FREQUENCY * w) ** 2), shapes=v,
                shape_covariance=np.broadcast_to(SHAPE**2 * np.eye(4), (3, 4, 4)), points=stand.points,
                mounting=mounting,
            )
        )  # fmt: skip
    return Combined(problems=tuple(found), unknown=names, own=(names,) * len(found))


def mountings() -> Values:
    """Unknowns left open by one, two and three mountings, and deviations of Iyy and Ixy from three, % of Iyy."""
    turns = [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)]
    found = {}
    for n, name in enumerate(("one", "two", "three"), start=1):
        p = _combined(turns[:n])
        J = p.jacobian(p.initial_estimate)
        found[name] = float(len(undetermined(J, p.unknown, p.scale)))
    std = np.sqrt(np.diag(np.linalg.inv(J.T @ J)))
    moment = float(p.initial_estimate[p.unknown.index("Iyy")])
    return found | {name: 100.0 * float(std[p.unknown.index(name)]) / moment for name in ("Iyy", "Ixy")}


def air_of_the_body() -> Values:
    """Air of a cylinder as wide as the paper's body, of the length of its moments; what it does to the moments, %."""
    stand, body = _paper()
    body = Body(mass=body.mass, centre=(0.0, 0.0, 0.0), inertia=body.inertia)
    radius = 0.87
    length = math.sqrt(12.0 * float(body.inertia[2, 2]) / float(body.mass) - 3.0 * radius**2)
    mass, moments = air.cylinder(radius, length, np.array([1.0, 0.0, 0.0]))
    mounting = Mounting(
        air_mass=mass[None], air_inertia=moments[None], air_centre=np.zeros((1, 3)), air_on_body=(True,),
        air_factor=np.ones(1), air_density=AIR,
    )  # fmt: skip
    modes = linearise(setup(stand, body)._replace(mounting=mounting)).modes()
    seen = {"shapes": modes.at(stand.points), "points": stand.points}
    without = linear_model(stand, body).modes()
    plain = from_three_frequencies(
        stand, body, without.natural_frequency, shapes=without.at(stand.points), points=stand.points
    )
    found = from_three_frequencies(stand, body, modes.natural_frequency, **seen)
    return {
        "length": length,
        "mass": AIR * float(mass[1, 1]),
        "share": 100.0 * AIR * float(mass[1, 1]) / float(body.mass),
        "Ixx": 100.0 * (found["Ixx"] / plain["Ixx"] - 1.0),
        "Izz": 100.0 * (found["Izz"] / plain["Izz"] - 1.0),
    }


def limiters() -> Values:
    """Amplitude that heave loses in a period on limiters with friction, over 4 F/K; errors of its frequency, %.

    `period` is by the instants at which it comes to rest above, `fit` of a decaying cosine over 1.6 s; `left` is the
    amplitude at the end, of that at the start.
    """
    mass, stiffness, pressed, friction, first = 150.0, 8e4, 100.0, 0.05, 0.02
    case: dict[str, Any] = {
        "system": "inertia-stand",
        "body": {"mass": mass, "inertia": [10.0, 16.0, 12.0]},
        "stand": {
            "support": "guided", "half_length": 0.6, "half_width": 0.4, "stiffness": 0.25 * stiffness,
            "natural_length": 0.3,
            "limiters": {
                "clearance": -1e-6 * pressed, "friction": friction, "stiffness": 1e6, "bristle_stiffness": 1e7
            },
        },
        "excitation": {"displacement": [0.0, first, 0.0]},
        "sensors": {"rate": 100.0, "duration": 1.6},
        "solver": {"method": "dopri5"},
        "identification": {"way": "none", "order": 1},
    }  # fmt: skip
    run = evolvent.run(case)
    fine = evolvent.run(case | {"sensors": {"rate": 2000.0, "duration": 1.6}})
    t, y, v = fine.time.values, fine.sensor_true.values[:, 0], fine["body"].velocity.values[:, 1]
    top = np.flatnonzero((v[:-1] > 0.0) & (v[1:] <= 0.0))  # comes to rest above: once a period
    times = t[top] + v[top] / (v[top] - v[top + 1]) * (t[top + 1] - t[top])
    w, force = math.sqrt(stiffness / mass), 8.0 * friction * pressed
    periods = len(top) - 1
    lost = (y[top[0]] - y[top[-1]]) / periods
    return {
        "lost": float(lost) / (4.0 * force / stiffness),
        "period": 100.0 * (2.0 * math.pi * periods / (w * float(times[-1] - times[0])) - 1.0),
        "fit": 100.0 * (float(run.mode_frequency[0]) / w - 1.0),
        "left": float(y[top[-1]]) / first,
    }
