"""Runs that would need too many steps are ended, with a sentence on why."""

from __future__ import annotations

import pytest

from evolvent import RunFailed, System, parts
from evolvent.solvers.time import pace


def test_a_pace_that_leads_nowhere(monkeypatch):
    monkeypatch.setattr(pace, "LOOK", -1.0)
    steps = pace.Pace(0.0)
    assert steps.stall(0.5, 1000, 1.0) is None
    stall = steps.stall(0.5 + 1e-6, 2000, 1.0)
    assert stall is not None
    assert str(stall) == (
        "by t = 0.500001 s the steps have become so small, 1e-09 s on average, that the remaining 0.5 s would need "
        "5.0e+08 steps"
    )
    assert steps.stall(0.5 + 1e-6 + 1e-3, 3000, 1.0, fixed=1e-6) is None


@pytest.mark.slow
@pytest.mark.parametrize("method", ["dopri5", "generalized-alpha", "energy-momentum"])
def test_a_law_that_grows_without_bounds(method, monkeypatch):
    """A spring that follows exp(1000 t) swings ever faster: the run ends soon and names the law and its value."""
    monkeypatch.setattr(pace, "LOOK", 0.2)
    system = System()
    system.add(parts.Point(mass=1.0, position=(0.0, 0.0, 0.0)), "mass")
    system.add(parts.Spring(a=("ground", (-1.0, 0.0, 0.0)), b="mass", law="exp(1e3*t)", length=1.0), "spring")
    with pytest.raises(
        RunFailed, match=r"steps have become so small.*the law of 'spring' has the value .*check the law"
    ):
        system.simulate(until=1.0, method=method)
