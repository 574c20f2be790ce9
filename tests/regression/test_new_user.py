"""What a new user's trial found: loads, contacts, units and refusals."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

from evolvent import System, parts
from evolvent.elements import Circle, Material
from evolvent.model.family import EXPLICIT
from evolvent_base.errors import InputError
from families.rows import FAMILIES, Row, set_kinds

METAL = Material(young_modulus=70e9, poisson_ratio=0.3, density=2700.0)


def boom(kind: type[Any] = parts.Rod, elements: int = 6) -> Any:
    """A rod or beam of 1 m along x."""
    return kind(length=1.0, section=Circle(radius=0.01), material=METAL, elements=elements)


def propped(kind: type[Any]) -> System:
    """A cantilever whose tip lies on a sphere beside the origin of the sphere's body."""
    system = System()
    system.add(boom(kind, 10), "boom")
    system.add(parts.Joint(a=(0, 0, 0), b="boom.root", type="clamp"), "root")
    system.add(
        parts.Load(at="boom[5]", direction=(0, 0, -1), profile={"ramp": {"final": 20.0, "duration": 0.02}}), "load"
    )
    ball = parts.Contact(
        a="boom", b=(1, 0, -0.1), shape=parts.Sphere(radius=0.1), stiffness=1e6, skip=9, law="conservative"
    )
    system.add(ball, "ball")
    return system


@pytest.mark.parametrize("kind", [parts.Rod, parts.Beam])
def test_a_force_that_grows_from_zero_presses_on_a_sphere(kind: type[Any]) -> None:
    """The surface presses on the beam upwards, whatever the beam is, and the work is that of the energy balance."""
    run = propped(kind).simulate(until=0.03, every=1e-4, method="energy-momentum")
    assert run.status == "success"
    contact, push = run["ball"], run["ball"].normal_force.values
    assert push.max() > 1.0
    np.testing.assert_allclose(contact.force.values[:, 2], push, rtol=1e-2, atol=1e-2 * push.max())
    wanted = np.cross([1.0, 0.0, 0.0], contact.force.values)
    np.testing.assert_allclose(contact.moment.values, wanted, atol=2e-2 * push.max())
    work = run.work_loads.values
    np.testing.assert_allclose(run["load"].work.values, work, atol=1e-3 * np.abs(work).max())


@pytest.mark.parametrize("method", ["dopri5", "generalized-alpha", "energy-momentum"])
@pytest.mark.parametrize(
    "load",
    [
        {"force": (3.0, 0.0, 0.0), "start": 0.0123, "until": 0.0757},
        {"direction": (1.0, 0.0, 0.0), "profile": {"table": [[0.0, 0.0], [0.0333, 0.0], [0.0334, 5.0], [0.1, 5.0]]}},
    ],
)
def test_the_work_of_a_force_that_jumps_between_samples(method: str, load: dict[str, Any]) -> None:
    system = System()
    system.add(parts.RigidBody(mass=2.0, inertia=(1.0, 1.0, 1.0), velocity=(0.3, 0.0, 0.0)), "body")
    system.add(parts.Load(at="body", **load), "push")
    run = system.simulate(until=0.1, every=0.01, method=method)
    t, work = run.time.values, run["push"].work.values
    window = np.clip(t, 0.0123, 0.0757) - 0.0123
    impulse = 3.0 * window if "force" in load else 5.0 * np.maximum(t - 0.03335, 0.0)
    np.testing.assert_allclose(work, 0.3 * impulse + impulse**2 / 4.0, atol=1e-3 * work.max())
    assert run.work_loads.values[-1] == pytest.approx(work[-1], rel=1e-3)


@pytest.mark.parametrize(
    "load",
    [
        parts.Load(at="ground", force=(1, 0, 0)),
        parts.Load(at="ground", torque=(1, 0, 0)),
        parts.Load(at=(1.0, 0.0, 0.0), force=(1, 0, 0)),
    ],
)
def test_a_load_on_the_ground_is_refused(load: Any) -> None:
    system = System()
    system.add(parts.RigidBody(mass=2.0, inertia=(1.0, 1.0, 1.0)), "body")
    system.add(load, "push")
    with pytest.raises(InputError, match=r"^push\.at is .*, on the ground, which no load moves; give a body"):
        system.assemble()


def panel(**motor: Any) -> System:
    """A panel on a hinge with a motor."""
    system = System()
    system.add(parts.RigidBody(mass=2.0, inertia=(1.0, 1.0, 1.0)), "panel")
    system.add(parts.Joint(a=(0, 0, 0), b="panel", type="revolute", axis=(0, 0, 1)), "hinge")
    system.add(parts.Motor(joint="hinge", **motor), "motor")
    return system


@pytest.mark.parametrize(
    ("motor", "words"),
    [
        ({"torque": {"constant": "5 N"}}, r"^motor\.torque\.constant is 5 N, .* an angle; give it in N m$"),
        ({"torque": {"constant": 5.0}, "limit": "3 N"}, r"^motor\.limit is 3 N, .* an angle; give it in N m$"),
        ({"motion": {"constant": {"rate": "1 m/s"}}, "position_gain": 1.0}, r"^motor\.motion\.rate is 1 m/s, .*rad/s$"),
        (
            {"motion": {"constant": {"rate": 1.0}}, "velocity_gain": "2 N s/m"},
            r"velocity_gain is 2 N s/m, .* N m s/rad",
        ),
    ],
)
def test_units_of_a_travel_on_an_angle_are_refused(motor: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=words):
        panel(**motor).assemble()
    panel(torque={"constant": "5 N m"}, limit="3 N m").assemble()


def test_a_synchronization_is_written_with_its_units() -> None:
    part = parts.Joint(type="synchronization", joints=("a", "b"), stiffness="3 N m/rad", damping="2 N m s/rad")
    written = part.model_dump(mode="json")
    assert (written["stiffness"], written["damping"]) == ("3.0 N m/rad", "2.0 N m s/rad")
    assert parts.Joint(**written) == part


def test_a_refusal_names_all_parts_and_the_method_that_supports_them(monkeypatch: pytest.MonkeyPatch) -> None:
    name, explicit = "a thread with segments of fixed length", frozenset({EXPLICIT})
    given = {"solvers": explicit}
    rows = [Row(row.records, dataclasses.replace(row.kind, **given)) if row.name == name else row for row in FAMILIES]
    set_kinds(monkeypatch, rows)  # of which two are refused beside one another
    system = System()
    system.add(parts.RigidBody(motion="spin", inertia=1.0), "hub")
    system.add(parts.Reel(body="hub", centre=(1.0, 0.0, 0.0), radius=0.1, drive=parts.ConstantDrive(rate=0.1)), "reel")
    system.add(parts.Thread(reel="reel", length=5.0, line_density=0.01, nodes=5, segments="inextensible"), "blade")
    words = r"'blade' is a thread with segments of fixed length, which energy-momentum does not support"
    with pytest.raises(InputError, match=words) as error:
        system.simulate(until=0.01, every=1e-3, method="energy-momentum")
    section = Circle(radius=0.01)
    given: dict[str, Any] = {"elements": 1, "stiffness_damping": 1e-3, "damping": "paper"}
    beam = parts.Beam(length=1.0, section=section, material=METAL, position=(0.0, 0.0, 9.0), **given)
    system.add(beam, "beam")
    words = r"'blade' \(a .*\), 'beam' \(a .*\); rk4, heun and dopri5 support all of them$"
    with pytest.raises(InputError, match=words) as error:
        system.simulate(until=0.01, every=1e-3, method="energy-momentum")
    assert "\n" not in str(error.value)
