"""A case as a laboratory would describe it: known stand, mass and centre of mass; unknown moments about x and z."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from evolvent_base.errors import InputError
from evolvent_massprops.inertia.stand import MOMENTS
from evolvent_massprops.inertia_stand.case import Case

#: Standard deviation of the noise, m, that a plan takes where a case has none.
NOISE = 1e-4


def description_of(case: Case) -> dict[str, Any]:
    """A description of a stand, as `evolvent_massprops.load` takes it, with what is expected and a plan.

    Raises
    ------
    InputError
        For limiters, whose friction no description has.
    """
    if case.stand.limiters is not None:
        raise InputError(
            "stand.limiters is given; a description of a stand takes a swing without friction: set stand.limiters=null"
        )
    body, given = case.body, case.stand
    stand: dict[str, Any] = {
        "kind": "springs", "support": given.support, "stiffness": given.stiffness,
        "natural_length": given.natural_length, "lateral_stiffness": given.lateral_stiffness, "damping": given.damping,
        "lateral_damping": given.lateral_damping, "gravity": given.gravity,
    }  # fmt: skip
    if given.points is None:
        stand |= {"half_length": given.half_length, "half_width": given.half_width}
    else:
        stand["points"] = given.points
    moments = {name: float(body.tensor[place]) for name, place in MOMENTS.items()}
    unknown = {name: f"unknown near {moments[name]!r} kg m^2" for name in ("Ixx", "Izz")}
    found: dict[str, Any] = {
        "signals": {"sensors": _sensors(case)},
        "stand": stand,
        "body": {
            "mass": body.mass, "offset_x": body.offset_x, "offset_z": body.offset_z, "height": body.height,
            **moments, **unknown,
        },
        "plan": {"excitation": case.excitation.model_dump(mode="json", exclude_none=True)},
    }  # fmt: skip
    if not case.sensors.noisy:
        found["plan"]["noise"] = NOISE
        found["remarks"] = (
            f"the case states no noise of its sensors; {1e3 * NOISE:g} mm is taken for a plan (sensors.noise or "
            "plan.noise)"
        )
    force = case.excitation.force
    if force is not None and force[1] < 0.0 and not force[0] and not force[2]:  # where it acts is compared
        found["plan"] |= {"force": -force[1]}
        del found["plan"]["excitation"]
    if case.air is not None:
        found["air"] = case.air.model_dump(mode="json", exclude_none=True)
        for shape in found["air"]["shapes"]:
            next(iter(shape.values()))["centre"] = list(body.centre)
    return found


def _sensors(case: Case) -> list[dict[str, Any]]:
    """The sensors with the names of their columns in a run; noise with that of the reading's step."""
    noise = np.broadcast_to(np.array(case.sensors.noise, dtype=float), (len(case.sensor_points),))
    noise = np.hypot(noise, case.sensors.quantisation / math.sqrt(12.0))
    at_springs = case.sensors.points == "springs"
    each = 3 if case.sensors.directions == "horizontal and vertical" else 1
    rows = []
    for k, (point, direction) in enumerate(zip(case.sensor_points, case.sensor_directions, strict=True)):
        row: dict[str, Any] = {"column": f"sensor {k + 1}", "point": 1 + k // each if at_springs else list(point)}
        row["direction"] = [float(x) for x in direction]
        if noise[k]:
            row["noise"] = f"{float(noise[k])!r} m"
        rows.append(row)
    return rows
