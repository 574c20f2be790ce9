"""The adjoint of runs is held by closed forms and by central differences of whole runs."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from evolvent import System, parts
from evolvent_base.errors import InputError
from structures.test_sensitivity import ALPHA, BOTH, ENERGY, differences, hinge


def driven_wheel() -> System:
    """A motor follows an angle that grows, and turns a wheel against a spring."""
    found = System()
    found.add(parts.RigidBody(motion="spin", inertia=0.4), "wheel")
    found.add(parts.JointSpring(a="ground", b="wheel", stiffness=1.5), "hinge")
    drive = parts.ConstantDrive(rate=0.7, angle=0.6)
    found.add(parts.Motor(joint="hinge", motion=drive, position_gain=5.0, velocity_gain=0.3), "motor")
    return found


@pytest.mark.slow
@BOTH
def test_those_of_a_motor_that_is_driven_are_its_closed_form(method: str) -> None:
    """J x'' + c x' + (k + p) x = p (r + w t) + c w, from rest: derivatives of x by k and J."""
    end, keys = 0.8, {"hinge.stiffness": 1.5, "wheel.inertia": 0.4}

    def angle(k: float, J: float) -> float:
        p, c, r, w = 5.0, 0.3, 0.6, 0.7
        slope = p * w / (k + p)
        a, decay = (p * r + c * (w - slope)) / (k + p), 0.5 * c / J
        swing = math.sqrt((k + p) / J - decay**2)
        sine = -(slope + decay * a) / swing
        return a + slope * end + math.exp(-decay * end) * (sine * math.sin(swing * end) - a * math.cos(swing * end))

    settings: dict[str, Any] = {"until": end, "step": 1e-3, "method": method}
    forward, adjoint = (
        driven_wheel().sensitivity("hinge.angle.last", list(keys), mode=mode, **settings).dataset
        for mode in ("forward", "adjoint")
    )
    np.testing.assert_allclose(adjoint.derivative, forward.derivative, rtol=1e-6)
    for j, (key, at) in enumerate(keys.items()):
        sides = [angle(*[v * (1.0 + d * (name == key)) for name, v in keys.items()]) for d in (1e-4, -1e-4)]
        exact = (sides[0] - sides[1]) / (2e-4 * at)
        assert float(adjoint.derivative[0, j]) == pytest.approx(exact, rel=1e-4), key


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "change", "within"),
    [
        ("hinge.latch_time", 2e-3, 1e-6),
        ("hinge.angle.last", 1e-4, 1e-5),  # latches lock within 1e-10 rad, which is 2e-6 of these differences
    ],
)
def test_those_of_the_adjoint_through_a_latch_are_central_differences(name: str, change: float, within: float) -> None:
    """Of energy-momentum, with fixed steps."""
    keys = ["hinge.stiffness", "flap.inertia"]
    settings: dict[str, Any] = {"until": 1.5, "step": 0.01, "method": ENERGY, "spectral_radius": 0.9}
    found = hinge().sensitivity(name, keys, mode="adjoint", **settings).dataset
    for key in keys:
        compared = differences(hinge(), name, key, float(found["at"].sel(key=key)), change=change, **settings)
        assert float(found.derivative.sel(value=name, key=key)) == pytest.approx(compared, rel=within), key


def test_a_law_of_a_motor_is_refused_by_the_adjoint() -> None:
    found = driven_wheel()
    found.add(parts.Motor(joint="hinge", law="0.2 - 0.1*v"), "second")
    with pytest.raises(InputError, match="motors have a law, which the adjoint does not support"):
        found.sensitivity("hinge.angle.last", "wheel.inertia", until=0.1, step=0.01, method=ALPHA, mode="adjoint")
