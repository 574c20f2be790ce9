"""The reflector of six curved ribs: equilibrium of its ring of cords, and its deployment."""

from __future__ import annotations

import functools
import math
from typing import Any

import numpy as np
import pytest
import scipy.linalg
import yaml

import evolvent as ev
from evolvent import cases
from evolvent.elements.materials import CFRP
from evolvent.parts import Parabola
from evolvent.solvers.static.static import solve_static
from evolvent.solvers.static.work import Work
from helpers import stiffness_by_differences

RIBS = 6


@functools.cache
def tensioned() -> Any:
    return ev.load("rib-reflector").equilibrium()


def test_the_cords_carry_the_torque_of_the_hinges(book):
    """Each tip is pulled inwards by 2 T sin(pi/N), a polygon's balance: times its height it is the hinge's torque."""
    found = tensioned()
    tension = [float(found[f"cord {k}"].force.values[-1]) for k in range(1, RIBS + 1)]
    assert tension == pytest.approx(RIBS * [tension[0]], rel=1e-7)
    places = found["rib 1"].position.values[-1]
    inwards = 2.0 * tension[0] * np.sin(np.pi / RIBS)
    moment = inwards * (places[-1, 2] - places[0, 2])
    torque = float(found["spring 1"].torque.values[-1])
    assert torque == pytest.approx(moment, rel=1e-6)
    book(
        "Statics of beams", "Ring of cords between the tips of six curved ribs",
        reference="2 T sin(pi/6) times the height is the hinge's torque", source="closed form",
        error=abs(torque / moment - 1.0), allowed=1e-6,
    )  # fmt: skip


def test_bending_moment_along_a_rib():
    """The moment in each section is the pull at the tip times the tip's height above it."""
    found = tensioned()
    rib, tension = found["rib 1"], float(found["cord 1"].force.values[-1])
    places = rib.position.values[-1]
    # at the middles of the elements a parabola through three nodes is closer than the chord
    middle = 0.5 * (places[1:, 2] + places[:-1, 2])
    wanted = 2.0 * tension * np.sin(np.pi / RIBS) * (places[-1, 2] - middle)
    assert np.abs(rib.bending_moment_z.values[-1]) == pytest.approx(wanted, rel=0.02, abs=0.02 * wanted[0])


@functools.cache
def slowest(angle: float = 0.0) -> Any:
    """Modes of the reflector turned about its axis, degrees."""
    content, c, s = cases.content_of("rib-reflector"), math.cos(math.radians(angle)), math.sin(math.radians(angle))
    for name, part in content["parts"].items():
        turned = [part[key] for key in ("position", "direction", "normal", "axis") if key in part]
        if name.startswith("hinge"):
            turned.append(part["a"][1])
        for vector in turned:
            vector[:2] = c * vector[0] - s * vector[1], s * vector[0] + c * vector[1]
    return ev.load(content).modes(count=5)


@pytest.mark.slow
def test_the_alternating_mode(book):
    """Ribs turn about their hinges in turn up and down, so that no cord is stretched: springs and tension hold them.

    With T, L of the cords, rho and h from hinge to tip, each rib has k + T/L (4 rho^2 + 3 h^2) - 2 T sin(pi/6) rho.
    """
    found = tensioned()
    tip, tension = found["rib 1"].position.values[-1][-1], float(found["cord 1"].force.values[-1])
    rho, h = tip[0] - 0.3, tip[2] - 0.01875
    stiffness = 1.0 + tension / tip[0] * (4.0 * rho**2 + 3.0 * h**2) - tension * rho
    arc = np.linspace(0.0, 2.0, 2001)
    places, _ = Parabola(focal_length=1.2, offset=0.3).plane(arc)
    inertia = CFRP.density * math.pi * (0.008**2 - 0.0075**2) * np.trapezoid(np.sum(places**2, axis=1), arc)
    wanted = math.sqrt(stiffness / inertia)
    assert slowest().frequency[2] == pytest.approx(wanted, rel=2e-3)
    book(
        "Wrapped rib", "Ribs with a ring of cords that turn in turn up and down: frequency", reference="rigid ribs",
        source="closed form", allowed=2e-3, error=abs(slowest().frequency[2] / wanted - 1.0),
    )  # fmt: skip


@pytest.mark.slow
def test_modes_of_the_reflector_come_in_pairs_and_turn_with_it():
    """Of six equal ribs cos and sin of an angle and of twice that are alike, wherever the first rib is."""
    frequency = slowest().frequency
    assert frequency[[1, 4]] == pytest.approx(frequency[[0, 3]], rel=1e-7)
    assert slowest(20.0).frequency == pytest.approx(frequency, rel=1e-6)


@pytest.mark.slow
def test_modes_of_the_reflector_by_differences_of_its_forces():
    """Steps of 3 um leave the cords taut: they are so by 40 um."""
    assembly = ev.load("rib-reflector").assemble()
    found = solve_static(assembly)
    work = Work(assembly, found.y[-1], 0.0, np.zeros(6))
    work.balance.la[:] = found.la[-1]
    K, G = stiffness_by_differences(work, 3e-6)
    T = scipy.linalg.null_space(G)
    squares = scipy.linalg.eigh(T.T @ (0.5 * (K + K.T)) @ T, T.T @ work.mass() @ T, eigvals_only=True)
    assert np.sqrt(squares[:5]) == pytest.approx(slowest().frequency, rel=1e-6)


@pytest.mark.slow
def test_the_cords_are_slack_until_the_ribs_are_open():
    system = ev.load("rib-reflector")
    run = system.simulate(until=0.6, every=0.01)
    tension, angle = run["cord 1"].force.values, run["spring 1"].angle.values
    assert tension.min() >= 0.0
    assert np.all(tension[angle > 0.1] == 0.0)
    assert angle[0] == pytest.approx(np.radians(60.0))


def test_a_misspelt_shape_is_refused_on_the_command_line(call, tmp_path):
    content = cases.content_of("rib-reflector")
    content["parts"]["rib 1"]["shape"] = {"parabola": {"focal": 1.2}}
    (tmp_path / "net.yaml").write_text(yaml.safe_dump(content, sort_keys=False))
    code, _, err = call("run", "net.yaml", "--no-figures")
    assert code == 2
    assert "unknown key 'parts.rib 1.shape.parabola.focal'" in err
    assert "did you mean" in err
    assert len(err.strip().splitlines()) == 1
