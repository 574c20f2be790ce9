"""Plans of measurements: the predicted uncertainty is met by simulated recordings, and agrees with closed forms."""

from __future__ import annotations

import math
import pathlib
import re
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

from book import Book
from evolvent_base.cli import commands
from evolvent_base.errors import InputError
from evolvent_massprops import planning
from evolvent_massprops.planning.expected import task_of
from evolvent_massprops.planning.predictions import predicted
from massprops import rig

EXAMPLE = rig.EXAMPLES / "plan.yaml"
#: A stand that is known exactly: the noise alone counts.
EXACT: dict[str, Any] = {
    "stand.half_length": "2 m", "stand.half_width": "0.8696 m", "stand.stiffness": "740250 N/m",
    "stand.natural_length": "0.5 m", "body.mass": "15190 kg", "body.height": "0 m", "body.offset_x": "0.3 m",
    "body.offset_z": "0.1 m", "body.Iyy": "43920 kg m^2", "body.Ixz": "0 kg m^2",
}  # fmt: skip

#: No moment is asked; a guided body with its centre of mass in the middle, which sways nowhere.
KNOWN: dict[str, Any] = {"body.Ixx": "3703 kg m^2", "body.Izz": "43920 kg m^2"}
LEVEL: dict[str, Any] = EXACT | {"body.offset_x": "0 m", "body.offset_z": "0 m", "stand.support": "guided"}


@pytest.mark.slow
def test_the_prediction_is_met_by_simulated_recordings(book: Book) -> None:
    """Recordings with noise, identified and evaluated, scatter as the plan predicts.

    The deviation of so few has one of 1/sqrt(2 runs), 9 %; 300 of them give 0.99 for both moments.
    """
    exact, runs = EXACT | {"plan.rate": "11 Hz"}, 60
    option = planning.plan(EXAMPLE, 1e-4, exact).best
    assert option.reached
    ratio = planning.check(EXAMPLE, option, exact, runs=runs)
    book(
        "Inertia stand and identification", "Planned uncertainty of Ixx and Izz by noise: 0.01 %, k = 2",
        reference="deviation of the results",
        source=f"{runs} simulated recordings with noise", error=float(np.max(np.abs(ratio - 1.0))), allowed=0.3,
    )  # fmt: skip


def test_the_uncertainty_of_one_oscillator_is_the_closed_form(book: Book) -> None:
    """Guided on soft springs with its moments apart, roll's frequency has 24 s^2/(A^2 T^2 N (N^2 - 1)).

    u(Ixx)/Ixx is then 2 u(w)/w.
    """
    exact = EXACT | {"body.offset_x": "0 m", "body.offset_z": "0 m", "stand.support": "guided", "plan.rate": "40 Hz"}
    N, T = 1601, 1.0 / 40.0
    task = task_of(EXAMPLE, 1.0, exact)
    prediction = predicted(task, task.recordings[0].pulls[:1], 1.0 / T, N, range(4))
    force, k, b = 9806.65, 740250.0, 0.8696
    amplitude = force / (4.0 * k)  # at every spring, of each of the three modes
    std = math.sqrt(24.0 * 1e-8 / (4.0 * amplitude**2 * T**2 * N * (N**2 - 1.0)))  # four sensors
    wanted = 2.0 * std / math.sqrt(4.0 * k * b * b / 3703.0)  # stiffness and mass are known
    at = prediction.keys.index("Ixx")
    error = abs(prediction.noise[at] / prediction.values[at] / wanted - 1.0)
    book(
        "Inertia stand and identification", "Planned uncertainty of Ixx of a guided body by noise",
        reference="2 u(w)/w of roll",
        source="closed form (Rife and Boorstyn 1974)", error=error, allowed=0.02,
    )  # fmt: skip


@pytest.mark.slow
def test_what_a_longer_record_does_not_improve() -> None:
    """Inputs set a floor, which is named; a wanted uncertainty below it is not reached."""
    found = planning.plan(EXAMPLE, 1e-3)
    assert not found.best.reached
    assert found.best.duration == pytest.approx(60.0, abs=0.1)
    assert found.floor[0][0] == "stand.half_width"
    assert np.nanmax(found.best.noise) < 0.1 * found.best.worst
    better = planning.plan(EXAMPLE, 2e-3, points=4)
    assert better.best.reached
    assert better.best.worst <= 2e-3
    lengths = [o.duration for o in better.sensors if o.reached]
    assert lengths == sorted(lengths)  # fewer sensors need longer records
    assert [o.label for o in better.pulls[:4]] == [f"spring {k}" for k in (1, 2, 3, 4)]
    assert [o.pulls[0].kind for o in better.pulls[4:]] == ["two springs", "point"]
    assert "release the pull at spring" in str(better)
    (figure,) = better.answer().figures
    assert [line.label for line in figure.panels[0].lines] == [*(one.label for one in better.pulls), "wanted"]
    assert all(line.x.size <= 4 for line in figure.panels[0].lines)
    assert found.curves is None
    with pytest.raises(InputError, match="plans are not saved as files"):
        better.save("plan.json")
    assert [rule.name for rule in better.rules] == ["(2.5)", "(2.6)", "(2.7)"]
    assert "(2.5) holds for the Cramér-Rao bound of as many samples, and is refuted for Prony" in better.rules[0].finds
    assert better.rules[0].verdict == "yes"


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"body.Ixx": "unknown"}, "body.Ixx is unknown; a plan needs the value that is expected"),
        ({"plan": None}, "plan is missing; give plan.force"),
        ({"plan.noise": None}, "signals.sensors.0.noise is missing; give it, or plan.noise"),
        ({"plan.force": "0 N"}, "plan.force is '0 N'"),
        ({"plan.force": None}, "plan gives neither of force and excitation; give one of them"),
        (
            {"plan": {"force": "1 N", "excitation": {"force": ["0 N", "-1 N", "0 N"]}}},
            "plan gives both of force and excitation",
        ),
        ({"plan.places": ["corner"]}, "plan.places"),
        (
            {"plan": {"noise": "1 mm", "excitation": {"impulse": ["0 N s", "9 N s", "0 N s"], "at": 5}}},
            "plan.excitation.at is 5, but there are 4 springs",
        ),
        ({"plan.mountings": ["90 deg about w"]}, "plan.mountings.0 is '90 deg about w'; it must be none, a turn"),
        ({"plan.duration": "0.1 s"}, "plan.duration is 0.1 s; to distinguish the modes takes"),
        ({"plan.rate": "5 Hz"}, "plan.rate is 5 Hz, which shows nothing above"),
        ({"plan.duration": "1 yr"}, "samples; at most 2e+06 are planned"),
        ({"identification.band": ["1 rad/s", "10 rad/s"]}, "identification.band is given; a plan looks at all modes"),
        ({"identification.method": "prony"}, "identification.method is 'prony'; a plan holds for varpro"),
        ({"signals.unit": "m/s^2", "plan.noise": "0.1 mm"}, "signals.sensors.0 reads m/s^2; a plan takes"),
        (KNOWN | {"body.offset_x": "unknown near 0.3 m"}, "body has the unknown offset_x; a plan needs one with a rel"),
        (LEVEL | {"signals.sensors.3.direction": "x"}, "signals.sensors.3 shows nothing, wherever the pull is"),
        (
            LEVEL | {"body.Ixx": f"unknown near {15190.0 * 0.8696**2} kg m^2"},
            "several modes have the same frequency, 13.96",
        ),
    ],
)
def test_refusals(changes: dict[str, Any], message: str) -> None:
    """Each is one sentence that names the key."""
    with pytest.raises(InputError, match=re.escape(message)):
        planning.plan(EXAMPLE, 2e-3, changes)


@pytest.mark.parametrize("text", ["0", "120%", "-1%", "much", "nan"])
def test_a_wanted_uncertainty_is_a_share(text: str) -> None:
    """Anything else is refused by name."""
    found = CliRunner().invoke(commands, ["plan", str(EXAMPLE), "--uncertainty", text], standalone_mode=False)
    assert isinstance(found.exception, InputError)
    assert f"--uncertainty is {text!r}" in str(found.exception)


def test_noise_and_sensitivity_in_the_unit_of_the_column() -> None:
    """Volts of a sensor with a sensitivity are displacements, and its uncertainty is part of the budget."""
    (plain,) = task_of(EXAMPLE, 1.0, {"signals.unit": "mm", "signals.sensors.0.noise": "0.2"}).recordings
    assert plain.noise == pytest.approx([2e-4, 1e-4, 1e-4, 1e-4])
    volts = {f"signals.sensors.{k}.sensitivity": "0.5 V/mm +- 0.2 %" for k in range(4)} | {"signals.unit": "V"}
    (found,) = task_of(EXAMPLE, 1.0, volts | {"signals.sensors.1.noise": "1 mV"}).recordings
    assert found.noise == pytest.approx([1e-4, 2e-6, 1e-4, 1e-4])
    assert found.sensitivity_std == pytest.approx(np.full(4, 2e-3))


@pytest.mark.slow
def test_a_rate_that_reaches_what_the_usual_one_does_not() -> None:
    """Eight samples in a period are not enough in a short record; the slowest rate that is becomes the plan."""
    found = planning.plan(EXAMPLE, 2e-3, EXACT | {"plan.duration": "2.2 s", "plan.noise": "0.4 mm"})
    assert found.best.reached
    assert not any(option.reached for option in found.pulls)
    assert found.best.rate == min(option.rate for option in found.rates if option.reached)


@pytest.mark.slow
def test_the_command(tmp_path: pathlib.Path) -> None:
    """It prints the recommendation and what was compared, and draws the figure."""
    figure = tmp_path / "plan.png"
    found = CliRunner().invoke(
        commands,
        ["plan", str(EXAMPLE), "--uncertainty", "0.2%", "-o", str(figure), "--set", "plan.rate=32 Hz"],
        standalone_mode=False,
    )
    assert found.exception is None, found.exception
    assert "release the pull at spring" in found.output
    for table in ("what it gives", "least energy", "damping ratio", "what a longer record does", "calibrated"):
        assert table in found.output
    assert figure.stat().st_size > 10_000
