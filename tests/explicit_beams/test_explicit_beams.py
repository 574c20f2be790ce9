"""Explicit methods on beams, contacts, hinges and penalties: against the implicit method, and by their accounts."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from book import Book
from evolvent import InputError, elements, model as mdl, parts
from evolvent.analysis.system import System
from evolvent.assembly.assembled import Assembly
from evolvent.families.joints import joint
from evolvent.kernels import rigid
from evolvent.solvers import solve
from evolvent.solvers.time.explicit.plan import choose_step
from evolvent.solvers.time.explicit.stability import fastest_mode
from evolvent.solvers.time.implicit.plan import solve_implicit
from helpers import fitted_order, run

LENGTH = 2.0
SECTION = elements.Rectangle(thickness=0.02, width=0.03)
MATERIAL = elements.Material(young_modulus=2e6, poisson_ratio=0.3, density=1000.0)


def beam(formulation: str = "cable", n: int = 4, section: Any = SECTION, **fields: Any) -> parts.Beam:
    """A soft beam along x."""
    return parts.Beam(length=LENGTH, section=section, material=MATERIAL, elements=n, formulation=formulation, **fields)


def thrown(formulation: str = "cable", n: int = 4, bend: float = 0.5, **fields: Any) -> Assembly:
    """A free beam that moves, turns and begins to bend."""
    nodes = beam(formulation, n).start_nodes()
    rates = np.cross([0.3, -0.2, 1.0], nodes)
    rates[:, 0] += [0.1, 0.2, -0.3]
    x = nodes[:, 0, 0] / LENGTH
    shape, slope = np.sin(np.pi * x), np.pi / LENGTH * np.cos(np.pi * x)
    rates[:, 0, 1] += bend * shape
    rates[:, 1, 1] += bend * slope
    if formulation != "cable":
        rates[:, 2, 0] -= bend * slope
    system = System()
    system.add(beam(formulation, n, rates=rates, **fields), "beam")
    return system.assemble()


def pendulum(stiffness: float = 2e3, **pin: Any) -> Assembly:
    """A beam that hangs on a penalty and swings down."""
    system = System(gravity=(0.0, -9.81, 0.0))
    system.add(beam(), "beam")
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="beam.root", stiffness=stiffness, **pin), "pin")
    return system.assemble()


def place(assembly: Assembly, y: np.ndarray) -> np.ndarray:
    """Coordinates of a state."""
    return y[: int(assembly.model.info.nq)]


@pytest.mark.parametrize("system", [thrown(stiffness_damping=2e-3), pendulum(damping=5.0), pendulum(stiffness=0.0)])
def test_implicit_and_explicit_meet(system: Assembly) -> None:
    """The implicit error against RK4 falls by 4 when the step is halved: both solve the same equations."""
    samples = np.linspace(0.0, 0.5, 3)
    exact = place(system, run(system, samples, "dopri5", rtol=1e-11, atol=1e-13).y[-1])
    errors, steps = [], [2.5e-4, 1.25e-4, 6.25e-5]
    for step in steps:
        found = solve_implicit(system, samples=samples, step=step, spectral_radius=0.5)
        assert found.success, found.message
        errors.append(np.abs(place(system, found.y[-1]) - exact).max())
    assert errors[-1] < 5e-6
    assert fitted_order(steps, errors) == pytest.approx(2.0, abs=0.25)


@pytest.mark.parametrize(("method", "order"), [("heun", 2), ("rk4", 4)])
def test_order(method: str, order: int, book: Book) -> None:
    system = thrown()
    limit = choose_step(system, method, None, 0.2)[1]
    exact = place(system, run(system, [0.0, 0.2], "dopri5", rtol=1e-12, atol=1e-14).y[-1])
    steps = [0.2 / int(np.ceil(0.2 / limit * k)) for k in (6.0, 8.0, 11.0, 16.0)]
    errors = [np.abs(place(system, run(system, [0.0, 0.2], method, step=h).y[-1]) - exact).max() for h in steps]
    assert fitted_order(steps, errors) == pytest.approx(order, abs=0.3)
    book(
        "Dynamics", f"{'RK4' if method == 'rk4' else 'Heun'}: order, a free cable", reference=f"{order}",
        source="Hairer, Norsett & Wanner, Solving ODEs I", error=abs(fitted_order(steps, errors) - order), allowed=0.3,
        unit="in the order", order=fitted_order(steps, errors), wanted=f"{order}",
    )  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("formulation", ["cable", "assumed_strain", "full"])
def test_free_beam_keeps_energy_and_momentum(formulation: str, book: Book) -> None:
    found = run(thrown(formulation), np.linspace(0.0, 1.0, 6), "dopri5", rtol=1e-10, atol=1e-12)
    assert np.abs(found.energy - found.energy[0]).max() < 1e-7 * found.energy[0]
    assert np.ptp(found.linear_momentum, axis=0).max() < 1e-12
    assert np.ptp(found.momentum, axis=0).max() < 1e-9
    assert found.energy[0] > 0.1
    book(
        "Dynamics", f"Free beam, energy over 1 s ({formulation}, Dormand-Prince, 1e-10)", reference="constant",
        source="invariant", error=np.abs(found.energy / found.energy[0] - 1.0).max(), allowed=1e-7,
    )  # fmt: skip


def test_momentum_of_a_craft_with_a_rib() -> None:
    """A beam on a free body by penalties and a hinge: what one loses the other takes."""
    system = System()
    system.add(
        parts.RigidBody(
            motion="free", mass=2.0, inertia=(0.2, 0.3, 0.4), velocity=(0.1, 0.0, 0.2), angular_velocity=(0.2, 0.5, 1.5)
        ),
        "craft",
    )
    system.add(beam(position=(0.3, 0.0, 0.0)), "rib")
    system.add(parts.Joint(a=("craft", (0.3, 0.0, 0.0)), b="rib.root", stiffness=500.0), "pin")
    system.add(parts.JointSpring(a="craft", b="rib.root", stiffness=0.5, damping=0.02), "hinge")
    found = run(system.assemble(), np.linspace(0.0, 2.0, 9), "dopri5", rtol=1e-9, atol=1e-11)
    assert np.ptp(found.linear_momentum, axis=0).max() < 1e-9
    assert np.ptp(found.momentum, axis=0).max() < 1e-8
    assert found.accounts[-1, mdl.DISSIPATED] > 1e-3
    assert np.abs(found.energy_defect).max() < 1e-7 * found.energy[0]


@pytest.mark.parametrize("law", ["hunt-crossley", "paper", "conservative"])
def test_account_of_everything_at_once(law: str) -> None:
    """Gravity, loads, damping of all kinds, a hinge with stops and contact: the account closes with the step."""
    system = System(gravity=(0.0, -9.81, 0.0))
    system.add(beam(n=6, position=(-0.5, 0.65, 0.0), mass_damping=0.2, stiffness_damping=1e-3), "beam")
    system.add(parts.Joint(a=(-0.5, 0.65, 0.0), b="beam.root", stiffness=500.0, damping=1.0, until=0.3), "pin")
    system.add(
        parts.JointSpring(a="ground", b="beam.root", stiffness=0.2, damping=0.01, low=-0.3, high=0.3, stop=1.0),
        "hinge",
    )
    damping = {"paper": 0.5}.get(law, 0.3)
    system.add(
        parts.Contact(a="beam", b="ground", shape=parts.Cylinder(radius=0.6), law=law, stiffness=1e3, damping=damping),
        "hub",
    )
    system.add(parts.Load(along="beam", torque=(0.0, 0.0, -0.5), until=0.2), "torque")
    system.add(parts.Load(at="beam.tip", force=(0.0, 0.0, 0.1), start=0.1), "push")
    assembly = system.assemble()
    found = run(assembly, np.linspace(0.0, 0.5, 6), "rk4", step=2e-5)
    given = np.abs(found.accounts[-1, mdl.LOAD])
    assert given > 0.1
    assert assembly.model.contact_surfaces["touching"][0] > 0
    assert found.accounts[-1, mdl.RELEASE] < -1e-3 * given  # the strain of the pin that has let go
    assert np.abs(found.energy_defect).max() < 2e-4 * given


@pytest.mark.parametrize("formulation", ["cable", "full", "assumed_strain"])
def test_stability_limit(formulation: str) -> None:
    """Just below the limit a run goes on; just above it fails; and such a step is refused."""
    system = thrown(formulation, bend=0.05)
    limit = choose_step(system, "rk4", None, 1.0)[1]
    samples = np.array([0.0, 6000.0 * limit])
    below = solve(system, samples=samples, method="rk4", step=0.98 * limit)
    assert below.success, below.message
    above = solve(system, samples=samples, method="rk4", step=1.03 * limit, unsafe_step=True)
    assert above.status == "failed"
    with pytest.raises(InputError, match=r"above the stability limit .* of rk4 .* in 'beam'"):
        solve(system, samples=samples, method="rk4", step=1.03 * limit)


def test_largest_frequency_by_lanczos_and_by_the_whole_matrix() -> None:
    """A cable of many elements tends to the same limit, element by element."""
    thin = elements.Rectangle(thickness=1e-4, width=0.03)  # whose fastest mode is a wave along it
    few, many = (fastest_mode(thrown(n=n, section=thin)).frequency * LENGTH / n for n in (16, 64))
    assert few == pytest.approx(many, rel=0.02)
    stiff = fastest_mode(pendulum(stiffness=1e6)).frequency
    assert stiff > 3.0 * fastest_mode(pendulum()).frequency


def test_contact_counts_in_the_limit() -> None:
    """A light beam on a stiff hub: the limit is that of the contact, and it holds."""
    system = System(gravity=(0.0, -9.81, 0.0))
    system.add(beam(n=6, position=(-1.0, 0.61, 0.0)), "beam")
    system.add(parts.Contact(a="beam", b="ground", shape=parts.Cylinder(radius=0.6), stiffness=1e6, damping=0.0), "hub")
    assembly = system.assemble()
    alone = choose_step(thrown(n=6), "rk4", None, 1.0)[1]
    limit = choose_step(assembly, "rk4", None, 1.0)[1]
    assert limit < 0.2 * alone
    assert solve(assembly, samples=[0.0, 0.2], method="rk4", step=0.5 * limit).success
    above = solve(assembly, samples=[0.0, 0.2], method="rk4", step=2.5 * limit, unsafe_step=True)
    assert above.status == "failed"


def test_damping_counts_in_the_limit() -> None:
    plain, damped = (choose_step(thrown(stiffness_damping=b), "rk4", None, 1.0)[1] for b in (0.0, 0.05))
    assert damped < 0.2 * plain
    system = thrown(stiffness_damping=0.05)
    assert solve(system, samples=[0.0, 0.2], method="rk4", step=0.95 * damped).success
    assert not solve(system, samples=[0.0, 0.2], method="rk4", step=1.1 * damped, unsafe_step=True).success


def craft_with_rib() -> System:
    """A rib that is clamped to a free body as a constraint, a mass on its tip."""
    system, w = System(), np.array([0.2, 0.5, 1.5])
    moves = {"velocity": (0.1, 0.0, 0.2), "angular_velocity": tuple(w)}
    system.add(parts.RigidBody(mass=2.0, inertia=(0.2, 0.3, 0.4), **moves), "craft")
    place = np.array([0.3, 0.0, 0.0])
    rib = beam("full", position=tuple(place))
    rates = np.cross(w, rib.start_nodes())
    rates[:, 0] += moves["velocity"]
    system.add(rib.model_copy(update={"rates": rates}), "rib")
    system.add(parts.Joint(a=("craft", place), b="rib.root", type="clamp"), "clamp")
    system.add(parts.Point(mass=0.1, at="rib.tip"), "bob")
    return system


def test_a_constraint_on_a_rib_keeps_momentum_and_energy() -> None:
    """What the craft loses the rib takes; neither the clamp's gap nor the energy drifts."""
    assembly = craft_with_rib().assemble()
    found = run(assembly, np.linspace(0.0, 0.5, 3), "rk4")
    assert np.ptp(found.linear_momentum, axis=0).max() < 1e-12
    assert np.ptp(found.momentum, axis=0).max() < 1e-8
    assert np.abs(found.energy_defect).max() < 1e-6 * found.energy[0]
    y, model = found.y[-1].copy(), assembly.model
    rigid.kinematics(0.5, y, model)
    for k in range(model.joints.size):
        joint.joint_geometry(0.5, y, k, model)
    assert np.abs(model.constraints["gap"]).max() < 1e-13
    assert np.abs(model.constraints["rate"]).max() < 1e-12
    implicit = solve_implicit(assembly, samples=found.t, step=2.5e-4, spectral_radius=0.9)
    assert implicit.success, implicit.message
    assert np.abs(place(assembly, implicit.y[-1]) - place(assembly, found.y[-1])).max() < 1e-4
    root = found.solution.la[1:, :3]  # the clamp's force, by the multipliers of both
    assert np.abs(root - implicit.la[1:, :3]).max() < 0.02 * np.abs(root).max()


@pytest.mark.parametrize("formulation", ["cable", "full"])
def test_stability_limit_of_a_held_beam(formulation: str) -> None:
    """A clamp as a constraint sets no limit of its own: that of the rest of the beam holds."""
    system = System()
    rates = np.zeros_like(beam(formulation).start_nodes())
    rates[2:, 0, 1] = 0.05
    system.add(beam(formulation, rates=rates), "beam")
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="beam.root", type="clamp", hold="section"), "clamp")
    assembly = system.assemble()
    free, limit = (choose_step(one, "rk4", None, 1.0)[1] for one in (thrown(formulation, bend=0.05), assembly))
    assert limit >= 0.999 * free
    samples = np.array([0.0, 6000.0 * limit])
    below = solve(assembly, samples=samples, method="rk4", step=0.98 * limit)
    assert below.success, below.message
    assert solve(assembly, samples=samples, method="rk4", step=1.03 * limit, unsafe_step=True).status == "failed"


def test_a_redundant_constraint_on_a_beam_is_refused() -> None:
    system = craft_with_rib()
    system.add(parts.Joint(a=("craft", (0.3, 0.0, 0.0)), b="rib.root"), "pin")
    with pytest.raises(InputError, match="is redundant: the other constraints already imply it, which rk4"):
        solve(system.assemble(), samples=[0.0, 1.0], method="rk4", step=1e-5)


def test_a_joint_is_a_penalty_as_a_whole() -> None:
    """Directions may have a stiffness of their own; it is no constraint where points are penalties."""
    system = System()
    system.add(beam(), "beam")
    held = {"a": (0.0, 0.0, 0.0), "b": "beam.root", "type": "clamp", "stiffness": 500.0}
    system.add(parts.Joint(**held, rotational_stiffness=2.0), "clamp")
    assert system.assemble().model.joints["stiffness"].tolist() == [500.0] * 3 + [2.0] * 2
    refused = System()
    refused.add(beam(), "beam")
    refused.add(parts.Joint(**held, rotational_stiffness=0.0), "clamp")
    with pytest.raises(InputError, match=r"clamp.rotational_stiffness is 0\.0, but clamp.stiffness is 500.0"):
        refused.assemble()
