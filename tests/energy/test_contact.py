"""Contact and friction under the energy-momentum method, against closed forms and independent solutions."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np
import pytest
import xarray as xr
from scipy.integrate import solve_ivp

from book import Book
from evolvent import System, cases, closed_forms, elements, parts

Array = np.ndarray
METHOD, CHAPTER, G = "energy-momentum", "Contact", 9.81
THIRD = 1.0 / 3.0
#: Share of the energy, or of the work, below which a gain is round-off, of EA L/8 of stiff elements.
GAIN = 1e-7


def simulated(system: System, until: float, step: float | None, **options: Any) -> xr.DataTree:
    """A run whose energy balance shows no gain, and with a spectral radius of 1 no loss."""
    options = {"every": until / 200.0, "spectral_radius": THIRD} | options
    run = system.simulate(until=until, method=METHOD, step=step, **options)
    scale = max(float(run[name].max()) for name in ("energy", "work_loads", "work_drives"))
    assert float(run.energy_defect.max()) <= GAIN * scale
    if options["spectral_radius"] == 1.0:
        assert float(run.energy_defect.min()) >= -GAIN * scale
    return run


def statistics(run: xr.DataTree) -> dict[str, float]:
    return dict(json.loads(run.attrs["statistics"]))


# ------------------------------------------------------------------------------------------------ bounces

SPEED, K = 1.0, 1e4
#: Of a mass of 1 kg on the contact.
CONTACT_TIME = math.pi / math.sqrt(K)


def bar(law: str, damping: float = 0.0, count: int = 1) -> System:
    """A stiff bar of 1 kg that meets a cylinder with its end."""
    nodes, rates = np.zeros((count + 1, 2, 3)), np.zeros((count + 1, 2, 3))
    nodes[:, 0, 1], nodes[:, 1, 1] = np.linspace(1.15, 1.05, count + 1), -1.0
    rates[:, 0, 1] = -SPEED
    return _falling("bar", law, damping, count=count, length=0.1, nodes=nodes, rates=rates)


def point(law: str, damping: float = 0.0, count: int = 2) -> System:
    """A point mass of 0.9 kg on a bar of 0.1 kg along the axis of a cylinder that only the bar's middle meets."""
    nodes, rates = np.zeros((count + 1, 2, 3)), np.zeros((count + 1, 2, 3))
    nodes[:, 0, 1], nodes[:, 0, 2], nodes[:, 1, 2] = 1.05, np.linspace(-0.1, 0.1, count + 1), 1.0
    rates[:, 0, 1] = -SPEED
    given = {"count": count, "length": 0.2, "nodes": nodes, "rates": rates, "density": 50.0, "drum": 0.02}
    system = _falling("bar", law, damping, **given)
    system.add(parts.Point(mass=0.9, at=f"bar[{count // 2}]"), "mass")
    return system


def _falling(name: str, law: str, damping: float, *, count: int, density: float = 1000.0,
             drum: float | None = None, **geometry: Any) -> System:  # fmt: skip
    system = System()
    material = elements.Material(young_modulus=1e9, poisson_ratio=0.0, density=density)
    section = elements.Rectangle(thickness=0.1, width=0.1)
    beam = parts.Beam(section=section, material=material, elements=count, formulation="cable", **geometry)
    system.add(beam, name)
    contact = {"law": law, "stiffness": K, "damping": damping, "points": 1}
    shape = parts.Cylinder(radius=1.0, length=drum)
    system.add(parts.Contact(a=name, b="ground", shape=shape, **contact), "cylinder")
    return system


def restitution(run: xr.DataTree) -> float:
    """Of the momentum across the cylinder; a point held by a joint carries its share in `momentum` of the system."""
    found = run.momentum.values[:, 1]
    return float(-found[-1] / found[0])


def hunt_crossley(damping: float, speed: float = SPEED) -> float:
    """Restitution by x'' = -K x (1 + d x') of 1 kg."""

    def out(t: float, s: Array) -> float:
        return float(s[0])

    out.terminal, out.direction = True, -1.0  # type: ignore[attr-defined]
    found = solve_ivp(
        lambda t, s: [s[1], -K * s[0] * max(1.0 + damping * s[1], 0.0)], (0.0, 1.0), [0.0, speed], "DOP853",
        events=out, rtol=1e-12, atol=1e-14,
    )  # fmt: skip
    return float(-found.y_events[0][0][1] / speed)


@pytest.mark.parametrize("part", [0.1, 0.5, 1.0, 3.0])
@pytest.mark.parametrize("body", [point, bar])
def test_an_elastic_bounce_at_any_step(body: Callable[..., System], part: float) -> None:
    """Law conservative and spectral radius 1: restitution 1, of a point mass and of a bar's end."""
    run = simulated(body("conservative"), 0.4, part * CONTACT_TIME, spectral_radius=1.0)
    assert run["cylinder"].impulse.values[-1] == pytest.approx(2.0 * SPEED, rel=2e-5)
    assert restitution(run) == pytest.approx(1.0, abs=2e-5)  # the rest vibrates


@pytest.mark.parametrize("part", [0.5, 1.0, 3.0])
def test_twenty_elements_bounce_at_a_step_of_a_contact_time(part: float, book: Book) -> None:
    run = simulated(bar("conservative", count=20), 0.4, part * CONTACT_TIME, spectral_radius=1.0)
    book(
        CHAPTER, f"Bounce of 20 elements on end, {part:g} contact times a step", reference="restitution 1",
        source="closed form", error=abs(restitution(run) - 1.0), allowed=2e-5,
    )  # fmt: skip


@pytest.mark.parametrize("share", [0.1, 0.3])
def test_a_damper_beside_the_spring(share: float) -> None:
    """The paper's law: restitution exp(-pi z/sqrt(1 - z^2)) of the share z of critical damping, pulling at the end."""
    run = simulated(point("paper", 2.0 * share * math.sqrt(K)), 0.4, 5e-3 * CONTACT_TIME, spectral_radius=1.0)
    assert restitution(run) == pytest.approx(math.exp(-math.pi * share / math.sqrt(1.0 - share**2)), abs=5e-3)


@pytest.mark.parametrize("part", [0.05, 0.01])
def test_what_the_filter_takes_from_a_bounce(part: float) -> None:
    """At the default spectral radius, 1/3, an elastic bounce loses what the step does not resolve, as its square."""
    run = simulated(bar("conservative"), 0.4, part * CONTACT_TIME)
    assert 1.0 - 0.2 * part**2 < restitution(run) <= 1.0


@pytest.mark.parametrize("step", [5e-3, 2e-2])
def test_the_end_of_a_hinged_bar_bounces(step: float) -> None:
    """A stiff bar that swings on its hinge onto a cylinder swings back at the rate at which it came."""
    rate, n = 1.0, 4
    nodes, rates = np.zeros((n + 1, 2, 3)), np.zeros((n + 1, 2, 3))
    nodes[:, 0, 0], nodes[:, 0, 1], nodes[:, 1, 0] = np.linspace(-1.0, 0.0, n + 1), 0.52, 1.0
    rates[:, 0, 1], rates[:, 1, 1] = -rate * np.linspace(0.0, 1.0, n + 1), -rate
    system = System()
    material = elements.Material(young_modulus=1e10, poisson_ratio=0.0, density=1000.0)
    section = elements.Rectangle(thickness=0.1, width=0.1)
    beam = parts.Beam(
        length=1.0, section=section, material=material, elements=n, formulation="cable", nodes=nodes, rates=rates
    )
    system.add(beam, "bar")
    system.add(parts.Joint(a=(-1.0, 0.52, 0.0), b="bar.root", type="spherical"), "hinge")
    contact = {"law": "conservative", "stiffness": K, "points": 1}
    system.add(parts.Contact(a="bar", b="ground", shape=parts.Cylinder(radius=0.5), **contact), "cylinder")
    run = simulated(system, 0.2, step, spectral_radius=1.0)
    angular = run["bar"].angular_momentum.values  # about the origin; the hinge adds what the momentum carries
    spin = angular[:, 2] - (-1.0 * run["bar"].momentum.values[:, 1] - 0.52 * run["bar"].momentum.values[:, 0])
    assert run["cylinder"].impulse.values[-1] > 0.0
    assert -spin[-1] / spin[0] == pytest.approx(1.0, abs=2e-3)  # the rest vibrates


@pytest.mark.parametrize("damping", [0.1, 0.5, 2.0])
@pytest.mark.parametrize("body", [point, bar])
def test_restitution_of_a_hunt_crossley_contact(body: Callable[..., System], damping: float, book: Book) -> None:
    """A thousand steps in contact: what the first one takes is of the order of the square of their share."""
    exact = hunt_crossley(damping)
    run = simulated(body("hunt-crossley", damping), 0.15, 1e-3 * CONTACT_TIME)
    lost = run.energy_losses.sel(cause="contact").values[-1]
    assert lost == pytest.approx(0.5 * SPEED**2 * (1.0 - exact**2), abs=2e-5)
    book(
        CHAPTER, f"Bounce of a {body.__name__}, hunt-crossley, damping {damping:g} s/m",
        reference=f"restitution {exact:.6f}", source="SciPy DOP853, 1e-12", error=abs(restitution(run) - exact),
        allowed=2e-5,
    )  # fmt: skip


def test_long_steps_make_a_hunt_crossley_bounce_plastic() -> None:
    """Restitution of an undamped contact falls with the step, and never rises above 1."""
    found = [
        restitution(simulated(bar("hunt-crossley"), 0.8, part * CONTACT_TIME, spectral_radius=1.0))
        for part in (0.01, 0.2, 1.0, 3.0)
    ]
    assert np.all(np.diff(found) < 0.0), found
    assert found[0] == pytest.approx(1.0, abs=1e-3)
    assert 0.0 <= found[-1] < 0.3


# ------------------------------------------------------------------------------------------------ cables on drums


def wound(legs: tuple[float, float], radius: float, wrap: float, first: float, count: int, *, strain: float = 0.0,
          sense: float = -1.0) -> Array:  # fmt: skip
    """Nodes of a cable: a straight leg, an arc from the angle `first` on in the sense of winding, a straight leg."""
    arc = radius * wrap
    s = np.linspace(-legs[0], arc + legs[1], count + 1)
    on = np.clip(s, 0.0, arc)
    angle = first + sense * on / radius
    nodes = np.zeros((count + 1, 2, 3))
    along = sense * np.stack([-np.sin(angle), np.cos(angle)], axis=-1)
    nodes[:, 0, :2] = radius * np.stack([np.cos(angle), np.sin(angle)], axis=-1) + (s - on)[:, None] * along
    nodes[:, 1, :2] = (1.0 + strain) * along
    return nodes


def cable(nodes: Array, *, length: float, thickness: float, width: float, modulus: float, density: float,
          **given: Any) -> parts.Beam:  # fmt: skip
    return parts.Beam(
        length=length, section=elements.Rectangle(thickness=thickness, width=width), elements=len(nodes) - 1,
        material=elements.Material(young_modulus=modulus, poisson_ratio=0.0, density=density), formulation="cable",
        nodes=nodes, **given,
    )  # fmt: skip


MU = 0.3


def capstan(rate: float, on: int = 96, off: int = 8) -> System:
    """A thin cable round a quarter of a turning drum, 1 N along -y at its root, its tip held along x alone.

    `on` elements lie on the drum, `off` on each leg, so that nodes stand where the legs begin.
    """
    radius, arc = 0.1, 0.5 * math.pi * 0.1
    tail = arc * off / on
    system = System()
    system.add(parts.RigidBody(motion="driven", rate=rate), "drum")
    given = {"thickness": 1e-6, "width": 1e-2, "modulus": 1e12, "density": 1e3, "mass_damping": 20.0}
    nodes = wound((tail, tail), radius, 0.5 * math.pi, math.pi, on + 2 * off)
    system.add(cable(nodes, length=arc + 2.0 * tail, **given), "cable")
    friction = {"friction": MU, "bristle_stiffness": 1e4, "bristle_damping": 1.0}
    system.add(
        parts.Contact(a="cable", b="drum", shape=parts.Cylinder(radius=radius), stiffness=1e6, damping=1.0, **friction),
        "contact",
    )
    system.add(parts.Load(at="cable.root", force=(0.0, -1.0, 0.0), ramp=0.05), "load")
    hold = parts.Joint(
        a="ground", b="cable.tip", type="point-on-line", drive=parts.ConstantDrive(rate=0.0), axis=(1.0, 0.0, 0.0)
    )
    system.add(hold, "hand")
    return system


@pytest.mark.slow
@pytest.mark.parametrize("rate", [0.5, -0.5])
def test_capstan(rate: float, book: Book) -> None:
    """The cable rests and the drum slips under all of it: T2 = T1 e^(+- mu beta), beta exactly a quarter of a turn."""
    run = simulated(capstan(rate), 1.0, 2e-3, every=0.1)
    exact = math.exp(math.copysign(MU * 0.5 * math.pi, rate))
    force = np.abs(run["hand"].force.values[5:, 0])
    assert run.energy_losses.sel(cause="friction").values[-1] > 0.0
    book(
        CHAPTER, f"Capstan, drum {'away from' if rate > 0.0 else 'towards'} the load, static limit (96 elements on it)",
        reference="e^(+- mu beta)", source="closed form", error=float(np.abs(force / exact - 1.0).max()), allowed=1e-6,
    )  # fmt: skip


def taut(strain: float, law: str, nodes: Array | None = None) -> tuple[System, float]:
    """A cable taut over half a drum, exactly on it (no gap, no depth), pulled at its ends; and its tension, N."""
    radius, modulus = 0.1, 2e10
    leg = 0.3 * math.pi * radius
    if nodes is None:  # 10 elements lie on the drum, 3 on each leg
        nodes = wound((leg, leg), radius, math.pi, math.pi, 16, strain=strain)
    system = System()
    given = {"thickness": 1e-4, "width": 1e-2, "modulus": modulus, "density": 1500.0}
    system.add(cable(nodes, length=(math.pi * radius + 2.0 * leg) / (1.0 + strain), **given), "cable")
    tension = modulus * 1e-6 * (strain + 0.5 * strain**2) * (1.0 + strain)
    for end in ("root", "tip"):
        system.add(parts.Load(at=f"cable.{end}", force=(0.0, -tension, 0.0)), f"{end}-load")
    contact = {"law": law, "stiffness": 1e5, "initial_overlap": 0.05}
    system.add(parts.Contact(a="cable", b="ground", shape=parts.Cylinder(radius=radius), **contact), "drum")
    return system, tension


@pytest.mark.parametrize("law", ["hunt-crossley", "conservative"])
@pytest.mark.parametrize("step", [2e-3, 1e-3, 1e-4])
def test_a_taut_cable_that_starts_on_the_cylinder(law: str, step: float) -> None:
    """From the first step on the drum carries 2 T: the cable sinks in by the contact's depth, and does not jump."""
    system, tension = taut(1e-3, law)
    run = simulated(system, 0.04, step, every=2e-3)
    depth = tension / 0.1 * (math.pi * 0.1 / 20) / 1e5  # of the pressure T/R on a contact point's share of the length
    force = run["drum"].force.values[:, 1]
    moved = run["cable"].position.values - run["cable"].position.values[0]
    assert force[5:].mean() == pytest.approx(2.0 * tension, rel=0.03)
    assert np.abs(moved).max() < 10.0 * depth
    assert float(run.energy_kinetic.max()) < 2.0 * tension * depth


@pytest.mark.parametrize("step", [2e-3, 1e-4])
def test_a_cable_in_equilibrium_stays_there(step: float) -> None:
    """Contacts that press at t = 0 count in the energy of the first sample, and their forces are those of statics."""
    rest = taut(1e-2, "hunt-crossley")[0].equilibrium()["cable"]
    nodes = np.stack([rest.position.values[-1], rest.slope.values[-1]], axis=1)
    system, tension = taut(1e-2, "hunt-crossley", nodes=nodes)
    run = simulated(system, 40 * step, step, every=step)
    scale = float(run.energy.max())
    assert np.abs(run["drum"].force.values[:, 1] / (2.0 * tension) - 1.0).max() < 1e-6
    assert np.abs(run.energy_defect.values).max() < 1e-9 * scale
    assert run["drum"].energy_elastic.values[0] > 1e-3 * scale


# ------------------------------------------------------------------------------------------------ pulley and peg


@pytest.mark.slow
@pytest.mark.parametrize(("friction", "step"), [(0.8, 1e-3), (0.8, 5e-3), (0.0, 1e-3)])
def test_masses_over_a_pulley(friction: float, step: float, book: Book) -> None:
    """Atwood's machine, the cable's mass included: M x'' = (m1 - m0) g + 2 rho A g x; the pulley turns if it rubs."""
    radius, leg, inertia, masses, line = 0.1, 0.5, 0.01, (1.2, 1.0), 7800.0 * 5e-7
    strain = 2.0 * masses[0] * masses[1] / sum(masses) * G / 1e5
    nodes = wound((leg, leg), radius, math.pi, math.pi, 66, strain=strain)
    length = math.pi * radius + 2.0 * leg
    system = System(gravity=(0.0, -G, 0.0))
    system.add(parts.RigidBody(motion="spin", inertia=inertia), "pulley")
    given = {"thickness": 5e-5, "width": 1e-2, "modulus": 2e11, "density": 7800.0}
    system.add(cable(nodes, length=length / (1.0 + strain), **given), "cable")
    for k, end in enumerate(("root", "tip")):
        system.add(parts.Point(mass=masses[k], position=tuple(nodes[-k, 0])), f"mass-{k}")
        system.add(parts.Joint(a=f"cable.{end}", b=f"mass-{k}"), f"pin-{k}")
    contact = {"stiffness": 1e6, "friction": friction, "bristle_stiffness": 1e5}
    system.add(parts.Contact(a="cable", b="pulley", shape=parts.Cylinder(radius=radius), **contact), "groove")
    run = simulated(system, 0.8, step, every=0.01)
    t = run.time.values
    M = sum(masses) + line * length + (inertia / radius**2 if friction else 0.0)
    b = math.sqrt(2.0 * line * G / M)
    x = (masses[0] - masses[1]) * G / M * (np.cosh(b * t) - 1.0) / b**2
    ways = [run[f"mass-{k}"].position.values[:, 1] - nodes[-k, 0, 1] for k in (0, 1)]
    turned = radius * run["pulley"].angle.values
    error = max(np.abs(ways[0] + x).max(), np.abs(ways[1] - x).max(), np.abs(turned - (x if friction else 0.0)).max())
    book(
        CHAPTER, f"Masses over a pulley, friction {friction:g}, step {1e3 * step:g} ms", reference="Atwood's machine",
        source="closed form", error=float(error / x[-1]), allowed=1e-3, unit="of the way",
    )  # fmt: skip
    # the axle carries no moment: the angular momentum about it is what gravity's moment gives
    moment = -G * sum(masses[k] * run[f"mass-{k}"].position.values[:, 0] for k in (0, 1))
    xs = run["cable"].position.values[:, :, 0]
    moment -= G * line * length * (0.5 * (xs[:, 1:] + xs[:, :-1])).mean(axis=1)
    given_by = np.concatenate([[0.0], np.cumsum(0.5 * (moment[1:] + moment[:-1]) * np.diff(t))])
    angular = run.angular_momentum.values[:, 2]
    assert np.abs(angular - angular[0] - given_by).max() < 1e-3 * np.abs(angular).max()


def wrapping(t: Array) -> Array:
    """Places of the bob on an inextensible string that wraps on a peg: theta'' = (R theta'^2 - g sin theta)/l."""
    R, L = 0.1, 1.0
    found = solve_ivp(
        lambda _, z: [z[1], (R * z[1] ** 2 - G * math.sin(z[0])) / (L - R * z[0])], (0.0, t[-1]), [1.0, 0.0],
        "DOP853", t, rtol=1e-12, atol=1e-13,
    )  # fmt: skip
    theta = found.y[0]
    line = L - R * theta
    return np.stack([-R * np.cos(theta) + line * np.sin(theta), -R * np.sin(theta) - line * np.cos(theta)], axis=-1)


@pytest.mark.slow
def test_a_pendulum_that_wraps_on_a_peg_at_fixed_steps(book: Book) -> None:
    """1 ms steps from the start on, where the string already lies on the peg without a gap."""
    R, L, theta, count = 0.1, 1.0, 1.0, 57
    first = -1.5  # angle theta at which the string would be off the peg
    nodes = wound((0.0, L - R * theta), R, theta - first, math.pi + first, count, sense=1.0)
    system = System(gravity=(0.0, -G, 0.0))
    given = {"thickness": 2e-5, "width": 0.05, "modulus": 4e11, "density": 10.0}
    system.add(cable(nodes, length=L - R * first, **given), "string")
    system.add(parts.Joint(a=tuple(nodes[0, 0]), b="string.root"), "anchor")
    system.add(parts.Point(mass=1.0, position=tuple(nodes[-1, 0])), "bob")
    system.add(parts.Joint(a="string.tip", b="bob"), "pin")
    system.add(parts.Contact(a="string", b="ground", shape=parts.Cylinder(radius=R), stiffness=1e6, points=4), "peg")
    run = simulated(system, 3.0, 1e-3, every=0.025)
    x = wrapping(run.time.values)
    error = np.linalg.norm(run["bob"].position.values[:, :2] - x, axis=1).max()
    assert statistics(run)["steps"] >= 3000
    book(
        CHAPTER, "Pendulum that wraps on a peg, 3 s at steps of 1 ms", reference="equation of one angle",
        source="SciPy DOP853, 1e-12", error=float(error), allowed=1e-3, unit="m",
    )  # fmt: skip


# ------------------------------------------------------------------------------------------------ sticking and slipping


class Slider(NamedTuple):
    """A mass on top of a turning drum, held by a spring and shaken along it.

    Attributes
    ----------
    radius, speed : m and m/s, of the drum's surface; spring : N/m; shaken : N, at 2 Hz
    """

    radius: float = 0.5
    speed: float = 0.1
    spring: float = 200.0
    shaken: float = 0.0
    mass: float = 1.0
    contact: float = 1e5
    bristle: float = 1e5

    @property
    def height(self) -> float:
        """Of the mass above the axis, at rest, m."""
        return self.radius - self.mass * G / self.contact

    def system(self) -> System:
        """The mass on the middle of a light stiff bar along the axis, which alone touches."""
        system, w, length = System(gravity=(0.0, -G, 0.0)), 0.1, 0.2
        system.add(parts.RigidBody(motion="driven", rate=-self.speed / self.radius), "drum")
        material = elements.Material(young_modulus=1e9, poisson_ratio=0.0, density=0.1 * self.mass / (w * w * length))
        start = {"position": (0.0, self.height, -0.5 * length), "direction": (0.0, 0.0, 1.0)}
        section = elements.Rectangle(thickness=w, width=w)
        system.add(
            parts.Beam(length=length, section=section, material=material, elements=2, formulation="cable", **start),
            "bar",
        )
        contact = {"law": "conservative", "stiffness": self.contact, "points": 1}
        friction = {"friction": MU, "bristle_stiffness": self.bristle}
        shape = parts.Cylinder(radius=self.radius, length=0.5 * length)
        system.add(parts.Contact(a="bar", b="drum", shape=shape, **contact, **friction), "contact")
        system.add(parts.Point(mass=0.9 * self.mass, at="bar[1]"), "mass")
        system.add(parts.Spring(a=(-1.0, self.height, 0.0), b="mass", length=1.0, stiffness=self.spring), "spring")
        if self.shaken:
            profile = {"sine": {"amplitude": self.shaken, "frequency": 2.0}}
            system.add(parts.Load(at="mass", direction=(1.0, 0.0, 0.0), profile=profile), "shaker")
        return system

    def _rates(self, t: float, z: Array, u: float) -> tuple[float, list[float]]:
        """Normal force and rates of (distance from the axis, its rate, angle from the top, its rate) at a bristle u."""
        r, dr, a, da = z[:4]
        normal = max(self.contact * (self.radius - r), 0.0)
        x = np.array([r * math.sin(a) + 1.0, r * math.cos(a) - self.height])
        length = float(np.hypot(*x))
        pull = -self.spring * (length - 1.0) / length * x
        pull[0] += self.shaken * math.sin(4.0 * math.pi * t)
        pull[1] -= self.mass * G
        out = (normal + pull @ [math.sin(a), math.cos(a)]) / self.mass + r * da * da
        across = (pull @ [math.cos(a), -math.sin(a)] - self.bristle * u) / self.mass - 2.0 * dr * da
        return normal, [dr, float(out), da, float(across / r)]

    def phases(self, t: Array) -> Iterator[tuple[bool, Array, Array]]:
        """Whether it slips, samples in the phase, and states there (as above, and the bristle)."""
        z, now, slips, sign = np.array([self.height, 0.0, 0.0, 0.0, 0.0]), 0.0, False, 1.0

        def limit(z: Array) -> float:
            return MU * max(self.contact * (self.radius - z[0]), 0.0) / self.bristle

        def sliding(z: Array) -> float:
            return float(z[0] * z[3] - z[0] * self.speed / self.radius)

        def rates(time: float, z: Array) -> list[float]:
            if slips:
                return [*self._rates(time, z, sign * limit(z))[1], 0.0]
            return [*self._rates(time, z, z[4])[1], sliding(z)]

        def ends(_: float, z: Array) -> float:
            """Rate of slip, or what the bristle lacks of its limit."""
            if slips:
                return sign * sliding(z) + MU * self.contact / self.bristle * z[1]
            return limit(z) - abs(z[4])

        ends.terminal, ends.direction = True, -1.0  # type: ignore[attr-defined]
        while now < t[-1]:
            found = solve_ivp(
                rates, (now, t[-1]), z, "DOP853", events=ends, rtol=1e-9, atol=1e-12, dense_output=True, max_step=0.01
            )
            inside = (t >= now) & (t <= found.t[-1])
            yield slips, inside, found.sol(t[inside]).T if inside.any() else np.zeros((0, 5))
            now, z = float(found.t[-1]), found.y[:, -1].copy()
            sign = math.copysign(1.0, z[4]) if not slips else sign
            z[4] = sign * limit(z)
            slips = not slips


@pytest.mark.slow
@pytest.mark.parametrize("shaken", [0.0, 2.0])
@pytest.mark.parametrize("rho", [THIRD, 1.0])
def test_stick_and_slip(shaken: float, rho: float, book: Book) -> None:
    """Carried by the drum until the spring pulls it off, it swings and sticks again; shaken, in each period."""
    slider = Slider(shaken=shaken)
    run = simulated(slider.system(), 3.0, 5e-4, every=5e-3, spectral_radius=rho)
    t = run.time.values
    x, slipping = np.full(t.size, np.nan), np.zeros(t.size, dtype=bool)
    for slips, inside, z in slider.phases(t):
        x[inside], slipping[inside] = z[:, 0] * np.sin(z[:, 2]), slips
    assert 0.05 < slipping[t > 2.0].mean()  # of the last periods
    taken, done = float(run.energy_losses.sel(cause="friction")[-1]), float(run.work_drives[-1] + run.work_loads[-1])
    assert taken == pytest.approx(done - float(run.energy[-1] - run.energy[0]), rel=1e-3)
    assert 0.0 < taken < 1.2 * MU * slider.mass * G * slider.speed * t[-1]
    name = "shaken" if shaken else "left alone"
    book(
        CHAPTER, f"Stick and slip of a mass on a turning drum, {name}, spectral radius {rho:.2g}",
        reference="sticking and slipping in turn", source="SciPy DOP853, 1e-9",
        error=float(np.abs(run["mass"].position.values[:, 0] - x).max() / np.abs(x).max()), allowed=1e-2,
        unit="of the travel",
    )  # fmt: skip


# ------------------------------------------------------------------------------------------------ wrapped rib


def rib(name: str, **changes: Any) -> tuple[Any, System]:
    case = cases.load(name, changes)
    return case, cases.system("wrapped-rib").build(case)


@pytest.mark.slow
@pytest.mark.parametrize(("step", "until"), [(0.5, 1000.0), (0.1, 60.0), (0.02, 30.0)])
def test_a_held_rib_presses_as_its_tension_does(step: float, until: float, book: Book) -> None:
    """T L/(2 R^2) of a wound rib that does not stretch, T = 0.2 N m; it rests to the end."""
    case, system = rib("wrapped-rib-hold")
    run = simulated(system, until, step, every=0.1 * until)
    force, exact = run["contact-1"].normal_force.values, closed_forms.wound_contact_force(case.strip, 0.2)
    places = run["rib-1"].position.values
    late = run.time.values >= 0.5 * until
    assert np.abs(places[late] - places[-1]).max() < 1e-4
    if until > 500.0:
        assert np.ptp(force[late]) < 1e-5 * exact
        assert np.abs(places[late] - places[-1]).max() < 1e-6
    book(
        CHAPTER, f"Wound rib held by 0.2 N m, step {step:g} s, {until:g} s", reference="contact force T L/(2 R^2)",
        source="closed form", error=float(np.abs(force[late] / exact - 1.0).max()), allowed=3e-3,
    )  # fmt: skip


@pytest.mark.slow
def test_a_rib_springs_open(book: Book) -> None:
    """2000 s of the built-in deployment at a tolerance of 1e-3: energy falls by less than 0.8 %."""
    case, system = rib("wrapped-rib-deploy")
    run = simulated(system, 2000.0, None, tolerance=1e-3, every=50.0)
    energy = run.energy.values
    assert 0.0 <= 1.0 - energy[-1] / energy[0] < 8e-3
    radius = float(np.linalg.norm(run["rib-1"].position.values[-1, -1]))
    exact = float(closed_forms.deployed_tip_radius(case.strip, 2000.0))
    book(
        CHAPTER, "Rib springs off its hub, 2000 s, tolerance 1e-3", reference="tip radius r^2 = R^2 + 2 v R t",
        source="closed form of a long tail", error=abs(radius / exact - 1.0), allowed=0.03,
    )  # fmt: skip
