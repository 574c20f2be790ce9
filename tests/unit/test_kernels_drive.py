"""Drive laws: rate and acceleration against differences of the angle, tables against SciPy."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, strategies as st
from numpy.testing import assert_allclose
from scipy.interpolate import CubicSpline, PchipInterpolator

from evolvent import parts
from evolvent.assembly.builder import Builder
from evolvent.compiled import laws
from evolvent.kernels import drive as kernels

H = 1e-4


@laws.law
def swinging(t, p):
    """phi = p0 t + p1 sin(p2 t)."""
    return (
        p[0] * t + p[1] * np.sin(p[2] * t),
        p[0] + p[1] * p[2] * np.cos(p[2] * t),
        -p[1] * p[2] ** 2 * np.sin(p[2] * t),
    )


def evaluate(drive, times):
    """Angle, rate and acceleration at `times`, by way of what the part writes."""
    builder = Builder((0.0, 0.0, 0.0))
    row = drive.write(builder, "reel")
    return np.array([drive.at(builder, row, float(t)) for t in times])


def check_derivatives(drive, times, tolerance):
    before, here, after = (evaluate(drive, np.asarray(times) + h) for h in (-H, 0.0, H))
    assert_allclose(here[:, 1:], (after - before)[:, :2] / (2.0 * H), rtol=0.0, atol=tolerance)


rates = st.floats(-5.0, 5.0)
steps = st.lists(st.tuples(st.floats(0.1, 2.0), st.floats(0.5, 3.0), rates), max_size=4)


@given(rates, st.floats(0.0, 10.0), steps)
def test_ramps_rate_and_acceleration_are_derivatives(rate, angle, gaps):
    start, listed = 0.0, []
    for gap, duration, after in gaps:
        listed.append((start + gap, duration, after))
        start += gap + duration
    drive = parts.RampDrive(rate=rate, angle=angle, steps=listed)
    corners = [t for time, duration, _ in listed for t in (time, time + duration)]
    times = np.linspace(0.0, start + 1.0, 41)
    times = times[[all(abs(t - corner) > 2.0 * H for corner in corners) for t in times]]
    check_derivatives(drive, times, 3e-5)
    first, last = evaluate(drive, [0.0, start + 1.0])
    assert_allclose(first, [angle, rate, 0.0], atol=1e-12)
    assert_allclose(last[1:], [listed[-1][2] if listed else rate, 0.0], atol=1e-12)


def test_ramp_is_the_quintic_smooth_step():
    s = np.linspace(0.0, 1.0, 11)
    found = evaluate(parts.RampDrive(steps=[(1.0, 2.0, 3.0)]), 1.0 + 2.0 * s)
    assert_allclose(found[:, 1], 3.0 * (10.0 * s**3 - 15.0 * s**4 + 6.0 * s**5), atol=1e-13)
    assert_allclose(found[:, 0], 6.0 * (2.5 * s**4 - 3.0 * s**5 + s**6), atol=1e-13)
    assert_allclose(found[-1, 0], 3.0, atol=1e-13)


def test_ramp_of_no_duration_is_a_jump_of_rate():
    found = evaluate(parts.RampDrive(rate=1.0, steps=[(2.0, 0.0, 3.0)]), [1.9, 2.1])
    assert_allclose(found, [[1.9, 1.0, 0.0], [2.3, 3.0, 0.0]], atol=1e-12)


def test_constant_drive_is_a_straight_line():
    found = evaluate(parts.ConstantDrive(rate=3.5, angle=0.2), [0.0, 4.0])
    assert_allclose(found, [[0.2, 3.5, 0.0], [14.2, 3.5, 0.0]], atol=1e-13)


T = np.array([0.0, 0.7, 1.5, 2.0, 4.0])
RATE = np.array([0.0, 2.0, 3.0, 3.0, -1.0])


def test_table_of_rates_is_the_integrated_pchip():
    curve = PchipInterpolator(T, RATE)
    inside = np.linspace(0.0, 4.0, 83)
    found = evaluate(parts.TableDrive(time=T, rate=RATE, start=0.5), inside)
    assert_allclose(found[:, 0], 0.5 + curve.antiderivative()(inside), atol=1e-13)
    assert_allclose(found[:, 1], curve(inside), atol=1e-13)
    away = np.min(np.abs(np.subtract.outer(inside, T)), axis=1) > 1e-6  # PCHIP's slope rate jumps at the data
    assert_allclose(found[away, 2], curve.derivative()(inside)[away], atol=1e-12)


def test_table_of_angles_is_the_cubic_spline():
    angle = np.array([0.0, 1.0, 1.5, 3.0, 2.5])
    curve = CubicSpline(T, angle)
    inside = np.linspace(0.0, 4.0, 83)
    found = evaluate(parts.TableDrive(time=T, angle=angle), inside)
    for order in range(3):
        assert_allclose(found[:, order], curve(inside, order), atol=1e-12)


def test_table_goes_on_at_its_end_rates():
    drive = parts.TableDrive(time=T, rate=RATE, start=0.5)
    (first, last) = evaluate(drive, [T[0], T[-1]])
    before, after = evaluate(drive, [T[0] - 2.0, T[-1] + 3.0])
    assert_allclose(before, [first[0] - 2.0 * RATE[0], RATE[0], 0.0], atol=1e-13)
    assert_allclose(after, [last[0] + 3.0 * RATE[-1], RATE[-1], 0.0], atol=1e-13)


def test_tables_rate_and_acceleration_are_derivatives():
    times = np.array([0.1, 0.4, 1.1, 1.8, 3.3])
    check_derivatives(parts.TableDrive(time=T, rate=RATE), times, 1e-6)
    check_derivatives(parts.TableDrive(time=T, angle=RATE), times, 1e-6)


def test_a_users_law_is_called_with_its_parameters():
    drive = parts.LawDrive(law=swinging, parameters=(3.5, 0.2, 4.0))
    check_derivatives(drive, np.linspace(0.0, 3.0, 11), 1e-6)
    assert_allclose(evaluate(drive, [0.0])[0], [0.0, 4.3, 0.0], atol=1e-14)


def test_the_kinds_have_numbers_of_their_own():
    kinds = [kernels.RAMPS, kernels.TABLE, kernels.LAW, kernels.FREE]
    assert len(set(kinds)) == 4


@pytest.mark.parametrize("t", [T[0], T[2], T[-1]])
def test_table_is_continuous_at_its_own_points(t):
    low, high = evaluate(parts.TableDrive(time=T, rate=RATE), [np.nextafter(t, -9.0), np.nextafter(t, 9.0)])
    assert_allclose(low[:2], high[:2], atol=1e-12)
