"""Copies of a run have the plans and the parts of single runs, whatever follows from the values of their keys."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import evolvent
from evolvent import InputError, System, parts
from evolvent.analysis import traced
from evolvent.analysis.many_runs import ManyRuns
from evolvent.assembly.builder import Builder
from evolvent.solvers.time.implicit import plan
from evolvent_base.columns import UndecidedError


def arm(settings: dict[str, Any] | None = None, **given: Any) -> System:
    """A body that a spring opens about a pivot on a free one, in which nothing is held from outside."""
    system = System(settings={"until": 0.5, **(settings or {})}, **given)
    system.add(parts.RigidBody(mass=20.0, inertia=(2.0, 2.0, 2.0)), "hub")
    system.add(parts.RigidBody(mass=1.0, inertia=(0.1, 0.1, 0.1), position=(0.5, 0.0, 0.0)), "arm")
    system.add(parts.Joint(a="hub", b=("arm", (-0.5, 0.0, 0.0)), type="revolute", axis=(0.0, 0.0, 1.0)), "pivot")
    keys: dict[str, Any] = {"start": 0.0, "rest": 1.5, "stiffness": 0.7, "damping": 0.05}
    system.add(parts.JointSpring(a="hub", b="arm", axis=(0.0, 0.0, 1.0), **keys), "hinge")
    return system


KEEP = ["hinge.angle.last", "energy.last", "hub.rate.last", "pivot.force.max"]
#: Of which the middle one differs: least, largest and that at half the list do not show it.
VALUES = [0.5, 0.4, 0.6, 0.55]


def check_alone(system: System, values: list[dict[str, Any]]) -> None:
    """Refuse variants of `simulate_many` and copies of a batch without the bits of single runs."""
    found = evolvent.simulate_many(system, values, KEEP, workers=1)
    assert found.status.values.tolist() == ["success"] * len(values)
    for k, own in enumerate(values):
        alone = system.with_values(own).simulate(keep=KEEP)
        for name in KEEP:
            assert np.array_equal(found[name.replace(".", "_")].values[k], alone[name]), (own, name)


def check_batch(system: System, values: dict[str, list[Any]]) -> None:
    """Refuse copies of a batch without the bits of single runs."""
    count = len(next(iter(values.values())))
    batch = system.batch(count, method="generalized-alpha", workers=1)
    for key, given in values.items():
        batch.expand(key, given)
    batch.run()
    for k in range(count):
        one = system.with_values({key: given[k] for key, given in values.items()})
        alone = one.simulate(fine=False, every=batch.until, method="generalized-alpha")
        assert batch.bind("hinge.angle")[k] == alone["hinge"].angle.values[-1], k
    batch.close()


@pytest.mark.parametrize("with_mass", [False, True])
def test_plans_that_follow_from_a_key_without_order(monkeypatch: pytest.MonkeyPatch, with_mass: bool) -> None:
    """A tolerance of some stiffnesses between others, which are expanded after masses as well."""
    before = plan._numbers

    def numbers(mine: Any, asked: Any) -> Any:
        within = bool(np.any(np.abs(mine.model.coordinates["stiffness"] - 0.5) < 0.03))
        return before(mine, asked._replace(tolerance=asked.tolerance * (0.1 if within else 1.0)))

    monkeypatch.setattr(plan, "_numbers", numbers)
    masses = {"arm.mass": [1.1, 1.2, 1.3, 1.4]} if with_mass else {}
    values = {**masses, "hinge.stiffness": VALUES}
    check_batch(arm(), values)
    own = [{key: of[k] for key, of in values.items()} for k in range(4)]
    check_alone(arm({"method": "generalized-alpha"}), own)


def test_a_part_that_writes_another_number_between_two_values(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whose write is run for each value then."""
    before = parts.JointSpring.write

    def write(self: Any, builder: Builder, name: str) -> None:
        within = 0.45 < self.stiffness < 0.52
        before(self.model_copy(update={"damping": 2.0 * self.damping}) if within else self, builder, name)

    monkeypatch.setattr(parts.JointSpring, "write", write)
    check_batch(arm(), {"hinge.stiffness": VALUES})
    check_alone(arm({"method": "generalized-alpha"}), [{"hinge.stiffness": one} for one in VALUES])


def test_blocks_of_copies_are_those_of_single_runs() -> None:
    """All numbers of the model and of the workspace at the start, whatever is varied, one after another."""
    system = arm()
    keys = {"hinge.damping": [0.04, 0.06], "arm.mass": [1.1, 0.9], "hinge.stiffness": [0.6, 0.5]}
    batch = system.batch(2, method="generalized-alpha", workers=1)
    for n in range(1, 4):
        key = [*keys][n - 1]
        batch.expand(key, keys[key])
        for k in range(2):
            one = system.with_values({name: keys[name][k] for name in [*keys][:n]})
            alone = one.batch(1, method="generalized-alpha", workers=1)._copies
            for struct in ("model", "work"):
                for path in alone.memory.places:
                    if path[0] == struct:
                        own, other = (
                            batch._copies.memory.values(batch._copies.blocks, *path)[k],
                            alone.memory.values(alone.blocks, *path)[0],
                        )
                        assert own.tobytes() == other.tobytes(), (key, path)


@pytest.mark.parametrize("method", ["generalized-alpha", "energy-momentum"])
def test_samples_of_the_run_before_are_not_seen(method: str) -> None:
    """Copies take other variants in turn, and keep the arrays of their samples, filled here with what no run has."""
    system = arm({"method": method, "every": 0.05})
    runs = ManyRuns(system, KEEP, {"until": 0.5, "every": 0.05, "method": method})
    copies, *_ = runs._own()
    points = [{"hinge.stiffness": one} for one in VALUES]
    first = list(runs.kept(points, None))
    copies.blocks[:, copies.memory.filled :] = 255
    again = list(runs.kept(points, None))
    for one, other in zip(first, again, strict=True):
        assert one is not None
        assert other is not None
        assert all(one.variables[name].identical(other.variables[name]) for name in KEEP)
        assert repr(one.attrs) == repr(other.attrs)  # times are not a number


def test_numbers_that_are_not_finite_are_refused_where_they_stand() -> None:
    batch = arm().batch(3, workers=1)
    with pytest.raises(InputError, match=r"copy 1: .*stiffness is nan"):
        batch.expand("hinge.stiffness", [0.4, np.nan, 0.6])


def test_keys_of_which_the_plan_does_not_follow_stand_in_fields() -> None:
    """As given; those that inertias follow from do not."""
    runs = ManyRuns(arm({"method": "generalized-alpha"}), KEEP, {"until": 0.5, "method": "generalized-alpha"})
    assert runs.varied.places("hinge.stiffness", VALUES) == (("coordinates", "stiffness", 0),)
    assert runs.varied.places("hinge.stiffness", ["0.4 N m/rad", 0.5]) == ()
    assert runs.varied.places("arm.mass", [1.1, 1.2]) == ()


def test_a_stand_in_of_numbers_answers_what_is_so_for_all_of_them() -> None:
    number: Any = traced.AnyNumber(1.0, 2.0)
    assert number > 0.5
    assert not number < 1.0
    assert number != 1.5
    assert number
    assert number.without == {1.5, 0.0}
    for act in (lambda: number > 1.5, lambda: 2.0 * number, lambda: np.sqrt(number), lambda: float(number)):
        with pytest.raises((UndecidedError, TypeError)):
            act()


def test_what_a_function_reads_of_a_model() -> None:
    model = arm().assemble().model
    assert traced.reads(lambda one: one.bodies[1:]["mass"].sum(), model) == frozenset({("bodies", "mass")})
    assert traced.reads(lambda one: [row["mass"] for row in one.bodies], model) == frozenset({("bodies", "mass")})
    assert traced.reads(lambda one: one.parameters.sum() + one.bodies.size, model) == frozenset({("parameters", "")})
    assert traced.reads(lambda one: np.asarray(one.bodies).size, model) == frozenset({("bodies", "")})
    assert traced.reads(lambda one: one.copy(), model) is None
    assert traced.reads(lambda one: one.bodies.__setitem__(0, 1.0), model) is None


SPINS: dict[str, dict[str, Any]] = {
    "about a point": {"spin": {"axis": (0, 0, 1), "rate": 0.3, "about": (0.1, 0.0, 0.0)}},
    "with a velocity": {"spin": {"axis": (0, 0, 1), "rate": 0.3, "about": (0, 0, 0)}, "velocity": (0.1, 0.2, 0.0)},
    "about the centre of mass": {"spin": {"axis": (0, 0, 1), "rate": 0.3}},
}


@pytest.mark.parametrize("motion", SPINS)
@pytest.mark.parametrize("method", ["generalized-alpha", "energy-momentum"])
def test_a_system_that_spins(motion: str, method: str) -> None:
    """Variants that are copies, or made one by one where the velocities follow from the masses; and as a batch."""
    system = arm({"method": method}, **SPINS[motion])
    values: list[dict[str, Any]] = [
        {"hinge.stiffness": 0.5},
        {"hinge.stiffness": 0.6, "arm.mass": 1.2},
        {"gravity": (0.0, -0.1, 0.0)},
    ]
    check_alone(system, values)
    batch = system.batch(2, workers=1)
    if "centre" in motion:
        with pytest.raises(InputError, match="spins about its centre of mass"):
            batch.expand("arm.mass", [1.1, 1.2])
    else:
        check_batch(system, {"hinge.stiffness": [0.5, 0.6], "arm.mass": [1.1, 1.2]})
    batch.reset()
    batch.run()
    alone = system.simulate(fine=False, every=batch.until, method=batch.method)
    assert batch.bind("hinge.angle")[1] == alone["hinge"].angle.values[-1]
    batch.close()
