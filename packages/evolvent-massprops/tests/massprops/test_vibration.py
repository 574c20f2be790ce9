"""Modes of recordings without a stand, and of any variable of a run."""

from __future__ import annotations

import json
import math
import pathlib
import typing
from typing import Any

import numpy as np
import pytest

import evolvent
from evolvent import InputError, System, parts
from evolvent_base import signals
from evolvent_base.signals import Signals
from evolvent_massprops import description, modal, recordings, vibration
from evolvent_massprops.identification.decay_laws import DECAY
from massprops import rig
from massprops.test_refusals import call

#: Two masses on three springs between walls, x, moved apart: frequencies sqrt(k/m) and sqrt(3 k/m).
K, M = 50.0, 2.0
EXACT = (math.sqrt(K / M), math.sqrt(3.0 * K / M))


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> pathlib.Path:
    """A run of two masses on springs, on a file."""
    system = System()
    for name, x, speed in (("left", 1.0, 0.03), ("right mass", 2.0, -0.01)):
        system.add(parts.Point(mass=M, position=(x, 0.0, 0.0), velocity=(speed, 0.0, 0.0)), name)
    ends = [(0.0, 0.0, 0.0), "left", "right mass", (3.0, 0.0, 0.0)]
    for k in range(3):
        system.add(parts.Spring(a=ends[k], b=ends[k + 1], stiffness=K), f"spring {k + 1}")
    path = tmp_path_factory.mktemp("run") / "masses.nc"
    evolvent.save(system.simulate(until=20.0, every=0.02, method="dopri5", tolerance=1e-10), path)
    return path


@pytest.mark.slow
def test_modes_of_a_variable_have_the_closed_form(run: pathlib.Path) -> None:
    found = vibration(run, ["right mass.position.x"])
    assert found.modes.frequency == pytest.approx(EXACT, rel=1e-7)
    assert found.reading.unit == "m"
    # modes in phase and against it: the amplitudes are those of the speeds at the start
    shapes = vibration(run, ["left.position.x", "right mass.position.x"]).shapes
    assert shapes[0, 1] / shapes[0, 0] == pytest.approx(1.0, rel=1e-6)
    assert shapes[1, 1] / shapes[1, 0] == pytest.approx(-1.0, rel=1e-6)
    later = vibration(run, ["spring 2.force"], {"signals.start": "5 s"})
    strongest = int(later.modes.amplitude[:, 0].argmax())  # the spring between them sees the second mode alone
    assert later.modes.frequency[strongest] == pytest.approx(EXACT[1], rel=1e-6)
    assert later.reading.unit == "N"


@pytest.mark.slow
def test_the_command_on_a_run(run: pathlib.Path) -> None:
    done = call(str(run), "--variables", "left.velocity.x", "--set", "identification.order=2")
    assert done.exit_code == 0, done.output
    assert "modes of masses.nc" in done.output
    assert f"{EXACT[0]:.4f}"[:6] in done.output
    assert call(str(run), "--variables", "left.velocity.x", "--quiet").output == ""


@pytest.mark.slow
def test_figures_of_every_recording(run: pathlib.Path, tmp_path: pathlib.Path) -> None:
    words = ["--variables", "left.position.x,right mass.position.x", "--set", "identification.order=2", "--quiet"]
    done = call(str(run), *words, "--figures", str(tmp_path / "one"))
    assert done.exit_code == 0, done.output
    assert sorted(path.name for path in (tmp_path / "one").iterdir()) == [
        "mode_shapes.png",
        "signals.png",
        "spectrum.png",
    ]
    other = tmp_path / "again.nc"
    other.write_bytes(run.read_bytes())
    assert call(str(run), str(other), *words, "--figures", str(tmp_path / "two")).exit_code == 0
    assert sorted(path.name for path in (tmp_path / "two").iterdir()) == ["again", "masses"]
    refused = call(str(run), *words, "--figures", str(run))
    assert "is not a folder" in str(refused.exception)


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        ([], "has no sensors; name the variables that they read with --variables or "),
        (["--variables", "left.position"], "is no single number over time; name one of its components"),
        (["--variables", "left.positon.x"], "no variable is called 'left.positon.x'; did you mean 'left.position'?"),
        (["--variables", "left.position.x,left.velocity.x"], "in m/s, left.position.x in m; they must"),
        (["--variables", "left.position.x", "-o", "c.html"], "needs a description of the stand: give --stand"),
        (["--variables", "left.position.x", "--set", "identification.ordr=2"], "did you mean 'identification.order'?"),
    ],
)  # fmt: skip
def test_what_is_missing_is_said_in_one_sentence(run: pathlib.Path, words: list[str], sentence: str) -> None:
    done = call(str(run), *words)
    assert isinstance(done.exception, InputError)
    assert sentence in str(done.exception)
    assert "\n" not in str(done.exception)


def test_a_recording_without_a_stand(tmp_path: pathlib.Path) -> None:
    t = np.arange(800) / 100.0
    x = np.exp(-0.2 * t) * np.cos(11.0 * t) + 1e-4 * np.random.default_rng(4).standard_normal(t.size)
    path = tmp_path / "swing.csv"
    np.savetxt(path, np.column_stack([t, x]), delimiter=",", header="time,x", comments="")
    found = vibration(path)
    assert found.modes.frequency == pytest.approx([11.0], rel=1e-4)
    assert found.modes.decay_rate == pytest.approx([0.2], rel=1e-2)
    done = call(str(path))
    assert done.exit_code == 0, done.output
    assert "damping ratio" in done.output


def test_sensors_of_a_description_name_variables_of_a_run(run: pathlib.Path) -> None:
    """A pendulum's description reads a variable; the bytes of the file are those of any run."""
    found = signals.read(run, ["left.position.x", "right mass.position.x"])
    assert found.names == ("time", "left.position.x", "right mass.position.x")
    assert found.units == ("s", "m", "m")
    assert found.format == "run"
    assert json.loads(json.dumps(list(found.names)))  # words alone


def test_units_of_results_are_read(run: pathlib.Path) -> None:
    from evolvent.results.sensors import _plain_unit
    from evolvent_base.units import parse

    for unit, plain in {"kg m2 s-1": "kg*m^2/s", "rad s-1": "rad/s", "m s-2": "m/s^2", "s-1": "1/s", "N": "N"}.items():
        assert _plain_unit(unit) == plain
        parse(f"1 {plain}", plain)


@pytest.mark.slow
def test_modes_of_a_boom_are_those_of_its_linear_model(tmp_path: pathlib.Path) -> None:
    """A clamped beam let go with a speed: the recording's first frequency is that of `System.modes`."""
    system: Any = System()
    section = evolvent.Tube(radius="1 cm", thickness="0.3 mm")
    beam = parts.Beam(length="3 m", direction=(1, 0, 0), section=section, material=evolvent.CFRP, elements=4)
    system.add(beam, "boom")
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="boom.root", type="clamp"), "root")
    system.add(parts.Load(at="boom.tip", direction=(0, 1, 0), profile=[(0, 0), (0.05, 0.05), (0.1, 0)]), "knock")
    path = tmp_path / "boom.nc"
    evolvent.save(system.simulate(until=2.0, every=0.004, tolerance=1e-7), path)
    found = vibration(path, ["boom.tip_deflection.y"], {"signals.start": "0.11 s"})
    linear = np.sort(system.modes(count=4).frequency)
    strongest = int(found.modes.amplitude[:, 0].argmax())
    assert found.modes.frequency[strongest] == pytest.approx(linear[0], rel=2e-3)


def test_motions_that_nothing_damps_are_reported_of_pendulums_alone() -> None:
    """A body on springs may sway without damping; on a pendulum such a mode is hum or a drive."""
    t = np.arange(800) / 40.0
    x = (
        np.exp(-0.1 * t) * np.cos(6.0 * t)
        + 0.2 * np.cos(9.0 * t)
        + 1e-3 * np.random.default_rng(1).standard_normal(800)
    )
    source = Signals.of(("a",), x[:, None], ("mm",), 40.0, path="a.csv", sha256="a")
    reading = recordings.read(source, description.without_stand(()).signals)
    springs = description.load(rig.EXAMPLES / "stand.yaml")
    pendulum = description.load(rig.EXAMPLES / "compound.yaml")
    said = "does not decay as the others do"
    assert not any(said in text for text in modal.find(reading, springs).warnings)
    assert any(said in text for text in modal.find(reading, pendulum).warnings)


def test_the_laws_of_decay_are_those_that_are_fitted() -> None:
    assert typing.get_args(description.Identification.model_fields["decay"].annotation) == DECAY
