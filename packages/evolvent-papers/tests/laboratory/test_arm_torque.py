"""What a torque is made of: noise, errors of the angle and terms, of made records and of those of the package."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest

from evolvent_papers.laboratory import arm, arm_torque
from evolvent_papers.laboratory.arm_torque import FRICTION, RIGID, WINDUP, Sampled

#: Moment of inertia, weight, Coulomb friction, windup and error of the angle, 12 times a turn, of made records; SI.
INERTIA, WEIGHT, DRY, SOFT, ERROR = 0.15, 3.0, 0.3, 6e-3, 1.6e-3


def made(*, noise: float, soft: float = SOFT, error: float = ERROR, seed: int = 5) -> Sampled:
    """20 s at 200 Hz: a swing that is a sum of sines, the torque that it takes, and the angle that a sensor reads."""
    rng, time = np.random.default_rng(seed), np.arange(0.0, 20.0, 0.005)
    parts = ((1.4, 3.1, 0.0), (0.8, 4.7, 1.0), (0.3, 7.9, 2.0))
    q, v, a = (sum(A * w**k * np.sin(w * time + p + k * math.pi / 2.0) for A, w, p in parts) for k in (0, 1, 2))
    torque = INERTIA * a + WEIGHT * np.sin(q) + DRY * np.tanh(v / arm_torque.SLOW)
    read = q + soft * torque + error * np.sin(12.0 * q)
    measured = torque + noise * rng.standard_normal(time.size)
    return Sampled.of("made", time, read, measured)


def test_white_noise_is_found_by_its_level() -> None:
    """Of a standard deviation s at a step h the density is 2 s^2 h."""
    record = made(noise=0.5, soft=0.0, error=0.0)
    assert record.noise(math.inf) == pytest.approx(2.0 * 0.5**2 * record.step, rel=0.05)


def test_an_error_of_the_angle_is_found_by_its_order() -> None:
    record = made(noise=0.01)
    first, later = record.within(0.0, 8.0, 0.2), record.within(8.0, 20.0, 0.2)
    found = max((arm_torque.order(record, float(n), first) for n in arm_torque.ORDERS), key=lambda one: one.share)
    assert found.number == 12.0
    assert (found.cosine, found.sine) == pytest.approx((0.0, ERROR), abs=0.1 * ERROR)
    assert found.share > 0.8
    assert arm_torque.explains(record, found, later) > 0.8


def test_terms_of_a_made_record_are_found_again() -> None:
    record = made(noise=0.02)
    chosen, columns = record.within(0.0, 10.0, 0.2), arm_torque.terms(record, 12.0)
    torque = record.low(record.torque, arm_torque.BELOW)
    models = arm_torque.path(columns, torque, chosen, record.step)
    last = next(one for one in models if {FRICTION, WINDUP, "error of the angle, order 12"} <= set(one.names))
    assert len(last.names) == 5
    values = [last.value(name, columns) for name in (*RIGID, FRICTION)]
    assert values == pytest.approx([INERTIA, WEIGHT, DRY], rel=0.05)
    assert last.value(WINDUP, columns) == pytest.approx(
        -INERTIA * SOFT, rel=0.15
    )  # gravity at the angle of the windup is not in it
    later = record.within(10.0, 20.0, 0.2)
    off = last.torque(columns) - torque
    assert arm_torque.rms(off[later]) < 0.06 * arm_torque.rms(torque[later])


def test_no_term_is_found_in_noise() -> None:
    record = made(noise=2.0, soft=0.0, error=0.0)
    chosen, columns = record.within(0.0, 4.0, 0.2), arm_torque.terms(record, 12.0)
    torque = record.low(record.torque, arm_torque.BELOW)
    models = arm_torque.path(columns, torque, chosen, record.step, arm_torque.OF_TORQUE)
    assert all("error" not in name and "ripple" not in name for name in models[-1].names)


def test_torques_of_the_package() -> None:
    """`docs/laboratory/driven-arm.md` states these numbers."""
    basis, whole = arm.records_of(None)
    swing = whole.part(0, whole.upright)
    found = arm_torque.explained(basis.sampled, whole.sampled, float(swing.time[-1]), arm.BELOW)
    assert found is not None
    first, second = found.paths[basis.name], found.paths[whole.name]
    assert first[0].names == RIGID
    assert "friction by load" in first[-1].names
    assert len(first) == 2
    assert [one.names[-1] for one in second[1:4]] == [FRICTION, WINDUP, "error of the angle, order 12"]
    assert found.best is second[3]
    assert found.noise == pytest.approx(0.33, abs=0.02)
    assert (found.order.number, found.order.amplitude) == pytest.approx((12.0, 1.5e-3), rel=0.05)
    second_record = whole.sampled
    for least, most in ((3.0, 5.0), (5.0, 9.0)):  # not by the rate, as a ripple of the torque would be
        rate = np.abs(second_record.rate)
        some = second_record.within(0.0, 4.59, 0.125) & (rate > least) & (rate < most)
        assert arm_torque.order(second_record, 12.0, some).amplitude == pytest.approx(1.55e-3, rel=0.15)
    frequency, density = basis.sampled.spectrum(math.inf)
    for low, high, level in ((10.0, 40.0, 0.025), (40.0, 150.0, 0.036)):
        assert np.mean(density[(frequency >= low) & (frequency < high)]) == pytest.approx(level, rel=0.05)
    columns = arm_torque.terms(second_record, 12.0)
    used, low_torque = second_record.within(0.0, 4.59, 0.25), second_record.low(second_record.torque, arm.BELOW)
    rigid = np.stack(
        [second_record.low(one, arm.BELOW) for name in (*RIGID, FRICTION) for one in columns[name]], axis=1
    )
    off = low_torque - rigid @ np.linalg.lstsq(rigid[used], low_torque[used], rcond=None)[0]
    assert arm_torque.rms(off[used]) / arm_torque.rms(low_torque[used]) == pytest.approx(0.11, abs=0.01)
    cells = [row[2:] for table in found.tables for row in table.rows]
    rows = [[float(cell.strip(" %")) for cell in row if cell != "-"] for row in cells]
    listed = [
        [34.2, 15.4, 56.2, 52.8], [27.2, 14.1, 46.7, 48.1], [21.1, 11.5, 43.4], [14.9, 7.3, 24.1], [13.0, 7.1, 31.9],
        [47.7, 34.8, 38.2], [45.1, 32.0, 33.1],
    ]  # fmt: skip
    for row, expected in zip(rows, listed, strict=True):
        assert row == pytest.approx(expected, abs=0.6)
    notes = "\n".join(found.notes)
    assert "33 % of the torque below 4 Hz; without peaks (median of 5 samples) a weight of 2.0 N m" in notes
    assert "explains 54 % of what is between 6 and 20 Hz, and 45 % of its later swings" in notes
    values = re.search(r"moment of inertia (\S+), weight (\S+), Coulomb friction (\S+)\)", notes)
    assert values is not None
    assert [float(one) for one in values.groups()] == pytest.approx([0.158, 3.09, 0.26], rel=0.02)
    assert "windup of the drive: 5.5 mrad for 1 N m" in notes


def test_samples_that_are_too_far_apart_say_nothing() -> None:
    time = np.arange(0.0, 4.0, 0.05)
    record = Sampled.of("coarse", time, np.sin(time), np.cos(time))
    assert arm_torque.explained(record, record, 4.0, 4.0) is None
