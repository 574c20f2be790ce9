"""Motors with a winding, detent, magnetic losses and a gear: steady states in closed form, balances, refusals."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from book import Book
from evolvent import InputError, System, parts
from evolvent.families.motors import drivetrain
from resistances.rigs import INERTIA, METHODS, run, seen, wheel

Array = np.ndarray
K, R, U, N = 0.2, 2.0, 10.0, 4.0
WINDING: dict[str, Any] = {"torque_constant": K, "resistance": R, "ratio": N}


def motor(**keys: Any) -> parts.Motor:
    return parts.Motor(joint="hinge", **(WINDING | keys))


def loaded(it: parts.Motor, load: float, **spring: Any) -> System:
    """A wheel with a motor, "it", and a constant torque against it."""
    found = wheel(it, **spring)
    found.add(parts.Motor(joint="hinge", torque={"constant": -load}), "load")
    return found


@pytest.mark.parametrize("method", METHODS)
def test_speeds_up_to_no_load(book: Book, method: str) -> None:
    """By the back-EMF alone, v = U/(n K) (1 - exp(-(n K)^2 t/(R J))); the stall torque is n K U/R."""
    c = N * K
    times = np.linspace(0.0, 6.0, 13)
    found = run(wheel(motor(voltage={"constant": U})), times, method, **({"step": 0.01} if method == "rk4" else {}))
    own = seen(found, "it")
    exact = U / c * (1.0 - np.exp(-c * c / (R * INERTIA) * times))
    book(
        "Rigid bodies", f"Motor at a constant voltage without load ({method}): rate",
        reference="exponential to U/(n K)", source="closed form",
        error=np.abs(own["rate"] - exact).max() / (U / c), allowed=2e-4,
    )  # fmt: skip
    assert own["torque"][0] == pytest.approx(c * U / R, rel=1e-3)
    assert own["current"] == pytest.approx((U - c * own["rate"]) / R, rel=1e-6)
    # all of the electric energy is in the wheel or in the winding
    kinetic = 0.5 * INERTIA * own["rate"] ** 2
    assert own["electrical_work"] == pytest.approx(kinetic + own["copper_work"], rel=3e-3, abs=1e-3)
    assert own["electrical_power"] == pytest.approx(U * own["current"], rel=1e-6, abs=1e-9)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("load", [0.6, -1.5])
def test_a_steady_rate_and_where_the_power_goes(book: Book, method: str, load: float) -> None:
    """Driving a load through a gear, and driven by it: i, rate and every loss in closed form."""
    h, b, e, back = 0.004, 1e-4, 0.8, 0.6
    it = motor(voltage={"constant": U}, hysteresis_torque=h, eddy_damping=b, efficiency=e, back_efficiency=back)
    found = run(loaded(it, load, damping=0.0), np.linspace(0.0, 30.0, 7), method,
                **({"step": 2e-3} if method == "rk4" else {}))  # fmt: skip
    own = seen(found, "it")
    # at the joint: e (n K i - n^2 b v - n h) = load where it drives, else (n h - D) / back = -load
    drive = N * h + load / e if load > 0.0 else N * h + load * back
    c = N * K
    rate = (c * U / R - drive) / (c * c / R + N * N * b)
    current = (U - c * rate) / R
    book(
        "Rigid bodies",
        f"Motor with magnetic losses and a gear {'driving' if load > 0 else 'driven'} ({method}): steady rate",
        reference=f"{rate:.5f} rad/s", source="balance of torques",
        error=abs(own["rate"][-1] - rate) / rate, allowed=2e-4,
    )  # fmt: skip
    assert own["current"][-1] == pytest.approx(current, rel=2e-4)
    assert own["joint_torque"][-1] == pytest.approx(load, rel=1e-3)
    powers = {key: (own[key][-1] - own[key][-2]) / 5.0 for key in ("electrical_work", "copper_work", "eddy_work",
              "magnetic_work", "gear_work")}  # fmt: skip
    gear = (1.0 - e) * (drive - N * h) if load > 0.0 else (1.0 / back - 1.0) * (N * h - drive)
    wanted = {
        "electrical_work": U * current, "copper_work": R * current**2, "eddy_work": N * N * b * rate**2,
        "magnetic_work": N * h * rate, "gear_work": gear * rate,
    }  # fmt: skip
    for key, value in wanted.items():
        assert powers[key] == pytest.approx(value, rel=2e-3), key
    lost = sum(value for key, value in powers.items() if key != "electrical_work")
    assert powers["electrical_work"] == pytest.approx(lost + load * rate, rel=1e-3)
    assert np.abs(found.energy_defect).max() < 2e-3 * max(found.balance.by_friction[-1], 1.0)


@pytest.mark.parametrize("step", [0.02, 0.2])
@pytest.mark.parametrize("hysteresis", [0.0, 0.004])
def test_the_balance_closes_at_long_steps(step: float, hysteresis: float) -> None:
    """Under energy-momentum to round-off, with a detent that the rotor passes, and where a gear alone rubs."""
    it = motor(current={"sine": {"amplitude": 3.0, "frequency": 0.2}}, hysteresis_torque=hysteresis, eddy_damping=1e-4,
               detent_torque=0.03, detents=6, efficiency=0.8, back_efficiency=0.6)  # fmt: skip
    found = run(wheel(it, stiffness=0.2), np.linspace(0.0, 20.0, 11), "energy", step=step)
    assert np.abs(found.energy_defect).max() < 1e-11
    own = seen(found, "it")
    assert found.balance.by_friction == pytest.approx(own["magnetic_work"] + own["gear_work"], abs=1e-12)
    assert found.balance.by_joints == pytest.approx(own["eddy_work"], abs=1e-12)
    assert own["gear_work"][-1] > 0.0
    assert np.ptp(own["angle"]) > 1.0


def test_a_detent_holds_without_current() -> None:
    """A rotor at rest in a detent swings with n sqrt(A N/J), and holds up to n A."""
    A, cycles = 0.03, 6
    it = motor(current={"constant": 0.0}, detent_torque=A, detents=cycles, bristle_stiffness=1.0)
    rate = 1e-3
    found = run(wheel(it, rate=rate), np.linspace(0.0, 2.0, 41), "energy", step=2e-3)
    w = N * math.sqrt(A * cycles / INERTIA)
    assert seen(found, "it")["angle"] == pytest.approx(rate / w * np.sin(w * found.t), abs=1e-3 * rate / w)
    assert found.balance.by_friction[-1] == 0.0


@pytest.mark.parametrize("method", ["alpha", "energy"])
def test_a_gear_that_locks_itself_holds_a_load(method: str) -> None:
    """Up to its holding torque; the motor drives on through it."""
    keys: dict[str, Any] = {"current": [[0.0, 0.0], [1.0, 0.0], [1.0, 5.0]], "back_efficiency": 0.0, "efficiency": 0.5}
    found = run(loaded(motor(**keys, holding_torque=2.0), 0.3), np.linspace(0.0, 2.0, 21), method)
    own = seen(found, "it")
    assert np.abs(own["angle"][:11]).max() < 1e-3
    assert own["joint_torque"][-1] == pytest.approx(0.5 * N * K * 5.0)
    assert own["rate"][-1] == pytest.approx((2.0 - 0.3) / INERTIA, rel=3e-2)
    free = seen(run(loaded(motor(**keys, holding_torque=0.2), 0.3), np.linspace(0.0, 1.0, 11), method), "it")
    assert free["rate"][-1] == pytest.approx(-0.1 / INERTIA, rel=1e-2)


@pytest.mark.parametrize("push", [-0.7, -0.05, 0.05, 0.7])
@pytest.mark.parametrize("backward", [0.6, 0.0])
def test_the_limit_of_friction_is_smooth_where_it_is_said(push: float, backward: float) -> None:
    kind = [(key, float) for key in ("ratio", "hysteresis", "forward", "backward", "holds")]
    rows = np.array([(2.0, 0.1, 0.8, backward, 3.0)], dtype=kind).view(np.recarray)
    law: Any = getattr(drivetrain.friction_limit, "py_func", drivetrain.friction_limit)
    slope, d = law(rows, 0, push)[1], 1e-6
    assert slope == pytest.approx((law(rows, 0, push + d)[0] - law(rows, 0, push - d)[0]) / (2.0 * d), rel=1e-6)
    at = 0.2  # 2 * 0.1, where the motor begins to drive
    assert law(rows, 0, at + 1e-12)[0] == pytest.approx(law(rows, 0, at - 1e-12)[0], rel=1e-9)


REFUSED: list[tuple[dict[str, Any], str]] = [
    ({"voltage": {"constant": 1.0}, "torque_constant": None}, r"it\.torque_constant is missing; it\.voltage needs it"),
    (
        {"torque": {"constant": 1.0}},
        r"it\.torque_constant belongs to it\.voltage or it\.current, but it\.torque is given",
    ),
    ({"current": {"constant": 1.0}, "detent_torque": 0.1}, r"it\.detent_torque and it\.detents go together"),
    ({"current": {"constant": 1.0}, "back_efficiency": 0.0}, r"it\.holding_torque belongs to a gear that locks itself"),
    ({"current": {"constant": 1.0}, "efficiency": 0.0}, r"it\.efficiency is 0\.0"),
    ({"current": {"expression": "sin(t)"}, "efficiency": 0.5}, r"it\.bristle_stiffness is missing"),
    ({"current": {"constant": "1 V"}}, r"current"),
]


@pytest.mark.parametrize(("keys", "sentence"), REFUSED)
def test_refusals(keys: dict[str, Any], sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        wheel(motor(**keys)).assemble()
