"""Derivatives of runs of shells by keys: neighbours, the adjoint and central differences of two runs agree."""

from __future__ import annotations

from typing import Any

import pytest

from evolvent import System, parts
from evolvent_base.errors import InputError
from shells.plates import material

KEYS = {
    "parts.panel.thickness": 0.004,
    "parts.panel.material.young_modulus": 5e7,
    "parts.panel.stiffness_damping": 1e-3,
}
RUN: Any = {"until": 0.06, "every": 0.02, "step": 0.005, "method": "energy-momentum", "spectral_radius": 1.0}
VALUE = "panel.largest_displacement.last"


def panel(**keys: Any) -> System:
    """A cantilever that a force at a corner bends."""
    values = {key.rpartition(".")[2]: value for key, value in KEYS.items()} | keys
    shell = parts.Shell(
        size=(0.5, 0.3), elements=(2, 1), thickness=values["thickness"], clamped=("x0",),
        material=material(values["young_modulus"], 0.3), stiffness_damping=values["stiffness_damping"],
    )  # fmt: skip
    system = System()
    system.add(shell, "panel")
    system.add(parts.Load(at="panel[5]", direction=(0, 0, 1), profile=[(0, 0), (0.05, 0.1), (1, 0.1)]), "push")
    return system


def test_derivatives() -> None:
    """By thickness, modulus and damping."""
    found = [
        panel().sensitivity([VALUE], list(KEYS), mode=mode, check=False, **RUN).dataset.derivative.values[0]
        for mode in ("forward", "adjoint")
    ]
    assert found[1] == pytest.approx(found[0], rel=1e-5)
    for k, (key, value) in enumerate(KEYS.items()):
        name, ends = key.rpartition(".")[2], []
        for factor in (1.001, 0.999):
            run = panel(**{name: factor * value}).simulate(**RUN)
            ends.append(float(run["panel"]["largest_displacement"].values[-1]))
        assert found[1][k] == pytest.approx((ends[0] - ends[1]) / (0.002 * value), rel=1e-4)


def test_the_largest_of_values_that_are_alike_has_no_adjoint() -> None:
    """All nodes of a panel that falls move alike; neighbours move all of them together."""
    system = System(gravity=(0.0, 0.0, -9.81))
    shell = parts.Shell(size=(0.5, 0.3), elements=(2, 1), thickness=0.01, material=material(5e7), mass_damping=1.0)
    system.add(shell, "panel")
    keys: Any = {"until": 0.02, "every": 0.01, "step": 0.01, "method": "energy-momentum", "spectral_radius": 1.0}
    key = "parts.panel.mass_damping"
    with pytest.raises(InputError, match=r"'panel.largest_displacement.last' is not supported, which has a kink"):
        system.sensitivity(VALUE, key, mode="adjoint", check=False, **keys)
    assert system.sensitivity(VALUE, key, check=False, **keys).dataset.derivative.values < 0.0
