"""Sensitivities of runs: against closed forms, and against central differences of runs with fixed steps."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import evolvent
from evolvent import System, elements, parts
from evolvent.assembly.assembled import Assembly
from evolvent.results.kept import kept_of
from evolvent.solvers.sensitivity.adjoint import Adjoint
from evolvent.solvers.sensitivity.patches import Sides
from evolvent.solvers.time.implicit import plan as implicit
from evolvent_base.errors import InputError

ALPHA, ENERGY = "generalized-alpha", "energy-momentum"
BOTH = pytest.mark.parametrize("method", [ALPHA, ENERGY])
#: Correction at which Newton's method of the runs that are compared has converged: differences show what it leaves.
NEWTON = 1e-14


def value_of(system: System, name: str, until: float, **settings: Any) -> float:
    """A value of a run with fixed steps, whose equations are solved to round-off."""
    samples = evolvent.analysis.settings.sample_times(until)
    found = implicit.plan(system.assemble(), samples=samples, newton=NEWTON, **settings).run()
    assert found.status in ("success", "stopped by event"), found.message
    kept = kept_of(found, [name], lambda: None, fine=np.zeros(found.t.size, dtype=bool), why="")  # type: ignore[arg-type, return-value]
    return float(np.ravel(kept[name])[-1])


def differences(system: System, name: str, key: str, at: float, change: float = 1e-3, **settings: Any) -> float:
    """Central difference of fourth order, of changes of a key beside its value."""
    size = abs(at) or 1.0

    def central(part: float) -> float:
        ends = [value_of(system.with_values({key: at + side * part * size}), name, **settings) for side in (1.0, -1.0)]
        return (ends[0] - ends[1]) / (2.0 * part * size)

    return (4.0 * central(0.5 * change) - central(change)) / 3.0


def oscillator() -> System:
    """A mass on a spring, pulled out by 0.2 m."""
    found = System()
    found.add(parts.Point(mass=2.0, position=(1.0, 0.0, 0.0)), "mass")
    found.add(parts.Spring(a=(0.0, 0.0, 0.0), b="mass", stiffness=8.0, length=0.8), "spring")
    return found


@pytest.mark.slow
@BOTH
def test_those_of_an_oscillator_are_its_closed_form(method: str) -> None:
    """x = L + (x0 - L) cos(w t), w^2 = k/m, to the second order of the step."""
    k, m, x0, length, t = 8.0, 2.0, 1.0, 0.8, 2.0
    w = math.sqrt(k / m)
    by_rate = -(x0 - length) * t * math.sin(w * t)
    expected = [by_rate * w / (2.0 * k), -by_rate * w / (2.0 * m), 1.0 - math.cos(w * t)]
    keys = ["spring.stiffness", "mass.mass", "parts.spring.length"]
    errors = []
    for step in (0.02, 0.01):
        found = (
            oscillator()
            .sensitivity("mass.position.x.last", keys, until=t, step=step, method=method, spectral_radius=1.0)
            .dataset
        )
        errors.append(np.abs(found.derivative.values[0] - expected))
    np.testing.assert_allclose(errors[0] / errors[1], 4.0, rtol=0.05)
    assert np.all(errors[1] < 2e-3 * np.abs(expected))
    assert found.unit.values.tolist() == [["m/(N/m)", "m/kg", "m/m"]]
    np.testing.assert_allclose(
        found.relative.values, found.derivative * found["at"] / found.result.values[:, None], rtol=1e-12
    )


@pytest.mark.slow
@BOTH
def test_those_of_a_value_at_a_time_and_an_integral_are_closed_forms(method: str) -> None:
    """Of the same oscillator: x at 1 s, and the integral of x, L t + (x0 - L) sin(w t)/w."""
    k, x0, length, t = 8.0, 1.0, 0.8, 2.0
    w, a = 2.0, x0 - length
    by_rate = np.array([-a * math.sin(w), a * (t * math.cos(w * t) / w - math.sin(w * t) / w**2)])
    found = oscillator().sensitivity(
        ["mass.position.x.at(1 s)", "mass.position.x.integral"], ["spring.stiffness", "spring.length"], until=t,
        every=0.005, step=2e-3, method=method, spectral_radius=1.0,
    ).dataset  # fmt: skip
    expected = [length + a * math.cos(w), length * t + a * math.sin(w * t) / w]
    np.testing.assert_allclose(found.result, expected, rtol=1e-4)
    np.testing.assert_allclose(found.derivative.sel(key="spring.stiffness"), by_rate * w / (2.0 * k), rtol=1e-4)
    np.testing.assert_allclose(
        found.derivative.sel(key="spring.length"), [1.0 - math.cos(w), t - math.sin(w * t) / w], rtol=1e-4
    )
    assert found.value_unit.values.tolist() == ["m", "m s"]


def hinge(**keys: Any) -> System:
    """A flap on a hinge, wound by 1.2 rad, that latches at 0."""
    found = System()
    body = parts.RigidBody(motion="spin", inertia=0.5, axis=(0.0, 0.0, 1.0))
    found.add(body, "flap")
    own = {"start": 1.0, "rest": -0.2, "stiffness": 2.0, "latch": 0.0, "latch_stiffness": 50.0, "latch_damping": 1.0}
    found.add(parts.JointSpring(a="ground", b="flap", axis=(0.0, 0.0, 1.0), **(own | keys)), "hinge")
    return found


@pytest.mark.slow
@BOTH
def test_that_of_the_time_of_a_latch_is_its_closed_form(method: str) -> None:
    """cos(w t) = (latch - rest)/(angle - rest), w^2 = k/I."""
    w, wound, left = 2.0, 1.2, 0.2
    t = math.acos(left / wound) / w
    by_rest = -(wound - left) / (wound**2 * w * math.sqrt(1.0 - (left / wound) ** 2))  # d acos(u)/du du/drest / w
    found = hinge().sensitivity(
        ["hinge.latch_time", "hinge.latch_rate"], ["hinge.stiffness", "flap.inertia", "hinge.rest"], until=1.0,
        step=1e-3, method=method, spectral_radius=1.0,
    ).dataset  # fmt: skip
    assert found.result[0] == pytest.approx(t, rel=1e-5)
    np.testing.assert_allclose(found.derivative[0], [-t / 4.0, t / 1.0, -by_rest], rtol=2e-5)
    rate = found.result.values[1]  # w^2 wound^2 sin^2: by k, rate/(2 k)
    assert found.derivative[1, 0] == pytest.approx(rate / 4.0, rel=2e-5)


def rod() -> System:
    """A cantilever of a geometrically exact rod, held by penalties, that bends far under a force at its tip."""
    found = System(gravity=(0.0, -2.0, 0.0))
    section = elements.Rectangle(thickness=0.02, width=0.05)
    material = elements.Material(young_modulus=2e6, poisson_ratio=0.0, density=1000.0)
    found.add(parts.Rod(length=1.0, section=section, material=material, elements=4), "rod")
    found.add(
        parts.Joint(a=(0.0, 0.0, 0.0), b="rod.root", type="clamp", stiffness=1e4, rotational_stiffness=1e2), "root"
    )
    found.add(parts.RigidBody(mass=0.2, shape=parts.Sphere(radius=0.05), position=(1.0, 0.0, 0.0)), "tip")
    found.add(parts.Joint(a="rod.tip", b="tip", type="clamp"), "end")
    return found


def ball() -> System:
    """A ball falls on a plane and rebounds."""
    found = System(gravity=(0.0, -9.81, 0.0))
    found.add(parts.RigidBody(mass=0.4, shape=parts.Sphere(radius=0.1), position=(0.0, 0.15, 0.0)), "ball")
    shapes = {"shape_a": parts.Sphere(radius=0.1), "shape": parts.Plane(normal=(0.0, 1.0, 0.0))}
    found.add(parts.Contact(a="ball", b=(0.0, 0.0, 0.0), stiffness=2e3, damping=0.3, **shapes), "touch")
    return found


def spinning() -> System:
    """A free body with three moments of inertia turns, pulled by a spring."""
    found = System()
    body = parts.RigidBody(
        mass=2.0, inertia=(0.1, 0.2, 0.25), position=(1.0, 0.0, 0.0), angular_velocity=(1.0, 3.0, 0.5)
    )
    found.add(body, "body")
    found.add(
        parts.Spring(a=(0.0, 0.0, 0.0), b=("body", (0.2, 0.1, 0.0)), stiffness=30.0, damping=0.4, length=1.0), "spring"
    )
    return found


def sliding() -> System:
    """A mass slides against friction, pulled back by a spring, and does not stop."""
    found = System()
    found.add(parts.Point(mass=2.0, velocity=(1.5, 0.0, 0.0)), "mass")
    keys = {"stiffness": 50.0, "friction": 1.0, "bristle_stiffness": 1e4}
    found.add(parts.JointSpring(a="ground", b="mass", axis=(1.0, 0.0, 0.0), motion="translation", **keys), "spring")
    return found


def thrown(latch: bool = False, **release: Any) -> System:
    """A panel turns about its hinge, against a spring, with a stone at its tip, which is released on the way."""
    found = System(gravity=(0.0, -1.0, 0.0))
    panel = {"velocity": (0.0, 1.5, 0.0), "angular_velocity": (0.0, 0.0, 3.0), "position": (0.5, 0.0, 0.0)}
    found.add(parts.RigidBody(mass=2.0, inertia=(0.3, 0.2, 0.4), **panel), "panel")
    found.add(parts.Joint(a="ground", b=("panel", (-0.5, 0.0, 0.0)), type="revolute", axis=(0.0, 0.0, 1.0)), "hinge")
    own = {"latch": 0.5, "latch_stiffness": 80.0, "latch_damping": 2.0} if latch else {}
    found.add(parts.JointSpring(joint="hinge", stiffness=5.0, rest=-0.4, damping=0.2, **own), "spring")
    found.add(parts.Point(mass=0.5, position=(1.0, 0.0, 0.0), velocity=(0.0, 3.0, 0.0)), "stone")
    found.add(parts.Event(law="y - 0.2", variables={"y": "panel.position.y"}), "high")
    found.add(parts.Joint(a=("panel", (0.5, 0.0, 0.0)), b="stone", type="spherical", **release), "hold")
    return found


def dropped() -> System:
    """A mass on a spring falls until an event stops the run."""
    found = System(gravity=(0.0, -2.0, 0.0))
    found.add(parts.Point(mass=2.0, position=(1.0, 0.0, 0.0)), "mass")
    found.add(parts.Spring(a=(0.0, 0.0, 0.0), b="mass", stiffness=8.0, length=0.8), "spring")
    found.add(parts.Event(law="-0.1 - y", variables={"y": "mass.position.y"}, stops=True), "down")
    return found


CASES: dict[str, tuple[Callable[[], System], str, dict[str, float], dict[str, Any], float]] = {
    "spinning": (
        spinning, "body.position.y.last", {"spring.stiffness": 30.0, "body.mass": 2.0, "spring.damping": 0.4},
        {"until": 2.0, "step": 0.01}, 1e-6,
    ),
    "rate": (spinning, "body.rate.z.last", {"spring.stiffness": 30.0}, {"until": 2.0, "step": 0.01}, 1e-6),
    "rod": (
        rod, "tip.position.y.last", {"rod.material.young_modulus": 2e6, "tip.mass": 0.2, "rod.length": 1.0},
        {"until": 0.6, "step": 0.005}, 1e-6,
    ),
    "contact": (
        ball, "ball.position.y.last", {"touch.stiffness": 2e3, "ball.mass": 0.4},
        {"until": 0.2, "step": 5e-4}, 1e-6,
    ),
    "friction": (
        sliding, "mass.position.x.last", {"spring.friction": 1.0, "mass.mass": 2.0}, {"until": 0.2, "step": 1e-3},
        1e-6,
    ),
}  # fmt: skip


CASES["beam"] = (
    lambda: evolvent.load("boom-slew"), "tip mass.position.y.last",
    {"boom.material.young_modulus": 70e9, "tip mass.mass": 0.5, "hub.mass": 20.0},
    {"until": 1.0, "step": 0.02}, 1e-6,
)  # fmt: skip
CASES["latch"] = (
    lambda: evolvent.load("solar-array"), "hinge 2.latch_time",
    {"hinge 1.stiffness": 0.2, "panel 2.mass": 4.0, "hinge 3.damping": 0.05, "hinge 2.rest": math.radians(20.0)},
    {"until": 7.38, "step": 0.003}, 1e-5,  # latches lock within 1e-10 rad, which is 4e-6 of these differences
)  # fmt: skip


CASES |= {
    "event that stops": (
        dropped, "mass.velocity.y.last", {"spring.stiffness": 8.0, "gravity.1": -2.0},
        {"until": 1.0, "step": 0.01}, 1e-6,
    ),
    "release by an event": (
        lambda: thrown(released_by="high"), "stone.position.y.last", {"spring.stiffness": 5.0, "stone.mass": 0.5},
        {"until": 0.4, "step": 2e-3}, 1e-5,
    ),
    "release by a latch": (
        lambda: thrown(latch=True, released_by="spring"), "stone.position.y.last",
        {"spring.stiffness": 5.0, "stone.mass": 0.5}, {"until": 0.4, "step": 2e-3}, 1e-5,
    ),
    "release at a time": (
        lambda: thrown(until=0.1031), "stone.position.y.last", {"spring.stiffness": 5.0, "hold.until": 0.1031},
        {"until": 0.4, "step": 2e-3}, 1e-6,
    ),
}  # fmt: skip


@pytest.mark.slow
@BOTH
@pytest.mark.parametrize("case", CASES)
def test_those_of_runs_with_fixed_steps_are_central_differences(case: str, method: str) -> None:
    """Free rotation, beams and exact rods with joints, a contact, friction, latches, events and releases."""
    system, name, keys, settings, within = CASES[case]
    settings = {**settings, "method": method, "spectral_radius": 0.9}
    built = system()
    found = built.sensitivity(name, list(keys), **settings).dataset
    for key, at in keys.items():
        change = {"latch": 2e-4, "release at a time": 1e-3}.get(case, 1e-4 if "release" in case else 1e-3)
        compared = differences(built, name, key, at, change=change, **settings)
        assert float(found.derivative.sel(value=name, key=key)) == pytest.approx(compared, rel=within), (case, key)


#: Cases that the adjoint does not support, and what it says.
REFUSED = {("friction", ALPHA): "joints have friction", ("friction", ENERGY): "joints have friction"}


#: Cases whose strains or gaps energy-momentum filters over two steps, unless its spectral radius is 1.
FILTERED = ("rod", "contact", "beam")


@pytest.mark.slow
@BOTH
@pytest.mark.parametrize("case", CASES)
def test_those_of_the_adjoint_are_those_of_neighbours(case: str, method: str) -> None:
    """Free rotation, beams and exact rods with joints, a contact, latches, events, releases; friction is refused."""
    system, name, keys, settings, _ = CASES[case]
    radius = 1.0 if method == ENERGY and case in FILTERED else 0.9
    settings = {**settings, "method": method, "spectral_radius": radius}
    built: Any = system()
    if (case, method) in REFUSED:
        with pytest.raises(InputError, match=f"{REFUSED[case, method]}.*mode 'forward'"):
            built.sensitivity(name, list(keys), mode="adjoint", **settings)
        return
    forward, adjoint = (
        built.sensitivity(name, list(keys), mode=mode, **settings).dataset for mode in ("forward", "adjoint")
    )
    np.testing.assert_allclose(adjoint.derivative, forward.derivative, rtol=5e-6)
    assert adjoint.attrs["mode"] == "adjoint"
    assert adjoint.unit.values.tolist() == forward.unit.values.tolist()


@pytest.mark.slow
@BOTH
@pytest.mark.parametrize(
    "name",
    [
        "hinge.latch_time", "hinge.angle.last", "hinge.torque.last", "flap.angle.integral", "flap.angle.mean",
        "hinge.angle.at(1.2 s)", "flap.rate.z.abs_max",
    ],
)  # fmt: skip
def test_values_of_the_adjoint_follow_from_samples_and_events(name: str, method: str) -> None:
    """Of a hinge that latches: its time, values at a time and over time, and what a key changes in a value itself."""
    keys = ["hinge.stiffness", "flap.inertia", "hinge.latch", "hinge.latch_stiffness"]
    settings: dict[str, Any] = {"until": 1.5, "step": 0.01, "method": method, "spectral_radius": 0.6}
    forward, adjoint = (
        hinge().sensitivity(name, keys, mode=mode, **settings).dataset for mode in ("forward", "adjoint")
    )
    size = float(np.abs(forward.derivative).max())
    np.testing.assert_allclose(adjoint.derivative, forward.derivative, rtol=1e-6, atol=1e-6 * size)


def test_the_adjoint_of_an_extreme_between_samples_is_refused() -> None:
    """The rate is largest when the latch locks; at the samples it is smaller and has other derivatives."""
    settings: dict[str, Any] = {"until": 1.5, "step": 0.01, "method": "generalized-alpha"}
    with pytest.raises(
        InputError, match=r"rate.abs_max' is not supported: the value is .* over all steps and .*'forward'"
    ):
        hinge().sensitivity("hinge.rate.abs_max", ["hinge.stiffness"], mode="adjoint", **settings)
    value = hinge().sensitivity("hinge.rate.abs_max", ["hinge.stiffness"], mode="forward", **settings).dataset
    assert value.result.item() == pytest.approx(math.sqrt(2.0 * (1.2**2 - 0.2**2) / 0.5), rel=1e-3)
    assert value.derivative.item() == pytest.approx(0.5 * value.result.item() / 2.0, rel=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "settings", "text"),
    [
        ("hinge.latch_rate", {}, "no time of a latch or event"),
        ("energy_kinetic.last", {}, "does not follow from coordinates and rates alone"),
        ("hinge.damper_work.last", {}, "does not follow from coordinates and rates alone"),
        ("hinge.latch_time", {"method": "rk4"}, "the method is rk4"),
        (
            "hinge.latch_time",
            {"method": ENERGY, "tolerance": 1e-8, "step": None},
            "does not support adaptive steps of energy-momentum; take `spectral_radius` 1",
        ),
        ("hinge.latch_time", {"mode": "backward"}, "must be one of forward, adjoint"),
    ],
)
def test_what_the_adjoint_does_not_have_is_refused(name: str, settings: dict[str, Any], text: str) -> None:
    given: dict[str, Any] = {"until": 1.5, "step": 0.01, "method": ALPHA, "mode": "adjoint"} | settings
    with pytest.raises(InputError, match=text):
        hinge().sensitivity(name, "hinge.stiffness", **given)


@pytest.mark.slow
def test_strains_that_are_filtered_over_two_steps_are_refused() -> None:
    settings: dict[str, Any] = {"until": 0.1, "step": 0.01, "method": ENERGY, "mode": "adjoint"}
    with pytest.raises(InputError, match="filtered strains of rods of energy-momentum; take `spectral_radius` 1"):
        rod().sensitivity("tip.position.y.last", "tip.mass", **settings)


@pytest.mark.slow
def test_strains_of_beams_that_are_filtered_are_refused() -> None:
    settings: dict[str, Any] = {"until": 0.1, "step": 0.02, "method": ENERGY, "mode": "adjoint"}
    with pytest.raises(InputError, match="filtered strains of beams of energy-momentum; take `spectral_radius` 1"):
        evolvent.load("boom-slew").sensitivity("tip mass.position.y.last", "tip mass.mass", **settings)


def masses_in_a_row(count: int) -> System:
    """Masses on damped springs, one behind the other."""
    chain = System()
    last: Any = (0.0, 0.0, 0.0)
    for k in range(count):
        chain.add(parts.Point(mass=1.0, position=(1.0 + k, 0.1 * math.cos(k), 0.0)), f"m{k}")
        chain.add(parts.Spring(a=last, b=f"m{k}", stiffness=100.0 + k, length=0.95, damping=0.1), f"s{k}")
        last = f"m{k}"
    return chain


@pytest.mark.slow
def test_keys_that_change_different_equations_are_evaluated_together() -> None:
    """Of a chain all masses at once, and every other spring: three evaluations a step beside that of the run."""
    chain, count, change = masses_in_a_row(8), 8, 1e-6
    system = chain.with_values({})
    assembly = system._assembled()
    keys = [(f"s{k}.stiffness", 100.0 + k) for k in range(count)] + [(f"m{k}.mass", 1.0) for k in range(count)]

    def changed(name: str, value: float) -> Assembly:
        return system.with_values({name: value})._assembled()

    listed = []
    for name, at in keys:
        sides = changed(name, at * (1.0 + change)), changed(name, at * (1.0 - change))
        listed.append((name, at * change, Sides.of(assembly, sides, name)))
    samples = evolvent.analysis.settings.sample_times(0.1)
    settings: dict[str, Any] = {"method": ALPHA, "step": 0.01}
    adjoint = Adjoint(lambda: evolvent.analysis.runs.plan(assembly, samples, **settings)[0], listed)
    assert adjoint.run()[0] == "success"
    assert adjoint._sides().tolist() == [1, 1, 1]


@pytest.mark.slow
@BOTH
def test_the_adjoint_of_a_chain_is_the_same_for_groups_of_keys(method: str) -> None:
    """Sixty keys in one pass: those that change different equations are evaluated together."""
    count, chain = 30, masses_in_a_row(30)
    keys = [f"s{k}.stiffness" for k in range(count)] + [f"m{k}.mass" for k in range(count)]
    settings: dict[str, Any] = {"until": 1.0, "step": 0.01, "method": method, "spectral_radius": 0.6}
    found = chain.sensitivity("m5.position.x.last", keys, mode="adjoint", **settings).dataset
    few = keys[::7]
    compared = chain.sensitivity("m5.position.x.last", few, **settings).dataset
    scale = float(np.abs(compared.derivative).max())
    np.testing.assert_allclose(found.derivative.sel(key=few), compared.derivative, rtol=1e-5, atol=1e-6 * scale)


@pytest.mark.slow
def test_those_through_latches_are_the_same_by_both_methods() -> None:
    """The last hinge latches after two others have: starts and jumps at these are in it."""
    array = evolvent.load("solar-array")
    keys = ["hinge 1.stiffness", "hinge 2.stiffness", "panel 1.mass"]
    settings: dict[str, Any] = {"until": 10.0, "spectral_radius": 0.6}
    steps = {ENERGY: 0.005, ALPHA: 0.002}
    found = {
        method: array.sensitivity(
            "hinge 1.latch_time", keys, method=method, step=step, **settings
        ).dataset.derivative.values[0]
        for method, step in steps.items()
    }
    np.testing.assert_allclose(found[ENERGY], found[ALPHA], rtol=2e-4)
    compared = differences(
        array, "hinge 1.latch_time", keys[1], 0.1, change=2e-5, method=ENERGY, step=steps[ENERGY], **settings
    )
    assert found[ENERGY][1] == pytest.approx(compared, rel=3e-5)


@pytest.mark.slow
def test_steps_that_are_adaptive_are_those_of_the_run() -> None:
    found = hinge().sensitivity("hinge.latch_time", "hinge.stiffness", until=1.0, method=ENERGY, tolerance=1e-9).dataset
    assert found.attrs["steps"] == "as in the run"
    assert float(found.derivative[0, 0]) == pytest.approx(-float(found.result[0]) / 4.0, rel=1e-4)


@pytest.mark.slow
def test_a_run_has_those_of_its_case() -> None:
    run = hinge().simulate(until=1.0, step=1e-2, method=ENERGY)
    shown = run.ev.sensitivity("hinge.latch_time", "parts.flap.inertia")
    found = shown.dataset
    assert "hinge.latch_time  parts.flap.inertia" in str(shown)
    assert float(found.derivative[0, 0]) == pytest.approx(float(found.result[0]), rel=1e-3)
    assert float(found.result[0]) == float(run["hinge"].latch_time.values[-1])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("values", "keys", "settings", "words"),
    [
        ("hinge.latch_time", "hinge.stiffness", {"method": "rk4"}, "the method is rk4; name one of them"),
        ("hinge.latch_time", "hing.stiffness", {}, "no part is called 'hing'; did you mean 'hinge'?"),
        ("hinge.latch_time", "hinge.stifness", {}, "did you mean"),
        ("hinge.latch_time", "hinge.a", {}, "a derivative is by a key that holds a number"),
        ("hinge.latch_time", "hinge.damping", {}, "needs values on both sides"),
        ("hinge.angle", "hinge.stiffness", {}, "values; a derivative is of one"),
        ("hinge.latch", "hinge.stiffness", {}, "latch"),
        ("hinge.latch_time", "hinge.stiffness", {"until": 0.1}, "is nan in this run"),
        (["hinge.latch_time", "hinge.latch_time"], "hinge.stiffness", {}, "values name 'hinge.latch_time' twice"),
        ([], "hinge.stiffness", {}, "values are []; they must be one or more names"),
    ],
)
def test_what_has_no_derivative_is_refused(values: Any, keys: Any, settings: dict[str, Any], words: str) -> None:
    given: dict[str, Any] = {"until": 1.0, "step": 0.01, "method": ENERGY} | settings
    with pytest.raises(InputError) as refused:
        hinge().sensitivity(values, keys, **given)
    assert words in str(refused.value)


@pytest.mark.slow
def test_a_value_with_a_kink_is_refused() -> None:
    """The largest distance from where the mass starts is not smooth where a change of sides makes it another one."""
    found = System()
    found.add(parts.Point(mass=2.0, position=(1.0, 0.0, 0.0)), "mass")
    found.add(parts.Spring(a=(0.0, 0.0, 0.0), b="mass", stiffness=8.0, length=1.0), "spring")
    with pytest.raises(InputError, match=r"has no derivative by .spring.length.: it is"):
        found.sensitivity("mass.position.x.max", "spring.length", until=2.0, step=0.01, method=ENERGY)


@pytest.mark.slow
def test_a_release_after_a_very_short_step_is_refused() -> None:
    """A panel that is driven on comes to rest short of its latch at the end of a step."""
    driven = thrown(latch=True, released_by="spring").with_values({"spring.stiffness": 30.0, "spring.rest": 1.5})
    with pytest.raises(InputError, match=r"the step to a release at t = .* is .* s, too short"):
        driven.sensitivity("stone.position.y.last", "stone.mass", until=0.4, step=1e-3, method=ENERGY)


@pytest.mark.slow
def test_events_that_shift_no_step_are_refused() -> None:
    """Two events in one step, and one that lies at the end of a step by chance."""
    twice = dropped()
    twice.add(parts.Event(law="-0.1 - y", variables={"y": "mass.position.y"}), "again")
    settings: dict[str, Any] = {"step": 0.01, "method": ENERGY, "spectral_radius": 0.9}
    with pytest.raises(InputError, match=r"'down' and 'again' happen at t = .* in one step"):
        twice.sensitivity("mass.velocity.y.last", "gravity.1", until=1.0, **settings)
    at = value_of(dropped(), "mass.position.y.last", 0.2, **settings)
    chance = dropped()
    chance.add(parts.Event(law=f"{at + 1e-9!r} - y", variables={"y": "mass.position.y"}), "chance")
    with pytest.raises(InputError, match="ends on an event by chance; take another step"):
        chance.sensitivity("mass.velocity.y.last", "gravity.1", until=1.0, **settings)
