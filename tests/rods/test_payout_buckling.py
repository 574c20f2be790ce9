"""Strips that are paid out fast: Coriolis forces bend them edgewise, by which they buckle sideways."""

from __future__ import annotations

import numpy as np
import pytest

import evolvent
from evolvent import closed_forms

WIDTH, THICKNESS, DENSITY, OUT, SPIN, RATE = 26.25e-3, 20e-6, 1400.0, 4.5, 1.1, 0.06


def twist(modulus: float) -> float:
    """Largest twist, rad, of the sail that pays out its last 0.3 m."""
    changes: dict[str, object] = {"parts.body.angular_velocity": [0.0, 0.0, SPIN], "simulate.until": 5.0}
    changes["simulate.every"] = 0.25
    for k, sign in ((1, 1.0), (2, -1.0)):
        for part, x in ((f"horn {k}", 0.05), (f"blade {k}", 0.05), (f"tip {k}", 0.05 + OUT)):
            changes[f"parts.{part}.velocity"] = [sign * (RATE if part[0] == "t" else 0.0), sign * x * SPIN, 0.0]
            changes[f"parts.{part}.angular_velocity"] = [0.0, 0.0, SPIN]
        changes[f"parts.tip {k}.position"] = [sign * (0.05 + OUT), 0.0, 0.0]
        changes[f"parts.blade {k}.payout"] = {"constant": {"rate": RATE, "angle": OUT}}
        changes[f"parts.blade {k}.material.young_modulus"] = modulus
        changes[f"parts.blade {k}.stiffness_damping"] = 1e7 / modulus
    run = evolvent.run("heliogyro-strip-payout", changes)
    return float(np.abs(np.asarray(run["blade 1"]["twist_angle"])).max())


def limit(modulus: float) -> float:
    """Largest rate without buckling in the middle of the run, m/s, by the closed form."""
    rotor = closed_forms.Rotor(0.004, 0.05, 2, WIDTH * THICKNESS * DENSITY, 0.0005)
    film = closed_forms.Film(WIDTH, THICKNESS, modulus, 0.3)
    momentum = float(closed_forms.rotor_inertia(rotor, OUT)) * SPIN
    return closed_forms.payout_buckling(film, rotor, OUT + 0.15, momentum)


@pytest.mark.slow
def test_a_strip_bent_edgewise_by_coriolis_forces_buckles_sideways() -> None:
    """Above the largest rate it twists out of its plane; five times softer, below it, it does not."""
    assert limit(1e9) < RATE
    assert np.degrees(twist(1e9)) > 10.0
    assert limit(2e8) > 1.2 * RATE
    assert np.degrees(twist(2e8)) < 3.0
