"""Copies side by side: each has the bits of a single run, also where events, slack springs and latches part them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import evolvent
from evolvent import InputError, Stepper, System, parts
from evolvent.analysis.batch import Batch
from evolvent.compiled.lane_types import LANE, WIDTH, lane_dtype, lane_zeros
from evolvent.solvers.time.explicit import lanes

CORNERS = ((1.0, 1.0), (-1.0, 1.0), (1.0, -1.0), (-1.0, -1.0))
KEY = "spring 1.stiffness"
COUNT = WIDTH + 3
VALUES = np.linspace(150.0, 300.0, COUNT)
OPTIONS: dict[str, Any] = {"until": 0.45, "method": "rk4", "step": 1e-3}


def suspended() -> System:
    """A body that jumps up on four springs, which only pull; an event stops it where it is too high."""
    system = System(gravity=(0.0, -9.81, 0.0))
    body = parts.RigidBody(
        mass=2.0, inertia=(0.1, 0.2, 0.3), position=(0.02, -1.0, 0.01), velocity=(0.0, 3.0, 0.0),
        angular_velocity=(0.3, 0.0, 0.1),
    )  # fmt: skip
    system.add(body, "body")
    for k, (x, z) in enumerate(CORNERS):
        b = ("body", (0.2 * x, 0.0, 0.2 * z))
        spring = parts.Spring(a=(x, 0.0, z), b=b, stiffness=200.0, damping=0.4, length=1.4, slack=True)
        system.add(spring, f"spring {k + 1}")
    return system


def lanes_of(batch: Batch) -> lanes.Lanes:
    found = batch._copies._lanes  # type: ignore[attr-defined]
    assert isinstance(found, lanes.Lanes)
    return found


@pytest.fixture(autouse=True)
def compiled_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Functions for lanes are compiled, and lanes are taken, however short the runs."""
    monkeypatch.setattr(lanes, "COMPILE", 0.0)
    monkeypatch.setattr(lanes, "FIRST", 16)
    monkeypatch.setattr(lanes, "JUDGED", 10**9)


@pytest.fixture(scope="module")
def system() -> System:
    return suspended()


@pytest.fixture(scope="module")
def alone(system: System) -> list[np.ndarray]:
    runs = [system.with_values({KEY: one}).simulate(**OPTIONS, every=0.45, fine=False) for one in VALUES]
    return [run["body"].position.values[-1] for run in runs]


@pytest.mark.parametrize("workers", [1, 2])
def test_copies_have_the_bits_of_single_runs_and_come_back_where_branches_part_them(
    system: System, alone: list[np.ndarray], workers: int
) -> None:
    batch = system.batch(COUNT, workers=workers, **OPTIONS)
    position = batch.bind("body.position")
    batch.expand(KEY, VALUES)
    batch.run()
    batch.close()
    assert np.array_equal(position, alone)
    assert lanes_of(batch).parted > 0
    assert lanes_of(batch).together > 0.3 * batch._copies.loop["steps"].sum()


def test_copies_that_go_alone_late_in_a_run_do_not_at_its_start(system: System) -> None:
    """They did, until a batch that was reset had come as far as before."""
    batch = system.batch(4, workers=1, **OPTIONS)
    batch.run(0.1)
    batch.reset()
    group = lanes_of(batch)._threads.own
    group._send_away([0, 1, 2, 3], 0b0011, 400)
    alone_for = group._wait
    grids = (0, 399, 400, 399 + alone_for, 400 + alone_for)
    assert [len(group._groups([0, 1, 2, 3], grid)) for grid in grids] == [1, 1, 3, 3, 1]


def test_copies_of_steps_of_their_own_have_the_bits_of_single_runs(system: System) -> None:
    """Of which each is planned by itself, with steps that differ, and is sampled."""
    keep = ["body.position.last", "energy.last"]
    options: dict[str, Any] = {"until": 0.3, "every": 0.1, "method": "rk4"}
    found = evolvent.simulate_many(system, {KEY: VALUES.tolist()}, keep, workers=1, **options)
    for k in (0, COUNT - 1):
        one = system.with_values({KEY: VALUES[k]}).simulate(keep=keep, **options)
        for name in keep:
            assert np.array_equal(found[name.replace(".", "_")].values[k], one[name])


def test_copies_that_stop_leave_the_others_and_unstable_steps_are_refused(system: System) -> None:
    own = system.copy()
    own.add(parts.Event(law="y + 0.62", variables={"y": "body.position.y"}, stops=True), "high")
    batch = own.batch(4, **OPTIONS)
    assert lanes_of(batch).why_alone == "laws of users and expressions are evaluated one copy at a time"
    batch.expand(KEY, [10.0, 150.0, 200.0, 900.0])
    batch.run(0.12)
    stopped = batch.status == "stopped by event"
    assert 0 < stopped.sum() < 4, batch.bind("body.position")
    assert all(batch.events(k)[-1][1] == "high" for k in np.flatnonzero(stopped).tolist())
    with pytest.raises(InputError, match=r"copy 1: step is 0\.001 s, above the stability limit"):
        batch.expand("body.mass", [2.0, 1e-4, 2.0, 2.0])


def test_a_copy_whose_steps_lose_the_energy_fails_as_a_single_run_does(system: System) -> None:
    """In the lanes of the others, which go on."""
    own, options = system.copy(), OPTIONS | {"step": 0.01}
    batch = own.batch(4, **options)
    batch.expand(KEY, [200.0, 300.0, 15000.0, 400.0])
    batch.run()
    with pytest.raises(evolvent.RunFailed) as alone:
        own.with_values({KEY: 15000.0}).simulate(**options, every=0.45, fine=False)
    assert dict(batch.reasons) == {2: str(alone.value)}


@pytest.mark.parametrize("method", [{"method": "rk4", "step": 1e-3}, {"method": "dopri5", "tolerance": 1e-6}])
def test_copies_step_as_steppers_do_under_inputs(system: System, method: dict[str, Any]) -> None:
    """Forces that change at every step, of every copy, and a step that is no multiple of that of the method."""
    forces = np.random.default_rng(1).standard_normal((3, 4, 3))
    options = method | {"inputs": "body", "until": 1.0}
    batch, alone = system.batch(4, every=0.0205, **options), [Stepper(system, **options) for _ in range(4)]
    bound = {name: batch.bind(name) for name in ("body.position", "body.attitude", "spring 2.force")}
    force, _ = batch.wrench("body")
    for now in forces:
        force[:] = now
        batch.step()
        for one, own in zip(alone, now, strict=True):
            one.set_wrench("body", own)
            one.step(0.0205)
    for name, found in bound.items():
        assert np.array_equal(found, np.stack([one.result(name) for one in alone])), name


def test_why_copies_go_alone(system: System) -> None:
    assert lanes_of(system.batch(2, **OPTIONS)).why_alone == "they are fewer than 3"
    adapts = system.batch(3, until=0.1, method="dopri5")
    assert lanes_of(adapts).why_alone == "the steps of dopri5 adapt, each copy's to itself"


def test_functions_for_lanes_are_compiled_only_where_runs_take_longer(
    system: System, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(lanes, "COMPILE", 1e6)
    monkeypatch.setattr(lanes, "count_missing", lambda functions: len(functions))
    monkeypatch.setattr(lanes, "load", lambda functions: pytest.fail("functions are compiled"))
    batch = system.batch(3, workers=1, **OPTIONS)
    batch.run()
    assert batch.status.tolist() == ["running"] * 3
    assert lanes_of(batch).together == 0


def test_memory_of_lanes_is_aligned() -> None:
    own = np.dtype([("index", np.int64), ("length", np.float64), ("R", np.float64, (3, 3))])
    found = lane_dtype(own)
    assert found["index"] == np.int64
    assert found["length"] == LANE
    assert found["R"].shape == (3, 3)
    fields: Any = found.fields
    assert fields["length"][1] % LANE.itemsize == fields["R"][1] % LANE.itemsize == 0
    assert found.itemsize % LANE.itemsize == 0
    assert lane_zeros((2, 3), found).ctypes.data % LANE.itemsize == 0
    assert lane_dtype(np.dtype([("a", np.int64), ("b", np.int64)])) == np.dtype([("a", np.int64), ("b", np.int64)])
