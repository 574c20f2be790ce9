"""Half-length, half-width and stiffness of a stand: identified from known bodies, and what a plan says of them."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from book import Book
from evolvent_base.errors import InputError
from evolvent_base.signals import Signals
from evolvent_massprops import mass_properties, planning
from evolvent_massprops.inertia import Body, Stand, linear_model
from evolvent_massprops.planning import calibration
from evolvent_massprops.planning.expected import task_of
from evolvent_massprops.planning.predictions import at, predicted
from massprops import rig

CHAPTER = "Inertia stand and identification"
EXAMPLE = rig.EXAMPLES / "plan.yaml"
QUICK: dict[str, Any] = {"plan.rate": "20 Hz", "plan.duration": "20 s", "plan.places": ["spring"]}
A, B, K = 0.6, 0.4, 20000.0
OWN = Body(mass=120.0, centre=(0.03, -0.02, 0.01), inertia=(9.0, 14.0, 11.0))
KNOWN = Body(mass=100.0, centre=(0.02, 0.0, 0.015), inertia=(8.0, 10.0, 12.0))


def known_body() -> dict[str, Any]:
    return {
        "name": "reference", "mass": "100 kg", "offset_x": "0.02 m", "offset_z": "0.015 m", "height": "0 m",
        "Ixx": "8 kg m^2", "Iyy": "10 kg m^2", "Izz": "12 kg m^2",
    }  # fmt: skip


def description() -> dict[str, Any]:
    """A body whose mass and moments are unknown, as are the stand's a, b and k, and a known one."""
    return {
        "signals": {"sensors": [{"column": f"sensor {k}", "point": k} for k in (1, 2, 3, 4)]},
        "stand": {
            "kind": "springs", "half_length": "unknown near 0.6 m", "half_width": "unknown near 0.4 m",
            "stiffness": "20000 N/m", "common_factor": "unknown near 1", "natural_length": "0.3 m",
        },
        "body": {
            "mass": "unknown near 120 kg", "offset_x": "0.03 m", "offset_z": "0.01 m", "height": "0.02 m",
            "Ixx": "unknown near 9 kg m^2", "Iyy": "14 kg m^2", "Izz": "unknown near 11 kg m^2",
        },
        "recordings": {"known.csv": {"body": known_body()}, "own.csv": {}},
        "identification": {"order": 3},
        "plan": {"force": "80 N", "noise": "0.02 mm", "rate": "40 Hz", "places": ["spring"]},
    }  # fmt: skip


def record(name: str, body: Body, stand: Stand, random: np.random.Generator) -> Signals:
    modes, t = linear_model(stand, body).modes(), np.arange(300) / 40.0
    x = modes.motion(t, modes.release((0.0, -80.0, 0.0), stand.points[0]), stand.points).T
    x = x + 2e-5 * random.standard_normal(x.shape)
    names = tuple(f"sensor {k}" for k in (1, 2, 3, 4))
    return Signals.of(names, x, ("m",) * 4, 40.0, path=name, sha256=f"{name} {x[0, 0]}")


@pytest.mark.slow
def test_a_known_body_calibrates_the_stand(book: Book) -> None:
    """Springs 0.7 and 0.5 mm further out and 0.2 % stiffer than stated: the body's moments are right none the less."""
    stand = Stand.rectangle(0.6007, 0.4005, stiffness=1.002 * K, length=0.3, damping=4.0)
    random = np.random.default_rng(2)
    signals = [record("known.csv", KNOWN, stand, random), record("own.csv", OWN, stand, random)]
    found = mass_properties(signals, description())
    true = {"half_length": 0.6007, "half_width": 0.4005, "common_factor": 1.002, "mass": 120.0, "Ixx": 9.0, "Izz": 11.0}
    off = np.array([(found[key] - value) / u for (key, value), u in zip(true.items(), found.std, strict=True)])
    assert [o.key for o in found.outputs] == list(true)
    assert np.abs(off).max() < 4.0
    assert found.std[1] < 1e-3 * 0.4
    assert "in 1 mounting and 1 of a known body" in found.evaluations[0].why[-1]
    wrong = mass_properties(signals[1:], description(), {
        "recordings": {}, "stand.half_width": "0.4 m", "stand.half_length": "0.6 m", "stand.common_factor": 1,
    })  # fmt: skip
    assert abs(wrong["Ixx"] - 9.0) > 10.0 * wrong.std[1]  # 0.45 % off by the stand alone
    alone = mass_properties(signals[:1], description(), {"recordings": {}, "body": known_body()})
    assert [o.key for o in alone.outputs] == ["half_length", "half_width", "common_factor"]
    assert alone["half_width"] == pytest.approx(0.4005, abs=4.0 * alone.std[1])
    book(
        CHAPTER, "Half-length, half-width and stiffness of a stand from a known body, and another body's moments",
        reference="put into the simulation", source="modes of a stand other than stated",
        error=float(np.abs(off).max()), allowed=4.0, unit="u",
    )  # fmt: skip


@pytest.mark.slow
def test_drawn_stands_scatter_as_stated() -> None:
    """Stands and known bodies are drawn as stated, recorded and identified: errors over u have the variance 1.

    Eight draws of six quantities, of which some depend on one another: the mean of the squares has a deviation of 0.2
    to 0.3.
    """
    content, random, squares = description(), np.random.default_rng(5), []
    content["stand"] |= {
        "half_length": "unknown near 0.6 m +- 0.5 mm", "half_width": "unknown near 0.4 m +- 0.5 mm",
        "stiffness": "20000 N/m +- 0.05 %",
    }  # fmt: skip
    content["recordings"]["known.csv"]["body"] |= {"Ixx": "8 +- 0.008 kg m^2", "mass": "100 +- 0.02 kg"}
    for _ in range(8):
        a, b = A + 5e-4 * random.standard_normal(), B + 5e-4 * random.standard_normal()
        factor = 1.0 + 2e-3 * random.standard_normal()
        stiffness = factor * K * (1.0 + 5e-4 * random.standard_normal(4))
        stand = Stand.rectangle(a, b, stiffness=stiffness, length=0.3, damping=4.0)
        known = Body(mass=100.0 + 0.02 * random.standard_normal(), centre=KNOWN.centre,
                     inertia=(8.0 + 0.008 * random.standard_normal(), 10.0, 12.0))  # fmt: skip
        signals = [record("known.csv", known, stand, random), record("own.csv", OWN, stand, random)]
        found = mass_properties(signals, content)
        true = np.array([a, b, float(np.mean(stiffness)) / K, 120.0, 9.0, 11.0])
        squares.append(((found.values - true) / found.std) ** 2)
    assert 0.4 < np.mean(squares) < 2.0
    assert np.all(np.mean(squares, axis=0) < 3.0)


def test_a_reference_like_the_body_costs_a_root_of_two() -> None:
    """Guided and centred, Ixx = I_ref (w_ref/w)^2, whatever a, b and k: u(Ixx)/Ixx = 2 sqrt(2) u(w)/w."""
    level = {"stand.support": "guided", "body.offset_x": "0 m", "body.offset_z": "0 m", "body.height": "0 m",
             "body.mass": "120 kg"}  # fmt: skip
    same = {"mass": "120 kg", "offset_x": "0 m", "offset_z": "0 m", "height": "0 m", "Ixx": "9 kg m^2",
            "Iyy": "14 kg m^2", "Izz": "11 kg m^2"}  # fmt: skip
    keys = level | {"recordings": {"known.csv": {"body": same}, "own.csv": {}}}
    exact = level | {
        "recordings": {},
        "stand.half_length": "0.6 m",
        "stand.half_width": "0.4 m",
        "stand.common_factor": 1,
    }
    both, alone = (task_of(description(), 1.0, changes) for changes in (keys, exact))
    calibrated = predicted(both, both.best_pulls, 40.0, 301, both.sensors)
    known = predicted(alone, alone.best_pulls, 40.0, 301, alone.sensors)
    for key in ("Ixx", "Izz"):
        ratio = calibrated.noise[calibrated.keys.index(key)] / known.noise[known.keys.index(key)]
        assert ratio == pytest.approx(math.sqrt(2.0), rel=1e-5)
    nothing = task_of(description(), 1.0, level | {"recordings": {}})
    with pytest.raises(InputError, match=r"half_width.* not distinguished"):
        predicted(nothing, nothing.best_pulls, 40.0, 301, nothing.sensors)
    half, ixx = calibrated.keys.index("half_width"), known.keys.index("Ixx")
    # b^2 = I w^2/4k: u(b)/b = hypot(2 u(w_roll)/w, 2 u(w_heave)/(w sqrt 2))/2, heave's being seen twice
    roll = known.noise[ixx] / 9.0
    assert 0.5 * roll < calibrated.noise[half] / 0.4 < 0.5 * roll * math.sqrt(1.0 + 9.0)


def test_needs_are_the_closed_forms() -> None:
    """Ixx = 4 k b^2/w^2 of a guided, centred body: U has 2 k u(b)/b of the half-width and k u(f)/f of the factor."""
    level = {"stand.support": "guided", "body.offset_x": "0 m", "body.offset_z": "0 m", "body.height": "0 m",
             "body.Ixz": "0 kg m^2", "body.mass": "15190 kg", "stand.half_length": "2 m",
             "stand.half_width": "0.8696 m", "stand.stiffness": "740250 N/m",
             "stand.natural_length": "0.5 m", "body.Iyy": "43920 kg m^2"}  # fmt: skip
    task, wanted = task_of(EXAMPLE, 1.0, QUICK | level), 1e-3
    option = at(task, wanted, task.best_pulls, 20.0, 401, task.sensors)
    found = {one.key: one for one in calibration.needs(task, wanted, option)}
    assert found["stand.half_width"].alone == pytest.approx(wanted * 0.8696 / 4.0, rel=1e-4)
    assert found["stand.half_length"].alone == pytest.approx(wanted * 2.0 / 4.0, rel=1e-4)
    assert found["stand.common_factor"].alone == pytest.approx(wanted / 2.0, rel=1e-4)
    roll = float(option.noise[option.keys.index("Ixx")])
    left = math.sqrt(wanted**2 - roll**2)
    assert found["stand.half_width"].needed == pytest.approx(left * 0.8696 / 4.0, rel=1e-4)
    assert found["stand.half_width"].std == 0.0
    # with half of it used up by an uncertainty of the mass, as much less is left
    more = task_of(EXAMPLE, 1.0, QUICK | level | {"stand.common_factor": "1 +- 0.0004"})
    option = at(more, wanted, more.best_pulls, 20.0, 401, more.sensors)
    found = {one.key: one for one in calibration.needs(more, wanted, option)}
    assert found["stand.common_factor"].part == pytest.approx(8e-4, rel=1e-3)
    assert found["stand.half_width"].needed == pytest.approx(math.sqrt(left**2 - 8e-4**2) * 0.8696 / 4.0, rel=1e-3)
    assert found["stand.common_factor"].needed == pytest.approx(left / 2.0, rel=1e-3)


@pytest.mark.slow
def test_calibrations_are_compared() -> None:
    """Each adds information, so that none makes it worse; what is stated of a known body counts."""
    task, wanted = task_of(EXAMPLE, 1.0, QUICK), 1e-3
    best = at(task, wanted, task.best_pulls, 20.0, 401, task.sensors)
    stated, too, mass, known = calibration.calibrations(task, wanted, best)
    assert stated.option.worst > too.option.worst > max(mass.option.worst, known.option.worst)
    assert not stated.option.reached
    assert known.option.reached
    assert stated.std["half_width"] == pytest.approx(3e-4 / 0.8696)
    assert stated.std["common_factor"] == pytest.approx(5e-4)  # of four springs, 0.1 % each
    assert known.std["half_width"] < 0.5 * stated.std["half_width"]
    reference = {"name": "slab", "mass": "15 t", "offset_x": "0.3 m", "offset_z": "0.1 m", "height": "0 m",
                 "Ixx": "3700 kg m^2 +- 0.2 %", "Iyy": "44000 kg m^2", "Izz": "44000 kg m^2 +- 0.2 %"}  # fmt: skip
    own = task_of(EXAMPLE, 1.0, QUICK | {"plan.reference": reference})
    slab = calibration.calibrations(own, wanted, best)[-1]
    assert "slab" in slab.label
    assert too.option.worst > slab.option.worst > 1.5 * known.option.worst
    # the same by a description that states the recordings, as identify takes it
    changes = {
        "stand.half_length": "unknown near 2 m +- 0.3 mm", "stand.half_width": "unknown near 0.8696 m +- 0.3 mm",
        "stand.common_factor": "unknown near 1 +- 0.0005",
        "recordings": {"own.csv": {}, "slab.csv": {"body": reference}},
    }  # fmt: skip
    described = task_of(EXAMPLE, 1.0, QUICK | changes)
    same = at(described, wanted, described.best_pulls, 20.0, 401, described.sensors)
    assert same.worst == pytest.approx(slab.option.worst, rel=1e-6)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"stand.half_width": "unknown"}, "stand.half_width is unknown; give it a start, such as unknown near"),
        (
            {"recordings": {"known.csv": {"stand.half_width": "0.4 m", "body": known_body()}, "own.csv": {}}},
            "recordings.known.csv.stand.half_width is given and stand.half_width is unknown",
        ),
        ({"recordings": {}, "body": known_body(), "stand.half_length": "0.6 m", "stand.half_width": "0.4 m",
          "stand.common_factor": 1}, "body has no unknown; write 'unknown'"),
        ({"recordings": {}}, "body.mass and stand.common_factor are both unknown"),
    ],
)  # fmt: skip
def test_what_a_calibration_refuses(changes: dict[str, Any], said: str) -> None:
    stand = Stand.rectangle(A, B, stiffness=K, length=0.3, damping=4.0)
    signals = [record("known.csv", KNOWN, stand, np.random.default_rng(1))]
    signals += [record("own.csv", OWN, stand, np.random.default_rng(1))] if changes.get("recordings") else []
    with pytest.raises(InputError) as error:
        mass_properties(signals, description(), changes)
    assert said in str(error.value)


def test_an_unknown_reference_is_refused() -> None:
    with pytest.raises(InputError, match=r"plan\.reference has the unknown Ixx, Izz; a reference body is known"):
        planning.plan(EXAMPLE, 1e-3, {"plan.reference": {"mass": "1 t", "offset_x": 0, "offset_z": 0, "height": 0}})
