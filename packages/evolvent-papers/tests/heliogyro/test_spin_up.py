"""Torques that spin up a body with deployed blades: closed forms of rigid blades, and the thread beside them."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

import evolvent
from book import Book
from evolvent import cases, closed_forms as cf
from evolvent_base.cli import commands
from evolvent_base.errors import InputError
from evolvent_papers import links, spin_up
from evolvent_papers.heliogyro import straight

#: Blades that are one rigid link with a mass at its end, wholly out.
LINK: dict[str, Any] = {
    "blade.nodes": 1, "blade.length": 1.0, "blade.line_density": 1e-9, "blade.tip_mass": 0.001,
    "blade.segments": "inextensible", "solver.method": "dopri5", "solver.rtol": 1e-10, "solver.atol": 1e-12,
    "spool.start_length": 1.0, "spool.rate": 0.0, "body.rate": 2.0, "solver.duration": 10.0, "output.fine": False,
}  # fmt: skip
ROTOR = cf.Rotor(0.004, 0.05, 2, 1e-9, 0.001)


def test_small_swings_have_the_frequency_of_the_closed_form(book: Book) -> None:
    run = evolvent.run("heliogyro", LINK | {"spool.start_lag": "0.1 deg", "output.every": 0.02})
    lag, t = run.tip_lag.values[:, 0], run.time.values
    k = np.flatnonzero(lag[:-1] * lag[1:] < 0.0)
    zeros = t[k] + lag[k] / (lag[k] - lag[k + 1]) * (t[k + 1] - t[k])
    found = math.pi * (zeros.size - 1) / (zeros[-1] - zeros[0])
    exact = cf.lag_frequency(ROTOR, 1.0, 2.0)
    book(
        "Threads, reels, tethers", "Frequency of the lag of one link on a free body",
        reference=f"closed form, {exact:.5f} rad/s",
        source="closed_forms.lag_frequency", error=abs(found / exact - 1.0), allowed=1e-4,
    )  # fmt: skip


@pytest.mark.parametrize("ramp", [0.0, 2.0])
def test_one_link_under_a_torque_is_the_rigid_blade(ramp: float) -> None:
    torque = 0.8 * cf.step_torque_limit(ROTOR, 1.0, 2.0)
    run = evolvent.run("heliogyro", LINK | {"spin_up": {"torque": torque, "ramp": ramp}, "solver.duration": 5.0})
    time, lag, rate = cf.spin_up_swing(ROTOR, 1.0, torque, 2.0, ramp=ramp, until=5.0)
    assert run.tip_lag.values[:, 0] == pytest.approx(np.interp(run.time.values, time, lag), abs=2e-5)
    assert run.hub_lag.values == pytest.approx(run.tip_lag.values, abs=1e-12)
    assert run.body_rate.values == pytest.approx(np.interp(run.time.values, time, rate), abs=2e-5)
    assert float(lag.max()) > 1.0


def test_the_torque_is_what_the_angular_momentum_gains() -> None:
    """Fully out, nothing else changes it; a profile is the same torque, and ends when it should."""
    given = LINK | {"blade.nodes": 8, "blade.line_density": 7e-4, "solver.duration": 4.0}
    one = evolvent.run("heliogyro", given | {"spin_up": {"torque": "1 mN m", "start": 1.0, "until": 3.0}})
    H = one.angular_momentum.values[:, 2]
    gained = 1e-3 * np.clip(one.time.values - 1.0, 0.0, 2.0)
    assert H - H[0] == pytest.approx(gained, abs=1e-8)
    profile = {"pulse": {"value": "1 mN m", "start": 1.0, "duration": 2.0}}
    other = evolvent.run("heliogyro", given | {"spin_up": {"profile": profile}})
    assert other.body_rate.values == pytest.approx(one.body_rate.values, abs=1e-7)
    assert "body_rate_paper" not in one


def test_a_slow_torque_keeps_the_lag_of_equilibrium() -> None:
    """The closed form at the acceleration and rate of the moment; its limit is at cos d = -k."""
    torque = 0.5 * cf.slow_torque_limit(ROTOR, 1.0, 2.0)
    time, lag, rate = cf.spin_up_swing(ROTOR, 1.0, torque, 2.0, ramp=60.0, until=60.0)
    middle = (time > 20.0) & (time < 40.0)  # over which small swings cancel
    steady = map(
        cf.spin_up_lag, [ROTOR] * middle.sum(), [1.0] * middle.sum(), np.gradient(rate, time)[middle], rate[middle]
    )
    assert np.mean(lag[middle]) == pytest.approx(np.mean(list(steady)), rel=0.02)
    _, S, I = cf.blade_moments(ROTOR, 1.0)  # noqa: E741
    small = ROTOR.offset * S / I
    most = 4.0 * small / math.sqrt(1.0 - small**2)
    assert cf.spin_up_lag(ROTOR, 1.0, most * (1.0 - 1e-12), 2.0) == pytest.approx(math.acos(-small), abs=1e-5)
    assert math.isnan(cf.spin_up_lag(ROTOR, 1.0, 1.001 * most, 2.0))
    turned = 4.0 * small * cf.rotor_inertia(ROTOR, 1.0, 0.5 * math.pi)
    assert cf.slow_torque_limit(ROTOR, 1.0, 2.0) == pytest.approx(turned, rel=1e-14)


def test_a_torque_at_once_tends_to_the_limit_of_constant_spin() -> None:
    """Share sqrt(k) by which the spin grows during a swing: the difference falls by it."""
    gaps = []
    for offset in (1e-4, 1e-6):
        heavy = cf.Rotor(1e4, offset, 2, 0.0, 0.001)
        exact = 1e4 * cf.step_acceleration_limit(heavy, 1.0, 2.0)
        gaps.append(cf.step_torque_limit(heavy, 1.0, 2.0) / exact - 1.0)
    assert 0.0 < gaps[1] < 0.01
    assert gaps[0] / gaps[1] == pytest.approx(10.0, rel=0.15)


def test_closed_forms_without_spin() -> None:
    """The limits for a rate that tends to 0, or a sentence where there is none."""
    for form in (cf.lag_frequency, cf.slow_torque_limit, cf.step_acceleration_limit):
        assert form(ROTOR, 1.0, 0.0) == 0.0
    for ramp in (0.0, 2.0):
        assert cf.step_torque_limit(ROTOR, 1.0, 0.0, ramp=ramp) == 0.0
        slow = [cf.step_torque_limit(ROTOR, 1.0, rate, ramp=ramp) for rate in (2e-2, 1e-2)]
        assert slow[0] / slow[1] == pytest.approx(4.0, rel=0.01)
    assert math.isnan(cf.payout_lag(ROTOR, 0.1, 0.0))
    assert math.isnan(cf.spin_up_lag(ROTOR, 1.0, 0.1, 0.0))
    with pytest.raises(InputError, match="rate is 0 rad/s and acceleration is 0"):
        cf.spin_up_lag(ROTOR, 1.0, 0.0, 0.0)
    with pytest.raises(InputError, match=r"rate is 0 rad/s, .* give until"):
        cf.spin_up_swing(ROTOR, 1.0, 1e-3, 0.0)
    assert float(cf.spin_up_swing(ROTOR, 1.0, 1e-3, 0.0, until=10.0)[1].max()) > 0.5 * math.pi
    assert cf.lag_frequency(ROTOR, 1.0, -2.0) == cf.lag_frequency(ROTOR, 1.0, 2.0)


def test_the_permissible_torque_of_one_link_is_that_of_the_rigid_blade(book: Book) -> None:
    found = spin_up.permissible_torque("heliogyro", [1.0], LINK, rate=2.0)
    error = abs(float(found.thread[0] / cf.step_torque_limit(ROTOR, 1.0, 2.0)) - 1.0)
    book(
        "Threads, reels, tethers", "Permissible spin-up torque of one link",
        reference="two equations of motion, by SciPy",
        source="closed_forms.step_torque_limit", error=error, allowed=2e-3,
    )  # fmt: skip


def test_a_torque_that_winds_the_blade_is_reported() -> None:
    torque = 1.3 * cf.step_torque_limit(ROTOR, 1.0, 2.0)
    given = LINK | {"spin_up": {"torque": torque}, "solver.duration": 6.0}
    run = evolvent.run("heliogyro", given)
    assert "the blade winds onto the body" in run.attrs["warning"]


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ({"spin_up": {}}, "spin_up.torque and spin_up.profile are both missing"),
        ({"spin_up": {"torque": 1.0, "profile": {"constant": 1.0}}}, "are both given"),
        ({"spin_up": {"torque": "1 N"}}, "spin_up.torque is '1 N'"),
        ({"spin_up": {"torq": 1.0}}, "did you mean"),
        ({"spin_up": {"torque": 1.0}, "body.motion": "driven"}, "body.motion is 'driven'"),
    ],
)
def test_a_torque_that_cannot_be_used_is_refused(given: dict[str, Any], sentence: str) -> None:
    with pytest.raises(InputError, match=sentence.replace("(", r"\(")):
        cases.load("heliogyro", given)


def test_times_out_of_order_name_the_key() -> None:
    with pytest.raises(InputError, match=r"spin_up\.until is 1\.0 s; it must be after spin_up\.start, 2\.0 s"):
        evolvent.run("heliogyro", {"spin_up": {"torque": 1e-3, "start": 2.0, "until": 1.0}})


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (["heliogyro", "--lengths", "0m"], "above 0"),
        (["heliogyro", "--lengths", "1kg"], "lengths.0 is '1kg'"),
        (["heliogyro", "--lengths", "1m", "--ramp", "1e20s"], "ramp is 1e+20 s; with blades of 1 m it must be at most"),
        (["heliogyro", "--rate", "1e20"], "a blade of 5 m at 1e+20 rad/s cannot be run"),
        (["heliogyro", "--rate", "-1rad/s"], "rate is '-1rad/s'"),
        (["heliogyro", "--ramp", "-1s"], "ramp is '-1s'"),
        (["inertia-stand", "--lengths", "1m"], "'inertia-stand'"),
        (["inertia-stand"], "'inertia-stand'"),
        (["heliogyro", "--set", "body.rate=0"], "body.rate is 0"),
        (["heliogyro", "--set", "body.motion=driven"], "'driven'"),
        (["heliogyro", "--set", "spin_up.torque=1"], "spin_up is given"),
    ],
)
def test_options_that_cannot_be_used_are_refused(options: list[str], sentence: str) -> None:
    found = CliRunner().invoke(commands, ["permissible-torque", *options], standalone_mode=False)
    assert isinstance(found.exception, InputError)
    assert sentence in str(found.exception)


def test_the_spin_before_the_torque_is_what_the_momentum_at_the_start_leaves() -> None:
    case = cases.load("heliogyro", {"spool.start_length": 2.0, "body.rate": -3.0})
    exact = 3.0 * cf.rotor_inertia(straight.rotor(case), 2.0)
    assert straight.start_momentum(case) == pytest.approx(exact, rel=1e-14)
    assert straight.start_momentum(cases.load("heliogyro")) == pytest.approx(0.024, rel=1e-14)


@pytest.mark.slow
def test_a_slowly_growing_torque_has_a_limit_too() -> None:
    """Many times that of equilibrium: the spin grows with it."""
    rotor = cf.Rotor(0.004, 0.05, 2, 0.000735, 0.0005)
    limit = cf.step_torque_limit(rotor, 5.0, 1.0, ramp=100.0)
    assert limit / cf.slow_torque_limit(rotor, 5.0, 1.0) == pytest.approx(5.626, rel=1e-3)


def test_segments_by_length_become_links() -> None:
    case = cases.load("heliogyro", {"blade.boundary_segment": "by-length"})
    assert cases.load(case.model_dump(mode="json"), links.LINKS).blade.boundary_segment == "constant"


def test_the_figure_has_points_at_the_computed_lengths_alone() -> None:
    """Two lengths joined by a line would look like a computed curve."""
    values = np.array([1.0, 2.0])
    found = spin_up.Permissible(values, values, values, values, values, ramp=0.0, nodes=20)
    lines = [line for panel in found.answer().figures[0].panels for line in panel.lines]
    assert all(line.marker and not line.style.strip() for line in lines)
