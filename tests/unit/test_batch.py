"""A batch: the bits of single runs at any number of threads, its own parameters, events, failures and refusals."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import evolvent
from evolvent import InputError, Stepper, System, parts


def arm(**spring: object) -> System:
    """A free body that a spring opens about a pivot on another one, until a latch locks."""
    system = System()
    system.add(parts.RigidBody(mass=20.0, inertia=(2.0, 2.0, 2.0)), "hub")
    system.add(parts.RigidBody(mass=1.0, inertia=(0.1, 0.1, 0.1), position=(0.5, 0.0, 0.0)), "arm")
    system.add(parts.Joint(a="hub", b=("arm", (-0.5, 0.0, 0.0)), type="revolute", axis=(0.0, 0.0, 1.0)), "pivot")
    keys = {"start": 0.0, "rest": 1.5, "stiffness": 0.5, "damping": 0.05, "latch": 1.0, "latch_stiffness": 100.0}
    hinge = parts.JointSpring(a="hub", b="arm", axis=(0.0, 0.0, 1.0), latch_damping=2.0, **{**keys, **spring})
    system.add(hinge, "hinge")
    return system


VALUES = [0.4, 0.5, 0.6, 0.7]
NAMES = ("hinge.angle", "arm.position", "arm.attitude", "hinge.torque", "hinge.damper_work", "pivot.force")


@pytest.fixture(scope="module")
def system() -> System:
    return arm()


@pytest.mark.parametrize("method", ["generalized-alpha", "energy-momentum"])
def test_copies_have_the_bits_of_single_runs(system: System, method: str) -> None:
    """With stiffnesses, which stand in a record, and masses, from which the plan follows, at two numbers of threads."""
    masses, found = [1.0, 1.2, 0.9, 1.1], []
    for workers in (1, 2):
        batch = system.batch(4, until=4.0, method=method, workers=workers)
        bound = batch.bind("hinge.angle"), batch.bind("arm.position")
        batch.expand("hinge.stiffness", VALUES)
        batch.expand("arm.mass", masses)
        batch.run()
        assert batch.status.tolist() == ["running"] * 4
        assert np.all(batch.time == 4.0)
        found.append([one.copy() for one in bound])
        batch.close()
    for k in range(4):
        values = {"hinge.stiffness": VALUES[k], "arm.mass": masses[k]}
        alone = system.with_values(values).simulate(until=4.0, every=4.0, fine=False, method=method)
        for angle, position in found:
            assert angle[k] == alone["hinge"].angle.values[-1]
            assert np.array_equal(position[k], alone["arm"].position.values[-1])
        times = [(time, part) for time, part, what in batch.events(k) if what == "latched"]
        assert times == [(float(alone["hinge"].latch_time.values[-1]), "hinge")]


def test_copies_step_as_steppers_do_under_inputs(system: System) -> None:
    """Torques that change at every step, of every copy, and results that depend on what copies have of their own."""
    torques = 0.1 * np.random.default_rng(1).standard_normal((3, 4, 3))
    batch = system.batch(4, until=10.0, step=0.01, every=0.05, inputs="hub", tolerance=1e-4, spectral_radius=0.9)
    assert batch.method == "generalized-alpha"
    bound = {name: batch.bind(name) for name in NAMES}
    batch.expand("hinge.stiffness", VALUES)
    _, torque = batch.wrench("hub")
    alone = [
        Stepper(system.with_values({"hinge.stiffness": one}), inputs="hub", until=10.0, step=0.01) for one in VALUES
    ]
    for now in torques:
        torque[:] = now
        batch.step()
        for k, one in enumerate(alone):
            one.set_wrench("hub", torque=now[k])
            one.step(0.05)
    bound["arm.tilt"] = batch.bind("arm.tilt")  # not from the start on
    for name in bound:
        assert np.array_equal(bound[name], np.stack([one.result(name) for one in alone])), name
    assert len({*bound["hinge.torque"].tolist()}) == 4


def test_reset_repeats_the_bits_of_the_chosen_copies(system: System) -> None:
    batch = system.batch(3, until=2.0, step=0.01)
    angle = batch.bind("hinge.angle")
    batch.expand("hinge.stiffness", VALUES[:3])
    start = angle.copy()
    batch.step(100)
    before = angle.copy()
    batch.reset([False, True, False])
    assert batch.time.tolist() == [1.0, 0.0, 1.0]
    assert angle[1] == start[1]
    assert angle[0] == before[0]
    batch.run(1.0)
    assert np.array_equal(angle, before)
    batch.expand("hinge.stiffness", [0.9], which=[2])
    batch.run(1.0)
    assert np.array_equal(angle[:2], before[:2])
    assert angle[2] != before[2]


def test_variants_are_copies_of_one_run_with_the_bits_of_single_ones(system: System) -> None:
    """Keys that stand in fields, that change the plan, or are of some variants alone; one made by itself."""
    values: list[dict[str, Any]] = [
        {"hinge.stiffness": 0.4},
        {},
        {"hinge.stiffness": 0.6, "arm.mass": 1.3},
        {"arm.mass": "0.9 kg", "hinge.damping": 0.07},
        {"hinge.damping": 0.0},
    ]
    keep = ["hinge.latch_time.last", "hinge.torque.max", "energy.last", "arm.position.last", "pivot.force.max"]
    found = evolvent.simulate_many(system, values, keep, workers=1, until=4.0, every=0.1)
    assert found.status.values.tolist() == ["success"] * 5
    for k, own in enumerate(values):
        alone = system.with_values(own).simulate(keep=keep, until=4.0, every=0.1)
        for name in keep:
            assert np.array_equal(found[name.replace(".", "_")].values[k], alone[name]), (k, name)


@evolvent.law
def brittle(extension, rate, t, p):  # type: ignore[no-untyped-def]
    if extension > 0.455:
        raise ValueError("the spring broke")
    return p[0] * extension


def test_a_copy_that_fails_says_why_and_the_others_go_on() -> None:
    """By their masses one copy turns back, one comes to an event that stops it, and one to where a law raises."""
    system = System()
    system.add(parts.Point(mass=1.0, position=(1.0, 0.0, 0.0), velocity=(1.0, 0.0, 0.0)), "bob")
    system.add(parts.Spring(a=(0.0, 0.0, 0.0), b="bob", length=1.0, law=brittle, parameters=[5.0]), "spring")
    system.add(parts.Event(law="x - 1.4", variables={"x": "bob.position.x"}, stops=True), "far")
    batch = system.batch(3, until=0.6, step=0.1, method="generalized-alpha")
    batch.expand("bob.mass", [0.5, 1.0, 4.0])
    batch.run()
    assert batch.status.tolist() == ["running", "stopped by event", "failed"], batch.reasons
    assert list(batch.reasons) == [2]
    assert "the spring broke" in batch.reasons[2]
    assert batch.events(1)[-1][1] == "far"
    assert 0.0 < batch.time[2] <= 0.6
    batch.reset()
    assert batch.status.tolist() == ["running"] * 3


@pytest.mark.parametrize(
    ("act", "match"),
    [
        (lambda s: s.batch(0), r"n is 0; it must be a whole number from 1"),
        (lambda s: s.batch(2, method="energy-momentum", inputs="hub"), r"a batch with inputs takes those"),
        (lambda s: s.batch(2, inputs="hob"), r"inputs name 'hob', which is no body"),
        (lambda s: s.batch(2).step(), r"every is missing"),
        (lambda s: s.batch(2, until=1.0).run(2.0), r"copy 0 would go on to 2 s, beyond the batch's end at 1 s"),
        (lambda s: s.batch(2).expand("hinge.stiffness", [1.0]), r"values has 1 entries; it must have one for each of"),
        (lambda s: s.batch(2).expand("hinge.stiffness", [1.0, -1.0]), r"copy 1: .*stiffness"),
        (lambda s: s.batch(2).expand("hinge.colour", [1.0, 2.0]), r"copy 0: .*colour"),
        (lambda s: s.batch(2).expand("hinge.damping", [0.05, 0.0]), r"use evolvent.simulate_many"),
        (lambda s: s.batch(2).bind("hinge.angel"), r"hinge.angel.*hinge.angle"),
        (lambda s: s.batch(2).wrench("hub"), r"'hub' is not among the inputs"),
        (lambda s: s.batch(2).reset([True, False, True]), r"copies are chosen by"),
        (lambda s: s.batch(10**9), r"so many copies need"),
    ],
)
def test_what_a_batch_cannot_do_is_refused(system: System, act: object, match: str) -> None:
    with pytest.raises(InputError, match=match):
        act(system)  # type: ignore[operator]


def test_copies_that_could_not_be_placed_wait(system: System, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a batch whose placing was interrupted once, as by Ctrl+C, and which goes on."""
    found = []
    for interrupted in (False, True):
        batch = system.batch(2, until=0.2, workers=1, method="generalized-alpha")
        batch.expand("hinge.stiffness", VALUES[:2])
        if interrupted:
            with monkeypatch.context() as patched:
                patched.setattr(batch._copies, "place", lambda *_: (_ for _ in ()).throw(KeyboardInterrupt))
                with pytest.raises(KeyboardInterrupt):
                    _ = batch.states
        batch.run()
        found.append(batch.states.copy())
        batch.close()
    assert np.array_equal(*found)
