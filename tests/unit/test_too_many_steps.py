"""Explicit runs that cannot end are refused with their number of steps; steps are chosen for every row of methods."""

from __future__ import annotations

import math

import numpy as np
import pytest

from evolvent import InputError, System, parts
from evolvent.solvers.time.explicit import plan as explicit_plan
from evolvent.solvers.time.explicit.methods import METHODS, RK4, Method
from evolvent.solvers.time.explicit.stability import energy_change

#: Kutta's method of third order, which no table of the package has.
KUTTA3 = Method(
    "kutta3", np.array([[0.0, 0.0, 0.0], [0.5, 0.0, 0.0], [-1.0, 2.0, 0.0]]), np.array([1 / 6, 2 / 3, 1 / 6]),
    np.array([0.0, 0.5, 1.0]), 3,
)  # fmt: skip


def bob(stiffness=0.0, damping=0.0):
    system = System()
    system.add(parts.Point(mass=1.0, position=(1.001, 0.0, 0.0)), "bob")
    system.add(parts.Spring(a=(0, 0, 0), b="bob", length=1.0, stiffness=stiffness, damping=damping), "spring")
    return system.assemble()


def test_what_a_mode_loses_follows_from_the_tableau():
    """Heun gains z^4/4 a step, RK4 loses z^6/72 (Hairer, Norsett, Wanner)."""
    assert energy_change(METHODS["heun"]) == (3, pytest.approx(1.0 / 4.0))
    assert energy_change(RK4) == (5, pytest.approx(1.0 / 72.0))
    for method in (*METHODS.values(), KUTTA3):
        order, change = energy_change(method)
        z = 0.02 if order < 6 else 0.1
        w = np.array([[0.0, 1.0], [-1.0, 0.0]])
        R = sum(np.linalg.matrix_power(z * w, k) * c for k, c in enumerate(_coefficients(method)))
        assert abs(np.linalg.det(R) - 1.0) == pytest.approx(change * z ** (order + 1), rel=0.02)


def _coefficients(method):
    power, found = np.ones(method.b.size), [1.0]
    for _ in range(method.b.size):
        found.append(float(method.b @ power))
        power = method.A @ power
    return found


@pytest.mark.parametrize("method", [*METHODS, "kutta3"])
def test_a_run_that_cannot_end_is_refused(method, monkeypatch):
    monkeypatch.setitem(METHODS, "kutta3", KUTTA3)
    for stiffness in (1e16, 1e20, 1e24):
        # the stable steps of 1e16 are few enough, but not those that keep the energy of the fastest mode
        assembly = bob(stiffness)
        if METHODS[method].is_adaptive and stiffness == 1e16:
            continue
        with pytest.raises(InputError, match=rf"^{method} .* steps in all, more than 1e\+09 .*'bob'") as caught:
            explicit_plan.plan(assembly, samples=[0.0, 1.0], method=method)
        steps = float(str(caught.value).split(" steps in all")[0].rpartition(", ")[2])
        assert steps > 1e9
        assert explicit_plan.plan(assembly, samples=[0.0, 1e-9], method=method).times[-1] == 1e-9


@pytest.mark.parametrize("method", [*METHODS, "kutta3"])
@pytest.mark.parametrize("spring", [{"stiffness": 100.0}, {"damping": 100.0}, {}])
def test_a_step_is_chosen_whatever_the_row(method, spring, monkeypatch):
    monkeypatch.setitem(METHODS, "kutta3", KUTTA3)
    assembly = bob(**spring)
    if not spring:
        with pytest.raises(InputError, match="nothing in the model sets a frequency"):
            explicit_plan.choose_step(assembly, method, None, 1.0)
        return
    step, limit, _ = explicit_plan.choose_step(assembly, method, None, 1.0)
    assert 0.0 < step < limit < math.inf
    if spring.get("stiffness") and not METHODS[method].is_adaptive:
        run = explicit_plan.solve(assembly, samples=[0.0, 1.0], method=method)
        x = 1.0 + 0.001 * math.cos(10.0)
        assert run.y[-1, 0] == pytest.approx(x, abs=2e-5 if method == "heun" else 1e-6)
