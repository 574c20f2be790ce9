"""Viscoelastic springs, joint springs and rods in motion: a second implementation, closed forms, energy."""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np
import pytest
import scipy

from book import Book
from evolvent import System, elements, parts
from evolvent.elements.viscoelastic import Viscoelastic
from evolvent.solvers.static.static import solve_static
from evolvent.solvers.static.storage import store
from evolvent_base.errors import InputError
from viscoelastic_rods import bent_rod

CHAPTER = "Relaxation and storage"
PRONY = [(0.3, 0.5), (0.3, 5.0)]
STIFFNESS, LENGTH, START, END = 100.0, 1.0, 0.1, 1.0


def oscillator(law: Any = None) -> System:
    system = System()
    system.add(parts.Point(mass=1.0, position=(LENGTH + START, 0, 0)), "mass")
    law = {"prony": PRONY} if law is None else law
    system.add(parts.Spring(a=(0.0, 0, 0), b="mass", stiffness=STIFFNESS, length=LENGTH, viscoelastic=law), "spring")
    return system


def hinge() -> System:
    """The same equations in an angle."""
    system = System()
    system.add(parts.RigidBody(mass=1.0, inertia=(1.0, 1.0, 1.0)), "body")
    system.add(parts.Joint(a="ground", b="body", type="revolute", axis=(0, 0, 1), position=(0, 0, 0)), "pin")
    spring = parts.JointSpring(joint="pin", stiffness=STIFFNESS, start=START, viscoelastic={"prony": PRONY})
    system.add(spring, "spring")
    return system


def integrated(until: float) -> float:
    """Displacement by SciPy."""

    def rates(_: float, z: Any) -> list[float]:
        x, v, *w = z
        left = 1.0 - sum(share for share, _ in PRONY)
        force = STIFFNESS * (left * x + sum(share * own for (share, _), own in zip(PRONY, w, strict=True)))
        return [v, -force, *(v - own / time for (_, time), own in zip(PRONY, w, strict=True))]

    found = scipy.integrate.solve_ivp(rates, (0.0, until), [START, 0.0, START, START], rtol=1e-12, atol=1e-14)
    return float(found.y[0, -1])


def moved(system: System, name: str, **options: Any) -> tuple[float, Any]:
    run = system.simulate(until=END, every=END, fine=False, **options)
    if name == "mass":
        return float(run["mass"].position.values[-1, 0]) - LENGTH, run
    return float(run["spring"].angle.values[-1]), run


@pytest.mark.parametrize(("make", "name"), [(oscillator, "mass"), (hinge, "spring")], ids=["spring", "joint spring"])
@pytest.mark.parametrize("method", ["rk4", "dopri5", "generalized-alpha", "energy-momentum"])
def test_motion_is_that_of_a_second_implementation(make: Any, name: str, method: str, book: Book) -> None:
    exact, order = integrated(END), None
    if method == "dopri5":
        x, run = moved(make(), name, method=method, tolerance=1e-10)
        allowed = 1e-8
    elif method == "rk4":
        x, run = moved(make(), name, method=method, step=0.002)
        allowed = 1e-7
    else:
        errors = []
        for step in (0.01, 0.005):
            x, run = moved(make(), name, method=method, step=step, spectral_radius=1.0)
            errors.append(abs(x - exact))
        order, allowed = math.log2(errors[0] / errors[1]), 2e-2
        assert order == pytest.approx(2.0, abs=0.2)
    what = "Point on a spring" if name == "mass" else "Body on a joint spring"
    book(
        CHAPTER, f"{what} of two terms, released ({method})", reference="displacement at 1 s", source="SciPy RK45",
        error=abs(x - exact) / START, allowed=allowed, order=order, wanted="" if order is None else "2",
    )  # fmt: skip
    defect = abs(float(run.energy_defect.values[-1]))
    assert defect < {"rk4": 1e-6, "dopri5": 1e-8, "generalized-alpha": 1e-3, "energy-momentum": 1e-12}[method]
    assert float(run.energy_dissipated.values[-1]) > 0.1


def test_no_step_gains_energy_whatever_its_length() -> None:
    run = oscillator().simulate(until=30.0, every=0.7, fine=False, method="energy-momentum", step=0.7)
    energy = run.energy.values
    assert np.all(np.diff(energy) <= 1e-14 * energy[0])


def test_a_cycle_dissipates_by_the_loss_modulus(book: Book) -> None:
    """A driven angle a (1 - cos(w t)) takes pi E'' a^2 a cycle in the steady state."""
    rate, size = 2.0 * math.pi / 3.0, 0.2
    system = System()
    system.add(parts.RigidBody(mass=1.0, inertia=(1.0, 1.0, 1.0), motion="spin", axis=(0, 0, 1)), "body")
    drive = {"expression": f"{size}*(1 - cos({rate!r}*t))"}
    system.add(parts.Joint(a="ground", b="body", type="revolute", drive=drive), "turn")
    law = Viscoelastic(prony=[(0.5, 0.7)])
    system.add(parts.JointSpring(a="ground", b="body", stiffness=2.0, viscoelastic=law), "spring")
    period = 2.0 * math.pi / rate
    run = system.simulate(
        until=8.0 * period, every=period, fine=False, method="energy-momentum", step=period / 400, spectral_radius=1.0
    )
    lost = np.diff(run.energy_dissipated.values)[-1]
    exact = math.pi * 2.0 * float(law.dynamic_modulus(np.array(1j * rate)).imag) * size**2
    book(
        CHAPTER, "Joint spring driven harmonically: dissipation of a cycle (energy-momentum, 400 steps)",
        reference="pi E'' a^2", source="closed form", error=abs(lost / exact - 1.0), allowed=1e-4,
    )  # fmt: skip


@pytest.mark.parametrize("method", ["generalized-alpha", "energy-momentum"])
def test_a_held_rod_relaxes_by_its_series(method: str, book: Book) -> None:
    law = Viscoelastic(prony=[(0.6, 1.0)])
    run = bent_rod(law).simulate(until=2.0, every=0.5, fine=False, method=method, step=0.05)
    moment = run["rod"].bending_moment_z.values[:, 2]
    book(
        CHAPTER, f"Rod bent and held: moment ({method}, 20 steps a relaxation time)",
        reference="0.4 + 0.6 exp(-t/tau)", source="closed form", allowed=1e-9,
        error=np.max(np.abs(moment / moment[0] / law.modulus(run.time.values) - 1.0)),
    )  # fmt: skip
    # what relaxation dissipates is what the strain energy falls by
    energy = run.energy_elastic.values
    assert float(run.energy_dissipated.values[-1]) == pytest.approx(energy[0] - energy[-1], rel=1e-12)
    assert energy[-1] / energy[0] == pytest.approx(0.4 + 0.6 * math.exp(-2.0 * 2.0), rel=1e-12)


def test_a_loaded_rod_creeps_from_its_stiff_to_its_soft_equilibrium() -> None:
    def cantilever(law: Any, modulus: float = 1e9) -> System:
        system = System()
        material = elements.Material(young_modulus=modulus, density=1000.0, viscoelastic=law)
        section = elements.Circle(radius=0.01)
        system.add(parts.Rod(length=1.0, elements=4, section=section, material=material), "rod")
        system.add(parts.Joint(a="ground", b="rod.root", type="clamp"), "root")
        system.add(parts.Load(at="rod.tip", direction=(0, 1, 0), profile={"constant": 1.0}), "load")
        return system

    found = store(cantilever({"prony": [(0.6, 1.0)]}).assemble(), 100.0, tolerance=1e-4).solution
    n_q = int(found.assembly.model.info.nq)
    for sample, modulus in ((0, 1e9), (-1, 0.4e9)):
        elastic = solve_static(cantilever(None, modulus).assemble()).y[-1]
        assert found.y[sample, :n_q] == pytest.approx(elastic[:n_q], abs=1e-8)


@pytest.mark.parametrize(
    ("law", "sentence"),
    [
        ({"prony": [(0.6, 1.0), (0.5, 2.0)]}, r"the shares of `prony` sum to 1\.1"),
        ({"prony": [(-0.1, 1.0)]}, r"viscoelastic\.prony"),
        ({"prony": []}, r"one or more rows \[share, time\]"),
        ({"prony": [(0.1, 1.0)], "temperature": 300.0}, r"has no effect without `shift`"),
        (
            {"prony": [(0.1, 1.0)], "temperature": 200.0,
             "shift": {"wlf": {"c1": 17.44, "c2": 51.6, "reference": 373.0}}},
            r"temperature is 200 K; the shift of the Prony series holds above 321\.4",
        ),
        (
            {"prony": [(0.1, 1.0)], "shift": {"wlf": {"c1": 17.44, "c2": "51.6 degC", "reference": 373.0}}},
            r"c2 is '51\.6 degC'; .*degC has a zero of its own; write the change in K",
        ),
        (
            {"prony": [(0.1, 1.0)], "shift": {"table": {"rows": [(290.0, 1.0), (300.0, 2.0)]}}},
            r"the decades of its rows must fall",
        ),
    ],
)  # fmt: skip
def test_laws_that_cannot_be_are_refused(law: Any, sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        oscillator(law)


def test_shifts_by_temperature() -> None:
    times = [(0.5, 10.0)]
    wlf = Viscoelastic(prony=times, shift={"wlf": {"c1": 17.44, "c2": 51.6, "reference": 373.15}}, temperature=393.15)
    assert wlf.terms[0][1] == pytest.approx(10.0 * 10.0 ** (-17.44 * 20.0 / 71.6), rel=1e-12)
    shift = {"arrhenius": {"energy": "80 kJ/mol", "reference": "20 degC"}}
    arrhenius = Viscoelastic(prony=times, shift=shift, temperature="60 degC")
    exact = 10.0 * math.exp(80e3 / 8.314462618 * (1.0 / 333.15 - 1.0 / 293.15))
    assert arrhenius.terms[0][1] == pytest.approx(exact, rel=1e-12)
    table = Viscoelastic(prony=times, shift={"table": {"rows": [(280.0, 2.0), (300.0, 0.0), (320.0, -1.0)]}})
    assert [table.factor(T, "T") for T in (290.0, 310.0)] == pytest.approx([10.0, 10.0**-0.5])


def test_what_cannot_relax_is_refused() -> None:
    system = oscillator()
    law = parts.Spring(a=(0.0, 0, 0), b="mass", law="-x", viscoelastic={"prony": PRONY})
    system.replace("spring", law)
    with pytest.raises(InputError, match=r"viscoelastic"):
        system.assemble()
    rod = bent_rod({"prony": PRONY})
    with pytest.raises(InputError, match=r"viscoelastic rod, which rk4, heun and dopri5 do not support"):
        rod.simulate(until=0.1, method="rk4")


def test_relaxed_modulus_and_dynamic_modulus_are_of_one_law() -> None:
    """E* = s times the Laplace transform of E(t)."""
    law = Viscoelastic(prony=[(0.2, 0.1), (0.3, 3.0)])
    for s in (0.3, 2.0):
        by_time = scipy.integrate.quad(
            lambda t, s=s: s * math.exp(-s * t) * float(law.modulus(np.array(t))), 0.0, 200.0
        )
        assert float(law.dynamic_modulus(np.array(s)).real) == pytest.approx(by_time[0], rel=1e-7)
    assert [a < b for a, b in itertools.pairwise(-law.modulus(np.linspace(0.0, 9.0, 5)))] == [True] * 4
