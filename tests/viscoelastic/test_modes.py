"""Equilibria at once, after all relaxation and after a history; modes by the law at each of them."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
import scipy

from book import Book
from evolvent import System, cases, elements, parts
from evolvent.algebra.eigenproblem import Eigenproblem
from evolvent.algebra.relaxation import RelaxingProblem
from evolvent.elements.viscoelastic import Viscoelastic
from evolvent.solvers.static.static import solve_static
from evolvent_base.errors import InputError

CHAPTER = "Relaxation and storage"
LAW = Viscoelastic(prony=[(0.6, 1.0)])
WEIGHT, STIFFNESS, LENGTH = 10.0, 100.0, 1.0


def mass_on_spring(law: Any, *, damping: float = 0.0, store: Any = None) -> System:
    """A mass of 1 kg that hangs along x from a spring, which is its only freedom; g = 10 m/s2."""
    system = System(gravity=(WEIGHT, 0.0, 0.0), sections={} if store is None else {"store": store})
    system.add(parts.RigidBody(mass=1.0, inertia=(1.0, 1.0, 1.0), position=(LENGTH, 0, 0)), "mass")
    system.add(parts.Joint(a="ground", b="mass", type="prismatic", axis=(1, 0, 0), position=(LENGTH, 0, 0)), "guide")
    spring = parts.Spring(
        a=(0.0, 0, 0), b="mass", stiffness=STIFFNESS, damping=damping, length=LENGTH, viscoelastic=law
    )
    system.add(spring, "spring")
    return system


def cantilever(law: Any, *, load: float = 0.0, pull: float = 0.0, elements_: int = 4, modulus: float = 1e9) -> System:
    system = System()
    material = elements.Material(young_modulus=modulus, density=1000.0, viscoelastic=law)
    section = elements.Circle(radius=0.01)
    system.add(parts.Rod(length=1.0, elements=elements_, section=section, material=material), "rod")
    system.add(parts.Joint(a="ground", b="rod.root", type="clamp"), "root")
    if load:
        system.add(parts.Load(at="rod.tip", direction=(0, 1, 0), profile={"constant": load}), "load")
    if pull:
        system.add(parts.Load(at="rod.tip", direction=(1, 0, 0), profile={"constant": pull}), "pull")
    return system


def poles_of(square: float, law: Viscoelastic, motion: Any) -> np.ndarray:
    """Zeros of motion(s) + square E*(s), by the polynomial."""
    whole = np.polynomial.Polynomial(motion) + square * law.left
    factors = [np.polynomial.Polynomial([1.0, time]) for _, time in law.terms]
    total = whole * math.prod(factors)
    for i, (share, time) in enumerate(law.terms):
        others = math.prod(one for j, one in enumerate(factors) if j != i)
        total = total + np.polynomial.Polynomial([0.0, square * share * time]) * others
    return np.asarray(total.roots(), dtype=complex)


def cubic(square: float, law: Viscoelastic = LAW, damping: float = 0.0) -> complex:
    """Pole of s^2 + c s + square E*(s) above the real axis."""
    poles = poles_of(square, law, [0.0, damping, 1.0])
    (found,) = poles[poles.imag > 0.0]
    return complex(found)


def test_equilibria_of_a_spring_at_once_and_after_all_relaxation() -> None:
    at_once = mass_on_spring(LAW).equilibrium()
    relaxed = mass_on_spring(LAW).equilibrium(relaxed=True)
    for run, stiffness in ((at_once, STIFFNESS), (relaxed, LAW.left * STIFFNESS)):
        assert float(run["spring"].extension.values[-1]) == pytest.approx(WEIGHT / stiffness, rel=1e-12)
        assert float(run["spring"].force.values[-1]) == pytest.approx(WEIGHT, rel=1e-12)
    energy = 0.5 * LAW.left * STIFFNESS * (WEIGHT / (LAW.left * STIFFNESS)) ** 2
    assert float(relaxed["spring"].energy_elastic.values[-1]) == pytest.approx(energy, rel=1e-12)


def test_an_equilibrium_after_a_history(book: Book) -> None:
    """Held for tau at the extension x0: what is kept at the release is (1 - 1/e) g x0, and the weight comes on it."""
    held = mass_on_spring(LAW, store={"time": 1.0})
    held.replace("mass", parts.RigidBody(mass=1.0, inertia=(1.0, 1.0, 1.0), position=(LENGTH + 0.2, 0, 0)))
    place = (LENGTH + 0.2, 0, 0)
    held.replace("guide", parts.Joint(a="ground", b="mass", type="prismatic", axis=(1, 0, 0), position=place))
    held.add(parts.Joint(a="ground", b="mass", type="clamp", position=place, until=0.5), "hold")
    kept = 0.6 * (1.0 - math.exp(-1.0)) * 0.2
    run = held.equilibrium(time=1.0)
    book(
        CHAPTER, "Spring held for one relaxation time, then loaded at once: extension", source="closed form",
        reference="m g/k + x0 E_1 (1 - 1/e)", allowed=1e-9,
        error=abs(float(run["spring"].extension.values[-1]) / (WEIGHT / STIFFNESS + kept) - 1.0),
    )  # fmt: skip
    run = held.equilibrium(time=1.0, relaxed=True)  # forgets the history
    assert float(run["spring"].extension.values[-1]) == pytest.approx(WEIGHT / (0.4 * STIFFNESS), rel=1e-10)


def test_equilibria_of_a_rod() -> None:
    for relaxed, modulus in ((False, 1e9), (True, 0.4e9)):
        found = solve_static(cantilever(LAW, load=1.0).assemble(), relaxed=relaxed)
        elastic = solve_static(cantilever(None, load=1.0, modulus=modulus).assemble()).y[-1]
        n_q = int(found.assembly.model.info.nq)
        assert found.success
        assert found.y[-1, :n_q] == pytest.approx(elastic[:n_q], abs=1e-8)


def test_relaxed_is_a_key_of_a_case() -> None:
    content = {
        "system": "structure",
        "gravity": [WEIGHT, 0, 0],
        "parts": {
            "mass": {"kind": "point", "mass": "1 kg", "position": [1, 0, 0]},
            "spring": {"kind": "spring", "a": [0, 0, 0], "b": "mass", "stiffness": "100 N/m", "length": "1 m",
                       "viscoelastic": {"prony": [[0.6, "1 h"]]}},
        },
        "equilibrium": {"relaxed": True},
    }  # fmt: skip
    case = cases.load(content)
    run = cases.system("structure").equilibrium(case)
    assert float(run["spring"].extension.values[-1]) == pytest.approx(WEIGHT / 40.0, rel=1e-9)
    assert cases.system("structure").system(case).sections["equilibrium"] == {"relaxed": True}


def test_relaxed_without_viscoelastic_parts_is_refused() -> None:
    for analysis in ("equilibrium", "modes"):
        with pytest.raises(InputError, match=r"`relaxed` has no effect: no part is viscoelastic"):
            getattr(mass_on_spring(None), analysis)(relaxed=True)


@pytest.mark.parametrize("tau", [1e-3, 0.1, 1.0, 1e6])
@pytest.mark.parametrize("damping", [0.0, 0.5])
def test_a_pole_of_the_cubic(tau: float, damping: float) -> None:
    law = Viscoelastic(prony=[(0.6, tau)])
    found = mass_on_spring(law, damping=damping).modes(damped=True)
    exact = cubic(STIFFNESS, law, damping)
    assert found.pole.size == 1
    assert abs(found.pole[0] - exact) < 1e-10 * abs(exact)
    assert found.frequency[0] == found.pole[0].imag
    assert found.damping_ratio[0] == pytest.approx(-exact.real / abs(exact), rel=1e-6)
    assert "by their law at the pole" in str(found)


def test_a_law_of_several_terms(book: Book) -> None:
    law = Viscoelastic(prony=[(0.2, 1e-2), (0.3, 0.2), (0.3, 3.0), (0.1, 1e5)])
    found, exact = mass_on_spring(law).modes(damped=True).pole, cubic(STIFFNESS, law)
    book(
        CHAPTER, "Mass on a spring of four terms: complex mode", reference="poles of s^2 m + k E*(s)",
        source="NumPy, roots", error=abs(found[0] / exact - 1.0), allowed=1e-9,
    )  # fmt: skip


def test_undamped_modes_have_the_instantaneous_stiffness_and_say_so() -> None:
    found = mass_on_spring(LAW).modes()
    assert found.pole[0] == pytest.approx(math.sqrt(STIFFNESS) * 1j, rel=1e-10)
    assert "instantaneous stiffness" in str(found)
    assert "instantaneous stiffness" in found.to_dataset().attrs["note"]
    assert mass_on_spring(None).modes().note == ""


def test_a_motion_that_does_not_oscillate_is_left_out() -> None:
    law = Viscoelastic(prony=[(0.99, 0.025)])  # all zeros of the cubic are real
    found = mass_on_spring(law).modes(damped=True)
    assert found.pole.size == 0
    assert "left out" in found.note


def test_modes_of_a_cantilever_by_the_cubic_of_each_elastic_one(book: Book) -> None:
    """All strains relax alike: the shapes are the elastic ones, each with the pole of its own cubic."""
    law = Viscoelastic(prony=[(0.3, 0.01), (0.3, 0.5)])
    system = cantilever(law)
    elastic, found = system.modes(count=6), system.modes(count=6, damped=True)
    exact = np.array([cubic(square, law) for square in elastic.square])
    book(
        CHAPTER, "Cantilever of two terms: six complex modes (4 elements)", reference="poles of each mode's polynomial",
        source="NumPy, roots", error=np.max(np.abs(found.pole / exact - 1.0)), allowed=1e-8,
    )  # fmt: skip
    alike = np.abs(np.einsum("ij,ij->i", found.shape.conj(), (found.M @ elastic.shape.T).T))
    assert alike == pytest.approx(np.ones(6), abs=1e-6)  # bends in the same planes


def test_the_first_mode_of_a_cantilever_by_its_dynamic_modulus(book: Book) -> None:
    """w^2 = 1.8751^4 E*(s) I/(rho A L^4) of a thin beam, of which four elements are within 0.2 %."""
    law = Viscoelastic(prony=[(0.3, 0.01), (0.3, 0.5)])
    s = complex(cantilever(law, elements_=8).modes(count=1, damped=True).pole[0])
    square = 1.875104068711961**4 * 1e9 * 0.25 * 0.01**2 / 1000.0
    book(
        CHAPTER, "Cantilever of two terms: square of the first complex frequency (8 elements)",
        reference="1.875104^4 E*(s) I/(rho A L^4)", source="closed form, thin beam", allowed=4e-3,
        error=abs(-s * s / (square * complex(law.dynamic_modulus(np.array(s)))) - 1.0),
    )  # fmt: skip


def test_laws_that_differ_change_shapes(book: Book) -> None:
    """Two masses in series on springs with laws of their own, of which the second relaxes nearly whole."""
    laws = [Viscoelastic(prony=[(0.2, 0.05)]), Viscoelastic(prony=[(0.9, 0.3), (0.05, 2.0)])]
    stiffness, mass = (100.0, 80.0), (1.0, 0.5)
    system, before = System(), "ground"
    for k in (0, 1):
        place = (LENGTH * (k + 1), 0.0, 0.0)
        system.add(parts.RigidBody(mass=mass[k], inertia=(1.0, 1.0, 1.0), position=place), f"mass {k}")
        system.add(
            parts.Joint(a="ground", b=f"mass {k}", type="prismatic", axis=(1, 0, 0), position=place), f"guide {k}"
        )
        start = (0.0, 0, 0) if k == 0 else before
        spring = parts.Spring(a=start, b=f"mass {k}", stiffness=stiffness[k], length=LENGTH, viscoelastic=laws[k])
        system.add(spring, f"spring {k}")
        before = f"mass {k}"
    # states: displacements, velocities, strains of the dashpots of all branches
    rows = np.array([[1.0, 0.0], [-1.0, 1.0]])  # extensions
    branches = [(k, share, time) for k, law in enumerate(laws) for share, time in law.terms]
    n = 4 + len(branches)
    A = np.zeros((n, n))
    A[:2, 2:4] = np.eye(2)
    A[2:4, :2] = -(rows.T * stiffness) @ rows / np.array(mass)[:, None]
    for i, (k, share, time) in enumerate(branches):
        A[2:4, 4 + i] = share * stiffness[k] * rows[k] / mass
        A[4 + i, :2], A[4 + i, 4 + i] = rows[k] / time, -1.0 / time
    exact = np.linalg.eigvals(A)
    exact = exact[exact.imag > 0.0]
    exact = exact[np.argsort(np.abs(exact))]
    found = system.modes(damped=True).pole
    assert found.size == exact.size == 2
    book(
        CHAPTER, "Two masses on springs of two laws: complex modes", reference="eigenvalues with dashpots as states",
        source="NumPy, eigvals", error=np.max(np.abs(found / exact - 1.0)), allowed=1e-9,
    )  # fmt: skip


@pytest.mark.parametrize("state", ["at once", "stored", "relaxed"])
def test_tension_does_not_relax_with_the_vibration(state: str) -> None:
    """A pendulum on a spring: across it g/l of its length at rest, without loss; along it the cubic."""
    sections = {"store": {"time": 2.0}} if state == "stored" else {}
    system = System(gravity=(WEIGHT, 0.0, 0.0), sections=sections)
    system.add(parts.Point(mass=1.0, position=(LENGTH, 0, 0)), "mass")
    spring = parts.Spring(a=(0.0, 0, 0), b="mass", stiffness=STIFFNESS, length=LENGTH, viscoelastic=LAW)
    system.add(spring, "spring")
    found = system.modes(damped=True, relaxed=state == "relaxed").pole
    crept = {"at once": 1.0, "stored": (1.0 - 0.6 * math.exp(-0.4 * 2.0)) / 0.4, "relaxed": 1.0 / 0.4}
    length = LENGTH + WEIGHT / STIFFNESS * crept[state]
    exact = np.array([1j * math.sqrt(WEIGHT / length)] * 2 + [cubic(STIFFNESS)])
    assert np.all(np.abs(found - exact) < (1e-7 if state == "stored" else 1e-10) * np.abs(exact))
    assert np.all(np.abs(found.real[:2]) < 1e-12)


def test_the_pull_of_a_rod_does_not_relax_with_the_vibration() -> None:
    """s^2 + a + b E*(s) = 0, a by the pull and b by bending, both by elastic rods of nearly the modulus E*(s)."""
    law, pull = Viscoelastic(prony=[(0.6, 0.3)]), 40.0
    found = complex(cantilever(law, pull=pull).modes(count=1, damped=True).pole[0])
    moduli = np.array([1.0, 0.98])
    squares = [cantilever(None, pull=pull, modulus=x * 1e9).modes(count=1).square[0] for x in moduli]
    b, a = np.polyfit(moduli, squares, 1)
    assert 0.3 < a / squares[0] < 0.7
    left = found**2 + a + b * complex(law.dynamic_modulus(np.array(found)))
    assert abs(left) < 1e-2 * abs(found**2 + squares[0])  # the shape changes with the modulus


def test_creep_buckling_grows() -> None:
    """A pendulum on its head, which the hinge's stiffness holds at once, but not after relaxation."""
    system = System(gravity=(0.0, -10.0, 0.0))
    system.add(parts.RigidBody(mass=1.0, inertia=(1.0, 1.0, 1.0), position=(0.0, 1.0, 0.0)), "body")
    system.add(parts.Joint(a="ground", b="body", type="revolute", axis=(0, 0, 1), position=(0, 0, 0)), "pin")
    system.add(parts.JointSpring(joint="pin", stiffness=20.0, viscoelastic=LAW), "spring")
    found = system.modes(damped=True)
    exact = poles_of(10.0, LAW, [-5.0, 0.0, 1.0])
    growth, vibration = exact[(exact.imag == 0.0) & (exact.real > 0.0)], exact[exact.imag > 0.0]
    assert found.pole == pytest.approx(np.concatenate([growth, vibration]), rel=1e-10)
    assert found.unstable.tolist() == [True, False]


def test_a_shaft_with_losses_grows_above_its_critical_speed() -> None:
    """(s + i W)^2 + w^2 E*(s) = 0 of whirl in the frame that turns; the lost rotary inertia of sections is 1e-3."""
    law, speed = Viscoelastic(prony=[(0.2, 0.003), (0.3, 0.1), (0.2, 5.0)]), 20.0
    square = float(cantilever(None).modes(count=1).square[0])
    found = cantilever(law).modes(count=1, damped=True, rotating=(speed, 0.0, 0.0))
    exact = poles_of(square, law, [-(speed**2), 2j * speed, 1.0])
    grows = exact[exact.real > 0.0]
    assert grows.size == 1
    assert found.pole[0] == pytest.approx(complex(grows[0].conj()), rel=1e-3)
    assert found.unstable[0]


def test_no_mode_is_left_out() -> None:
    """Oscillators of 1 to 30 rad/s, coupled, every third of which is left 4 % of its stiffness: others are slowest."""
    n, rng, times = 30, np.random.default_rng(3), (1e-4, 2.0)
    coupling = 0.02 * rng.standard_normal((n, n))
    mix = np.eye(n) + coupling
    squares = np.arange(1.0, n + 1.0) ** 2
    shares = [np.where(np.arange(n) % 3 == 2, 0.96, 0.0), np.where(np.arange(n) % 3 == 1, 0.5, 0.0)]
    K, D = mix.T @ np.diag(squares) @ mix, [mix.T @ np.diag(share * squares) @ mix for share in shares]
    none, one = np.zeros((n, n)), np.eye(n)
    rows = [[none, one, none, none], [-K, none, *D]]
    rows += [[one / t, none, *(-one / t if i == j else none for j in (0, 1))] for i, t in enumerate(times)]
    exact = np.linalg.eigvals(np.block(rows))
    exact = exact[exact.imag > 0.1 * np.abs(exact)]
    exact = exact[np.argsort(np.abs(exact))]
    M, C, G = scipy.sparse.eye(n), scipy.sparse.csr_matrix((n, n)), scipy.sparse.csr_matrix((0, n))
    problem = Eigenproblem(M, C, scipy.sparse.csr_matrix(K), G, np.ones(n), conservative=True)
    parts_ = [scipy.sparse.csr_matrix(one) for one in D]
    pole, shape = RelaxingProblem(problem, times, parts_, 0.04, lambda _, shape: shape).solve(5)
    assert np.all(np.abs(pole - exact[:5]) < 1e-9 * np.abs(pole))
    for s, u in zip(pole, shape, strict=True):
        stiffness = K - sum(one / (1.0 + s * t) for one, t in zip(D, times, strict=True))
        assert np.linalg.norm((s * s * np.eye(n) + stiffness) @ u) < 1e-9 * np.linalg.norm(K @ u)


def test_a_free_rod_has_its_rigid_motions() -> None:
    system = cantilever(LAW, elements_=6)
    system.remove("root")
    elastic, found = system.modes(count=8), system.modes(count=8, damped=True)
    assert np.all(found.pole[:6] == 0.0)
    exact = np.array([cubic(square) for square in elastic.square[6:]])
    assert np.all(np.abs(found.pole[6:] - exact) < 1e-9 * np.abs(exact))


def test_linear_models_and_loops_refuse_viscoelastic_parts() -> None:
    with pytest.raises(InputError, match=r"'spring' is viscoelastic, which linear state-space models do not support"):
        mass_on_spring(LAW).linearize(["mass.force.x"], ["mass.displacement.x"])
    with pytest.raises(InputError, match=r"'spring' is viscoelastic, which modes of a closed loop do not support"):
        mass_on_spring(LAW).loop_modes()
