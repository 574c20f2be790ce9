"""Observations of reaction wheels, thrusters and attitude controllers."""

from __future__ import annotations

from evolvent.results.observe.variables import Observed, observer
from evolvent.results.observe.view import View


@observer("wheels")
def observe_wheel(view: View, name: str) -> Observed:
    """Angle, rate, torques, momentum and energy of a reaction wheel.

    Notes
    -----
    Momentum and energy are those beyond what the body's inertia has of the wheel: h = J rate n, and
    J rate (rate/2 + n . w) (`kernels.attitude.evaluate_actuators`).
    """
    found, row = Observed(), view.model.wheels[view.index(name)]
    found.results("wheels", view.fields["wheels"], view.index(name))
    part = view.part(name)
    if part.radius is not None:
        found.drawn = [
            {
                "spool": {
                    "body": part.body, "radius": part.radius, "angle": "angle", "centre": list(part.centre),
                    "axis": [float(c) for c in row["axis"]], "width": 0.3 * part.radius,
                }
            }
        ]  # fmt: skip
    found.plots = ["rate", "torque"]
    return found


@observer("thrusters")
def observe_thruster(view: View, name: str) -> Observed:
    """Force and impulse of a thruster."""
    found = Observed()
    found.results("thrusters", view.fields["thrusters"], view.index(name))
    found.drawn = [{"forces": {"name": name, "points": "position", "vectors": "force"}}]
    found.plots = ["thrust"]
    return found


@observer("controllers")
def observe_controller(view: View, name: str) -> Observed:
    """Errors of attitude and rate, and the commanded torque of a controller."""
    found = Observed()
    found.results("controllers", view.fields["controllers"], view.index(name))
    found.plots = ["error", "torque"]
    return found
