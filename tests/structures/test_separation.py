"""Separation by springs that end at their stroke: speed and tip-off rate against closed forms."""

import math

import pytest

from evolvent import System, parts

LAW = "where(x < 0, k*x - f + r*tanh(v/slip), 0)"
STROKE, STAGE, PAYLOAD, TURNS, TURNS_STAGE = 0.05, 1200.0, 60.0, 4.0, 400.0


def separated(method: str, lever: float, k: float, f: float, r: float) -> tuple[float, float]:
    """Relative speed and rate of turn after separation by one spring."""
    s = System()
    s.add(parts.RigidBody(mass=STAGE, inertia=(TURNS_STAGE, TURNS_STAGE, 300), position=(0, 0, -0.5)), "stage")
    s.add(parts.RigidBody(mass=PAYLOAD, inertia=(TURNS, TURNS, 4), position=(0, 0, 0.3)), "payload")
    ends = {"a": ("stage", (lever, 0, 0)), "b": ("payload", (lever, 0, 0)), "length": 0.8 + STROKE}
    s.add(parts.Spring(**ends, law=LAW, constants={"k": k, "f": f, "r": r, "slip": 1e-3}), "pusher")
    band = parts.Joint(a=("stage", (0, 0, 0.5)), b=("payload", (0, 0, -0.3)), type="clamp", until="0.05 s")
    s.add(band, "band")
    run = s.simulate(until=0.3, method=method)
    apart = (run["payload"].velocity - run["stage"].velocity).sel(axis="z")[-1].item()
    return apart, float(run["payload"].rate.sel(axis="y")[-1])


@pytest.mark.parametrize("method", ["energy-momentum", "dopri5"])
@pytest.mark.parametrize(("lever", "r"), [(0.0, 0.0), (0.0, 15.0), (0.02, 0.0)])
def test_speed_and_tip_off(method: str, lever: float, r: float) -> None:
    k, f = 1e4, 20.0
    work = (k * STROKE / 2 + f - r) * STROKE
    # the spring opens by the translation and by the turns of both bodies; its impulse p gives all three
    both = 1 / PAYLOAD + 1 / STAGE
    p = math.sqrt(2 * work / (both + lever**2 / TURNS + lever**2 / TURNS_STAGE))
    apart, rate = separated(method, lever, k, f, r)
    assert apart == pytest.approx(p * both, rel=1e-5)
    assert rate == pytest.approx(-lever * p / TURNS, rel=1e-4, abs=1e-12)
