"""Steps on demand: the same as one run, closed forms under wrenches set from outside, and refusals."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import evolvent
from evolvent import InputError, RunFailed, Stepper, System, cases, elements, parts
from evolvent.results import variables
from evolvent.solvers.time.implicit.plan import solve_implicit


def craft(gravity: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> System:
    """A free hub with a beam clamped to it."""
    system = System(gravity=gravity)
    system.add(parts.RigidBody(mass=20.0, inertia=5.0), "hub")
    section, material = (
        elements.Rectangle(thickness=0.01, width=0.02),
        elements.Material(young_modulus=1e7, poisson_ratio=0.3, density=1000.0),
    )
    beam = parts.Beam(
        length=2.0, section=section, material=material, elements=6, formulation="cable", position=(0.5, 0.0, 0.0)
    )
    system.add(beam, "rib")
    system.add(parts.Joint(a=("hub", (0.5, 0.0, 0.0)), b="rib.root", type="clamp"), "root")
    return system


def mass() -> System:
    system = System()
    system.add(parts.RigidBody(mass=2.0, inertia=(0.5, 0.5, 0.8)), "body")
    system.add(parts.Spring(a=(-1.0, 0.0, 0.0), b="body", stiffness=50.0, length=1.0))
    return system


def test_steps_are_those_of_one_run() -> None:
    system = craft()
    stepper = Stepper(system, until=10.0, step=0.01)
    for _ in range(25):
        stepper.step(0.04)
    whole = solve_implicit(system.assemble(), samples=[0.0, 1.0], step=0.01)
    assert stepper.time == pytest.approx(1.0)
    np.testing.assert_allclose(stepper.state[: whole.y.shape[1]], whole.y[-1], atol=1e-9)


@pytest.mark.parametrize("step", [0.01, 0.005])
def test_a_load_may_change_where_a_step_ends(step: float) -> None:
    """The profile of the torque has knots at 1 and 2 s, which ten steps of 0.1 s reach but for round-off."""
    boom = evolvent.load("boom-slew")
    stepper, rates = Stepper(boom, inputs="hub", until=60.0, step=step), []
    for _ in range(40):
        stepper.step(0.1)
        rates.append(stepper.body("hub").rate[2])
    settings = {"method": "generalized-alpha", "step": step, "spectral_radius": 0.9, "tolerance": None}
    alone = boom.simulate(until=4.0, every=0.1, fine=False, **settings)  # type: ignore[call-overload]
    np.testing.assert_allclose(rates, alone["hub"].rate.values[1:, 2], rtol=0.0, atol=1e-8)


def test_a_torque_turns_the_whole_craft() -> None:
    """Angular momentum about the centre of mass follows the torque; the structure pulls back what the hub lacks."""
    stepper = Stepper(craft(), inputs=["hub"], until=10.0)
    momenta = []
    stepper.set_wrench("hub", torque=(0.0, 0.0, 0.2))
    for _ in range(50):
        before = stepper.body("hub").rate[2]
        stepper.step(0.02)
        momenta.append(stepper.wrench("hub")[1][2])
        gained = 5.0 * (stepper.body("hub").rate[2] - before) / 0.02
        if len(momenta) > 10:  # the mean of both ends is the step's to second order
            assert gained == pytest.approx(0.2 + 0.5 * (momenta[-1] + momenta[-2]), abs=2e-3)
    stepper.set_wrench("hub")
    assert stepper.body("hub").rate[2] > 0.0
    kept = stepper.body("hub").velocity
    for _ in range(5):
        stepper.step(0.02)
    assert np.all(np.isfinite(kept))


@pytest.mark.parametrize("method", ["generalized-alpha", "hht", "dopri5", "rk4"])
def test_a_force_held_from_outside_moves_an_oscillator(method: str) -> None:
    """x = F/k (1 - cos w t), the spring's force back is -k x; weight is not part of the wrench."""
    stepper = Stepper(mass(), inputs=["body"], method=method, until=10.0, tolerance=1e-8)
    stepper.set_wrench("body", force=(3.0, 0.0, 0.0))
    w = math.sqrt(50.0 / 2.0)
    for _ in range(40):
        stepper.step(0.025)
        x = 3.0 / 50.0 * (1.0 - math.cos(w * stepper.time))
        assert stepper.body("body").position[0] == pytest.approx(x, abs=5e-5)
        assert stepper.wrench("body")[0][0] == pytest.approx(-50.0 * x, abs=3e-3)


def test_weight_is_no_part_of_the_wrench() -> None:
    for method in ("generalized-alpha", "rk4"):
        system = System(gravity=(0.0, 0.0, -9.81))
        system.add(parts.RigidBody(mass=2.0, inertia=1.0), "body")
        stepper = Stepper(system, inputs=["body"], method=method, step=0.01, until=1.0)
        stepper.set_wrench("body", force=(0.0, 0.0, 2.0 * 9.81))
        stepper.step(0.1)
        np.testing.assert_allclose(stepper.wrench("body")[0], 0.0, atol=1e-9)
        np.testing.assert_allclose(stepper.body("body").velocity, 0.0, atol=1e-12)


def test_a_turned_body_has_its_quaternion_and_rate() -> None:
    system = System()
    system.add(parts.RigidBody(mass=2.0, inertia=1.0, angular_velocity=(0.0, 0.0, 0.5)), "body")
    stepper = Stepper(system, until=10.0)
    stepper.step(2.0)
    state = stepper.body("body")
    np.testing.assert_allclose(state.quaternion, [math.cos(0.5), 0.0, 0.0, math.sin(0.5)], atol=1e-7)
    np.testing.assert_allclose(state.rate, [0.0, 0.0, 0.5], atol=1e-12)


def test_refusals() -> None:
    with pytest.raises(InputError, match="inputs name 'bdy', which is no body; did you mean 'body'"):
        Stepper(mass(), inputs=["bdy"])
    with pytest.raises(InputError, match="method is 'rk5'"):
        Stepper(mass(), method="rk5")
    with pytest.raises(InputError, match="until is -1"):
        Stepper(mass(), until=-1.0)
    stepper = Stepper(mass(), until=1.0)
    with pytest.raises(InputError, match="'body' is not among the inputs"):
        stepper.set_wrench("body", force=(1.0, 0.0, 0.0))
    with pytest.raises(InputError, match="dt is 0"):
        stepper.step(0.0)
    with pytest.raises(InputError, match="beyond the stepper's end"):
        stepper.step(2.0)
    for name in ("bdy", 3, ["body"]):
        with pytest.raises(InputError, match="no body is called"):
            stepper.body(name)
        with pytest.raises(InputError, match="no body is called"):
            stepper.wrench(name)


@pytest.mark.parametrize(
    ("given", "told"),
    [
        ({"inputs": None}, "inputs is None; it must be names of bodies"),
        ({"inputs": 3}, "inputs is 3; it must be names of bodies"),
        ({"inputs": [["body"]]}, "which is no body; did you mean 'body'"),
        ({"until": "10 s"}, "until is '10 s'; it must be a finite time in seconds"),
        ({"start": None}, "start is None; it must be a finite time in seconds"),
        ({"step": "fast", "method": "rk4"}, "step is 'fast'; it must be a finite time above 0, or None"),
        ({"tolerance": -1.0, "method": "dopri5"}, "tolerance is -1.0; it must be a finite number above 0"),
    ],
)
def test_what_cannot_be_an_argument_is_told_in_a_sentence(given: dict, told: str) -> None:
    with pytest.raises(InputError, match=re.escape(told)):
        Stepper(mass(), **given)


def test_a_stepper_takes_a_system() -> None:
    with pytest.raises(InputError, match=r"system is a str; it must be a System \(Stepper.of_case takes a case\)"):
        Stepper("heliogyro")


def test_a_stepper_takes_a_loaded_case() -> None:
    """A section of one of several kinds keeps its kind when a checked case is read again."""
    tube = {"tube": {"radius": "5 mm", "thickness": "1 mm"}}
    material = {"young_modulus": "70 GPa", "poisson_ratio": 0.3, "density": "2700 kg/m^3"}
    mast = {"kind": "beam", "length": "1 m", "elements": 2, "section": tube, "material": material}
    bus = {"kind": "rigid-body", "mass": "10 kg", "inertia": "1 kg m^2"}
    fixed = {"kind": "joint", "a": "mast.root", "b": "bus", "type": "clamp"}
    content = {"parts": {"bus": bus, "mast": mast, "fixed": fixed}, "simulate": {"until": "1 s"}}
    loaded = cases.load(content)
    assert cases.load(loaded) == loaded
    assert Stepper.of_case(loaded).until == Stepper.of_case(content).until == 1.0


def test_one_input_may_be_given_by_its_name_alone() -> None:
    assert Stepper(mass(), inputs="body", until=1.0).inputs == ("body",)


def test_a_step_that_fails_says_why() -> None:
    system = craft()
    stepper = Stepper(system, inputs=["hub"], step=0.5, until=100.0)
    stepper.set_wrench("hub", torque=(1e9, 1e9, 0.0))
    with pytest.raises(RunFailed, match="the step of"):
        stepper.step(10.0)
    assert stepper.time < 10.0
    assert np.all(np.isfinite(stepper.state))


def test_wrenches_that_change_converge_in_second_order() -> None:
    """A force anew every 0.1 s on an oscillator, against the exact motion pieced together."""
    forces, dt, w = [3.0, -2.0, 5.0, 0.0, 4.0, -6.0], 0.1, 5.0
    c, s = math.cos(w * dt), math.sin(w * dt)
    x, v, exact = 0.0, 0.0, []
    for force in forces:
        rest = force / 50.0
        x, v = rest + (x - rest) * c + v / w * s, -(x - rest) * w * s + v * c
        exact.append(x)
    errors = []
    for step in (0.05, 0.025, 0.0125):
        stepper, found = Stepper(mass(), inputs=["body"], step=step, until=10.0), []
        for force in forces:
            stepper.set_wrench("body", force=(force, 0.0, 0.0))
            stepper.step(dt)
            found.append(stepper.body("body").position[0])
        errors.append(np.abs(np.array(found) - exact).max())
    assert errors[-1] < 1e-2 * np.abs(exact).max()
    assert 3.4 < errors[0] / errors[1] < 4.6
    assert 3.4 < errors[1] / errors[2] < 4.6


@pytest.mark.parametrize("method", ["generalized-alpha", "dopri5"])
def test_a_wrench_is_read_with_the_inputs_of_its_step(method: str) -> None:
    stepper = Stepper(mass(), inputs=["body"], method=method, until=10.0, tolerance=1e-8)
    stepper.set_wrench("body", force=(3.0, 0.0, 0.0))
    stepper.step(0.1)
    read = stepper.wrench("body")[0]
    stepper.set_wrench("body", force=(100.0, 0.0, 0.0))
    np.testing.assert_array_equal(stepper.wrench("body")[0], read)


def test_the_same_wrench_again_changes_nothing() -> None:
    steppers = [Stepper(craft(), inputs=["hub"], until=10.0, step=0.01) for _ in range(2)]
    for stepper in steppers:
        stepper.set_wrench("hub", torque=(0.0, 0.0, 0.2))
    for _ in range(10):
        steppers[1].set_wrench("hub", torque=(0.0, 0.0, 0.2))
        for stepper in steppers:
            stepper.step(0.02)
    np.testing.assert_array_equal(steppers[0].state, steppers[1].state)


def test_a_case_is_stepped_as_it_runs() -> None:
    """The heliogyro of inextensible blades; what the thread does to the body is what changes its spin."""
    case = {"blade.segments": "inextensible", "solver.method": "dopri5", "solver.duration": "2 s"}
    stepper = Stepper.of_case("heliogyro", case, inputs=["body"])
    assert stepper.bodies == ("body",)
    assert stepper.until == 2.0
    rate, torque = [stepper.body("body").rate[2]], [stepper.wrench("body")[1][2]]
    while stepper.time < 2.0 - 1e-9:
        stepper.step(0.02)
        rate.append(stepper.body("body").rate[2])
        torque.append(stepper.wrench("body")[1][2])
    change = 0.004 * np.diff(rate) / 0.02  # J W' = M (16)
    mean = 0.5 * (np.array(torque[1:]) + torque[:-1])
    np.testing.assert_allclose(change[20:], mean[20:], atol=2e-3 * np.abs(torque).max())
    run = evolvent.run("heliogyro", case)
    assert rate[-1] == pytest.approx(float(run.body_rate[-1]), abs=1e-7)


def test_cases_that_are_not_stepped() -> None:
    with pytest.raises(
        InputError, match="'inertia-stand', which is not stepped from outside; known: film-blade, helio"
    ):
        Stepper.of_case("inertia-stand")
    with pytest.raises(InputError, match="inputs name 'hub', which no force moves"):
        Stepper.of_case("wrapped-rib", inputs=["hub"])
    with pytest.raises(InputError, match="inputs name 'body' twice"):
        Stepper(mass(), inputs=["body", "body"])


@pytest.mark.parametrize("method", ["generalized-alpha", "hht", "rk4"])
def test_a_tumbling_body_that_nothing_touches_bears_no_wrench(method: str) -> None:
    system = System()
    system.add(parts.RigidBody(mass=2.0, inertia=(0.5, 0.6, 0.8), angular_velocity=(1.0, 2.0, 3.0)), "body")
    stepper = Stepper(system, method=method, until=1.0, step=1e-3)
    stepper.step(0.01)
    np.testing.assert_allclose(np.concatenate(stepper.wrench("body")), 0.0, atol=1e-12)


def test_a_stepper_that_has_failed_goes_no_further() -> None:
    stepper = Stepper(craft(), inputs=["hub"], step=0.5, until=100.0)
    stepper.set_wrench("hub", torque=(1e9, 1e9, 0.0))
    with pytest.raises(RunFailed):
        stepper.step(10.0)
    with pytest.raises(RunFailed, match="the stepper has failed at t = "):
        stepper.step(0.5)


_FIXED = {"simulate.method": "generalized-alpha", "simulate.step": "5 ms", "simulate.spectral_radius": 0.9}
_HALF_A_SECOND = {"simulate.until": "0.5 s", "simulate.every": "0.05 s"}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("case", "changes"),
    [
        ("boom-slew", _FIXED | {"simulate.tolerance": 1e-4}),
        ("solar-array", _FIXED),
        ("wire-boom-satellite", _FIXED),
        ("yo-yo-despin", {}),
    ],
)
def test_results_are_those_of_a_run(case: str, changes: dict) -> None:
    """All that a run has of its parts, but what adds up over its samples."""
    run = evolvent.run(case, _HALF_A_SECOND | changes)
    stepper = Stepper.of_case(case, _HALF_A_SECOND | changes)
    for _ in range(10):
        stepper.step(0.05)
    names = stepper.results()
    assert {"hub.position", "boom.strain"} <= set(names) or case != "boom-slew"
    listed = {name for name in variables.names(run) if variables.owner(name) in run.children}
    left_out = {name for name in listed - set(names) if not name.endswith((".work", ".angle"))}
    assert not left_out
    for name in names:
        of_run = variables.get(run, name)
        now = of_run.isel(time=-1).values if "time" in of_run.dims else of_run.values
        scale = float(np.nanmax(np.abs(of_run.values), initial=1e-6))
        np.testing.assert_allclose(
            np.ravel(stepper.result(name)), np.ravel(now), rtol=0.0, atol=1e-6 * scale + 1e-8, err_msg=name
        )


def test_a_result_knows_of_a_latch() -> None:
    stepper = Stepper.of_case("solar-array", {"simulate.tolerance": 1e-5, "simulate.spectral_radius": 0.3})
    assert np.all(np.isnan(stepper.result("hinge 1.latch_time")))
    while np.all(np.isnan(stepper.result("hinge 1.latch_time"))):
        stepper.step(1.0)
    run = evolvent.run("solar-array")
    np.testing.assert_allclose(stepper.result("hinge 1.latch_time"), run["hinge 1"].latch_time, rtol=1e-3)


def test_results_do_not_change_the_motion() -> None:
    one, other = (Stepper.of_case("boom-slew", until=2.0) for _ in range(2))
    for _ in range(10):
        one.step(0.1)
        other.step(0.1)
        for name in one.results():
            one.result(name)
    assert np.array_equal(one.state, other.state)
    assert all(np.array_equal(a, b) for a, b in zip(one.wrench("hub"), other.wrench("hub"), strict=True))


def test_results_by_name() -> None:
    stepper = Stepper.of_case("boom-slew", inputs="hub", until=2.0)
    stepper.set_wrench("hub", torque=(0.3, 0.2, 0.1))
    stepper.step(0.5)
    hub = stepper.body("hub")
    turn = Rotation.from_quat(hub.quaternion, scalar_first=True)
    np.testing.assert_allclose(stepper.result("hub.position"), hub.position, atol=1e-12)
    np.testing.assert_allclose(turn.apply(stepper.result("hub.rate")), hub.rate, atol=1e-12)
    assert stepper.result("boom.tip.position.y") == stepper.result("boom.position").reshape(-1, 3)[-1, 1]
    assert stepper.describe("hub.rate.z") == ("rad s-1", "angular velocity, body axes")
    for name, text in {
        "hub.rte": "did you mean 'hub.rate'",
        "hup.rate": "no result is called 'hup.rate'; did you mean 'hub.rate'",
        "hub": "'hub' is a part; give one of its results: position, attitude",
        "slew.work": "adds up over all samples of a run",
        "hub.rate.w": "the variable has no component 'w'",
        "boom[99].position": "boom.position has no 99",
        3: "no result is called 3",
    }.items():
        with pytest.raises(InputError, match=re.escape(text)):
            stepper.result(name)
