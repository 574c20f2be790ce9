"""The tie, a family from outside with a row of constraint, under every method; released, redundant, refused, varied.

`tests/families/test_outside_family.py` runs this module in a process in which its entry point is found.
"""

from __future__ import annotations

from typing import Any

import damper_case  # noqa: F401  (each family outside has a case)
import numpy as np
import pytest
from tie import Tie
from tie_case import FREQUENCY, LENGTH, START, G, case, pendulum

from evolvent import System, parts
from evolvent.equations.implicit import is_isolated
from evolvent.model.registry import families
from evolvent.results.happened import events_of
from evolvent.solvers.common.graph import pattern_of
from evolvent_base.errors import InputError
from families.case import swing
from families.rows import Row
from families.test_families import LONG, VARIANTS, check_equilibrium, check_motion, check_poles

METHODS = ["rk4", "dopri5", "generalized-alpha", "energy-momentum"]


@pytest.mark.parametrize("variant", [name for name in VARIANTS if name not in LONG])
def test_every_method_agrees_with_the_closed_form(variant: str) -> None:
    if variant == "static":
        check_equilibrium(case())
    elif variant == "modes":
        check_poles(case())
    else:
        check_motion(Row("ties", families()["ties"].kinds[0]), case(), variant)


@pytest.mark.parametrize("method", METHODS)
def test_the_tension_follows_from_the_multiplier(method: str) -> None:
    run = pendulum().simulate(until=1.0, every=0.1, method=method, **({} if method == "dopri5" else {"step": 1e-3}))
    angle = swing(run["time"].values, START, FREQUENCY)
    exact = 2.0 * G * (3.0 * np.cos(angle) - 2.0 * np.cos(START))
    assert run["tie"]["tension"].values == pytest.approx(exact, rel=2e-3)


@pytest.mark.parametrize("method", METHODS)
def test_two_points_keep_momentum_and_distance(method: str) -> None:
    found = System()
    found.add(parts.Point(mass=1.0, position=(0.5, 0.0, 0.0), velocity=(0.0, 1.0, 0.3)), "a")
    found.add(parts.Point(mass=2.0, position=(-0.5, 0.0, 0.0), velocity=(0.0, -1.0, 0.0)), "b")
    found.add(Tie(a="a", b="b"), "tie")
    assert is_isolated(0.0, found.assemble().model)
    assert not is_isolated(0.0, pendulum().assemble().model)
    assert len(pattern_of(found.assemble().model).pairs) == 2 + 1  # the row with both points, and these
    run = found.simulate(until=2.0, every=0.1, method=method, **({} if method == "dopri5" else {"step": 5e-3}))
    apart = np.linalg.norm(run["a"]["position"].values - run["b"]["position"].values, axis=-1)
    assert apart == pytest.approx(1.0, abs=1e-6)
    whole = 1.0 * run["a"]["velocity"].values + 2.0 * run["b"]["velocity"].values
    assert np.ptp(whole, axis=0).max() < 1e-6
    assert np.ptp(run["angular_momentum"].values, axis=0).max() < 1e-6


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("released", [{"until": 0.4}, {"released_by": "clock"}], ids=["until", "event"])
def test_a_released_point_flies_on(method: str, released: dict[str, Any]) -> None:
    found = pendulum(clock=0.4, **released)
    run = found.simulate(until=0.8, every=0.1, method=method, **({} if method == "dopri5" else {"step": 1e-3}))
    x, v = (run["bob"][name].values for name in ("position", "velocity"))
    t = run["time"].values
    late, k = t > 0.55, int(np.argmin(np.abs(t - 0.5)))
    after = (t - t[k])[late, None]
    assert x[late] == pytest.approx(x[k] + v[k] * after - 0.5 * G * np.array([0.0, 0.0, 1.0]) * after**2, abs=1e-5)


@pytest.mark.parametrize("method", METHODS)
def test_a_tie_is_cut_by_its_own_event(method: str) -> None:
    """It hangs on one side, and is cut on the other, once per run, where the height is that of 0.4 rad."""
    height = -LENGTH * np.cos(0.4)
    found = pendulum(cut=height)
    for _ in range(2):  # with what an earlier run has left
        run = found.simulate(until=0.9, every=0.05, method=method, **({} if method == "dopri5" else {"step": 1e-3}))
    events = events_of(run)
    assert events["part"].values.tolist() == ["tie"]
    assert events["what"].values.tolist() == ["cut"]
    time = float(events["time"].values[0])
    assert swing(np.array([time]), START, FREQUENCY)[0] == pytest.approx(-0.4, abs=2e-4)
    t, x = run["time"].values, run["bob"]["position"].values
    late = t > time
    rate = -np.sqrt(2.0 * G / LENGTH * (np.cos(0.4) - np.cos(START)))
    v = LENGTH * rate * np.array([np.cos(0.4), 0.0, -np.sin(0.4)])
    after = (t[late] - time)[:, None]
    exact = np.array([-LENGTH * np.sin(0.4), 0.0, height]) + v * after - 0.5 * G * np.array([0.0, 0.0, 1.0]) * after**2
    assert late.sum() > 3
    assert x[late] == pytest.approx(exact, abs=3e-4)
    assert run["tie"]["tension"].values[late] == pytest.approx(0.0, abs=1e-12)


def test_what_repeats_it_is_named() -> None:
    found = pendulum()
    found.add(Tie(a=(0.0, 0.0, 0.0), b="bob"), "again")
    with pytest.raises(InputError, match=r"'(tie|again)' is redundant: the other constraints already"):
        found.simulate(until=0.1, method="rk4", step=1e-3)
    run = found.simulate(until=0.1, every=0.1, method="energy-momentum", step=1e-3)
    both = run["tie"]["tension"].values, run["again"]["tension"].values
    assert both[0] == pytest.approx(both[1], rel=1e-6)


@pytest.mark.parametrize("mode", ["forward", "adjoint"])
def test_sensitivities(mode: str) -> None:
    settings: dict[str, Any] = {"until": 0.5, "method": "generalized-alpha", "step": 5e-3}
    found = pendulum().sensitivity("bob.position.z.last", ["gravity.2"], mode=mode, fine=False, **settings).dataset
    ends = []
    for d in (-1e-4, 1e-4):
        ends.append(float(pendulum(weight=G - d).simulate(**settings)["bob"]["position"].values[-1, 2]))
    assert float(found.derivative[0, 0]) == pytest.approx((ends[1] - ends[0]) / 2e-4, rel=1e-4)
