"""A motor-driven arm: motion and torque against SciPy, parameters of a made record, and what the guide states."""

from __future__ import annotations

import dataclasses
import math
import re

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from evolvent_base.errors import InputError
from evolvent_papers import laboratory
from evolvent_papers.laboratory import arm
from laboratory.verdicts import stored

ARM = arm.Arm(inertia=0.15, weight=2.9, viscous=0.03, dry=0.1)


def drive(t: float | np.ndarray) -> float | np.ndarray:
    """Torque of a made record, N m."""
    return 1.2 * np.sin(4.2 * t) + 0.4 * np.sin(9.0 * t)


def acceleration(own: arm.Arm, t: float, angle: float, rate: float) -> float:
    """Of an arm that slips."""
    friction = own.viscous * rate + own.dry * math.tanh(rate / 1e-3)
    return float((drive(t) - own.weight * math.sin(angle) - friction) / own.inertia)


def made(own: arm.Arm, duration: float) -> arm.Record:
    """A record at 200 Hz from rest by SciPy, its friction a steep function of the rate."""
    time = np.arange(0.0, duration + 1e-9, 0.005)
    found = solve_ivp(
        lambda t, y: [y[1], acceleration(own, t, y[0], y[1])], (0.0, duration), [0.0, 0.0], t_eval=time, method="Radau",
        rtol=1e-8, atol=1e-9, max_step=0.005,
    )  # fmt: skip
    return arm.Record(name="made", time=time, angle=found.y[0], torque=np.asarray(drive(time)))


@pytest.fixture(scope="module")
def record() -> arm.Record:
    return made(ARM, 3.0)


@pytest.mark.slow
def test_motion_is_that_of_the_equation(record) -> None:
    pieces = record.pieces()
    assert len(pieces) == 6
    for piece in pieces[1:]:
        assert arm.rms([arm.motion(ARM, piece) - piece.record.angle]) < 3e-3
    whole = arm.Piece(record=record, start=np.zeros(2), deviation=np.zeros(2))
    assert arm.rms([arm.motion(ARM, whole) - record.angle]) < 1e-2


@pytest.mark.slow
def test_torque_is_that_of_the_motion(record) -> None:
    inner, measured = record.inner, record.smooth[2]
    size = arm.rms([measured[inner]])
    assert arm.rms([(arm.torque(ARM, record) - measured)[inner]]) < 0.05 * size
    other = dataclasses.replace(ARM, inertia=0.3, weight=5.8)
    assert arm.rms([(arm.torque(other, record) - measured)[inner]]) > 0.2 * size


@pytest.mark.slow
def test_a_made_record_is_fitted_and_another_one_predicted(record, tmp_path) -> None:
    for name, own in ((arm.FITTED, record.until(1.5)), (arm.PREDICTED, record.until(1.01))):
        rows = np.column_stack([own.time, own.angle, np.zeros_like(own.time), own.torque])
        np.savetxt(tmp_path / name, rows, fmt="%.9f", delimiter=",", header=",".join(arm.HEAD), comments="")
    found = laboratory.found("driven-arm").validate(data=str(tmp_path))
    inertia, weight, _, dry, off = map(float, re.findall(r" (-?\d+\.\d+)", found.notes[0])[:5])
    assert off <= 2e-3
    assert inertia == pytest.approx(ARM.inertia, rel=0.02)
    assert weight == pytest.approx(ARM.weight, rel=0.02)
    assert dry == pytest.approx(ARM.dry, abs=0.02)
    motion, _, torque = found.comparisons
    assert motion.what == "rms of the angle, 2 pieces of 0.5 s"
    assert motion.predicted < 2e-3
    assert motion.covered
    assert motion.meets
    assert torque.meets


def test_records_are_those_of_the_package_or_of_a_folder(tmp_path) -> None:
    basis, whole = arm.records_of(None)
    assert (basis.time.size, whole.time.size) == (1170, 4000)
    assert whole.time[whole.upright] == pytest.approx(4.59, abs=0.01)
    with pytest.raises(InputError, match=r"has no file pd-identification\.csv; it needs"):
        arm.records_of(str(tmp_path))
    rows = "time,position,velocity,torque\n0,0,0,0\n0.1,0,0,0\n"
    (tmp_path / "pd-identification.csv").write_text(rows)
    with pytest.raises(InputError, match=r"times must rise, over 1 s or more"):
        arm.records_of(str(tmp_path))


@pytest.mark.parametrize("again", [False, pytest.param(True, marks=[pytest.mark.slow, pytest.mark.release])])
def test_the_records_of_the_package(again: bool) -> None:
    """`docs/laboratory/driven-arm.md` and the table of `docs/guide/laboratory.md` state these numbers."""
    found = laboratory.found("driven-arm").validate() if again else stored("driven-arm")
    motion, largest, torque = found.comparisons
    assert motion.predicted == pytest.approx(0.034, abs=0.003)
    assert largest.predicted == pytest.approx(0.073, abs=0.008)
    assert torque.predicted == pytest.approx(0.169, abs=0.01)
    assert torque.allowed == pytest.approx(0.0807, abs=1e-3)
    assert [one.meets for one in found.comparisons] == [True, True, False]
    assert found.coverage == (3, 3)
    assert 0.1 < motion.band.half_width < 0.3
    assert 0.5 < torque.band.half_width < 1.3
    assert max(one.band.numerics for one in found.comparisons) < 1e-3
    notes = "\n".join(found.notes)
    assert "36 % of its own torque are not those of a rigid arm" in notes
    assert "the authors' least squares: 0.20" in notes
    assert "torque 41 % rms off" in notes
    assert "the authors' other file: 0.35" in notes
    assert "torque 147 % rms off" in notes
    assert "after that the arm is pushed: at 16.1 s" in notes
