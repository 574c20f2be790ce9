"""Modes against closed forms: beams, strings, bodies on springs, and all of them on something that turns."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.optimize import brentq
from scipy.sparse.linalg import ArpackError

from evolvent import InputError, RunFailed, System, parts
from evolvent.algebra import eigenproblem
from evolvent.algebra.eigenproblem import DENSE
from evolvent.elements import General, Material, Rectangle
from evolvent.solvers.modal.modes import modes
from evolvent.solvers.static.linear_motion import matrices
from evolvent.solvers.static.static import solve_static
from evolvent.solvers.static.work import Work, spin_of
from helpers import stiffness_by_differences
from static.composing import EI, STEEL, beam, solved, tip_force

BAR = Rectangle(thickness=1e-3, width=2e-3)
_P = BAR.properties(0.3)
#: sqrt(EI/(rho A L^4)) of a bar of 1 m.
UNIT = np.sqrt(STEEL.E * _P.Iz / (STEEL.density * _P.area))
FORMS = {
    "clamped": (("clamp",), (3.516015, 22.034492, 61.697214)),
    "pinned": (("spherical", "spherical"), (np.pi**2, 4 * np.pi**2, 9 * np.pi**2)),
    "free": ((), (22.373285, 61.672823)),
}


def across(found, axis: int, name: str = "beam", threshold: float = 0.9) -> np.ndarray:
    """Numbers of the modes whose points move along one axis mainly."""
    places = np.abs(found[name].displacement).max(axis=1)
    return np.flatnonzero(places[:, axis] > threshold * np.linalg.norm(places, axis=1))


# ------------------------------------------------------------------------------------------------ beams


@pytest.mark.parametrize("ends", list(FORMS))
@pytest.mark.parametrize(("formulation", "count"), [("cable", 16), ("cable_stretch", 16), ("assumed_strain", 32)])
def test_bending_frequencies_of_a_beam(formulation, count, ends, book):
    joints, wanted = FORMS[ends]
    found = modes(beam(formulation, count, joints, section=BAR), count=16)
    if formulation == "assumed_strain":
        w = found.frequency[across(found, 1)] / UNIT
    else:  # equally stiff in both planes
        w = found.frequency[found.frequency > 0.0][::2] / UNIT
    w = w[w > 0.0][: len(wanted)]
    assert_allclose(w, wanted, rtol=5e-3 if formulation == "assumed_strain" else 1e-4)
    if ends == "free":
        assert np.sum(found.frequency == 0.0) == (6 if formulation == "assumed_strain" else 5)
    assert np.all(found.decay_rate == 0.0)
    numbers = ", ".join(f"{x:.6g}" for x in wanted)
    book(
        "Modes", f"Beam, {ends}: {len(wanted)} frequencies ({formulation}, {count} elements)",
        reference=f"{numbers} sqrt(EI/m L^4)", source="closed form", error=np.abs(w / wanted - 1.0).max(),
        allowed=5e-3 if formulation == "assumed_strain" else 1e-4,
    )  # fmt: skip


def test_frequencies_converge_with_the_square_of_the_elements(book):
    errors = [
        modes(beam("assumed_strain", n, section=BAR), count=1).frequency[0] / UNIT / 3.516015 - 1.0 for n in (4, 8, 16)
    ]
    assert_allclose(np.log2(np.array(errors[:-1]) / errors[1:]), 2.0, atol=0.15)
    book(
        "Modes", "Cantilever, first frequency (assumed_strain, 16 elements)", reference="3.516015 sqrt(EI/m L^4)",
        source="closed form", error=abs(errors[-1]), allowed=2e-3, order=np.log2(errors[1] / errors[2]), wanted="2",
    )  # fmt: skip


@pytest.mark.slow
def test_dense_algebra_takes_over_where_a_krylov_method_fails(monkeypatch):
    system = System()
    system.add(parts.Rod(length=1.0, section=BAR, material=STEEL, elements=DENSE // 6 + 2), "bar")
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="bar.root", type="clamp"))
    wanted = system.modes(count=4).frequency

    def fails(*_, **__):
        raise ArpackError(3)

    monkeypatch.setattr(eigenproblem.scipy.sparse.linalg, "eigsh", fails)
    assert_allclose(system.modes(count=4).frequency, wanted, rtol=1e-6)
    monkeypatch.setattr(eigenproblem, "MOST_DENSE", DENSE)
    with pytest.raises(InputError, match="lost in round-off"):
        system.modes(count=4)


def test_modes_are_orthogonal_and_their_multiple_frequencies_complete():
    # eight bars, all alike: every frequency 16-fold; sparse algebra
    system = System()
    for k in range(8):
        place = (0.0, 0.1 * k, 0.0)
        system.add(
            parts.Beam(length=1.0, section=BAR, material=STEEL, elements=8, formulation="cable", position=place),
            f"bar-{k}",
        )
        system.add(parts.Joint(a=place, b=f"bar-{k}.root", type="clamp"))
    a = system.assemble()
    found = modes(a, count=18)
    assert a.model.info.nv > DENSE
    assert_allclose(found.frequency / UNIT, np.repeat([3.516015, 22.034492], [16, 2]), rtol=1e-4)
    work = Work(a, found.equilibrium.y[-1], 0.0, np.zeros(6))
    M = matrices(work)[0]
    assert_allclose(found.shape @ (M @ found.shape.T), np.eye(18), atol=1e-7)


@pytest.mark.parametrize("formulation", ["assumed_strain", "elastic_line"])
def test_torsion_of_a_clamped_rod(formulation, book):
    section = General(area=1e-4, Iy=2e-9, Iz=1e-9, J=5e-10)
    a = beam(formulation, 16, section=section)
    found = modes(a, count=12)
    slopes = found["beam"].shape[:, -1]
    twist = np.flatnonzero(np.abs(slopes[:, 2, 2]) > 0.5 * np.linalg.norm(slopes.reshape(12, -1), axis=1))
    wanted = 0.5 * np.pi * np.sqrt(STEEL.shear_modulus * 5e-10 / (STEEL.density * 3e-9))
    assert_allclose(found.frequency[twist[0]], wanted, rtol=1e-3)
    book(
        "Modes", f"Torsion of a clamped rod ({formulation}, 16 elements)", reference="(pi/2) sqrt(G J/rho Ip)/L",
        source="closed form", error=abs(found.frequency[twist[0]] / wanted - 1.0), allowed=1e-3,
    )  # fmt: skip


def test_a_string_is_tuned_by_its_tension(book):
    strain, n = 1e-3, 24
    section, material = Rectangle(thickness=1e-4, width=1e-4), STEEL
    start = np.zeros((n + 1, 2, 3))
    start[:, 0, 0], start[:, 1, 0] = np.linspace(0.0, 1.0 + strain, n + 1), 1.0 + strain
    a = beam("cable", n, ("spherical", "spherical"), section=section, material=material, nodes=start)
    found = modes(a, count=6)
    # and by its own stiffness, a little
    k = np.pi * np.repeat([1, 2, 3], 2)
    tension = STEEL.E * strain * 1e-8
    wanted = k * np.sqrt((tension + STEEL.E * 1e-16 / 12.0 * k**2) / (STEEL.density * 1e-8))
    assert_allclose(found.frequency, wanted, rtol=3e-3)
    book(
        "Modes", "Stiff string, six frequencies (cable, 24 elements)", reference="k sqrt((T + EI k^2)/m)",
        source="closed form", error=np.abs(found.frequency / wanted - 1.0).max(), allowed=3e-3,
    )  # fmt: skip


def pressed(part: float) -> float:
    """First frequency of a cantilever (length, EI and rho A are 1) under a part of Euler's load, a dead one.

    EI w,4 + P w,2 = omega^2 w; w = w,1 = 0 at one end, w,2 = w,3 + P w,1 = 0 at the other.
    """
    P = 0.25 * np.pi**2 * part

    def missing(omega: float) -> float:
        a, c = np.sqrt(np.array([-0.5, 0.5]) * P + np.sqrt(0.25 * P * P + omega * omega))
        # w = cosh ax - cos cx, and sinh ax - (a/c) sin cx
        first = [a * np.sinh(a) + c * np.sin(c), a * np.cosh(a) - a * np.cos(c)]
        second = [a * a * np.cosh(a) + c * c * np.cos(c), a * a * np.sinh(a) + a * c * np.sin(c)]
        third = [a**3 * np.sinh(a) - c**3 * np.sin(c), a**3 * np.cosh(a) + a * c * c * np.cos(c)]
        return second[0] * (third[1] + P * first[1]) - second[1] * (third[0] + P * first[0])

    return brentq(missing, 0.01, 3.6)


def test_pressed_beams_slow_down_and_buckle_at_the_load_of_euler(book):
    section = Rectangle(thickness=1e-3, width=2e-2)
    unit = EI / (STEEL.density * 2e-5)
    squares = []
    for part in (0.0, 0.5, 0.999, 1.001):
        a = beam("cable", 16, section=section, more=tip_force(-0.25 * np.pi**2 * EI * part, 0.0, 0.0))
        squares.append(modes(a, count=1).square[0] / unit)
    assert_allclose(squares[:2], [pressed(1e-9) ** 2, pressed(0.5) ** 2], rtol=1e-4)
    assert squares[2] > 0.0 > squares[3]
    book(
        "Modes", "Cantilever under half of the load of Euler (cable, 16 elements)", reference="first frequency",
        source="transcendental equation", error=abs(np.sqrt(squares[1]) / pressed(0.5) - 1.0), allowed=5e-5,
    )  # fmt: skip


# ------------------------------------------------------------------------------------------------ bodies and points


def stand(ex: float = 0.0) -> System:
    """Belyakov's stand, hanging free; its centre of mass off the springs' by ex."""
    system = System(gravity=(0.0, -9.80665, 0.0))
    system.add(parts.RigidBody(motion="free", mass=15190.0, inertia=(3703.0, 43920.0, 43920.0)), "body")
    for x, z in ((2.0, 0.8696), (2.0, -0.8696), (-2.0, -0.8696), (-2.0, 0.8696)):
        system.add(parts.Spring(a=(x - ex, 0.5, z), b=("body", (x - ex, 0.0, z)), stiffness=740250.0, length=0.5))
    return system


@pytest.mark.parametrize(
    ("ex", "wanted"),
    [(0.0, (13.962, 16.422, 24.590)), (0.4, (13.229, 17.332, 24.590)), (0.8, (12.036, 19.050, 24.590))],
)
def test_the_inertia_stand(ex, wanted, book):
    w = modes(stand(ex).assemble()).frequency
    assert_allclose(w[3:], wanted, rtol=1e-3 if ex else 4e-5)
    if ex == 0.0:
        assert_allclose(w[:3], [4.2214, 4.2214, 5.4142], atol=1e-4)
    numbers = ", ".join(map(str, wanted))
    book(
        "Inertia stand and identification", f"Stand by the general engine, offset {ex:g} m: three frequencies",
        reference=f"{numbers} rad/s", source="independent linear model", error=np.abs(w[3:] / wanted - 1.0).max(),
        allowed=1e-3 if ex else 4e-5,
    )  # fmt: skip


def test_two_bodies_on_a_spring_swing_against_each_other(book):
    system = System()
    for name, x, mass in (("light", 0.0, 2.0), ("heavy", 1.0, 5.0)):
        system.add(parts.RigidBody(motion="free", mass=mass, inertia=0.1, position=(x, 0.0, 0.0)), name)
    system.add(parts.Spring(a="light", b="heavy", stiffness=300.0))
    found = modes(system.assemble(), count=12)
    assert np.abs(found.square[:-1]).max() < 1e-6  # no tension holds them sideways
    assert_allclose(found.frequency[-1], np.sqrt(300.0 * (1 / 2.0 + 1 / 5.0)), rtol=1e-9)
    light, heavy = (found[name].displacement[-1] for name in ("light", "heavy"))
    assert_allclose(2.0 * light, -5.0 * heavy, atol=1e-9)
    book(
        "Modes", "Two bodies on a spring", reference="sqrt(k (1/m1 + 1/m2))", source="closed form",
        error=abs(found.frequency[-1] / np.sqrt(300.0 * (1 / 2.0 + 1 / 5.0)) - 1.0), allowed=1e-9,
    )  # fmt: skip


@pytest.mark.parametrize("heavier", [-1e-9, 1e-9])
def test_of_equal_displacements_the_first_is_positive(heavier):
    """Of equal bodies, whichever is the lighter one by round-off, and so moves more."""
    system = System()
    for name, x, mass in (("left", 0.0, 2.0), ("right", 1.0, 2.0 * (1.0 + heavier))):
        system.add(parts.RigidBody(motion="free", mass=mass, inertia=0.1, position=(x, 0.0, 0.0)), name)
    system.add(parts.Spring(a="left", b="right", stiffness=300.0))
    found = modes(system.assemble(), count=12)
    left, right = (found[name].displacement[-1, ..., 0].item() for name in ("left", "right"))
    assert left > 0.0
    assert right == pytest.approx(-left, rel=1e-6)


def test_a_mass_on_dampers_decays(book):
    system = System()
    mass = system.add(parts.Point(mass=2.0))
    for axis, c in zip(np.eye(3), (1.0, 3.0, 60.0), strict=True):
        system.add(parts.Spring(a=tuple(axis), b=mass, stiffness=50.0, damping=c))
    a = system.assemble()
    found = modes(a, count=4, damped=True)
    w2, rates = 25.0, np.array([1.0, 3.0]) / 4.0
    wanted = [15.0 - np.sqrt(225.0 - w2), *rates, 15.0 + np.sqrt(225.0 - w2)]
    assert_allclose(found.decay_rate, wanted, rtol=1e-9)
    assert_allclose(found.frequency, [0.0, *np.sqrt(w2 - rates**2), 0.0], rtol=1e-9)
    assert_allclose(found.damping_ratio[1:3], rates / 5.0, rtol=1e-9)
    assert_allclose(modes(a).frequency, 5.0, rtol=1e-12)
    book(
        "Modes", "Mass on springs and dampers: decay rates, one overdamped", reference="c/2m, and both real poles",
        source="closed form", error=np.abs(found.decay_rate / wanted - 1.0).max(), allowed=1e-9,
    )  # fmt: skip


@pytest.mark.parametrize(("formulation", "beta"), [("cable", 0.0), ("assumed_strain", 1e-3)])
def test_damping_of_a_beam_is_that_of_its_parts(formulation, beta, book):
    alpha = 0.5
    a = beam(formulation, 12, section=BAR, mass_damping=alpha, stiffness_damping=beta)
    still, found = modes(a, count=3), modes(a, count=3, damped=True)
    assert_allclose(found.decay_rate, 0.5 * (alpha + beta * still.square), rtol=1e-4)
    assert_allclose(np.abs(found.pole), still.frequency, rtol=1e-5)
    book(
        "Modes", f"Decay of a beam under proportional damping ({formulation})", reference="(alpha + beta w^2)/2",
        source="closed form", error=np.abs(found.decay_rate / (0.5 * (alpha + beta * still.square)) - 1.0).max(),
        allowed=1e-4,
    )  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("taut", [1e-4, 1e-6, 1e-8])
def test_cords_that_are_hardly_taut(taut, book):
    """A body between two cords without compression: along them k alone, across them and in turns the tension."""
    k, length, arm, mass, inertia = 2e4, 1.0, 0.3, 2.0, 0.05
    system = System()
    system.add(parts.RigidBody(motion="free", mass=mass, inertia=inertia), "body")
    for side in (1.0, -1.0):
        cord = {"length": length - taut, "law": "max(k*x, 0)", "constants": {"k": k}}
        system.add(parts.Spring(a=(side * (arm + length), 0.0, 0.0), b=("body", (side * arm, 0.0, 0.0)), **cord))
    found = modes(system.assemble(), count=6).square
    across, turn = 2.0 * k * taut / length / mass, 2.0 * k * taut * arm * (1.0 + arm / length) / inertia
    wanted = [across, across, turn, turn, 2.0 * k / mass]
    assert abs(found[0]) < 1e-6 * across  # nothing holds turns about the cords
    assert_allclose(found[1:], wanted, rtol=1e-6)
    book(
        "Modes", f"Body between two cords, taut by {taut:g} m of 1 m: squares of five frequencies",
        reference="2T/(L m), 2T r (1 + r/L)/J, 2k/m", source="closed form",
        error=np.abs(found[1:] / wanted - 1.0).max(), allowed=1e-6,
    )  # fmt: skip


# ------------------------------------------------------------------------------------------------ turning

FLAP = {2.0: 4.137320, 6.0: 7.360373, 12.0: 13.170150}


@pytest.mark.parametrize("eta", list(FLAP))
def test_a_turning_cantilever(eta, book):
    found = modes(beam("cable", 24, section=BAR), rotating=(0.0, 0.0, eta * UNIT), count=4)
    w = found.frequency / UNIT
    book(
        "Modes", f"Turning cantilever, first flap, eta = {eta:g} (cable)", reference=f"{FLAP[eta]} sqrt(EI/m L^4)",
        source="series solution", error=abs(w[across(found, 2)[0]] / FLAP[eta] - 1.0), allowed=2e-5,
    )  # fmt: skip
    book(
        "Modes", f"Turning cantilever, first lag, eta = {eta:g} (cable)", reference="lag^2 = flap^2 - eta^2",
        source="closed form", error=abs(w[across(found, 1)[0]] / np.sqrt(FLAP[eta] ** 2 - eta**2) - 1.0), allowed=5e-5,
    )  # fmt: skip
    assert_allclose(w[across(found, 2)[0]], FLAP[eta], rtol=2e-5)
    assert_allclose(w[across(found, 1)[0]], np.sqrt(FLAP[eta] ** 2 - eta**2), rtol=5e-5)
    # of 24 coordinates, with the soft direction along the axis
    found = modes(beam("assumed_strain", 32, section=BAR), rotating=(0.0, eta * UNIT, 0.0), count=3)
    assert_allclose(found.frequency[across(found, 1)[0]] / UNIT, FLAP[eta], rtol=1e-3)
    book(
        "Modes", f"Turning cantilever, first flap, eta = {eta:g} (assumed_strain)",
        reference=f"{FLAP[eta]} sqrt(EI/m L^4)", source="series solution",
        error=abs(found.frequency[across(found, 1)[0]] / UNIT / FLAP[eta] - 1.0), allowed=1e-3,
    )  # fmt: skip


def test_a_driven_hub_names_the_turn():
    def hub(system: System) -> None:
        system.add(parts.RigidBody(motion="driven", rate=6.0 * UNIT), "hub")
        system.add(parts.Joint(a="hub", b="beam.root", type="clamp"))

    a = beam("cable", 16, (), section=BAR, more=hub)
    found = modes(a, rotating="hub", count=2)
    assert_allclose(found.frequency[across(found, 2)[0]] / UNIT, FLAP[6.0], rtol=1e-4)
    assert_allclose(found.equilibrium.path.spin, [0.0, 0.0, 6.0 * UNIT, 0.0, 0.0, 0.0])


def test_an_oscillator_seen_from_a_turn_has_two_frequencies(book):
    system = System()
    mass = system.add(parts.Point(mass=1.0))
    system.add(parts.RigidBody(motion="driven", rate=2.0), "frame")
    for axis in np.eye(3):
        system.add(parts.Spring(a=("frame", tuple(100.0 * axis)), b=mass, stiffness=25.0))
    found = modes(system.assemble(), rotating=(0.0, 0.0, 2.0), count=3)
    assert_allclose(found.frequency, [3.0, 5.0, 7.0], rtol=1e-6)
    assert np.abs(found.decay_rate).max() < 1e-9
    slow = found[mass].displacement[0]
    assert_allclose(abs(slow[0]), abs(slow[1]), rtol=1e-6)  # a circle
    assert_allclose(abs(np.angle(slow[1] / slow[0])), 0.5 * np.pi, rtol=1e-6)
    book(
        "Modes", "Oscillator in a turning frame", reference="w - W, w, w + W", source="closed form",
        error=np.abs(found.frequency / [3.0, 5.0, 7.0] - 1.0).max(), allowed=1e-6,
    )  # fmt: skip


def test_a_turning_body_nutates(book):
    system = System()
    system.add(parts.RigidBody(motion="free", mass=1.0, inertia=(2.0, 2.0, 3.5)), "top")
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="top"))
    found = modes(system.assemble(), rotating=(0.0, 0.0, 4.0), count=3)
    # about its axis; tilted for good, which turns back in the frame; nutation, W (J3 - J1)/J1
    assert_allclose(found.frequency, [0.0, 3.0, 4.0], atol=1e-6)
    book(
        "Modes", "Nutation of a symmetric body", reference="W (J3 - J1)/J1", source="closed form",
        error=abs(found.frequency[1] / 3.0 - 1.0), allowed=1e-6,
    )  # fmt: skip


# ------------------------------------------------------------------------------------------------ matrices


@pytest.mark.parametrize("turns", [False, True])
def test_the_stiffness_is_the_derivative_of_all_forces(turns, rng):
    """A free hub with a hinged beam and a clamped one, springs, a field, a contact, a force that turns with it."""
    soft, section = Material(young_modulus=1e5, poisson_ratio=0.3, density=900.0), Rectangle(thickness=0.05, width=0.08)
    system = System()
    system.add(parts.RigidBody(motion="free", mass=3.0, inertia=(0.2, 0.3, 0.4)), "hub")
    system.add(parts.RigidBody(motion="spin", inertia=0.3, position=(0.0, 0.0, 0.5)), "wheel")
    common = {"length": 1.0, "section": section, "material": soft, "elements": 2}
    system.add(parts.Beam(position=(0.2, 0.0, 0.0), formulation="cable", **common), "cable")
    system.add(parts.Beam(position=(0.0, 0.2, 0.0), direction=(0.0, 1.0, 0.0), normal=(0.0, 0.0, 1.0),
                          formulation="assumed_strain", **common), "rib")  # fmt: skip
    system.add(parts.Joint(a=("hub", (0.2, 0.0, 0.0)), b="cable.root", type="revolute"), "pin")
    system.add(parts.JointSpring(a="hub", b="cable.root", stiffness=0.4, rest=0.3))
    system.add(parts.Joint(a=("hub", (0.0, 0.2, 0.0)), b="rib.root", type="clamp"))
    system.add(parts.Joint(a=("wheel", (0.3, 0.0, 0.0)), b="rib.tip", type="distance"))
    system.add(parts.RigidBody(motion="driven", rate=0.7, position=(0.1, 0.2, 0.0)), "frame")
    for x, y in ((-1.0, 0.3), (0.2, -1.0), (1.0, 1.0)):
        held, end = ("frame", (x - 0.1, y - 0.2, 0.4)), ("hub", (0.1 * x, 0.1 * y, 0.1))
        system.add(parts.Spring(a=held, b=end, stiffness=30.0, length=0.9))
    system.add(parts.Spring(a=("frame", (0.9, 0.8, 0.5)), b=("wheel", (0.1, 0.2, 0.0)), stiffness=5.0))
    system.add(parts.Load(along="cable", torque=(0.0, 0.0, 0.05), centre=(0.1, 0.2, 0.0)))
    system.add(parts.Load(at=("hub", (0.1, 0.0, 0.2)), force=(0.3, 0.1, 0.2), frame="body"))
    system.add(parts.Contact(a="cable", b=("hub", (0.9, -0.31, 0.0)), shape=parts.Cylinder(radius=0.3), stiffness=50.0))
    a = system.assemble()
    spin = spin_of(a, "frame", None) if turns else np.zeros(6)
    n_q, y = int(a.model.info.nq), a.y.copy()
    y[:n_q] += 0.02 * rng.standard_normal(n_q)
    cable = a.model.beams["iq"][0]
    y[cable + 13] -= 0.05  # its tip dips into the cylinder
    y[3:7] /= np.linalg.norm(y[3:7])
    work = Work(a, y, 0.0, spin)
    b, model = work.balance, work.model
    b.la[:] = rng.standard_normal(work.n_j)
    _, _, K, G = matrices(work)
    wanted, gaps = stiffness_by_differences(work, 1e-4)
    assert model.contact_surfaces["touching"][0] > 0.0
    assert_allclose(K.toarray(), wanted, atol=1e-6 * np.abs(wanted).max())
    assert_allclose(G.toarray(), gaps, atol=1e-8)


# ------------------------------------------------------------------------------------------------ refused


def test_bad_input():
    a = beam("cable", 4, section=BAR)
    found = solve_static(a)
    with pytest.raises(InputError, match="count is 0"):
        modes(a, count=0)
    with pytest.raises(InputError, match="not both"):
        modes(a, equilibrium=found, y=a.y)
    with pytest.raises(InputError, match="'root' is one of the joints and does not move"):
        modes(a, equilibrium=found, count=1)["root"]
    with pytest.raises(InputError, match="no part is called"):
        modes(a, equilibrium=found, count=1)["bea"]
    with pytest.raises(RunFailed, match=r"no equilibrium to vibrate about: nothing holds 'beam'") as caught:
        modes(beam("cable", 4, (), section=BAR, gravity=(0.0, 0.0, -9.81)))
    assert caught.value.run.status == "failed"


def test_fewer_modes_where_fewer_directions_are_free():
    system = System()
    mass = system.add(parts.Point(mass=1.0, position=(1.0, 0.0, 0.0)))
    system.add(parts.Spring(a=(0.0, 0.0, 0.0), b=mass, stiffness=4.0, length=0.5))
    system.add(parts.Load(at=mass, force=(2.0, 0.0, 0.0)))
    found = modes(system.assemble(), count=10)
    assert_allclose(found.frequency, [np.sqrt(2.0), np.sqrt(2.0), 2.0], rtol=1e-9)  # sqrt(tension/length), sqrt(k/m)
    assert solved(found.equilibrium).path.free == []
