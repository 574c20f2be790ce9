"""Moments and follower forces on beams, loads by laws, forces on nodes of threads, light on panels."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import evolvent
from book import Book
from evolvent import InputError, System, elements, parts

SECTION = elements.Rectangle(width=0.02, thickness=0.01)
MATERIAL = elements.Material(young_modulus=2e9, poisson_ratio=0.0, density=1000.0)
EI = 2e9 * 0.02 * 0.01**3 / 12.0
ORIGIN = (0.0, 0.0, 0.0)


def beam(formulation: str = "assumed_strain", count: int = 4, **fields: Any) -> parts.Beam:
    return parts.Beam(
        length=1.0, section=SECTION, material=MATERIAL, elements=count, formulation=formulation, **fields
    )  # fmt: skip


def cantilever(formulation: str, count: int = 4) -> System:
    system = System()
    system.add(beam(formulation, count), "beam")
    system.add(parts.Joint(a="beam.root", b=ORIGIN, type="clamp"), "root")
    return system


@pytest.mark.parametrize(("formulation", "allowed"), [("cable", 1e-6), ("assumed_strain", 5e-4)])
def test_a_moment_bends_a_cantilever_into_an_arc(formulation: str, allowed: float, book: Book) -> None:
    moment = 0.4
    system = cantilever(formulation)
    system.add(parts.Load(at="beam.tip", torque=(0.0, 0.0, moment)), "moment")
    found, k = system.equilibrium(), moment / EI
    tip = found["beam/position"].values[-1, -1]
    book(
        "Statics of beams", f"arc of a cantilever under a moment at its end ({formulation}, 4 elements)",
        reference="(sin k, 1 - cos k)/k, k = M/(E I)", source="Bernoulli",
        error=float(np.abs(tip - [math.sin(k) / k, (1.0 - math.cos(k)) / k, 0.0]).max()), allowed=allowed,
    )  # fmt: skip
    np.testing.assert_allclose(found["root/moment"].values[-1], [0.0, 0.0, moment], atol=1e-9)


def test_a_moment_twists_a_rod() -> None:
    """T L/(G J) at its end, and the moment at its root."""
    section, twist = elements.Circle(radius=0.01), 0.2
    T = twist * 1e9 * math.pi * 0.01**4 / 2.0
    system = System()
    system.add(
        parts.Beam(length=1.0, section=section, material=MATERIAL, elements=2, formulation="assumed_strain"), "beam"
    )  # fmt: skip
    system.add(parts.Joint(a="beam.root", b=ORIGIN, type="clamp"), "root")
    system.add(parts.Load(at="beam.tip", axis=(1.0, 0.0, 0.0), profile={"constant": T}), "moment")
    found = system.equilibrium()
    np.testing.assert_allclose(found["root/moment"].values[-1], [T, 0.0, 0.0], rtol=1e-7, atol=1e-9)
    np.testing.assert_allclose(found["beam/torsional_moment"].values[-1], T, rtol=2e-2)


@pytest.mark.parametrize("formulation", ["cable", "assumed_strain"])
def test_a_moment_is_the_rate_of_the_angular_momentum(formulation: str) -> None:
    """Of a free beam, to round-off under the energy-momentum method; its work closes the balance."""
    system, moment = System(), np.array([0.0, 0.02, 0.05])
    system.add(beam(formulation, 2), "beam")
    system.add(parts.Load(at="beam.tip", torque=tuple(moment)), "moment")
    run = system.simulate(until=0.2, every=0.002, method="energy-momentum", step=0.002, spectral_radius=1.0)
    gained = run["angular_momentum"].values[-1] - run["angular_momentum"].values[0]
    np.testing.assert_allclose(gained, 0.2 * moment, rtol=1e-3 if formulation == "cable" else 1e-8, atol=1e-9)
    assert float(np.abs(run["energy_defect"]).max()) < 1e-7 * float(run["energy_kinetic"].max())
    assert float(run["moment/work"][-1]) == pytest.approx(float(run["work_loads"][-1]), rel=0.05)


def follower_arc(force: float) -> np.ndarray:
    """Tip of an inextensible cantilever under a force that stays across its end: in the tip's axes it stands still."""

    def slope(s: float, y: np.ndarray) -> list[float]:  # s from the tip inwards, y = x, y, angle
        bend = force * y[0] / EI  # force (0, force) at the tip, at the arm -x
        return [-math.cos(y[2]), -math.sin(y[2]), bend]

    x, y, angle = solve_ivp(slope, (0.0, 1.0), [0.0, 0.0, 0.0], rtol=1e-11, atol=1e-12).y[:, -1]
    c, s = math.cos(-angle), math.sin(-angle)  # root at the origin, along x
    return np.array([c * -x - s * -y, s * -x + c * -y, 0.0])


def test_a_follower_force(book: Book) -> None:
    force = 3.0
    system = cantilever("assumed_strain", 16)
    system.add(parts.Load(at="beam.tip", force=(0.0, force, 0.0), frame="body"), "push")
    found = system.equilibrium(load_steps=4)
    tip = found["beam/position"].values[-1, -1]
    book(
        "Statics of beams", "cantilever under a follower force across its end (assumed_strain, 16 elements)",
        reference="elastica, integrated from the tip", source="Bernoulli, Euler",
        error=float(np.abs(tip - follower_arc(force)).max()), allowed=2e-3,
    )  # fmt: skip


@evolvent.law
def spring(x: Any, v: Any, t: float, p: Any) -> tuple[float, float, float]:
    return -p[0] * x[0] - p[1] * v[0], -p[0] * x[1] - p[1] * v[1], -p[0] * x[2] - p[1] * v[2]


METHODS: dict[str, dict[str, Any]] = {
    "dopri5": {"tolerance": 1e-8},
    "generalized-alpha": {"step": 2e-3},
    "energy-momentum": {"step": 2e-3, "spectral_radius": 1.0},
}


@pytest.mark.slow
@pytest.mark.parametrize("formulation", ["cable", "assumed_strain"])
def test_laws_moments_and_follower_forces_on_a_beam_agree_between_methods(formulation: str) -> None:
    soft = elements.Material(young_modulus=2e7, poisson_ratio=0.0, density=1000.0)
    system = System()
    system.add(
        parts.Beam(length=1.0, section=SECTION, material=soft, elements=2, formulation=formulation), "beam"
    )  # fmt: skip
    system.add(parts.Joint(a="beam.root", b=ORIGIN, type="clamp", stiffness=1e4, damping=5.0), "root")
    sine = {"sine": {"amplitude": 1e-2, "frequency": 0.5}}
    system.add(parts.Load(at="beam.tip", axis=(0.0, 0.0, 1.0), profile=sine), "moment")
    system.add(
        parts.Load(at="beam[1]", type="torque", law=["-c*vx", "-c*vy", "-c*vz"], constants={"c": 1e-3}), "damper"
    )
    if formulation != "cable":
        system.add(parts.Load(at="beam.tip", force=(0.0, 0.01, 0.01), frame="body"), "follower")
    system.add(parts.Load(at="beam.tip", law=spring, parameters=(0.1, 0.01)), "spring")
    system.add(parts.Load(along="beam", law=["-0.1*vx", "-0.2*vy", "sin(t)*0.5"]), "drag")
    places = []
    methods = {**METHODS, "generalized-alpha": {"tolerance": 1e-5}}
    del methods["generalized-alpha" if formulation == "cable" else "dopri5"]  # which take long there
    for method, options in methods.items():
        run = system.simulate(until=0.1, every=1e-3, method=method, **options)
        places.append(run["beam/position"].values[-1])
        scale = float(run["energy_kinetic"].max())
        allowed = {"dopri5": 1e-7, "generalized-alpha": 1e-2, "energy-momentum": 1e-7}[method]
        assert float(np.abs(run["energy_defect"]).max()) < allowed * scale, method
        works = [float(group["work"][-1]) for group in run.children.values() if "work" in group]
        assert sum(works) == pytest.approx(float(run["work_loads"][-1]), rel=1e-2)
    np.testing.assert_allclose(places[1:], [places[0]] * (len(places) - 1), atol=2e-5)


def test_a_beam_on_an_elastic_foundation() -> None:
    """A line load by a law -k y: the free beam goes up and down with sqrt(k/(rho A))."""
    k, w = 5.0, math.sqrt(5.0 / 0.2)
    system = System()
    system.add(beam("cable", 2, position=(0.0, 0.01, 0.0)), "beam")
    system.add(parts.Load(along="beam", law=["0", "-k*y", "0"], constants={"k": k}), "soil")
    run = system.simulate(until=1.0, every=0.1, method="energy-momentum", step=2e-3, spectral_radius=1.0)
    exact = 0.01 * np.cos(w * run["time"].values)
    np.testing.assert_allclose(run["beam/position"].values[:, :, 1], exact[:, None] * np.ones(3), atol=1e-6)


@pytest.mark.parametrize("method", METHODS)
def test_a_torque_by_a_law_slows_a_body_down(method: str) -> None:
    system = System()
    system.add(parts.RigidBody(mass=1.0, inertia=(0.2, 0.2, 0.4), angular_velocity=(0.0, 0.0, 2.0)), "body")
    system.add(
        parts.Load(at="body", type="torque", law=["0", "0", "-c*vz"], constants={"c": 0.5}, frame="body"), "brake"
    )
    run = system.simulate(until=1.0, every=0.25, method=method, **METHODS[method])
    exact = 2.0 * np.exp(-0.5 / 0.4 * run["time"].values)
    np.testing.assert_allclose(run["body/rate"].values[:, 2], exact, rtol=2e-6)


def tethered(**fields: Any) -> System:
    system = System()
    system.add(parts.RigidBody(motion="driven"), "hub")
    system.add(parts.Reel(body="hub", radius=0.1, drive=parts.ConstantDrive(rate=0.0, angle=10.0)), "reel")
    system.add(
        parts.Thread(reel="reel", length=1.0, line_density=0.1, nodes=4, stiffness=1e3, damping=20.0, **fields),
        "tether",
    )
    return system


def test_a_force_on_the_tip_of_a_thread_reaches_its_mass() -> None:
    """The tension is the force in every segment; a force on the second node pulls inside of that alone."""
    system = tethered(tip_mass=0.5)
    system.add(parts.Load(at="tether.tip", force=(3.0, 0.0, 0.0)), "pull")
    system.add(parts.Load(at="tether[2]", law=["1", "-c*vy", "0"], constants={"c": 0.1}), "more")
    run = system.simulate(until=2.0, every=0.5, method="generalized-alpha", step=2e-3)
    tension = np.sort(run["tether/tension"].values[-1])
    np.testing.assert_allclose(tension, [3.0, 3.0, 4.0, 4.0], atol=1e-3)
    np.testing.assert_allclose(run["pull/force"].values[-1], [3.0, 0.0, 0.0], atol=1e-12)
    place = run["tether/position"].values[-1]
    np.testing.assert_allclose(run["pull/position"].values[-1], place[np.argmax(place[:, 0])], atol=1e-9)
    assert "warning" not in run.attrs


def test_a_load_per_length_warns_of_a_tip_mass() -> None:
    system = tethered(tip_mass=0.5)
    system.add(parts.Load(along="tether", law=["1", "0", "0"]), "wind")
    run = system.simulate(until=0.01, every=0.01, method="generalized-alpha", step=2e-3)
    assert "'wind' acts per length of 'tether', not on its tip mass of 0.5 kg" in run.attrs["warning"]
    bare = tethered()
    bare.add(parts.Load(along="tether", law=["1", "0", "0"]), "wind")
    run = bare.simulate(until=0.01, every=0.01, method="generalized-alpha", step=2e-3)
    assert "warning" not in run.attrs


@pytest.mark.parametrize(("specular", "diffuse"), [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (0.3, 0.5)])
def test_light_on_a_panel(specular: float, diffuse: float, book: Book) -> None:
    """A plate at 30 degrees to the light, off the body's centre: force and torque in closed form."""
    p, area, angle, arm = 0.5, 2.0, math.pi / 6.0, 1.5
    s, c = np.array([math.sin(angle), 0.0, math.cos(angle)]), math.cos(angle)
    system = System()
    system.add(parts.RigidBody(mass=2.0, inertia=(2.0, 3.0, 4.0)), "body")
    system.add(
        parts.Radiation(at=("body", (0.0, arm, 0.0)), area=area, normal=(0.0, 0.0, -1.0), pressure=p,
                             direction=tuple(s), specular=specular, diffuse=diffuse), "light",
    )  # fmt: skip
    run = system.simulate(until=1e-3, every=1e-3, method="dopri5")
    push = p * area * c * (1.0 - specular) * s
    push[2] += p * area * c * (2.0 * specular * c + 2.0 / 3.0 * diffuse)
    found = run["light/force"].values[0]
    turn = run["body/rate"].values[-1] / 1e-3 * [2.0, 3.0, 4.0]
    book(
        "Rigid bodies", f"light on a flat plate (specular {specular}, diffuse {diffuse})",
        reference="force in closed form", source="McInnes 1999", error=np.abs(found - push).max() / p, allowed=1e-12,
    )  # fmt: skip
    np.testing.assert_allclose(turn, np.cross([0.0, arm, 0.0], push), rtol=1e-3, atol=1e-6)


def test_refusals() -> None:
    def refused(words: str, part: Any) -> None:
        system = tethered()
        system.add(beam("cable", 2, position=(0.0, 5.0, 0.0)), "cable")
        system.add(parts.Point(mass=1.0), "point")
        system.add(part, "load")
        with pytest.raises(InputError, match=words):
            system.assemble()

    law = ["1", "0", "0"]
    refused("load.at is 'point'; this load needs a body", parts.Load(at="point", torque=(0.0, 0.0, 1.0)))
    refused(
        "load.at is 'tether.tip', a node of a thread, on which only forces can act",
        parts.Load(at="tether.tip", type="torque", law=law),
    )
    refused("'tether' has no 'root'; give 'tether.tip'", parts.Load(at="tether.root", law=law))
    refused("'tether' has no node 4; give", parts.Load(at="tether[4]", law=law))
    refused("'tether' is a thread; give 'tether.tip'", parts.Load(at="tether", law=law))
    refused("load.torque is .*, along the cable at 'cable.tip'", parts.Load(at="cable.tip", torque=(2.0, 0.0, 0.0)))
    refused("load.frame is 'body', but .* a node of a cable", parts.Load(at="cable.tip", law=law, frame="body"))
    refused("load.force and load.law are both given", parts.Load(at="point", law=law, force=(1.0, 0.0, 0.0)))
    refused("load.profile and load.law are both given", parts.Load(along="cable", law=law, profile={"constant": 1.0}))
    refused(
        "load.constants is given without load.law", parts.Load(at="point", force=(1.0, 0.0, 0.0), constants={"a": 1})
    )
    refused(
        "load.specular and load.diffuse add up to 1.2",
        parts.Radiation(at="hub", area=1.0, normal=(0.0, 0.0, 1.0), pressure=1.0, specular=0.7, diffuse=0.5),
    )
    refused(
        "load.at is 'point'; this load needs a body",
        parts.Radiation(at="point", area=1.0, normal=(0.0, 0.0, 1.0), pressure=1.0),
    )


@evolvent.law
def pulsed(t: float, x: Any, v: Any, parameters: Any) -> tuple[float, float, float]:
    return parameters[0] * t, -parameters[1] * x[1], 0.0


def test_a_law_with_the_time_first() -> None:
    system = System()
    system.add(parts.Point(mass=2.0, position=(0.0, 0.1, 0.0)), "mass")
    system.add(parts.Load(at="mass", law=pulsed, parameters=(3.0, 8.0)), "push")
    run = system.simulate(until=1.0, every=0.5, method="dopri5", tolerance=1e-10)
    np.testing.assert_allclose(run["mass/position"].values[-1], [0.25, 0.1 * math.cos(2.0), 0.0], atol=1e-8)
    broken = parts.Load(at="mass", law=pulsed)
    system = System()
    system.add(parts.Point(mass=2.0), "mass")
    system.add(broken, "push")
    with pytest.raises(
        InputError, match=r"'push' at t = 0 s: the law 'pulsed' .*test_law_loads.py.*0 parameters are given"
    ):
        system.simulate(until=1.0)


def test_loads_in_a_file(tmp_path: Any) -> None:
    """A system with all of them is the same after it was written and read."""
    system = tethered(tip_mass=0.5)
    drive = {"expression": "a*sin(t)", "constants": {"a": 0.1}}
    system.add(parts.RigidBody(motion="driven", drive=drive, direction=(0.0, 0.0, 1.0)), "table")
    system.add(beam(position=(0.0, 5.0, 0.0)), "beam")
    law: dict[str, Any] = {"law": ["a*x", "sin(t)", "-vz"], "constants": {"a": 0.1}}
    system.add(parts.Load(at="tether.tip", frame="body", **law), "force")
    system.add(parts.Load(at="beam.tip", type="torque", **law), "torque")
    system.add(parts.Load(along="beam", **law), "line")
    system.add(parts.Field(**law), "field")
    light: dict[str, Any] = {"area": 2.0, "normal": (0.0, 0.0, 1.0), "pressure": 4.56e-6, "specular": 0.3}
    system.add(parts.Radiation(at=("table", (0.0, 1.0, 0.0)), **light), "light")
    path = tmp_path / "case.yaml"
    path.write_text(system.to_yaml(until="1 s"))
    read = evolvent.load(path)
    assert dict(read.parts) == dict(system.parts)
    read.assemble()
