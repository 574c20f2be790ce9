"""The reflector of six curved ribs: equilibrium of its ring of cords, and its deployment."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
import pytest
import yaml

import evolvent as ev
from evolvent import cases

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
