"""The part: keys, refusals, points by name, results, files, drawings."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import yaml

import evolvent
from evolvent import InputError, RunFailed, System, parts
from evolvent.analysis.methods import choose_method
from evolvent.elements import Material, Rectangle, rods
from evolvent.view.drawing import motion_of
from rods.building import RUBBER, STRIP, cantilever

KEYS: dict[str, Any] = {"length": 1.0, "section": STRIP, "material": RUBBER, "elements": 4}


def refused(**keys: Any) -> str:
    def assembled() -> None:
        system = System()
        system.add(parts.Rod(**(KEYS | keys)), "arm")
        system.assemble()

    with pytest.raises(InputError) as error:
        assembled()
    return str(error.value)


def test_refusals() -> None:
    no_torsion = {"area": 1.0, "Iy": 1.0, "Iz": 1.0, "J": 0.0}
    assert "J is 0" in refused(section={"general": no_torsion})
    assert "shear_y is 0" in refused(section={"general": no_torsion | {"J": 1.0, "shear_y": 0.0}})
    assert "arm.normal" in refused(normal=(1.0, 0.0, 0.0))
    words = "is 95 deg; at most 90 deg is allowed, use 9 elements"
    assert words in refused(curvature=(0.0, 0.0, 6.6))
    assert "the angle between the ends of element 0 is 458 deg" in refused(curvature=(0.0, 32.0, 0.0))
    assert "arm.nodes has the shape" in refused(nodes=np.zeros((4, 4, 3)).tolist())
    skewed = np.zeros((5, 4, 3))
    skewed[:, 1:] = np.eye(3)
    skewed[2, 1, 1] = 0.1
    assert "arm.nodes[2] has axes" in refused(nodes=skewed.tolist())
    assert "arm.nodes and arm.position" in refused(nodes=skewed.tolist(), position=(0.0, 0.0, 0.0))


@pytest.mark.parametrize(
    ("at", "words"),
    [
        ("rod", "'rod' is a rod; give 'rod.root', 'rod.tip' or a node from 'rod[0]' to 'rod[4]'"),
        ("rod[9]", "'rod' has no node 9"),
        ("rod.tp", "'rod' has no 'tp'"),
        ("rood.tip", "no part is called that; did you mean 'rod'"),
    ],
)
def test_places_that_are_none(at: str, words: str) -> None:
    with pytest.raises(InputError) as error:
        cantilever(parts.Load(at=at, force=(0.0, 1.0, 0.0))).assemble()
    assert words in str(error.value)


def test_an_element_that_bends_too_far_is_named() -> None:
    EI = RUBBER.E * STRIP.properties(0.3).Iz
    system = cantilever(parts.Load(at="rod.tip", torque=(0.0, 0.0, 5.0 * EI)), elements=2)
    with pytest.raises(RunFailed, match=r"element [01] of 'rod' is bent or twisted by .* use more `elements`"):
        system.equilibrium()


def test_auto_takes_energy_momentum() -> None:
    assert choose_method(cantilever().assemble(), "auto") == (
        "energy-momentum",
        "rods: steps of any length gain no energy",
    )


def test_nodes_stand_as_they_are_given() -> None:
    """Elastic energy of `nodes`: zero with rest "start", above zero with "straight"."""
    x, R = rods.advanced(np.array([0.0, 0.0, 1.0]), 0.5)
    nodes = np.array([[np.zeros(3), *np.eye(3)], [x, *R.T]])
    for rest, wanted in (("start", 0.0), ("straight", 0.25 * RUBBER.E * STRIP.properties(0.3).Iz)):
        system = System()
        system.add(parts.Rod(**(KEYS | {"length": 0.5, "elements": 1}), nodes=nodes.tolist(), rest=rest), "arm")
        run = system.simulate(until=1e-6, every=1e-6)
        assert run["arm"].energy_elastic.values[0] == pytest.approx(wanted, rel=1e-9, abs=1e-12)
        assert run["arm"].position.values[0] == pytest.approx(nodes[:, 0], abs=1e-12)


def test_results_of_an_equilibrium() -> None:
    """Forces and moments of a cantilever under a small force: shear P, moment P (L - x), named as of a beam."""
    P = 1e-4
    run = cantilever(parts.Load(at="rod.tip", force=(0.0, P, 0.0))).equilibrium()
    rod = run["rod"].to_dataset()
    arc = rod.arc.values
    assert rod.shear_force_y.values[-1] == pytest.approx(np.full(4, P), rel=1e-6)
    assert rod.bending_moment_z.values[-1] == pytest.approx(P * (1.0 - arc), rel=1e-6)
    s = STRIP.properties(0.3)
    assert rod.curvature_z.values[-1] == pytest.approx(P * (1.0 - arc) / (RUBBER.E * s.Iz), rel=1e-6)
    shear = P / (s.shear_y * RUBBER.shear_modulus * s.area)
    assert rod.shear_strain_y.values[-1] == pytest.approx(np.full(4, shear), rel=1e-6)
    assert rod.tip_deflection.values[-1, 1] == pytest.approx(P / (3.0 * RUBBER.E * s.Iz) + shear, rel=1e-6)
    assert rod.energy_elastic.values[-1] == pytest.approx(0.5 * P * rod.tip_deflection.values[-1, 1], rel=1e-6)
    assert run["clamp"].to_dataset()


def test_results_of_a_motion(tmp_path: Any) -> None:
    """A rod that turns rigidly: points, attitudes, rates, momenta; the same from a file; drawn as a beam is."""
    system = System(title="turns")
    motion = {"velocity": (1.0, 0.0, 0.0), "angular_velocity": (0.0, 0.0, 2.0)}
    stiff = Material(young_modulus=1e10, poisson_ratio=0.3, density=1000.0)
    system.add(parts.Rod(**(KEYS | {"material": stiff, "mass_damping": 0.0}), **motion), "arm")
    text = system.to_yaml(until=0.2, every=0.05)
    again = evolvent.load(yaml.safe_load(text))
    assert again.parts == system.parts
    run = again.simulate(until=0.2, every=0.05)
    arm = run["arm"].to_dataset()
    assert arm.velocity.values[0, -1] == pytest.approx((1.0, 2.0, 0.0))
    assert arm.rate.values[0] == pytest.approx(np.tile([0.0, 0.0, 2.0], (5, 1)))
    assert arm.energy_kinetic.values[0] == pytest.approx(0.5 * 0.8 * (1.0 + 2.0**2 / 3.0), rel=1e-3)
    assert np.abs(arm.attitude.values[-1, -1]) == pytest.approx((np.cos(0.2), 0.0, 0.0, np.sin(0.2)), abs=1e-3)
    assert run.ev.get("arm.tip.position").shape == (5, 3)
    assert list(arm.energy_kinetic.attrs) == ["units", "long_name"]
    line = motion_of(run).lines[0]
    assert line.name == "arm"
    assert line.width == pytest.approx(0.04)
    evolvent.save(run, tmp_path / "run.nc")
    assert evolvent.open(tmp_path / "run.nc")["arm"].tip_speed.values == pytest.approx(arm.tip_speed.values)


def test_joined_to_a_body_a_point_and_springs() -> None:
    """Modes of a rod with a mass at its tip, clamped to a heavy free body: the light end swings; points by name."""
    system = System()
    system.add(parts.RigidBody(mass=1e3, inertia=1e3, position=(-0.1, 0.0, 0.0)), "hub")
    system.add(parts.Rod(**KEYS), "arm")
    system.add(parts.Joint(a=("hub", (0.1, 0.0, 0.0)), b="arm.root", type="clamp"), "clamp")
    system.add(parts.RigidBody(mass=50.0, inertia=1e-3, position=(1.0, 0.0, 0.0)), "end")
    system.add(parts.Joint(a="end", b="arm.tip", type="clamp"), "seat")
    system.add(parts.Point(mass=1e-6, at="arm[3]"), "sensor")
    system.add(parts.Spring(a="arm[2]", b=(0.5, 1.0, 0.0), stiffness=1e-3), "spring")
    found = system.modes(count=8)
    s = STRIP.properties(0.3)
    k, m = 3.0 * RUBBER.E * s.Iz, 50.0 + 33.0 / 140.0 * 0.8
    hub = 1e3 * 1e3 / (1e3 + 1.1**2 * 1e3)  # what the hub's mass and inertia are beside a force 1.1 m away
    assert np.min(np.abs(found.frequency / np.sqrt(k * (1.0 / m + 1.0 / hub)) - 1.0)) < 0.02
    assert found["arm"].shape.shape == (8, 5, 6)
    assert found["arm"].displacement.shape == found["arm"].rotation.shape == (8, 5, 3)
    assert found["arm.tip"].displacement == pytest.approx(found["arm"].displacement[:, -1])
    assert found["arm[2]"].shape.shape == (8, 6)
    assert found.total_mass[0] == pytest.approx(1050.8)
    model = system.linearize(["arm.tip.force.y"], ["arm.tip.displacement.y"], modes=8)
    assert np.all(np.isfinite(model.A))
    assert {"arm", "hub", "end"} <= set(found.parts)
    with pytest.raises(InputError, match=r"a point of the rod 'arm' is 'arm.root'"):
        system.linearize(["arm.force.y"], ["arm.tip.displacement.y"], modes=8)


def test_wide_things_are_drawn() -> None:
    """Bodies of the nodes are no parts of their own."""
    run = cantilever(section=Rectangle(thickness=0.05, width=0.02)).simulate(until=0.01, every=0.01)
    assert set(run.children) == {"rod", "clamp"}
    assert not motion_of(run).frames
