"""Plans of several recordings: mountings, tare, air, pulls; against the identification, closed forms, simulations."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from book import Book
from evolvent_base.errors import InputError
from evolvent_massprops import mass_properties, planning
from evolvent_massprops.planning.expected import reading_of, task_of, with_noise
from evolvent_massprops.planning.predictions import predicted
from massprops import rig

EXAMPLE = rig.EXAMPLES / "plan-mountings.yaml"
CHAPTER = "Inertia stand and identification"
TEN = ("mass", "offset_x", "height", "offset_z", "Ixx", "Iyy", "Izz", "Ixy", "Ixz", "Iyz")
#: A rate of few samples and short records, for speed.
QUICK: dict[str, Any] = {"plan.rate": "40 Hz", "plan.duration": "6 s", "plan.places": ["spring"]}
#: A guided stand with everything centred: roll is sqrt(4 k b^2/I) of all that moves.
LEVEL: dict[str, Any] = {
    "stand": {"kind": "springs", "support": "guided", "half_length": "0.6 m", "half_width": "0.4 m",
              "stiffness": "20000 N/m", "natural_length": "0.3 m"},
    "body": {"mass": "120 kg", "offset_x": "0 m", "offset_z": "0 m", "height": "0 m", "Ixx": "unknown near 9 kg m^2",
             "Iyy": "14 kg m^2", "Izz": "unknown near 11 kg m^2"},
    "recordings": {}, "mounting": None,
}  # fmt: skip


@pytest.mark.slow
def test_the_prediction_of_three_mountings_is_met_by_simulations(book: Book) -> None:
    """All ten properties and two of the cradle; the real identification of four simulated recordings.

    The deviation of so few has one of 1/sqrt(2 runs), 13 %; that of all twelve together a few per cent. 200 of them
    give 0.88 to 1.07.
    """
    task, runs = task_of(EXAMPLE, 1.0, QUICK), 30
    option = planning.search.option(task, 4e-3, task.best_pulls, 40.0, task.sensors)
    assert option.keys[:10] == TEN
    ratio = planning.check(EXAMPLE, option, QUICK, runs=runs)
    assert np.abs(ratio - 1.0).max() < 4.0 / math.sqrt(2.0 * runs)
    book(
        CHAPTER, "Planned uncertainty of ten properties in three mountings by noise",
        reference="deviation of the results", source=f"{runs} simulated sets of recordings",
        error=float(abs(np.mean(ratio) - 1.0)), allowed=0.15,
    )  # fmt: skip


@pytest.mark.slow
def test_what_is_predicted_is_what_identify_states() -> None:
    """The identification of one simulated set states the uncertainties that the plan has predicted, inputs and all."""
    task = task_of(EXAMPLE, 1.0, QUICK)
    pulls, rows = task.best_pulls, task.sensors
    prediction = predicted(task, pulls, 40.0, 241, rows)
    random, signals = np.random.default_rng(4), []
    for one, pull in zip(task.recordings, pulls, strict=True):
        reading = with_noise(one, reading_of(one, pull, 40.0, 241, rows), random, rows)
        signals.append(reading.source.of(
            reading.names, reading.data, ("m",) * 4, 40.0, path=one.name, sha256=one.name
        ))  # fmt: skip
    found = mass_properties(signals, EXAMPLE, {"identification.order": 3})
    assert [o.key for o in found.outputs] == list(prediction.keys)
    # the noise is known to the plan, and estimated in the identification
    np.testing.assert_allclose(found.std, prediction.std, rtol=0.08)
    shares = {s.label: s.contribution for s in prediction.shares}
    at = prediction.keys.index("Izz")
    for share in found.shares:
        if not share.label.startswith(("noise", "amplitude")):
            assert share.contribution[at] == pytest.approx(shares[share.label][at], abs=0.02 * prediction.std[at])


@pytest.mark.slow
def test_three_mountings_suffice_and_two_do_not() -> None:
    found = planning.plan(EXAMPLE, 4e-3, QUICK)
    assert found.best.reached
    assert [len(one.names) for one in found.sets] == [1, 2, 3]
    one, two, three = (each.option for each in found.sets)
    assert one.open == 4
    assert two.open == 1
    assert "does not show in the data" in two.reason
    assert three.worst == pytest.approx(found.best.worst)
    worst = [each.option.worst for each in found.further]
    assert worst == sorted(worst)
    # the sides that measure a moment change places: roll and pitch both see it
    assert found.further[0].rotation in ("90 deg about y", "90 deg about x then 90 deg about y")
    assert worst[0] < found.best.worst
    assert len(found.modes) == 12
    damped = found.modes[0]
    assert damped.damping_ratio == pytest.approx(damped.decay_rate / damped.frequency, rel=1e-4)
    # u of a ratio is that of the decay rate over the frequency, of which more is known
    assert damped.damping_ratio_std == pytest.approx(damped.decay_rate_std / damped.frequency, rel=1e-3)


def test_tare_and_air_are_taken_off_with_their_uncertainties() -> None:
    """I = 4 k b^2/w^2 - I_tare - J_air: u of both enter as they are; U by noise is that of the whole inertia."""
    tare = [{"mass": "40 +- 0.5 kg", "Ixx": "4 +- 0.2 kg m^2", "Iyy": "7 kg m^2", "Izz": "5 +- 0.1 kg m^2"}]
    air = {"density": "1.2 kg/m^3", "shapes": [{"disc": {"radius": "0.5 m", "factor": "1 +- 0.1"}}]}
    task = task_of(EXAMPLE, 1.0, QUICK | LEVEL | {"tare": tare, "air": air})
    prediction = predicted(task, task.best_pulls, 40.0, 241, task.sensors)
    moment = 16.0 / 45.0 * 1.2 * 0.5**5
    share = {s.label: s.contribution for s in prediction.shares}
    np.testing.assert_allclose(share["tare.0.Ixx"], [-0.2, 0.0], atol=1e-3)
    np.testing.assert_allclose(share["tare.0.Izz"], [0.0, -0.1], atol=1e-3)
    np.testing.assert_allclose(share["air.shapes.0.factor"], np.full(2, -0.1 * moment), rtol=1e-2)
    alone = task_of(EXAMPLE, 1.0, QUICK | LEVEL | {"tare": [], "body.Ixx": f"unknown near {13.0 + moment!r} kg m^2",
                    "body.mass": f"{160.0 + 8.0 / 3.0 * 1.2 * 0.125!r} kg",
                    "body.Izz": f"unknown near {16.0 + moment!r} kg m^2"})  # fmt: skip
    as_one = predicted(alone, alone.best_pulls, 40.0, 241, alone.sensors)
    np.testing.assert_allclose(prediction.noise, as_one.noise, rtol=1e-6)


def test_the_empty_cradle_is_recorded_for_its_unknowns() -> None:
    """Independent measurements of the whole and of the tare: their variances by noise add."""
    tare = [{"mass": "40 kg", "Ixx": "unknown near 4 kg m^2", "Iyy": "7 kg m^2", "Izz": "5 kg m^2"}]
    both = {"a.csv": {}, "empty.csv": {"mounting.body": False}}
    task = task_of(EXAMPLE, 1.0, QUICK | LEVEL | {"tare": tare, "recordings": both})
    prediction = predicted(task, task.best_pulls, 40.0, 241, task.sensors)
    ixx, cradle = (prediction.keys.index(key) for key in ("Ixx", "tare.0.Ixx"))
    known = task_of(EXAMPLE, 1.0, QUICK | LEVEL | {"tare": tare, "tare.0.Ixx": "4 kg m^2"})
    whole = predicted(known, known.best_pulls, 40.0, 241, known.sensors)
    assert prediction.noise[ixx] == pytest.approx(math.hypot(whole.noise[0], prediction.noise[cradle]), rel=1e-6)
    with pytest.raises(InputError, match="record the stand without the body as well"):
        planning.plan(EXAMPLE, 1e-2, QUICK | LEVEL | {"tare": tare})


def test_two_pulls_in_two_records_see_what_each_leaves_dead() -> None:
    """At (0.8, 0.14) m pitch's axis passes by spring 1: a record there hardly sees it. Information of records adds.

    So equal records give 1/sqrt(2) of the deviation of one, and different ones at most the harmonic sum of the squares.
    """
    case = {"body.offset_x": "0.8 m", "body.offset_z": "0.14 m", "sensors.noise": "0.1 mm", "plan.duration": "10 s",
            "plan.rate": "32 Hz"}  # fmt: skip
    pull = {"force": ["0 N", "-9806.65 N", "0 N"]}

    def noise(*places: Any) -> np.ndarray:
        own = {f"{k}.csv": {"plan.excitation": {**pull, "at": place}} for k, place in enumerate(places)}
        task = task_of("inertia-stand", 1.0, case | {"plan.excitation": {**pull, "at": 1}, "recordings": own})
        return predicted(task, task.best_pulls, 32.0, 321, task.sensors).noise

    first, opposite, both = noise(1), noise(3), noise(1, 3)
    np.testing.assert_allclose(noise(1, 1), first / math.sqrt(2.0), rtol=1e-6)
    assert first[1] > 3.0 * opposite[1]
    assert np.all(both <= (first**-2 + opposite**-2) ** -0.5 * (1.0 + 1e-6))
    assert np.all(both > 0.5 * np.minimum(first, opposite))


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"tare.0.Ixx": "unknown"}, "tare.0.Ixx is unknown; a plan needs the value that is expected, such as Ixx"),
        ({"body.Iyz": "unknown"}, "body.Iyz is unknown; a plan needs"),
        ({"mounting.position": ["unknown", "0 m", "0 m"]}, "mounting.position.x is unknown; a plan needs"),
        ({"mounting.body": False, "recordings": {}}, "mounting.body is false for all recordings"),
        ({"recordings": {f"{k}.csv": {} for k in range(25)}}, "recordings has 25; at most 24 are planned together"),
    ],
)
def test_what_a_plan_of_mountings_refuses(changes: dict[str, Any], said: str) -> None:
    with pytest.raises(InputError, match=said):
        planning.plan(EXAMPLE, 1e-2, changes)
