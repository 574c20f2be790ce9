"""Motors that are switched off at a time, by an event or by a latch: no torque from then on, under every method."""

from __future__ import annotations

import math
import pathlib
from typing import Any

import numpy as np
import pytest

import evolvent
from evolvent import InputError, System, parts
from evolvent.results.observe import observe
from evolvent.solvers import Solution, solve
from evolvent.solvers.time.implicit.energy_momentum import solve_energy
from evolvent.solvers.time.implicit.plan import solve_implicit

Array = np.ndarray
INERTIA, TORQUE, LATCH, SPRING = 0.4, 0.3, 0.5, 40.0
#: Time at which the torque has turned the wheel to the latch.
REACHED = math.sqrt(2.0 * LATCH * INERTIA / TORQUE)
METHODS: dict[str, tuple[Any, dict[str, Any]]] = {
    "rk4": (solve, {"method": "rk4", "step": 1e-3}),
    "dopri5": (solve, {"method": "dopri5", "rtol": 1e-9, "atol": 1e-11}),
    "alpha": (solve_implicit, {"tolerance": 1e-7, "spectral_radius": 0.9}),
    "alpha, fixed": (solve_implicit, {"step": 2e-3, "spectral_radius": 0.9}),
    "energy": (solve_energy, {"tolerance": 1e-7, "spectral_radius": 1.0}),
    "energy, fixed": (solve_energy, {"step": 2e-3, "spectral_radius": 1.0}),
}


def wheel(motor: parts.Motor, *, latch: float | None = None) -> System:
    """A wheel on a coordinate that a motor drives."""
    system = System()
    system.add(parts.RigidBody(motion="spin", inertia=INERTIA), "wheel")
    stiff = {} if latch is None else {"latch": latch, "latch_stiffness": SPRING}
    system.add(parts.JointSpring(a="ground", b="wheel", **stiff), "hinge")
    system.add(parts.Event(law="x - 0.5", variables={"x": "wheel.angle"}), "half")
    system.add(motor, "motor")
    return system


def run(system: System, method: str, end: float = 2.0) -> tuple[Solution, dict[str, Array]]:
    function, options = METHODS[method]
    found = function(system.assemble(), samples=np.linspace(0.0, end, 41), **options)
    assert found.success, found.message
    return found, {key: variable.values for key, variable in observe(found)["motor"].variables.items()}


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("by", ["time", "event", "latch"])
def test_a_motor_is_switched_off(by: str, method: str) -> None:
    """A constant torque until then; after it the wheel turns freely, or on its latch about where that has locked."""
    off = {"time": {"until": 0.8}, "event": {"released_by": "half"}, "latch": {"released_by": "hinge"}}[by]
    motor = parts.Motor(joint="hinge", torque={"constant": TORQUE}, **off)
    found, seen = run(wheel(motor, latch=LATCH if by == "latch" else None), method)
    until, t = 0.8 if by == "time" else REACHED, found.t
    rate, w = TORQUE / INERTIA * until, math.sqrt(SPRING / INERTIA)
    on, x = t < until - 1e-6, 0.5 * TORQUE / INERTIA * np.minimum(t, until) ** 2
    rest = np.maximum(t - until, 0.0)
    wanted = x + (rate / w * np.sin(w * rest) if by == "latch" else rate * rest)
    assert seen["angle"] == pytest.approx(wanted, abs=1e-3 if "fixed" in method else 2e-4)
    sure = np.abs(t - until) > 1e-3
    assert seen["torque"][sure] == pytest.approx(np.where(on, TORQUE, 0.0)[sure], abs=1e-12)
    assert seen["on"][sure].tolist() == on[sure].astype(float).tolist()
    assert seen["work"][-1] == pytest.approx(TORQUE * x[-1], abs=1e-5)  # within a long step it lies on a straight line
    assert found.balance.drives == pytest.approx(seen["work"], abs=1e-9)
    assert np.abs(found.energy_defect).max() < 2e-4 * TORQUE * x[-1]


@pytest.mark.parametrize("method", METHODS)
def test_a_motor_that_followed_a_motion_leaves_the_joint_free(method: str) -> None:
    """It does not hold the coordinate: the wheel keeps the rate that it has."""
    drive = parts.ConstantDrive(rate=2.0)
    motor = parts.Motor(joint="hinge", motion=drive, position_gain=40.0, velocity_gain=8.0, until=1.0)
    _, seen = run(wheel(motor), method)
    late = slice(22, None)
    assert np.all(seen["torque"][late] == 0.0)
    assert seen["rate"][late] == pytest.approx(seen["rate"][-1], abs=1e-4)
    assert seen["rate"][-1] == pytest.approx(2.0, abs=0.1)


@pytest.mark.parametrize("method", METHODS)
def test_a_latch_releases_a_joint(method: str) -> None:
    """A point mass on a spring flies once the latch of a wheel, which is 0.1 m off it, has locked."""
    motor = parts.Motor(joint="hinge", torque={"constant": TORQUE})
    system, k = wheel(motor, latch=LATCH), 1e4 if method in ("rk4", "dopri5") else 0.0
    system.add(parts.Point(mass=2.0, position=(3.0, 0.0, 0.0)), "mass")
    system.add(parts.Joint(a=(3.0, 0.0, 0.0), b="mass", released_by="hinge", stiffness=k), "hold")
    system.add(parts.Load(at="mass", force=(1.0, 0.0, 0.0)), "push")
    found, _ = run(system, method)
    hold = {key: variable.values for key, variable in observe(found)["hold"].variables.items()}
    t, index = found.t, found.assembly.index("mass", "points")
    x = found.y[:, int(found.assembly.model.points["iq"][index])]
    late = t > REACHED + 0.05
    assert hold["closed"].tolist() == (t <= REACHED).astype(float).tolist()
    assert np.all(hold["force"][late] == 0.0)
    allowed = 2e-4 if k == 0.0 else 1.5 * (1.0 / k + math.sqrt(1.0 / 2.0 / k) * 0.02)
    assert x[late] == pytest.approx(3.0 + 0.25 * (t[late] - REACHED) ** 2, abs=max(allowed, 1e-3))


@pytest.mark.parametrize(
    ("by", "words"),
    [
        ("halff", "'motor' refers to 'halff', but no part is called that; did you mean 'half'"),
        ("wheel", "motor.released_by is 'wheel', neither an event nor a spring with a latch"),
        ("hinge", "motor.released_by is 'hinge', a spring without a latch; give hinge.latch, or name an event"),
    ],
)
def test_what_switches_nothing_off_is_refused(by: str, words: str) -> None:
    motor = parts.Motor(joint="hinge", torque={"constant": TORQUE}, released_by=by)
    with pytest.raises(InputError, match=words):
        wheel(motor).assemble()


def test_a_latch_that_is_locked_from_the_start_is_refused() -> None:
    motor = parts.Motor(joint="hinge", torque={"constant": TORQUE}, released_by="hinge")
    with pytest.raises(InputError, match=r"motor\.released_by is 'hinge', whose latch is locked from the start"):
        wheel(motor, latch=0.0).assemble()


def test_a_file_has_the_keys(tmp_path: pathlib.Path) -> None:
    """Of a motor that is switched off, as the schema of parts has them."""
    motor = parts.Motor(joint="hinge", torque={"constant": TORQUE}, until=0.8, released_by="half")
    path = tmp_path / "wheel.yaml"
    path.write_text(wheel(motor).to_yaml(until="2 s"))
    assert {"until: 0.8 s", "released_by: half"} <= {line.strip() for line in path.read_text().splitlines()}
    row = evolvent.load(path).assemble().model.motors[0]
    assert (row["until"], row["event"]) == (0.8, 0)
