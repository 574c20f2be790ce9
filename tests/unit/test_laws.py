"""Users' laws that fail: indices out of bounds, exceptions, laws that never return; in every place, by every solver."""

from __future__ import annotations

import re

import numpy as np
import pytest
from numba import config

from evolvent import InputError, RunFailed, Stepper, System, law, parts
from evolvent.solvers import solve
from evolvent.solvers.modal.modes import modes
from evolvent.solvers.static.static import solve_static
from evolvent.solvers.time.implicit.plan import solve_implicit

HERE = r"\(.*test_laws\.py:\d+\)"
METHODS = ["rk4", "heun", "dopri5", "generalized-alpha"]


@law
def short_spring(extension, rate, t, p):
    return p[0] * extension + p[2] * rate


@law
def brittle(extension, rate, t, p):
    if extension > p[0]:
        raise ValueError("the spring broke")
    return 0.1 + 0.0 * extension


@law
def stepwise(extension, rate, t, p):
    return p[int(4.0 * t)]


@law
def short_force(x, v, t, p):
    return p[0], p[1], p[2]


@law
def gust(x, v, t, p):
    if t > p[0]:
        raise ValueError("no wind data beyond this time")
    return 0.0, p[1], 0.0


@law
def short_drive(t, p):
    return p[0] + p[1] * t, p[1], 0.0


@law
def until(t, p):
    if t > p[0]:
        raise ValueError("the table ends")
    return p[1] + p[2] * t, p[2], 0.0


@law
def short_event(t, y, p):
    return y[0] - p[1]


@law
def far_state(t, y, p):
    return y[1000] - p[0]


@law
def late(t, y, p):
    if t > p[0]:
        raise ValueError("no event is known")
    return -1.0


def on_spring(law, *parameters: float, event=None) -> System:
    """A mass that leaves the end of a spring at 1 m/s."""
    system = System()
    system.add(parts.Point(mass=1.0, position=(1.0, 0.0, 0.0), velocity=(1.0, 0.0, 0.0)), "ball")
    system.add(parts.Spring(a=(0.0, 0.0, 0.0), b="ball", length=1.0, law=law, parameters=parameters), "spring")
    if event is not None:
        system.add(parts.Event(law=event[0], parameters=event[1:]), "event")
    return system


def reeled(drive, load=None) -> System:
    """A blade of three nodes on a spinning hub."""
    system = System()
    system.add(parts.RigidBody(motion="spin", inertia=0.004, rate=6.0), "hub")
    system.add(parts.Reel(body="hub", centre=(0.05, 0.0, 0.0), radius=0.01, drive=drive), "reel")
    blade = {"length": 2.0, "line_density": 7e-4, "nodes": 3, "stiffness": 1e3, "boundary_segment": "constant"}
    system.add(parts.Thread(reel="reel", **blade), "blade")
    if load is not None:
        system.add(parts.Load(along="blade", law=load[0], parameters=load[1:]), "wind")
    return system


def driven(law, *parameters: float) -> System:
    """A point that a joint carries along a line by a drive."""
    system = System()
    system.add(parts.Point(mass=1.0, position=(0.0, 0.0, 0.0)), "ball")
    drive = parts.LawDrive(law=law, parameters=parameters)
    system.add(parts.Joint(a="ground", b="ball", type="point-on-line", drive=drive, axis=(1.0, 0.0, 0.0)), "drive")
    return system


def ran(system: System, method: str, end: float = 1.0):
    samples = np.linspace(0.0, end, 11)
    if method == "generalized-alpha":
        return solve_implicit(system.assemble(), samples=samples, step=0.01)
    step = 1e-5 if "blade" in system.assemble().names else 0.01
    return solve(system.assemble(), samples=samples, method=method, step=None if method == "dopri5" else step)


STEADY = parts.ConstantDrive(rate=3.5, angle=100.0)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(
    ("system", "words"),
    [
        (lambda: on_spring(short_spring, 1.0, 2.0), f"'spring' .*'short_spring' {HERE} .*index 2 .*2 parameters are"),
        (lambda: on_spring(short_spring), f"'spring' .*'short_spring' {HERE} .*index 0 .*0 parameters are given"),
        (lambda: reeled(STEADY, (short_force, 1.0)), f"'wind' .*'short_force' {HERE} .*index 1 .*1 parameter is given"),
        (
            lambda: reeled(parts.LawDrive(law=short_drive, parameters=(1.0,))),
            f"'short_drive' {HERE} .*index 1 .*1 param",
        ),
        (lambda: on_spring(brittle, 9.0, event=(short_event, 1.0)), f"'event' .*'short_event' {HERE} .*index 1 "),
        (lambda: on_spring(brittle, 9.0, event=(far_state, 1.0)), f"'event' .*'far_state' {HERE} .*index 1000 "),
        (lambda: driven(short_drive, 1.0), f"'drive' .*'short_drive' {HERE} .*index 1 .*1 parameter is given"),
    ],
)
def test_a_parameter_that_was_not_given_is_refused(system, words, method):
    with pytest.raises(InputError, match=words) as refused:
        ran(system(), method)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(
    ("system", "end", "when", "words"),
    [
        (lambda: on_spring(brittle, 0.3), 1.0, 0.3, f"'brittle' {HERE} .*ValueError: the spring broke"),
        (lambda: on_spring(stepwise, 0.1, 0.1), 1.0, 0.5, f"'stepwise' {HERE} .*IndexError: index .*"),
        (lambda: reeled(STEADY, (gust, 0.05, 1e-4)), 0.1, 0.05, f"'gust' {HERE} .*ValueError: no wind data"),
        (
            lambda: reeled(parts.LawDrive(law=until, parameters=(0.05, 100.0, 3.5))),
            0.1,
            0.05,
            f"'until' {HERE} .*ValueError: the table ends",
        ),
        (lambda: on_spring(brittle, 9.0, event=(late, 0.3)), 1.0, 0.3, f"'late' {HERE} .*ValueError: no event is kn"),
    ],
)
def test_a_law_that_raises_in_a_run_ends_it_and_keeps_what_was_computed(system, end, when, words, method):
    if "until" in words:  # which is tried at the end as well
        with pytest.raises(InputError, match=f"'blade' at t = 0.1 s: .*{words}"):
            ran(system(), method, end)
        return
    found = ran(system(), method, end)
    assert found.status == "failed"
    assert "what was computed is kept" in found.message
    assert "\n" not in found.message
    assert re.search(f"at t = 0.* {words}", found.message), found.message
    assert when - 0.21 * end < found.t[-1] <= when + 1e-9
    assert np.all(np.isfinite(found.y))


def test_a_drive_law_with_a_gap_fails_there():
    """It has values at both ends, but not in between: for joints and reels."""

    @law
    def gap(t, p):
        if 0.5 < t < 0.6:
            raise ValueError("no rate is known")
        return p[0] + p[1] * t, p[1], 0.0

    for system in (driven(gap, 0.0, 0.0), reeled(parts.LawDrive(law=gap, parameters=(100.0, 3.5)))):
        found = ran(system, "generalized-alpha")
        assert found.status == "failed"
        assert "'gap'" in found.message
        assert "no rate is known" in found.message
        assert 0.39 < found.t[-1] < 0.5 + 1e-6  # the last sample before the gap, or at it


def test_a_law_that_only_raises_is_refused_where_it_is_written():
    def never(extension, rate, t, p):
        raise NotImplementedError("to do")

    if config.DISABLE_JIT:
        with pytest.raises(InputError, match="NotImplementedError: to do"):
            ran(on_spring(law(never)), "rk4")
        return

    def never_event(t, y, p):
        raise ValueError

    def never_drive(t, p):
        while True:
            t += 1.0

    def never_force(x, v, t, p):
        raise ValueError

    for kind, one in (("spring", never), ("event", never_event), ("drive", never_drive), ("force", never_force)):
        words = rf"^a\.law: the law '{one.__name__}' {HERE} never returns a value; it must be law\("
        with pytest.raises(InputError, match=words):
            law(one).of(kind, "a.law")


def hung(law, *parameters: float) -> System:
    system = System(gravity=(0.0, 0.0, -9.81))
    system.add(parts.Point(mass=1.0, position=(0.0, 0.0, -1.0)), "ball")
    system.add(parts.Spring(a=(0.0, 0.0, 0.0), b="ball", length=1.0, law=law, parameters=parameters), "spring")
    return system


@law
def torn(extension, rate, t, p):
    if extension > p[1]:
        raise ValueError("the spring broke")
    return p[0] * extension


def test_statics_and_modes_name_the_law():
    found = solve_static(hung(torn, 10.0, 0.3).assemble())
    assert found.status == "failed"
    assert "'torn'" in found.message
    assert "ValueError: the spring broke" in found.message
    assert "'spring'" in found.message
    with pytest.raises(RunFailed, match=r"'torn' .*the spring broke"):
        modes(hung(torn, 10.0, 0.3).assemble())
    with pytest.raises(InputError, match=r"'short_spring' .*2 parameters are given"):
        solve_static(hung(short_spring, 1.0, 2.0).assemble())
    with pytest.raises(InputError, match=r"'short_spring' .*2 parameters are given"):
        modes(hung(short_spring, 1.0, 2.0).assemble())


@pytest.mark.parametrize("method", METHODS)
def test_a_stepper_names_the_law_and_keeps_the_state(method):
    step = None if method == "dopri5" else 0.01
    with pytest.raises(InputError, match=r"'short_spring' .*2 parameters are given"):
        Stepper(on_spring(short_spring, 1.0, 2.0), method=method, step=step, until=2.0)
    stepper = Stepper(on_spring(brittle, 0.3), method=method, step=step, until=2.0)
    stepper.step(0.1)
    with pytest.raises(RunFailed, match=r"'brittle' .*ValueError: the spring broke"):
        stepper.step(0.5)
    assert np.all(np.isfinite(stepper.state))
    assert 1.0 < stepper.state[0] < 1.32
    with pytest.raises(RunFailed, match="has failed"):
        stepper.step(0.1)
