"""Commands that take the description of a stand take the name or file of a case as well."""

from __future__ import annotations

import math
import pathlib
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

import evolvent
from evolvent import cases
from evolvent_base.cli import commands
from evolvent_base.errors import InputError
from evolvent_massprops import load, mass_properties, planning
from evolvent_massprops.description import OnSprings
from massprops import rig

OFFSET: dict[str, Any] = {"body.offset_x": "0.3 m", "body.offset_z": "0.1 m"}


def test_a_case_plans_as_its_description_does() -> None:
    """The description of examples/plan.yaml with exact inputs, by hand, and the case that it describes."""
    exact = {
        "stand.half_length": "2 m", "stand.half_width": "0.8696 m", "stand.stiffness": "740250 N/m",
        "stand.natural_length": "0.5 m", "body.mass": "15190 kg", "body.height": "0 m", "body.offset_x": "0.3 m",
        "body.offset_z": "0.1 m", "body.Iyy": "43920 kg m^2", "body.Ixz": "0 kg m^2", "plan.rate": "20 Hz",
        "plan.places": ["spring"],
    }  # fmt: skip
    by_hand = planning.plan(rig.EXAMPLES / "plan.yaml", 1e-3, exact)
    own = {"sensors.noise": "0.1 mm", "plan.rate": "20 Hz", "plan.places": ["spring"]}
    by_case = planning.plan("inertia-stand", 1e-3, OFFSET | own)
    assert by_case.best.label == by_hand.best.label
    assert by_case.best.samples == by_hand.best.samples
    np.testing.assert_allclose(by_case.best.noise, by_hand.best.noise, rtol=1e-9)
    assert not by_case.warnings


def test_keys_of_the_case_and_of_the_description() -> None:
    keys = OFFSET | {"stand.half_width": "0.87 m +- 0.3 mm", "plan.duration": "30 s",
                     "sensors.points": [["1 m", "0 m", "0 m"]], "sensors.quantisation": "0.1 mm",
                     "uncertainty.coverage_factor": 3}  # fmt: skip
    given = load("inertia-stand", keys)
    assert isinstance(given, OnSprings)
    assert given.plan is not None
    assert given.stand.half_width is not None
    assert (given.plan.force, given.plan.duration) == (9806.65, 30.0)
    assert (given.stand.half_width.value, given.stand.half_width.std) == (0.87, 3e-4)
    assert given.body.offset_x.value == 0.3
    assert given.signals.sensors[0].noise == f"{1e-4 / math.sqrt(12.0)!r} m"
    assert given.uncertainty.coverage_factor == 3.0
    sideways = load("inertia-stand", {"excitation.force": ["10 N", "-1 N", "0 N"], "excitation.at": 2})
    assert isinstance(sideways, OnSprings)
    assert sideways.plan is not None
    assert sideways.plan.excitation is not None
    assert sideways.plan.excitation.at == 2
    assert "0.1 mm is taken" in sideways.remarks


def test_air_of_a_case_is_that_of_its_run() -> None:
    """The frequencies that a plan expects are those of the simulation, whose air hangs at the centre of mass."""
    from evolvent_massprops.planning.expected import task_of

    keys = OFFSET | {"air": {"shapes": [{"disc": {"radius": "3 m", "factor": 2}}]}, "stand.support": "guided"}
    (one,) = task_of("inertia-stand", 1e-2, keys).recordings
    run = evolvent.run("inertia-stand", keys | {"sensors.duration": "1 s", "identification.way": "none"})
    np.testing.assert_allclose(one.modes.frequency, run.linear_frequency, rtol=1e-6)


@pytest.mark.slow
def test_identify_takes_the_case_of_the_run() -> None:
    run = evolvent.run("inertia-stand", OFFSET | {"sensors.noise": "0.05 mm"})
    names = tuple(f"sensor {k}" for k in (1, 2, 3, 4))
    from evolvent_base.signals import Signals

    signals = Signals.of(names, run.sensor_displacement.values, ("m",) * 4, 50.0, path="a", sha256="a")
    found = mass_properties(signals, "inertia-stand", OFFSET)
    assert abs(found["Ixx"] - 3703.0) < 4.0 * found.std[0]
    assert abs(found["Izz"] - 43920.0) < 4.0 * found.std[1]


@pytest.mark.parametrize(
    ("stand", "changes", "said"),
    [
        ("inertia-stnd", {}, "there is neither a file nor a case 'inertia-stnd'; did you mean 'inertia-stand'?"),
        ("heliogyro", {}, "the system 'heliogyro' is no stand; give a description of a stand, or a case of the system"),
        ("boom-slew", {}, "is no stand; give a description of a stand"),
        ("inertia-stand", {"stand.half_widht": "1 m"}, "unknown key 'stand.half_widht'; did you mean"),
        (
            "inertia-stand",
            {"body.inertia": ["1 kg m^2", "1 kg m^2", "9 kg m^2"]},
            "body.inertia with body.products is no inertia of a body",
        ),
        ("inertia-stand", {"excitation.at": 7}, "excitation.at is 7, but there are 4 springs"),
        ("inertia-stand", {"body.Ixy": "1 kN"}, "body.Ixy is '1 kN'; it must be a product of inertia"),
        ("no-file.yaml", {}, "cannot read 'no-file.yaml'"),
    ],
)
def test_refusals(stand: str, changes: dict[str, Any], said: str) -> None:
    with pytest.raises(InputError) as error:
        load(stand, changes)
    assert said in str(error.value)
    assert "\n" not in str(error.value)


def test_limiters_have_no_description() -> None:
    with pytest.raises(InputError, match="a description of a stand takes a swing without friction"):
        load("inertia-stand", {"stand.limiters": {"clearance": "0 m"}, "solver.method": "dopri5"})


@pytest.mark.slow
def test_the_command_takes_names_and_files(tmp_path: pathlib.Path) -> None:
    file = tmp_path / "own.yaml"
    file.write_text(cases.to_yaml(cases.load("inertia-stand", OFFSET)), encoding="utf-8")
    out = []
    for stand, changes in (("inertia-stand", OFFSET), (str(file), {}), ("inertia-stand-paper", OFFSET)):
        sets = [f"--set={key}={value}" for key, value in (changes | {"plan.rate": "20 Hz"}).items()]
        done = CliRunner().invoke(commands, ["plan", stand, "--uncertainty", "0.5%", *sets], standalone_mode=False)
        assert done.exception is None, done.exception
        out.append(done.output)
    assert out[0] == out[1]
    assert "no noise of its sensors; 0.1 mm is taken" in out[0]
    assert "damping ratio" in out[0]
