"""The guide "Model your own structure": its file runs, and what it quotes is what the command says."""

from __future__ import annotations

import pathlib
import re
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy import linalg

import evolvent as ev
from evolvent import cases

GUIDE = pathlib.Path(__file__).parents[2] / "docs" / "guide"
PAGE, LOADS = ((GUIDE / name).read_text(encoding="utf-8") for name in ("model-your-own.md", "loads.md"))
FILE = re.findall(r"^```yaml\n(.*?)^```", PAGE, flags=re.DOTALL | re.MULTILINE)[0]  # later ones are sections
(QUOTED,) = re.findall(r"^```text\n(.*?)^```", PAGE, flags=re.DOTALL | re.MULTILINE)
CHANGES = [
    ("kind: rigid-body", "kind: rigid-bdy"),
    ("length: 3 m", "lenght: 3 m"),
    ("length: 3 m", "length: 3 kg"),
    ("b: boom.root", "b: bom.root"),
]


@pytest.mark.slow
def test_the_file_is_the_program(tmp_path: Any) -> None:
    """The same system as the twelve lines of Python: equal runs."""
    program = re.findall(r"^```python\n(.*?)^```", PAGE, flags=re.DOTALL | re.MULTILINE)[0]
    assert len([line for line in program.splitlines() if line.strip()]) <= 12
    names: dict[str, Any] = {}
    exec(program, names)
    (tmp_path / "slew.yaml").write_text(FILE)
    system = ev.load(tmp_path / "slew.yaml")
    assert system.parts == names["craft"].parts
    run = ev.run(tmp_path / "slew.yaml")
    for name in run.ev.names():
        np.testing.assert_array_equal(run.ev.get(name).values, names["run"].ev.get(name).values, err_msg=name)


@pytest.mark.slow
def test_the_array(tmp_path: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """The programs run: latches lock, locked hinges have the modes of a chain of panels."""
    page = (pathlib.Path(__file__).parents[2] / "docs" / "guide" / "array-and-tether.md").read_text(encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    names: dict[str, Any] = {}
    for program in re.findall(r"^```python\n(.*?)^```", page, flags=re.DOTALL | re.MULTILINE):
        exec(program, names)
    run = names["run"]
    latched = [float(run[f"hinge {n}"].latch_time[-1]) for n in (1, 2, 3)]
    assert 0.0 < latched[2] < latched[1] < latched[0] < 15.0
    assert [abs(float(run[f"hinge {n}"].angle[-1])) for n in (1, 2, 3)] == pytest.approx([0.0] * 3, abs=1e-4)
    # y of the centres of bus and panels, of y of the bus and the angles of all
    shape = np.array([[1, 0, 0, 0, 0], [1, 0.5, 0.5, 0, 0], [1, 0.5, 1, 0.5, 0], [1, 0.5, 1, 1, 0.5]])
    mass = shape.T @ np.diag([100.0, 3.0, 3.0, 3.0]) @ shape
    mass[1:, 1:] += np.diag([16.7] + 3 * [0.25 * (1.0 + 0.02**2)])
    turn = np.diff(np.eye(5)[1:], axis=0)
    squares = linalg.eigh((1000.0 + 0.1) * turn.T @ turn, mass, eigvals_only=True)
    np.testing.assert_allclose(names["modes"].frequency_hz[6:], np.sqrt(squares[2:]) / (2.0 * np.pi), rtol=1e-6)
    assert {path.name for path in tmp_path.iterdir()} == {"angles.png", "array.html"}


def test_the_frame_of_two_booms(tmp_path: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """The program of the page on joints: the corner passes on the force's moment about it."""
    page = (pathlib.Path(__file__).parents[2] / "docs" / "guide" / "joints.md").read_text(encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    names: dict[str, Any] = {}
    (program,) = re.findall(r"^```python\n(.*?)^```", page, flags=re.DOTALL | re.MULTILINE)
    exec(program, names)
    assert names["rest"].corner.moment.values[-1] == pytest.approx([0.0, 0.0, -10.0], abs=0.05)


@pytest.mark.parametrize(("change", "line"), list(zip(CHANGES, QUOTED.splitlines(), strict=True)))
def test_what_is_refused(
    change: tuple[str, str], line: str, call: Callable[..., tuple[int, str, str]], tmp_path: Any
) -> None:
    assert change[0] in FILE
    (tmp_path / "slew.yaml").write_text(FILE.replace(*change))
    code, _, err = call("run", "slew.yaml", "--no-figures")
    assert (code, err.strip()) == (2, line)


def test_the_pages_name_every_profile_and_all_built_in_cases() -> None:
    from evolvent.parts.profile import KINDS

    assert all(word in LOADS for word in KINDS)
    for name in cases.built_in():
        assert cases.content_of(name)["system"] != "structure" or name in PAGE, name


def test_every_function_of_expressions_is_named() -> None:
    from evolvent.assembly.expressions import FUNCTIONS

    for word in FUNCTIONS:
        assert re.search(rf"\b{word}\b", LOADS), word


@pytest.mark.slow
def test_reels_and_attitude(tmp_path: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """The programs run: the brake lets the tether out, the wheels turn the craft."""
    page = (pathlib.Path(__file__).parents[2] / "docs" / "guide" / "reels-and-attitude.md").read_text(encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    names: dict[str, Any] = {}
    for program in re.findall(r"^```python\n(.*?)^```", page, flags=re.DOTALL | re.MULTILINE):
        exec(program, names)
        if "slew = " in program:
            names["craft_on_wheels"] = names["craft"].assemble()
    flight = names["flight"]
    assert "warning" not in flight.attrs
    assert float(flight["tether"].deployed_length[-1]) > 0.7
    momentum = flight.angular_momentum.values
    # generalized-alpha, the default for threads of springs, conserves it to the order of its step
    assert np.abs(momentum - momentum[0]).max() < 3e-5 * np.linalg.norm(momentum[0])
    slew = names["slew"]
    assert float(slew["control"].error_angle.max()) < 0.02
    assert slew["bus"].attitude.values[-1] == pytest.approx([np.cos(np.pi / 6), 0.0, 0.0, np.sin(np.pi / 6)], abs=1e-3)
    assert np.abs(slew.angular_momentum.values).max() < 1e-6 * float(np.ptp(slew["wheel 1"].wheel_momentum.values))
    # the inertia that the guide states for the controller's frequency; `tests/attitude` has the motion in closed form
    whole, wheels, turned = map(float, re.findall(r"here (\S+) - (\S+) = (\S+) kg m2", page)[0])
    own = [part for part in names["craft_on_wheels"].parts.values() if part.kind == "reaction-wheel"]
    assert len(own) == 4
    assert wheels == pytest.approx(sum(part.inertia * (part.axis[2] / np.linalg.norm(part.axis)) ** 2 for part in own))
    assert (whole, turned) == (6.0, 6.0 - wheels)
    flexible = names["flexible"]
    assert float(flexible["control"].error_angle[-1]) < 2e-4
    exchanged = float(np.ptp(flexible["wheel"].wheel_momentum.values))
    assert np.abs(flexible.angular_momentum.values).max() < 1e-6 * exchanged
