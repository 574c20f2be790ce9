"""Estimates of the error of the mesh by halved elements, against closed forms of a cantilever."""

from __future__ import annotations

import math
import pathlib
import re
from typing import Any

import numpy as np
import pytest
import xarray as xr
from click.testing import CliRunner
from numpy.testing import assert_allclose

from evolvent import InputError, System, parts
from evolvent.analysis.mesh_error import refined, richardson
from evolvent.elements import Rectangle
from evolvent_base.cli import commands

LENGTH, THICKNESS, WIDTH = 0.3, 0.005, 0.015
MATERIAL = {"young_modulus": 70e9, "poisson_ratio": 0.0, "density": 2800.0}
EI, MU = 70e9 * WIDTH * THICKNESS**3 / 12.0, 2800.0 * WIDTH * THICKNESS
FIRST = 1.8751040687**2 * math.sqrt(EI / MU) / LENGTH**2 / (2.0 * math.pi)
SAG = MU * 9.81 * LENGTH**4 / (8.0 * EI)


def cantilever(kind: type, elements: int, gravity: float = 9.81, **keys: Any) -> System:
    """A strip that is clamped at its root, under gravity across its thickness."""
    system = System(gravity=(0.0, 0.0, -gravity))
    section = Rectangle(thickness=THICKNESS, width=WIDTH)
    made = kind(length=LENGTH, normal=(0.0, 0.0, 1.0), section=section, material=MATERIAL, elements=elements, **keys)
    system.add(made, "strip")
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="strip.root", type="clamp"), "clamp")
    return system


@pytest.mark.parametrize("kind", [parts.Rod, parts.Beam])
def test_the_first_frequency_of_two_elements(kind):
    """The estimate has the sign of the error and its size within a factor of 2; it falls by order 2."""
    estimates = []
    for n in (2, 4):
        found = cantilever(kind, n).modes(count=2, mesh_error=True)
        true, estimate = found.frequency_hz[0] / FIRST - 1.0, float(found.mesh.relative[0])
        assert 0.5 < estimate / true < 2.0
        assert abs(found.mesh.extrapolated[0] / FIRST - 1.0) < 0.5 * abs(true)
        estimates.append(estimate)
    assert math.log2(estimates[0] / estimates[1]) > 1.8


@pytest.mark.parametrize(("load", "share"), [("force", 0.25), ("weight", 1.0 / 3.0)])
def test_a_beam_of_few_elements_is_too_stiff(load, share):
    """By 25 %/n^2 under a force at the tip, by 33 %/n^2 under its weight."""
    force = 0.05
    sag = SAG if load == "weight" else force * LENGTH**3 / (3.0 * EI)
    for n in (2, 4):
        system = cantilever(parts.Beam, n, gravity=9.81 if load == "weight" else 0.0)
        if load == "force":
            system.add(parts.Load(at="strip.tip", force=(0.0, 0.0, -force)), "load")
        tip = system.equilibrium(mesh_error=True)["strip"].tip_deflection
        true = 1.0 - np.linalg.norm(tip.values[-1]) / sag
        assert_allclose(true, share / n**2, rtol=0.02)
        assert 0.5 < tip.attrs["mesh_error"] / true < 2.0
        assert abs(np.linalg.norm(tip.attrs["extrapolated"]) / sag - 1.0) < 0.5 * true


def test_the_nodes_of_a_rod_are_exact():
    exact = cantilever(parts.Rod, 2).equilibrium(mesh_error=True)["strip"].tip_deflection
    assert exact.attrs["mesh_error"] < 1e-4
    assert_allclose(np.linalg.norm(exact.values[-1]), SAG, rtol=1e-3)  # the rest is shear


@pytest.mark.parametrize("kind", [parts.Rod, parts.Beam])
def test_modes_are_paired_by_shape(kind):
    """Of 2 elements the second mode of one plane comes beside other ones of the finer mesh."""
    found = cantilever(kind, 2).modes(count=4, mesh_error=True)
    flat, edge = found.mesh.extrapolated[0], found.mesh.extrapolated[1]
    assert_allclose(edge / flat, WIDTH / THICKNESS, rtol=0.01)


def test_references_to_nodes_and_lists_follow():
    system = cantilever(parts.Beam, 3, grading=[1.0, 2.0, 1.0], stiffness_damping=1e-3, damped=[1])
    system.add(parts.Load(at="strip[2]", force=(0.0, 0.0, -1.0)), "load")
    fine = refined(system)
    assert fine.parts["load"].at == "strip[4]"
    assert fine.parts["strip"].damped == (2, 3)
    assert_allclose(fine.parts["strip"].arc[::2], system.parts["strip"].arc, rtol=1e-14)
    assert fine.parts["clamp"] == system.parts["clamp"]
    assert system.parts["strip"].elements == 3


def test_a_thread_keeps_its_stiffness():
    """Stiffness and damping are those of one segment: halves have twice as much."""
    system = System(gravity=(0.0, 0.0, -9.81))
    system.add(parts.RigidBody(motion="driven"), "hub")
    reel = parts.Reel(body="hub", radius=0.1, drive=parts.ConstantDrive(rate=0.0, angle=20.0))
    system.add(reel, "reel")
    thread = parts.Thread(reel="reel", length=2.0, nodes=4, line_density=0.1, stiffness=2e3, damping=3.0)
    system.add(thread, "line")
    fine = refined(system).parts["line"]
    assert (fine.nodes, fine.stiffness, fine.damping) == (8, 4e3, 6.0)
    assert refined(system).assemble().model.threads["n"][0] == 8


def test_bad_input():
    empty = System()
    empty.add(parts.Point(mass=1.0), "mass")
    with pytest.raises(InputError, match="no part has elements"):
        empty.modes(mesh_error=True)
    nodes = cantilever(parts.Beam, 2).parts["strip"].start_nodes().tolist()
    with pytest.raises(InputError, match=r"^strip\.nodes has values of every node"):
        cantilever(parts.Beam, 2, nodes=nodes).modes(mesh_error=True)
    system = cantilever(parts.Beam, 2)
    system.add(parts.RigidBody(motion="driven"), "hub")
    system.add(parts.Contact(a="strip", b=("hub", (0.15, -0.5, 0.0)), shape=parts.Cylinder(radius=0.1)), "touch")
    with pytest.raises(InputError, match="does not support 'touch'"):
        system.equilibrium(mesh_error=True)


def test_extrapolation_of_what_does_not_change():
    found = richardson(np.array([0.0, 2.0, 1.0]), np.array([0.0, 2.0, np.nan]))
    assert_allclose(found.relative, [0.0, 0.0, np.nan])


@pytest.mark.slow
def test_the_commands_show_and_keep_it(tmp_path: pathlib.Path):
    case, run = tmp_path / "strip.yaml", CliRunner()
    case.write_text(cantilever(parts.Beam, 2).to_yaml())
    shown = run.invoke(commands, ["modes", str(case), "--count", "2", "--mesh-error", "-o", str(tmp_path / "modes.nc")])
    assert shown.exit_code == 0, shown.output
    assert "extrapolated, Hz  mesh error, %" in shown.output
    with xr.open_dataset(tmp_path / "modes.nc") as kept:
        assert 0.03 < float(kept.mesh_error[0]) < 0.08
        assert_allclose(kept.frequency_extrapolated[0], FIRST, rtol=0.01)
    shown = run.invoke(commands, ["equilibrium", str(case), "--mesh-error", "-o", str(tmp_path / "rest.nc")])
    assert shown.exit_code == 0, shown.output
    assert "strip.tip_deflection, mesh error" in shown.output
    assert re.search(r"^message +the whole load is carried$", shown.output, re.MULTILINE)
    with xr.open_datatree(tmp_path / "rest.nc") as kept:
        assert 0.03 < float(kept["strip"].tip_deflection.attrs["mesh_error"]) < 0.12
