"""Limiters of the stand as gaps with friction, and air that the body moves, against closed forms."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import evolvent
from book import Book
from evolvent_base.errors import InputError

CHAPTER = "Inertia stand and identification"
MASS, STIFFNESS = 150.0, 8e4


def case(**changes: Any) -> dict[str, Any]:
    """A light body on four springs."""
    return {
        "system": "inertia-stand",
        "body": {"mass": "150 kg", "inertia": ["10 kg m^2", "16 kg m^2", "12 kg m^2"]},
        "stand": {
            "support": "guided", "half_length": "0.6 m", "half_width": "0.4 m", "stiffness": "20000 N/m",
            "natural_length": "0.3 m",
        },
        "excitation": {"displacement": ["0 m", "20 mm", "0 m"]},
        "sensors": {"rate": "100 Hz", "duration": "3 s"},
        "identification": {"way": "none", "order": 1},
    } | changes  # fmt: skip


@pytest.mark.slow
def test_friction_takes_the_same_of_every_period_and_leaves_a_dead_band(book: Book) -> None:
    """Heave loses 4 F/K a period, F the friction of eight pads of 100 N at 0.1, and stops within F/K."""
    pads = {"clearance": "-0.1 mm", "friction": 0.1, "stiffness": "1e6 N/m", "bristle_stiffness": "1e7 N/m"}
    found = evolvent.run(case(solver={"method": "dopri5"}), {"stand.limiters": pads})
    t, y = found.time.values, found.sensor_true.values[:, 0]
    force, period = 8.0 * 0.1 * 100.0, 2.0 * math.pi * math.sqrt(MASS / STIFFNESS)
    peaks = []
    for n in range(1, 5):
        near = np.abs(t - n * period) < 0.2 * period
        a, b, c = np.polyfit(t[near], y[near], 2)
        peaks.append(c - b**2 / (4.0 * a))
    lost = -np.diff([0.02, *peaks])
    closed = 4.0 * force / STIFFNESS
    assert np.abs(lost / closed - 1.0).max() < 0.06  # the parabola through a peak of few samples
    assert abs(float(np.sum(lost)) / (4.0 * closed) - 1.0) < 0.02
    assert np.ptp(y[t > 6.0 * period]) < 1e-6
    assert abs(y[-1]) < force / STIFFNESS
    book(
        CHAPTER, "Limiters with friction: amplitude that heave loses in four periods", reference="16 F/K",
        source="closed form", error=abs(float(np.sum(lost)) / (4.0 * closed) - 1.0), allowed=0.02,
    )  # fmt: skip


@pytest.mark.slow
def test_a_gap_shortens_the_period_of_sway(book: Book) -> None:
    """Sway meets stiff springs behind a gap: a motion of pieces of two sines."""
    clearance, speed, each = 1e-3, 0.02, 1e6
    pads = {"clearance": f"{clearance} m", "friction": 0.0, "stiffness": f"{each} N/m"}
    sway = case(solver={"method": "dopri5"}, excitation={"velocity": [f"{speed} m/s", "0 m/s", "0 m/s"]})
    sway["stand"] = sway["stand"] | {"support": "hanging"}
    found = evolvent.run(sway, {"stand.limiters": pads, "sensors.directions": "horizontal and vertical"})
    x, t = found.displacement.values[:, 0], found.time.values
    w0 = float(found.linear_frequency.values[0])
    free = speed / w0
    assert free > 2.0 * clearance
    up = np.flatnonzero((x[:-1] < 0.0) & (x[1:] >= 0.0))
    crossing = t[up] - x[up] * (t[up + 1] - t[up]) / (x[up + 1] - x[up])
    period = float(np.mean(np.diff(crossing)))
    stiff = math.sqrt(w0**2 + 2.0 * each / MASS)  # two pads face the same way
    entry = math.sqrt(free**2 - clearance**2) * w0
    inside = math.atan2(entry / stiff, clearance * (w0 / stiff) ** 2) / stiff
    closed = 4.0 * (math.asin(clearance / free) / w0 + inside)
    assert period == pytest.approx(closed, rel=5e-3)
    assert 2.0 * math.pi / w0 > 2.0 * closed  # far from that of the free body
    book(
        CHAPTER, "Limiters with a gap: period of sway", reference="pieces of two sines", source="closed form",
        error=abs(period / closed - 1.0), allowed=5e-3,
    )  # fmt: skip


@pytest.mark.slow
def test_pressed_pads_are_springs_of_negative_stiffness(book: Book) -> None:
    """Four pads of N at the lever b take 4 N b of the rotational stiffness."""
    pads = {"clearance": "-0.1 mm", "friction": 0.0, "stiffness": "1e6 N/m"}
    pulled = case(
        solver={"method": "dopri5"}, excitation={"force": ["0 N", "-40 N", "0 N"]},
        identification={"way": "none", "order": 3},
    )  # fmt: skip
    found = evolvent.run(pulled, {"stand.limiters": pads, "sensors.rate": "60 Hz"})
    low = found.mode_frequency.values / np.sort(found.linear_frequency.values) - 1.0
    closed = np.array([0.0, -4.0 * 100.0 * 0.4 / (2.0 * 12800.0), -4.0 * 100.0 * 0.6 / (2.0 * 28800.0)])
    np.testing.assert_allclose(low, closed, atol=2e-5)
    book(
        CHAPTER, "Pressed limiters: roll and pitch are low", reference="sum N b/2 K", source="closed form",
        error=float(np.abs(low - closed).max()), allowed=2e-5,
    )  # fmt: skip


@pytest.mark.slow
def test_air_slows_the_simulated_body(book: Book) -> None:
    """A light board of 2 kg: heave falls to sqrt(K/(M + m_a)), and the moments found hold the air's."""
    rho, r = 1.204, 0.6
    mass, moment = 8.0 / 3.0 * rho * r**3, 16.0 / 45.0 * rho * r**5
    board = case(
        body={"mass": "2 kg", "inertia": ["0.2 kg m^2", "0.3 kg m^2", "0.2 kg m^2"]},
        excitation={"force": ["0 N", "-1 N", "0 N"]},
        identification={"way": "three-frequencies", "order": 3},
        air={"shapes": [{"disc": {"radius": "0.6 m"}}]},
    )
    board["stand"] = board["stand"] | {"stiffness": "100 N/m"}
    found = evolvent.run(board, {"sensors.duration": "8 s", "sensors.rate": "50 Hz"})
    heave = math.sqrt(400.0 / (2.0 + mass))
    assert found.mode_frequency.values.min() == pytest.approx(heave, rel=1e-4)
    # with the mass taken as known the stiffness comes out too small by M/(M + m_a)
    biased = (0.2 + moment) * 2.0 / (2.0 + mass)
    xx = float(found.inertia_identified.sel(component="xx"))
    assert xx == pytest.approx(biased, rel=1e-3)
    assert float(found.inertia_true.sel(component="xx")) == pytest.approx(0.2)
    book(
        CHAPTER, "Air of a board on the stand: moment that is found without its correction",
        reference="(I + J) M/(M + m)", source="closed form", error=abs(xx / biased - 1.0), allowed=1e-3,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"stand.limiters": {"clearance": "1 mm"}}, "solver.method is 'dop853'.*; stand.limiters takes 'dopri5'"),
        ({"stand.limiters": {"friction": 0.1}}, "stand.limiters.clearance"),
        ({"stand.limiters": {"clearance": "1 mm", "friction": -0.1}}, "stand.limiters.friction"),
        (
            {"air": {"shapes": [{"sphere": {"radius": "1 m", "centre": [1, 0, 0]}}]}},
            "air.shapes.0 has centre .* leave centre and of out",
        ),
    ],
)
def test_what_is_refused(changes: dict[str, Any], said: str) -> None:
    with pytest.raises(InputError, match=said) as error:
        evolvent.run(case(), changes)
    assert "\n" not in str(error.value)
