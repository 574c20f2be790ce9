"""Springs that only pull."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from evolvent import InputError, System, load, parts
from evolvent.families.springs.springs import taut_over

G, MASS, LENGTH, STIFFNESS = 9.81, 70.0, 10.0, 200.0
#: Largest extension of a jump from the anchor, and the time of the free fall: by energy.
DEEPEST = (MASS * G + math.sqrt((MASS * G) ** 2 + 2.0 * STIFFNESS * MASS * G * LENGTH)) / STIFFNESS
TAUT = math.sqrt(2.0 * LENGTH / G)


def jump(damping: float = 0.0) -> System:
    system = System(gravity=(0.0, 0.0, -G))
    system.add(parts.Point(mass=MASS, position=(0.0, 0.0, 0.0)), "jumper")
    bungee = parts.Spring(
        a=(0.0, 0.0, 0.0), b="jumper", length=LENGTH, stiffness=STIFFNESS, damping=damping, slack=True
    )
    system.add(bungee, "bungee")
    return system


def test_taut_over_is_the_secant_of_half_the_square() -> None:
    for start, end in ((-1.0, 2.0), (2.0, -1.0), (1.0, 3.0), (-2.0, -1.0), (0.0, 0.0), (0.3, 0.3), (0.0, 1.0)):
        mean, share = taut_over(start, end)
        work = 0.5 * (max(end, 0.0) ** 2 - max(start, 0.0) ** 2)
        assert mean * (end - start) == pytest.approx(work, abs=1e-15)
        assert share * (end - start) == pytest.approx(max(end, 0.0) - max(start, 0.0), abs=1e-15)
    assert taut_over(0.3, 0.3) == (0.3, 1.0)


@pytest.mark.parametrize("method", ["dopri5", "rk4", "generalized-alpha", "energy-momentum"])
def test_a_jumper_falls_freely_and_as_deep_as_energy_says(method: str) -> None:
    run = jump().simulate(until=6.0, every=0.01, method=method)
    z, t, tension = run["jumper"].position.values[:, 2], run.time.values, run["bungee"].force.values
    free = t < TAUT - 0.02
    np.testing.assert_allclose(z[free], -0.5 * G * t[free] ** 2, atol=2e-3)
    assert not tension[free].any()
    assert tension.min() >= 0.0
    assert z.min() == pytest.approx(-LENGTH - DEEPEST, rel=3e-3)
    assert np.abs(run.energy_defect.values).max() < 0.01 * MASS * G * LENGTH


@pytest.mark.parametrize("step", [0.2, 0.05])
def test_energy_is_exact_at_any_step_of_energy_momentum(step: float) -> None:
    run = jump().simulate(until=20.0, every=step, method="energy-momentum", step=step, spectral_radius=1.0)
    assert np.abs(run.energy_defect.values).max() < 1e-9 * MASS * G * LENGTH


@pytest.mark.parametrize("method", ["dopri5", "energy-momentum"])
def test_its_damper_does_not_push(method: str) -> None:
    run = jump(damping=400.0).simulate(until=10.0, every=0.01, method=method)
    assert run["bungee"].force.values.min() >= 0.0
    assert np.abs(run.energy_defect.values).max() < 0.01 * MASS * G * LENGTH


def test_what_cannot_go_slack_is_refused() -> None:
    given = {"a": (0.0, 0.0, 0.0), "b": "ball", "slack": True}
    for fields, said in (
        ({"law": "50*x"}, "cord.slack is true beside cord.law"),
        ({"stiffness": 1.0, "length": 0.0}, "cord.slack is true, but cord.length is 0"),
        ({"damping": 1.0}, "cord.slack is true; it needs cord.stiffness above 0"),
        ({"stiffness": 1.0, "lateral_stiffness": 1.0}, "cord.slack is true beside cord.lateral_stiffness"),
    ):
        system = System()
        system.add(parts.Point(mass=1.0, position=(1.0, 0.0, 0.0)), "ball")
        system.add(parts.Spring(**given, **fields), "cord")
        with pytest.raises(InputError, match=said):
            system.assemble()


def test_a_case_file_holds_it(tmp_path: Path) -> None:
    file = tmp_path / "cord.yaml"
    file.write_text(
        """
system: structure
parts:
  ball: {kind: point, mass: 1 kg, position: [0, 0, -1 m], velocity: [1 m/s, 0, 0]}
  cord: {kind: spring, a: [0, 0, 0], b: ball, length: 2 m, stiffness: 100 N/m, slack: true}
simulate: {until: 0.5 s, every: 0.1 s}
"""
    )
    run = load(file).simulate()
    np.testing.assert_allclose(run["ball"].position.values[:, 0], run.time.values, atol=1e-9)
    assert not run["cord"].force.values.any()
