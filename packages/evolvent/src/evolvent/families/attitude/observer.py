"""Observations of reaction wheels, thrusters and attitude controllers."""

from __future__ import annotations

import numpy as np

from evolvent.results.observe.symbols import Seat, entry, pin, revolved, symbol
from evolvent.results.observe.variables import Observed, observer
from evolvent.results.observe.view import View


@observer("wheels")
def observe_wheel(view: View, name: str) -> Observed:
    """Angle, rate, torques, momentum and energy of a reaction wheel.

    Notes
    -----
    Momentum and energy are those beyond what the body's inertia has of the wheel: h = J rate n, and
    J rate (rate/2 + n . w) (`attitude.evaluate_actuators`).
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


@symbol("wheel")
def _wheel(view: View, name: str, found: Observed) -> None:
    """A disc that turns, unless its radius is stated and it is drawn with that, and its axis."""
    part, row = view.part(name), view.model.wheels[view.index(name)]
    axis = np.asarray(row["axis"], dtype=float)
    seat = Seat(int(row["body"]), np.array(part.centre, dtype=float), axis)
    if part.radius is not None:
        shaft = (np.array([[-0.5], [0.5]]) * part.radius * axis).tolist()
        found.drawn.append(entry(view, found, seat, outline=[shaft], lift=True))
        return
    own = axis.tolist()
    solids = [pin(1.4, -0.3, 0.3, own, turned="angle"), pin(0.18, -1.2, 1.2, own)]
    found.drawn.append(entry(view, found, seat, solids=solids, lift=True))


@symbol("thruster")
def _thruster(view: View, name: str, found: Observed) -> None:
    """A nozzle, and a plume whose size follows the thrust."""
    row = view.model.thrusters[view.index(name)]
    seat = Seat(int(row["body"]), np.array(row["local"]), np.asarray(row["direction"], dtype=float))
    back = (-np.asarray(row["direction"], dtype=float)).tolist()
    plume = revolved([(0.0, 0.55), (3.5, 0.0)], back, scaled="thrust", most=float(row["limit"]))
    plume["revolution"]["centre"] = [1.2 * c for c in back]
    found.drawn.append(entry(view, found, seat, solids=[revolved([(0.0, 0.25), (1.2, 0.7)], back), plume]))
