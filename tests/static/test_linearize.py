"""Linear models and their reductions against closed forms, modes and a simulation in time."""

from __future__ import annotations

import dataclasses
import math
import sys

import numpy as np
import pytest
import scipy.signal
from numpy.testing import assert_allclose
from scipy.optimize import brentq

from evolvent import InputError, System, law, parts
from evolvent.assembly.assembled import Assembly
from evolvent.elements import Material, Rectangle
from evolvent.parts.base import unit
from evolvent.solvers.modal.linear import StateSpace, linearize
from evolvent.solvers.modal.modes import modes
from evolvent.solvers.static.static import solve_static
from evolvent.solvers.time.implicit.plan import solve_implicit
from helpers import rotation
from static.composing import STEEL, beam

BAR = Rectangle(thickness=1e-3, width=2e-3)
LINE = STEEL.density * 2e-6
EI = STEEL.E * 2e-3 * 1e-9 / 12.0
#: sqrt(EI/(rho A L^4)) of a bar of 1 m.
UNIT = math.sqrt(EI / LINE)


def response(model: StateSpace, omega: float) -> np.ndarray:
    """(outputs, inputs) at one frequency."""
    return model.frequency_response(omega).response[0]


def hub_with_boom(J: float, *, motion: str = "spin", **fields) -> Assembly:
    """A hub that a boom of 1 m along x is clamped to, at the hub's centre."""
    system = System()
    system.add(parts.RigidBody(motion=motion, mass=1.0, inertia=J), "hub")
    system.add(
        parts.Beam(length=1.0, section=BAR, material=STEEL, **{"elements": 16, "formulation": "cable", **fields}),
        "boom",
    )
    system.add(parts.Joint(a="hub", b="boom.root", type="clamp"), "root")
    return system.assemble()


def free_frequencies(J: float, count: int) -> np.ndarray:
    """Of a bar (length, EI, line mass 1) on a hub that turns: EI w''(0) = -J w^2 w'(0), w(0) = 0, free at its tip."""

    def off(b: float) -> float:
        # w = cosh bx - cos bx + p (sinh bx - sin bx) + r sin bx; w'(0) = r b, w''(0) = 2 b^2
        r = -2.0 / (J * b**3)
        ch, sh, c, s = np.cosh(b), np.sinh(b), np.cos(b), np.sin(b)
        two, three = np.array([ch + c - r * s, sh + s]), np.array([sh - s - r * c, ch + c])
        return float(two[0] * three[1] - two[1] * three[0])

    grid = np.linspace(0.5, 4.0 * count, 4000)
    values = [off(b) for b in grid]
    found = [brentq(off, *grid[i : i + 2]) for i in range(len(grid) - 1) if values[i] * values[i + 1] < 0.0]
    return np.array(found[:count]) ** 2


# ------------------------------------------------------------------------------------------------ closed forms


def test_an_oscillator_with_a_damper(book):
    """x/F = 1/(m (i w)^2 + c i w + k), and its derivatives."""
    m, c, k = 2.0, 3.0, 50.0
    system = System()
    system.add(parts.Point(mass=m, position=(0.3, 0.0, 0.0)), "mass")
    for axis in np.eye(3):
        system.add(parts.Spring(a=tuple(axis + np.array([0.3, 0.0, 0.0])), b="mass", stiffness=k, damping=c))
    names = [f"mass.{what}.x" for what in ("position", "displacement", "velocity", "acceleration")]
    model = linearize(system.assemble(), ["mass.force.x"], names)
    assert model.inputs == ("mass.force.x",)
    assert model.outputs == tuple(names)
    assert model.input_units == ("N",)
    assert model.output_units == ("m", "m", "m/s", "m/s2")
    assert_allclose(model.at_rest, [0.3, 0.0, 0.0, 0.0])
    errors = []
    for w in (0.0, 1.0, 5.0, 40.0):
        x = 1.0 / (k - m * w * w + 1j * c * w)
        wanted = np.array([x, x, 1j * w * x, -w * w * x])
        assert_allclose(response(model, w)[:, 0], wanted, rtol=1e-9, atol=1e-15)
        errors.append(np.abs(response(model, w)[0, 0] / x - 1.0))
    found = model.frequency_response([1.0, 5.0])
    assert found.units[2] == ("m/s/N",)
    assert_allclose(found.phase_deg[1, 0, 0], -90.0)  # at resonance
    assert_allclose(found.magnitude_db[:, 0, 0], 20.0 * np.log10(found.magnitude[:, 0, 0]))
    assert_allclose(np.sort_complex(model.poles), np.sort_complex(np.repeat(np.roots([m, c, k]), 3)), rtol=1e-9)
    book(
        "Modes", "Linear model of a mass on springs and dampers: frequency response", reference="1/(k - m w^2 + i c w)",
        source="closed form", error=max(errors), allowed=1e-9,
    )  # fmt: skip


def test_a_free_body_is_a_double_integrator():
    """Rates R J^-1 R^T tau/(i w) by a torque in inertial axes, velocity F/(m i w)."""
    q = unit((0.8, 0.3, -0.4, 0.2))
    R = rotation(q)
    J = np.diag([0.2, 0.3, 0.4])
    system = System()
    system.add(parts.RigidBody(mass=3.0, inertia=(0.2, 0.3, 0.4), orientation=q), "hub")
    model = linearize(system.assemble(), ["hub.force", "hub.torque"], ["hub.velocity", "hub.rate", "hub.rotation.z"])
    assert model.rigid == 6
    assert model.summary == "12 states: 6 rigid-body and 0 elastic modes (full), 6 inputs, 7 outputs"
    found = response(model, 2.0)
    wanted = np.zeros((7, 6), dtype=complex)
    wanted[:3, :3], wanted[3:6, 3:] = np.eye(3) / 3.0 / 2j, R @ np.linalg.inv(J) @ R.T / 2j
    wanted[6] = wanted[5] / 2j
    assert_allclose(found, wanted, atol=1e-12)
    assert np.all(np.isinf(response(model, 0.0)))


@pytest.mark.slow
@pytest.mark.parametrize(("formulation", "count"), [("cable", 16), ("assumed_strain", 32)])
def test_poles_and_zeros_of_a_hub_with_a_boom(formulation, count, book):
    """Torque to rate: poles where hub and boom swing freely, zeros where the boom swings and the hub stands still."""
    ratio = 0.2
    J = ratio * LINE
    model = linearize(
        hub_with_boom(J, formulation=formulation, elements=count),
        ["hub.torque.z"],
        ["hub.rate.z", "boom.tip.velocity.y"],
    )
    poles = free_frequencies(ratio, 3) * UNIT
    zeros = np.array([3.516015, 22.034492, 61.697214]) * UNIT
    tolerance = 1e-3 if formulation == "cable" else 4e-3
    assert model.rigid == 1
    # undamped: imaginary numbers, which change sign at zeros and at poles
    small = model.reduce(12)

    def conductance(omega: float) -> float:
        return float(response(small, omega)[0, 0].imag)

    swinging = small.poles.imag
    ours = np.array([swinging[np.abs(swinging - p).argmin()] for p in poles])
    errors = np.abs(ours / poles - 1.0)
    # between two poles
    ends = zip([1e-3 * ours[0], *ours[:-1] * (1.0 + 1e-5)], ours * (1.0 - 1e-5), strict=True)
    found = [brentq(conductance, *pair, xtol=1e-9) for pair in ends]
    assert max(errors) < tolerance
    assert_allclose(found, zeros, rtol=tolerance)
    # as one body at low frequencies
    assert response(model, 1e-4 * UNIT)[0, 0] == pytest.approx(1.0 / (1e-4j * UNIT * (J + LINE / 3.0)), rel=1e-4)
    assert response(model, 1e-4 * UNIT)[1, 0] == pytest.approx(1.0 / (1e-4j * UNIT * (J + LINE / 3.0)), rel=1e-4)
    book(
        "Modes", f"Hub with a boom, torque to rate: three poles and zeros ({formulation}, {count} elements)",
        reference="frequency equation of hub and beam; 3.516, 22.03, 61.70", source="closed form (Euler's beam)",
        error=max(*errors, *np.abs(np.array(found) / zeros - 1.0)), allowed=tolerance,
    )  # fmt: skip


def test_a_free_hub_keeps_its_rigid_body_modes():
    model = linearize(
        hub_with_boom(0.01, motion="free", formulation="assumed_strain"), ["hub.torque.z"], ["hub.rate.z"]
    )
    assert model.rigid == 6
    small = model.reduce(4)
    assert small.rigid == 6
    assert len(small.square) == 10
    assert small.summary == "20 states: 6 rigid-body and 4 elastic modes (modal), 1 inputs, 1 outputs"
    # inertia of hub and boom about their common centre of mass
    m, w = LINE, 1e-3
    about = 0.01 + m / 12.0 + 0.25 * m / (1.0 + m)
    assert response(small, w)[0, 0] == pytest.approx(1.0 / (1j * w * about), rel=1e-4)


# ------------------------------------------------------------------------------------------------ spinning


def test_poles_of_an_oscillator_in_a_frame_that_turns():
    system = System()
    system.add(parts.Point(mass=1.0), "mass")
    system.add(parts.RigidBody(motion="driven", rate=2.0), "frame")
    for axis in np.eye(3):
        system.add(parts.Spring(a=("frame", tuple(100.0 * axis)), b="mass", stiffness=25.0))
    model = linearize(system.assemble(), ["mass.force"], ["mass.displacement"], rotating=(0.0, 0.0, 2.0))
    assert_allclose(np.sort(model.poles.imag), [-7.0, -5.0, -3.0, 3.0, 5.0, 7.0], rtol=1e-9)
    # K - W^2 - w^2 on the diagonal, -+2 i w W beside it
    w, W = 1.3, 2.0
    D = np.array([[25.0 - W * W - w * w, -2j * w * W], [2j * w * W, 25.0 - W * W - w * w]])
    assert_allclose(response(model, w)[:2, :2], np.linalg.inv(D), rtol=1e-6, atol=1e-9)


def test_gyroscopic_poles_are_those_of_the_modes():
    system = System()
    system.add(parts.RigidBody(mass=1.0, inertia=(0.02, 0.03, 0.04)), "hub")
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="hub"))
    common = {"length": 1.0, "section": BAR, "material": STEEL, "elements": 6, "formulation": "cable"}
    for name, side in (("east", 1.0), ("west", -1.0)):
        system.add(parts.Beam(position=(0.1 * side, 0.0, 0.0), direction=(side, 0.0, 0.0), **common), name)
        system.add(parts.Joint(a=("hub", (0.1 * side, 0.0, 0.0)), b=f"{name}.root", type="clamp"))
    a = system.assemble()
    rest = solve_static(a, rotating=(0.0, 0.0, 4.0))
    found = modes(a, equilibrium=rest, count=8)
    model = linearize(a, ["hub.torque.x"], ["hub.rate.y", "west.tip.velocity.z"], equilibrium=rest)
    assert np.abs(found.pole.imag).max() > 10.0
    for pole in found.pole[found.frequency > 0.1]:
        assert np.abs(model.poles - pole).min() < 1e-6 * abs(pole)
    assert abs(response(model, 3.0)[0, 0]) > 1e-3  # a torque about x turns it about y
    small = model.reduce(20)
    assert_allclose(response(small, 3.0), response(model, 3.0), rtol=1e-3)


# ------------------------------------------------------------------------------------------------ in time


@law
def shaker(extension, rate, t, p):
    return p[0] * math.sin(p[1] * t)


def test_the_frequency_response_is_that_of_a_simulation(book):
    """A damped cantilever with a mass at its tip, shaken from far away until it swings steadily."""
    amplitude, w = 1e-3, 20.0
    soft = {"length": 1.0, "section": Rectangle(thickness=0.01, width=0.02), "elements": 4,
            "formulation": "cable", "mass_damping": 6.0,
            "material": Material(young_modulus=1e9, poisson_ratio=0.3, density=1000.0)}  # fmt: skip

    def compose(*, shaken: bool) -> Assembly:
        system = System()
        system.add(parts.Beam(**soft), "boom")
        system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="boom.root", type="clamp"))
        system.add(parts.Point(mass=0.05, position=(1.0, 0.0, 0.0)), "mass")
        system.add(parts.Joint(a="mass", b="boom.tip", type="spherical"))
        if shaken:
            far = (1.0, -1e3, 0.0)
            system.add(parts.Spring(a=far, b="mass", length=1e3, law=shaker, parameters=(amplitude, w)), "shaker")
        return system.assemble()

    model = linearize(compose(shaken=False), ["mass.force.y"], ["mass.displacement.y", "boom[2].rotation.z"])
    wanted = response(model, w)[:, 0]
    period = 2.0 * math.pi / w
    t = np.linspace(0.0, 20.0 * period, 1201)
    a = compose(shaken=True)
    run = solve_implicit(a, samples=t, step=period / 120)
    assert run.success, run.message
    row = a.model.beams[0]
    point = run.y[:, int(a.model.points["iq"][0]) + 1]
    slope = run.y[:, int(row["iq"]) + 12 + 3 : int(row["iq"]) + 12 + 6]
    errors, t = [], t[-120:]
    for found, G in zip((point, np.arctan2(slope[:, 1], slope[:, 0])), wanted, strict=True):
        # the spring pulls towards -y
        fit = np.linalg.lstsq(np.column_stack([np.sin(w * t), np.cos(w * t)]), found[-120:], rcond=None)[0]
        errors.append(abs((fit[0] + 1j * fit[1]) / (-amplitude * G) - 1.0))
    assert max(errors) < 2.5e-3
    book(
        "Modes", "Linear model of a damped cantilever with a tip mass: response at one frequency",
        reference="steady swing under a harmonic force", source="generalized-alpha, 120 steps a period",
        error=max(errors), allowed=2.5e-3,
    )  # fmt: skip


# ------------------------------------------------------------------------------------------------ reductions


@pytest.fixture(scope="module")
def cantilever() -> StateSpace:
    a = beam("assumed_strain", 16, section=BAR, mass_damping=0.2, stiffness_damping=1e-4)
    return linearize(a, ["beam.tip.force.y"], ["beam.tip.displacement.y", "beam[8].rotation.z"])


def test_static_response_is_that_of_a_beam(cantilever):
    """L^3/3EI and 3 L^2/8EI at midspan."""
    assert_allclose(response(cantilever, 0.0)[:, 0].real, [1.0 / (3.0 * EI), 3.0 / (8.0 * EI)], rtol=2e-3)


@pytest.mark.parametrize("formulation", ["cable", "assumed_strain"])
def test_a_couple_at_the_tip_turns_it(formulation):
    """By L/EI, and midspan by half as much; a cable takes no torque along itself."""
    names = ["beam.tip.torque.z"], ["beam.tip.rotation.z", "beam[4].rotation.z", "beam.tip.displacement.y"]
    model = linearize(beam(formulation, 8, section=BAR), *names)
    assert_allclose(response(model, 0.0)[:, 0].real, [1.0 / EI, 0.5 / EI, 0.5 / EI], rtol=2e-3)
    along = linearize(beam("cable", 8, section=BAR), ["beam.tip.torque.x"], ["beam.tip.rotation.x"])
    assert_allclose(response(along, 1.0), 0.0)


def craft(count: int) -> Assembly:
    """A free hub with two booms and masses at their tips."""
    system = System()
    system.add(parts.RigidBody(mass=2.0, inertia=(0.1, 0.2, 0.25)), "hub")
    for name, side in (("east", 1.0), ("north", -0.5)):
        d = np.array([side, math.sqrt(1.0 - side * side), 0.0])
        boom = parts.Beam(length=1.0, section=BAR, material=STEEL, elements=count, position=tuple(0.2 * d),
                          direction=tuple(d), normal=(0.0, 0.0, 1.0), formulation="assumed_strain")  # fmt: skip
        system.add(boom, name)
        system.add(parts.Point(mass=0.01, position=tuple(1.2 * d)), f"{name} mass")
        system.add(parts.Joint(a=("hub", tuple(0.2 * d)), b=f"{name}.root", type="clamp"))
        system.add(parts.Joint(a=f"{name} mass", b=f"{name}.tip", type="spherical"))
    return system.assemble()


def test_a_free_hub_with_two_booms(book):
    """Reciprocal (Maxwell and Betti), the rigid-body part by mass and inertia, and well reduced."""
    names = ["hub.torque", "east.tip.torque.y", "north mass.force.z"]
    seen = ["hub.rotation", "east.tip.rotation.y", "north mass.displacement.z"]
    a = craft(6)
    model = linearize(a, names, seen)
    assert model.rigid == 6
    G = response(model, 5.0)
    assert_allclose(G, G.T, atol=1e-9 * np.abs(G).max())
    found = modes(a, count=12)
    assert_allclose(found.effective_mass[:6].sum(axis=0), found.total_mass, rtol=1e-9)
    # a slow torque about z: the hub turns with all inertia about the common centre of mass
    m = 2.02 + 2.0 * LINE
    first = (0.01 * 1.2 + LINE * 0.7) * (np.array([1.0, 0.0]) + np.array([-0.5, math.sqrt(0.75)]))
    inertia = found.total_mass[5] - first @ first / m
    assert response(model, 1e-3)[2, 2] == pytest.approx(-1e6 / inertia, rel=1e-4)
    small = model.reduce(10, "craig-bampton")
    assert small.rigid == 6
    assert small.boundary == ("hub", "east.tip", "north mass")
    elastic = np.sqrt(model.square[6:12])
    w = np.array([0.5 * elastic[0], *(0.5 * (elastic[1:] + elastic[:-1]))[np.diff(elastic) > 0.05 * elastic[:-1]]])
    assert w.size > 3
    whole, reduced = (m.frequency_response(w).response for m in (model, small))
    error = (np.abs(reduced - whole).max(axis=(1, 2)) / np.abs(whole).max(axis=(1, 2))).max()
    book(
        "Modes", "Free hub with two booms and tip masses, response between six resonances (Craig-Bampton, 10 modes)",
        reference="model of all modes", source="unreduced model", error=error, allowed=1e-3,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("method", "options", "static"),
    [("modal", {}, 1e-3), ("modal", {"static_correction": True}, 1e-7), ("craig-bampton", {}, 1e-7),
     ("craig-bampton", {"boundary": ["beam.tip", "beam[4]"]}, 1e-7)],
)  # fmt: skip
def test_reduced_models(cantilever, method, options, static, book):
    """Zero frequency, the first frequencies, and the response below the third pair of modes."""
    small = cantilever.reduce(8, method, **options)
    assert small.A.shape == (2 * len(small.square),) * 2
    assert_allclose(response(small, 0.0), response(cantilever, 0.0), rtol=static)
    assert_allclose(np.sqrt(small.square[:4]), np.sqrt(cantilever.square[:4]), rtol=1e-3)
    third = math.sqrt(cantilever.square[3])
    w = np.linspace(0.0, third, 40)
    whole, found = (model.frequency_response(w).response for model in (cantilever, small))
    error = (np.abs(found - whole).max(axis=0) / np.abs(whole).max(axis=0)).max()
    allowed = 2e-4
    assert error < allowed
    book(
        "Modes", f"Cantilever, response by 8 modes ({small.method}{', ' + str(*options) if options else ''})",
        reference="model of all modes, below the fourth mode", source="unreduced model", error=error, allowed=allowed,
    )  # fmt: skip


@pytest.mark.slow
def test_reduction_from_the_start_is_that_of_the_full_model():
    a = hub_with_boom(0.002)
    names = ["hub.torque.z"], ["hub.rate.z", "boom.tip.acceleration.y"]
    full = linearize(a, *names)
    for method in ("modal", "craig-bampton"):
        one, other = linearize(a, *names, modes=5, method=method), full.reduce(5, method)
        assert one.method == other.method == method
        assert one.boundary == other.boundary
        assert_allclose(response(one, 30.0), response(other, 30.0), rtol=1e-9)
    assert other.boundary == ("hub", "boom.tip")
    assert other.rigid == 1
    # sparse algebra
    b = beam("assumed_strain", 40, (), section=BAR)
    few, whole = (linearize(b, ["beam.tip.force.y"], ["beam.root.velocity.y"], modes=k) for k in (8, None))
    assert few.rigid == whole.rigid == 6
    assert len(few.square) == 14
    assert_allclose(few.square, whole.square[:14], rtol=1e-6)
    assert_allclose(response(few, 20.0), response(whole.reduce(8), 20.0), rtol=1e-5)


def test_a_boundary_that_holds_the_structure_is_guyan_without_modes():
    """No modes besides the boundary of a free point mass on a spring: all is in the boundary."""
    system = System()
    for name, x, m in (("left", 0.0, 2.0), ("right", 1.0, 5.0)):
        system.add(parts.Point(mass=m, position=(x, 0.0, 0.0)), name)
    system.add(parts.Spring(a="left", b="right", stiffness=300.0))
    model = linearize(system.assemble(), ["left.force"], ["right.displacement"])
    small = model.reduce(0, "craig-bampton")
    assert len(small.square) == 6
    assert small.rigid == 5
    assert_allclose(response(small, 7.0), response(model, 7.0), rtol=1e-9, atol=1e-12)


def test_scipy_takes_the_model(cantilever):
    small = cantilever.reduce(6, static_correction=True)
    for system in (small.to_scipy(), scipy.signal.StateSpace(small.A, small.B, small.C, small.D)):
        w, found = scipy.signal.freqresp(
            scipy.signal.StateSpace(system.A, system.B, system.C[:1], system.D[:1]), [3.0, 40.0]
        )
        assert_allclose(found, small.frequency_response(w).response[:, 0, 0], rtol=1e-9)
    assert len(small.states) == len(small.state_units) == len(small.A)


def test_python_control_takes_the_model(cantilever):
    control = pytest.importorskip("control")
    small = cantilever.reduce(6)
    system = small.to_control()
    assert_allclose(system(3j), response(small, 3.0), rtol=1e-9)
    assert np.shape(system.A) == np.shape(small.A)
    assert system.isctime()
    assert system.input_labels == [name.replace(".", "_") for name in small.inputs]
    plain = [name.replace(".", "_").replace("[", "_").replace("]", "") for name in small.outputs]
    assert system.output_labels == plain
    assert tuple(system.state_labels) == small.states
    assert (system.input_units, system.output_units) == (small.input_units, small.output_units)
    assert system.state_units == small.state_units
    assert_allclose(np.sort(np.abs(system.poles())), np.sort(np.abs(small.poles)), rtol=1e-6, atol=1e-6)
    # a step of python-control against SciPy's own
    times = np.linspace(0.0, 0.5, 40)
    step = control.step_response(system, times, input=0, output=0)
    one = scipy.signal.StateSpace(small.A, small.B[:, :1], small.C[:1], small.D[:1, :1])
    _, theirs = scipy.signal.step(one, T=times)
    assert_allclose(np.squeeze(step.outputs), theirs, rtol=1e-6, atol=1e-9 * np.abs(theirs).max())


def test_signals_of_python_control_have_names_of_their_own():
    from evolvent.solvers.modal.linear import _signals

    names = ["boom[5].force.y", "hub.torque.z", "hub.torque.z", "panel 1.force.x", "hub_torque.z"]
    found = _signals(names)
    assert found[:2] == ["boom_5_force_y", "hub_torque_z"]
    assert len(set(found)) == len(names)
    assert all(name.isidentifier() for name in found)


def test_python_control_is_asked_for_in_a_sentence(cantilever, monkeypatch):
    monkeypatch.setitem(sys.modules, "control", None)
    with pytest.raises(InputError, match=r"needs the package control .*pip install 'evolvent\[control\]'"):
        cantilever.to_control()


def test_python_control_gets_no_empty_model(cantilever):
    pytest.importorskip("control")
    empty = dataclasses.replace(cantilever, inputs=(), B=cantilever.B[:, :0], D=cantilever.D[:, :0])
    with pytest.raises(InputError, match="the model has no inputs"):
        empty.to_control()


@pytest.mark.slow
def test_frequencies_for_a_figure(cantilever):
    found = cantilever.frequency_response()
    assert found.omega[0] < 0.11 * math.sqrt(cantilever.square[0])
    assert np.all(np.diff(found.omega) > 0.0)
    assert found.response.shape == (found.omega.size, 2, 1)
    assert found.omega.size < 1000
    assert_allclose(found.frequency_hz, found.omega / (2.0 * np.pi))


@pytest.mark.slow
def test_the_figure_of_a_frequency_response(tmp_path):
    """Of a mass on a damped spring: magnitude 1/|k - m w^2 + i w c| and phase over Hz, a panel a unit."""
    m, k, c = 2.0, 800.0, 4.0
    system = System()
    system.add(parts.Point(mass=m, position=(1.0, 0.0, 0.0)), "bob")
    system.add(parts.Spring(a=(0.0, 0.0, 0.0), b="bob", length=1.0, stiffness=k, damping=c), "rod")
    model = system.linearize(["bob.force.x"], ["bob.displacement.x", "bob.velocity.x"])
    assert repr(model) == f"<LinearModel: {model.summary}>"
    response = model.frequency_response()
    sheet = response.figure()
    assert [panel.y_label for panel in sheet.panels] == ["magnitude, m/N", "magnitude, m/s/N", "phase, deg"]
    assert all(panel.log_x for panel in sheet.panels)
    line = sheet.panels[0].lines[0]
    w = 2.0 * np.pi * line.x
    assert_allclose(line.y, 1.0 / np.abs(k - m * w**2 + 1j * w * c), rtol=1e-6)
    assert_allclose(sheet.panels[2].lines[0].y, np.degrees(np.angle(1.0 / (k - m * w**2 + 1j * w * c))), atol=1e-4)
    assert line.label == "bob.displacement.x / bob.force.x"
    assert response.plot(tmp_path / "response.png") == str(tmp_path / "response.png")
    assert [axis.get_xscale() for axis in response.plot().axes] == ["log"] * 3
    small = model.reduce(1)
    assert small.frequency_response([3.0]).plot(tmp_path / "one.svg")
    with pytest.raises(InputError, match="frequencies above 0"):
        model.frequency_response([0.0]).plot()


# ------------------------------------------------------------------------------------------------ refused


@pytest.mark.parametrize(
    ("inputs", "outputs", "message"),
    [
        (["hbu.torque.z"], [], r"inputs holds 'hbu.torque.z'; did you mean 'hub.torque.z'\?"),
        (["hub.torqe.z"], [], r"inputs holds 'hub.torqe.z'; did you mean 'hub.torque.z'\?"),
        (["hub.torque.w"], [], r"inputs holds 'hub.torque.w'; did you mean 'hub.torque.[xyz]'\?"),
        (["hub.torque"], ["boom.tip"], r"outputs holds 'boom.tip'; did you mean 'boom.tip\..*'\?"),
        (
            [],
            ["boom.rate.z"],
            r"outputs holds 'boom.rate.z'; a point of the beam 'boom' is 'boom.root', 'boom.tip' or ",
        ),
        ([], ["boom[17].rate.z"], r"or 'boom\[0\]' to 'boom\[16\]'"),
        ([], ["root.rate.z"], r"'root' is one of the joints and does not move"),
        (["hub.force.x"], [], r"inputs holds 'hub.force.x'; did you mean 'hub.torque.x'\?"),  # on a fixed axis
        ([], ["hub.rate.z", "hub.rate"], r"outputs holds 'hub.rate.z' twice"),
        ("hub.torque.z", [], r"inputs is 'hub.torque.z'; it must be a list of names such as 'hub.torque.x'"),
        ([3], [], r"inputs holds 3; give names such as"),
    ],
)
def test_bad_names(inputs, outputs, message):
    with pytest.raises(InputError, match=message):
        linearize(hub_with_boom(0.01), inputs, outputs)


def test_bad_reductions(cantilever):
    for arguments, options, message in (
        ((3, "guyan"), {}, "method is 'guyan'; known: craig-bampton, modal"),
        ((0,), {}, "the number of modes is 0; it must be a whole number from 1"),
        ((2.5,), {}, "the number of modes is 2.5"),
        ((3, "craig-bampton"), {"static_correction": True}, "static_correction is for modal reduction"),
        ((3,), {"boundary": ["beam.tip"]}, "belongs to a reduction with method='craig-bampton'"),
        (
            (3, "craig-bampton"),
            {"boundary": ["beam.tp"]},
            "boundary holds 'beam.tp.displacement'; did you mean 'beam.tip.displacement'",
        ),
        ((3, "craig-bampton"), {"boundary": "beam.tip"}, "it must be a list of points"),
    ):
        with pytest.raises(InputError, match=message):
            cantilever.reduce(*arguments, **options)
    with pytest.raises(InputError, match="omega is"):
        cantilever.frequency_response("fast")
    with pytest.raises(InputError, match="the number of modes is not given"):
        linearize(hub_with_boom(0.01), ["hub.torque.z"], [], method="craig-bampton")
