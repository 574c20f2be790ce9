"""Viscoelastic cables: moments that are held, sets that stay, creep, motion through straight, balances, modes."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from book import Book
from evolvent import System, elements, parts
from evolvent.elements.viscoelastic import Viscoelastic
from evolvent.families.relaxation.family import set_of
from evolvent.solvers.static.storage import store
from evolvent_base.errors import InputError
from viscoelastic.test_modes import cubic

CHAPTER = "Relaxation and storage"
#: Three-element law of the closed forms: E_inf = 0.4, E_1 = 0.6, tau = 1 s.
LAW = {"prony": [(0.6, 1.0)]}
TWO = {"prony": [(0.3, 0.05), (0.3, 1.0)]}
SECTION = elements.Circle(radius=0.005)


def material(law: Any, modulus: float = 1e9) -> Any:
    return elements.Material(young_modulus=modulus, density=1000.0, viscoelastic=law)


def bow(law: Any, *, curvature: float = 1.0, modulus: float = 1e9, until: float | None = None, **keys: Any) -> System:
    """A cable of 1 m bent to a curvature, its ends clamped, that of the tip until a time; free where that is 0."""
    angle = np.linspace(0.0, curvature, 5)
    x = np.stack([np.sin(angle), 1.0 - np.cos(angle), 0.0 * angle], axis=1) / curvature
    nodes = np.stack([x, np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1)], axis=1)
    keys = {"section": SECTION, "formulation": "cable", "rest": "start"} | keys
    system = System()
    system.add(parts.Beam(length=1.0, elements=4, material=material(law, modulus), nodes=nodes.tolist(), **keys), "bow")
    if until != 0.0:
        system.add(parts.Joint(a="ground", b="bow.root", type="clamp"), "root")
        system.add(parts.Joint(a="ground", b="bow.tip", type="clamp", until=until), "tip")
    return system


def straight(law: Any, modulus: float = 1e9) -> parts.Beam:
    return parts.Beam(length=1.0, elements=4, section=SECTION, material=material(law, modulus), formulation="cable")


def kept(model: Any) -> np.ndarray:
    """Curvatures that stay just after a release, at the points of all elements."""
    return np.concatenate([set_of(model, row, 4)[:2] / row["radii"] for row in model.bend_relaxations])


def test_a_held_bow_relaxes_and_keeps_curvature_which_decays(book: Book) -> None:
    fresh, aged = bow(LAW).equilibrium(), bow(LAW)
    aged.sections["store"] = {"time": 10.0}
    moments = [run["bow"].bending_moment.values[-1] for run in (fresh, aged.equilibrium())]
    left = 0.4 + 0.6 * math.exp(-10.0)
    assert left == pytest.approx(0.4000272, abs=5e-8)
    book(
        CHAPTER, "Cable bent and held for 10 tau: moment", reference="0.4000272 of the first", allowed=1e-9,
        source="closed form, E_inf 0.4, E_1 0.6", error=np.max(np.abs(moments[1] / (left * moments[0]) - 1.0)),
    )  # fmt: skip
    held = store(bow(LAW, curvature=0.25).assemble(), 10.0).assembly
    bent = held.model.branch_strains["x"][np.add.outer(held.model.bend_relaxations["branch"], [0, 1])].ravel()
    assert bent == pytest.approx(np.full(8, 0.25 * 0.0025), rel=1e-3)
    assert kept(held.model) * 0.0025 / bent == pytest.approx(np.full(8, 0.6 * (1.0 - math.exp(-10.0))), rel=1e-9)
    held.model.constraints["until"] = np.where([name == "tip" for name in held.row_parts], -1.0, np.inf)
    free = store(held, 3.0, tolerance=1e-7, most_moved=1.0).assembly.model
    now = free.branch_strains["x"][np.add.outer(free.bend_relaxations["branch"], [0, 1])].ravel()
    book(
        CHAPTER, "Cable held for 10 tau and released, 3 tau later: curvature", reference="0.5999728 exp(-0.4 t/tau)",
        source="closed form, rate E_inf/(E_0 tau)", allowed=1e-6,
        error=np.max(np.abs(now / (bent * 0.6 * (1.0 - math.exp(-10.0)) * math.exp(-1.2)) - 1.0)),
    )  # fmt: skip


def test_storage_states_the_curvature_that_stays() -> None:
    system = bow(LAW, until=1.0)
    system.sections["store"] = {"time": 10.0}
    (part, words, value, unit), *_ = system.storage(motion=False).sets
    assert (part, words, unit) == ("bow", "largest curvature", "1/m")
    assert value == pytest.approx(0.5999728, rel=1e-3)


def test_a_cable_creeps_under_a_constant_load(book: Book) -> None:
    system = System()
    system.add(straight(LAW), "cable")
    system.add(parts.Joint(a="ground", b="cable.root", type="clamp"), "root")
    force = 1e-6 * 1e9 * math.pi * SECTION.radius**2
    system.add(parts.Load(at="cable.tip", direction=(1, 0, 0), profile={"constant": force}), "pull")
    found = store(system.assemble(), 20.0)
    tip = int(found.assembly.model.beams["iq"][0]) + 24
    strain = found.solution.y[:, tip] - 1.0
    exact = 1e-6 * (1.0 - 0.6 * np.exp(-0.4 * found.times)) / 0.4
    book(
        CHAPTER, "Cable under a constant load for 20 relaxation times: creep", source="closed form",
        reference="(1 - 0.6 exp(-0.4 t/tau))/0.4", error=np.max(np.abs(strain / exact - 1.0)), allowed=1e-5,
    )  # fmt: skip


def swung(method: str, step: float) -> tuple[float, Any]:
    """A soft cantilever, relaxed by half while it was bent, swings through straight and back."""
    system = bow(TWO, curvature=0.4, modulus=2e6, until=0.5)
    run = system.simulate(until=3.5, every=3.5, fine=False, method=method, step=step, spectral_radius=1.0)
    return float(run["bow"].position.values[-1, -1, 1]), run


@pytest.mark.parametrize("method", ["generalized-alpha", "energy-momentum"])
def test_motion_through_straight_is_of_second_order(method: str) -> None:
    found = [swung(method, step) for step in (0.01, 0.005, 0.0025)]
    places = [place for place, _ in found]
    assert math.log2((places[0] - places[1]) / (places[1] - places[2])) == pytest.approx(2.0, abs=0.2)
    run = found[-1][1]
    first, allowed = float(run.energy.values[0]), {"generalized-alpha": 1e-3, "energy-momentum": 1e-10}[method]
    assert abs(float(run.energy_defect.values[-1])) < allowed * first
    assert float(run.energy_dissipated.values[-1]) > 0.1 * first


@pytest.mark.parametrize("step", [0.02, 0.3])
def test_a_free_bow_that_turns_about_all_axes_never_gains_energy(step: float) -> None:
    """Its plane of bending turns with it, and it bends through straight: without any damping but that of the law."""
    system = bow(TWO, until=0.0, modulus=1e7, angular_velocity=(3.0, 2.0, 1.0))
    keys: dict[str, Any] = {"method": "energy-momentum", "step": step, "spectral_radius": 1.0}
    run = system.simulate(until=20 * step, every=step, fine=False, **keys)
    energy = run.energy.values
    assert np.all(np.diff(energy) <= 1e-9 * energy[0])
    assert np.max(np.abs(run.energy_defect.values)) <= 1e-9 * energy[0]
    momentum = run["bow"].momentum.values
    assert np.max(np.abs(momentum - momentum[0])) <= 1e-12


def test_a_free_bow_in_its_plane_keeps_its_angular_momentum() -> None:
    system = bow(TWO, until=0.0, modulus=1e7, angular_velocity=(0.0, 0.0, 2.0))
    run = system.simulate(until=1.0, every=1.0, fine=False, method="energy-momentum", step=0.02, spectral_radius=1.0)
    turn = run["bow"].angular_momentum.values
    assert np.max(np.abs(turn[-1] - turn[0])) <= 1e-12 * np.max(np.abs(turn))


def test_modes_of_a_cantilever_by_the_cubic_of_each_elastic_one(book: Book) -> None:
    law = Viscoelastic(prony=[(0.3, 0.01), (0.3, 0.5)])
    system = System()
    system.add(straight(law), "cable")
    system.add(parts.Joint(a="ground", b="cable.root", type="clamp"), "root")
    elastic, found = system.modes(count=6), system.modes(count=6, damped=True)
    exact = np.array([cubic(square, law) for square in elastic.square])
    book(
        CHAPTER, "Cable of two terms, clamped: six complex modes (4 elements)", allowed=1e-8,
        reference="poles of each mode's polynomial", source="NumPy, roots",
        error=np.max(np.abs(found.pole / exact - 1.0)),
    )  # fmt: skip


def test_a_relaxed_equilibrium_is_that_of_what_is_left() -> None:
    def sag(law: Any, modulus: float, **keys: Any) -> np.ndarray:
        system = System(gravity=(0.0, -1.0, 0.0))
        system.add(straight(law, modulus), "cable")
        system.add(parts.Joint(a="ground", b="cable.root", type="clamp"), "root")
        return np.asarray(system.equilibrium(**keys)["cable"].position.values[-1])

    assert sag(LAW, 1e9, relaxed=True) == pytest.approx(sag(None, 0.4e9), abs=1e-10)
    assert sag(LAW, 1e9) == pytest.approx(sag(None, 1e9), abs=1e-10)


def test_bending_out_of_a_plane_is_reported() -> None:
    """Not that of a bow which turns as a whole."""
    for law, load, reported in ((LAW, 0.05, True), (LAW, 0.0, False), (None, 0.05, False)):
        system = bow(law, curvature=0.5)
        system.add(parts.Load(at="bow[2]", direction=(0, 0, 1), profile={"constant": load}), "load")
        assert ("leaves its plane" in str(system.equilibrium().attrs)) is reported


@pytest.mark.parametrize(
    ("keys", "sentence"),
    [
        ({"formulation": "cable_stretch"}, r"bow\.formulation is 'cable_stretch', whose relaxation is not implemented"),
        ({"damping": "paper", "stiffness_damping": 0.1}, r"bow\.damping is 'paper'; use 'objective'"),
    ],
)
def test_what_cannot_relax_is_refused(keys: dict[str, Any], sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        bow(LAW, **keys).assemble()


def test_explicit_methods_are_refused() -> None:
    with pytest.raises(InputError, match=r"viscoelastic cable, which rk4, heun and dopri5 do not support"):
        bow(LAW).simulate(until=0.1, method="rk4")
