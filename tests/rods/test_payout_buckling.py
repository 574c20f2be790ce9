"""Strips that are paid out fast: Coriolis forces bend them edgewise, by which they buckle sideways."""

from __future__ import annotations

import numpy as np
import pytest

import evolvent

WIDTH, THICKNESS, DENSITY, OUT, SPIN = 26.25e-3, 20e-6, 1400.0, 4.5, 1.1


def twist_and_ratio(modulus: float) -> tuple[float, float]:
    """Largest twist, rad, and M^2 beside its bound of theory/rod-payout.md before the strip buckles."""
    changes: dict[str, object] = {"parts.body.angular_velocity": [0.0, 0.0, SPIN], "simulate.until": 5.0}
    changes["simulate.every"] = 0.25
    for k, sign in ((1, 1.0), (2, -1.0)):
        for part, x in ((f"horn {k}", 0.05), (f"blade {k}", 0.05), (f"tip {k}", 0.05 + OUT)):
            changes[f"parts.{part}.velocity"] = [sign * (0.06 if part[0] == "t" else 0.0), sign * x * SPIN, 0.0]
            changes[f"parts.{part}.angular_velocity"] = [0.0, 0.0, SPIN]
        changes[f"parts.tip {k}.position"] = [sign * (0.05 + OUT), 0.0, 0.0]
        changes[f"parts.blade {k}.payout"] = {"constant": {"rate": 0.06, "angle": OUT}}
        changes[f"parts.blade {k}.material.young_modulus"] = modulus
        changes[f"parts.blade {k}.stiffness_damping"] = 1e7 / modulus
    run = evolvent.run("heliogyro-strip-payout", changes)
    blade, first = run["blade 1"], np.asarray(run["time"]) < 2.6
    M = np.abs(np.asarray(blade["bending_moment_y"])).max(axis=1)
    N, length = np.asarray(blade["axial_force"]).mean(axis=1), np.asarray(blade["deployed_length"])
    spin = np.asarray(run["body"]["rate"])[:, 2]
    bound = N * WIDTH**2 / 12.0 * (N + DENSITY * THICKNESS * WIDTH * spin**2 * length**2 / np.pi**2)
    ratio = M[1:] ** 2 / bound[1:]  # the run starts without strain
    return float(np.abs(np.asarray(blade["twist_angle"])).max()), float(ratio[first[1:]].max())


@pytest.mark.slow
def test_a_strip_bent_edgewise_by_coriolis_forces_buckles_sideways() -> None:
    """Above the bound it twists out of its plane; five times softer, below it, it does not."""
    twist, ratio = twist_and_ratio(1e9)
    assert ratio > 1.0
    assert np.degrees(twist) > 10.0
    twist, ratio = twist_and_ratio(2e8)
    assert ratio < 0.7
    assert np.degrees(twist) < 3.0
