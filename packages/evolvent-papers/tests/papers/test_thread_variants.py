"""The thread paper's own scheme, what it rejects, and Sazonov's model, beside the engine and closed forms."""

from __future__ import annotations

import dataclasses
import functools
import math
from typing import Any

import numpy as np
import pytest

import evolvent
from evolvent_papers.papers.thread_variants import SHARE, Data, Deployment, deploy, hold

SOFT = Data(stiffness=1e3)


@functools.cache
def run(**changes: Any) -> Deployment:
    """A run at 1e3 N/m; changes of the data and of the arguments of `deploy`."""
    fields = {field.name for field in dataclasses.fields(Data)}
    data = dataclasses.replace(SOFT, **{key: value for key, value in changes.items() if key in fields})
    return deploy(data, **{key: value for key, value in changes.items() if key not in fields})


@pytest.mark.slow
def test_the_papers_scheme_agrees_with_the_engine():
    """Rotating axes and steps that end at releases here, inertial axes and events there: the same motion."""
    own = run()
    engine = evolvent.run("heliogyro", {"blade.stiffness": 1e3, "output.every": own.t[20], "output.fine": False})
    rate, momentum = engine.body_rate.values, engine.angular_momentum.values[:, 2]
    assert own.rate[::20] == pytest.approx(rate, rel=1e-5)
    assert own.lag[20::20] == pytest.approx(np.degrees(engine.tip_lag.values[1:, 0]), abs=0.02)
    assert own.momentum[-1] / own.momentum[0] == pytest.approx(momentum[-1] / momentum[0], rel=1e-6)


def test_momentum_is_kept_between_releases():
    parts = run().momentum[:-1].reshape(20, 20)
    assert np.abs(np.ptp(parts, axis=1)).max() < 1e-9 * parts[0, 0]


@pytest.mark.slow
@pytest.mark.parametrize("start", ["departure", "growing"])
def test_the_lag_of_steady_pay_out(start):
    """sin delta = 2 v/(L0 W) for any masses where W is constant, here by a heavy body (thread.md)."""
    found = run(inertia=1e6, start=start)
    exact = math.degrees(math.asin(2.0 * 0.035 / (0.05 * 6.0)))
    assert found.rate[-1] == pytest.approx(6.0, rel=1e-6)
    assert found.mean_lag(20.0, 140.0) == pytest.approx(exact, abs=0.02)


@pytest.mark.slow
def test_the_torque_as_printed_hardly_slows_the_body():
    """Eq. (15) with all forces on the boundary node: about 5 rad/s at the end in place of 0.26 (thread.md)."""
    assert run().rate[-1] == pytest.approx(0.260, abs=0.001)
    assert run(printed=True).rate[-1] == pytest.approx(5.0, abs=0.1)
    assert run(printed=True).momentum[-1] > 10.0 * run().momentum[-1]


@pytest.mark.slow
def test_nodes_on_the_spool_as_neighbours_throw_the_thread_off_its_plane():
    """By several radii at 6 nodes a turn, by more than one at 12, not at all with the departure point."""
    for nodes, least in ((477, 2.0), (955, 0.5)):
        film = Data(nodes=nodes, stiffness=100.0 * nodes)
        found = {start: deploy(film, start, until=3.0, samples=4) for start in ("spool node", "departure")}
        assert found["spool node"].off_plane > least * film.radius
        assert found["departure"].off_plane < 2e-7 * film.radius


@pytest.mark.slow
def test_added_nodes_lead_to_the_same_motion_with_more_nodes():
    """Sazonov's model, as understood: the momentum that it gains falls with l0; the lag of the tip agrees."""
    gain = {n: run(nodes=n, start="growing").momentum[-1] / run(nodes=n).momentum[0] - 1.0 for n in (10, 20)}
    assert 1.5 < gain[10] / gain[20] < 4.0
    assert run(start="growing").mean_lag(20.0, 60.0) == pytest.approx(run().mean_lag(20.0, 60.0), abs=0.1)


def test_an_unstable_run_ends_with_its_last_finite_sample():
    found = deploy(SOFT, step=1.2 * SOFT.stable_step("departure"))
    assert found.t[-1] < 142.0
    assert np.all(np.isfinite(found.rate))


def test_a_disturbance_grows_above_the_longest_stable_step_alone():
    """RK4 is stable up to 2 sqrt(2) over the largest frequency, near 2 sqrt(c/m) of many nodes."""
    from evolvent_papers.papers.thread_stability_measures import longest_step

    data = Data(stiffness=1e5, damping=0.0)
    limit = math.sqrt(8.0 * data.line_density * data.segment / (4.0 * data.stiffness))
    assert hold(data, 0.99 * limit, 2000) < 10.0
    assert hold(data, 1.02 * limit, 2000) > 1e3
    assert longest_step(1e5, 0.0) == pytest.approx(limit, rel=0.01)


def test_contact_stiffens_a_turn_by_its_own_frequency():
    """Contact much stiffer than the springs: the frequency is that of a node on it, sqrt(k/m)."""
    from evolvent_papers.papers.thread_stability_measures import RK4, _step_of_a_turn

    mass = SOFT.line_density * 2.0 * math.pi * SOFT.radius / 12
    assert _step_of_a_turn(12, 1.0, 1e6) == pytest.approx(RK4 / math.sqrt(1e6 / mass), rel=1e-3)
    assert _step_of_a_turn(12, 1e3, 0.0) > RK4 / math.sqrt(4e3 / mass)


def test_a_tip_that_starts_across_draws_a_straight_thread_with_the_departure_point():
    """Without spin the thread is straight from Q to the tip, which moves on at the speed of the pay-out."""
    film = Data(nodes=477, stiffness=100.0 * 477, rate=0.0)
    found = deploy(film, until=1.0, samples=4, kick=(0.0, 0.3 * film.speed, 0.4 * film.speed))
    from_q = found.positions[-1, :, :] - np.array([0.0, 0.0, film.radius])
    out = np.isfinite(from_q[:, 0])
    assert np.linalg.norm(from_q[0]) == pytest.approx(film.speed * found.t[-1], rel=2e-3)
    assert from_q[0] == pytest.approx(np.linalg.norm(from_q[0]) * np.array([1.0, 0.3, 0.4]) / math.sqrt(1.25), rel=1e-3)
    across = np.cross(from_q[out], from_q[0] / np.linalg.norm(from_q[0]))
    assert np.abs(across).max() < 1e-3 * film.radius


def test_without_eq_11_the_first_step_is_singular():
    assert run(until=8.0, tiny=0.0).t.size == 1


@pytest.mark.parametrize("damping", [0.1, 1.0])
def test_a_step_is_stable_where_damping_limits_it(damping):
    """Of a soft, damped thread the damper limits the step: a step by the stiffness alone is unstable."""
    film = Data(nodes=477, stiffness=47.7, damping=damping, rate=0.0, tip_mass=0.0)
    longest = film.stable_step("departure")
    by_stiffness = math.sqrt(8.0 * film.line_density * film.segment / (4.0 * film.stiffness))
    assert longest < 0.5 * by_stiffness
    found, half, unstable = (
        deploy(film, "spool node", until=1.5, samples=4, step=step)
        for step in (SHARE * longest, 0.5 * SHARE * longest, SHARE * by_stiffness)
    )
    assert found.off_plane == pytest.approx(half.off_plane, rel=1e-3)
    assert unstable.t[-1] < found.t[-1]


def test_a_thread_without_forces_leaves_straight_with_the_departure_point_only():
    """Figures III.3 and III.4: no spin; the tip is as far from Q as has been paid out, in the plane z = r."""
    film = Data(nodes=477, stiffness=100.0 * 477, rate=0.0)
    found = {start: deploy(film, start, until=1.0, samples=4) for start in ("spool node", "departure")}
    right = found["departure"]
    assert right.positions[:, 0, 0] == pytest.approx(film.speed * right.t, abs=1e-9)
    assert right.off_plane == 0.0
    assert np.nanmax(np.abs(right.positions[:, :, 1])) == 0.0
    assert np.isfinite(right.positions[-1, :, 0]).sum() == round(film.speed * right.t[-1] / film.segment)
    assert np.nanmax(np.abs(found["spool node"].positions[:, :, 2] - film.radius)) > film.radius


@pytest.mark.slow
def test_stiffness_by_the_length_of_the_boundary_segment_keeps_lag_and_peak():
    """Section III.3 leaves open what the constant c of the boundary segment does along the thread.

    A released node starts without strain: its segment overshoots to twice the tension. Steps near the stability limit
    damp that.
    """
    step = 0.125 * SHARE * SOFT.stable_step("scaled")
    constant, scaled = run(until=30.0, step=step), run(until=30.0, start="scaled", step=step)
    late = constant.t >= 7.0
    gap = constant.lag - np.interp(constant.t, scaled.t, scaled.lag)
    assert np.abs(gap[late]).max() < 0.03
    assert np.nanmax(scaled.pull) == pytest.approx(np.nanmax(constant.pull), rel=0.02)


@pytest.mark.slow
def test_a_node_that_stays_on_the_spool_does_not_act():
    """Node n is held by the paper, released by eq. (1) at 135.7 s: before it the runs are the same."""
    free, held = run(), run(held=True)
    same = free.t < 135.714
    assert np.array_equal(free.rate[same], held.rate[same])
    assert np.isnan(held.positions[-1, -1]).all()
    assert held.rate[-1] == pytest.approx(free.rate[-1], rel=0.01)
