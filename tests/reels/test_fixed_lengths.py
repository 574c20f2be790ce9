"""Threads with segments of fixed length under implicit methods and in equilibrium: as under dopri5, closed forms."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

from evolvent import InputError, System, parts
from evolvent.algebra.ordering import matrix_of, operations
from evolvent.families.joints import joint
from evolvent.kernels import rigid
from evolvent.solvers import Solution, solve
from evolvent.solvers.common.coordinates import with_positions
from evolvent.solvers.common.graph import pattern_of
from evolvent.solvers.modal.modes import modes
from evolvent.solvers.static.static import solve_static
from evolvent.solvers.time.implicit.plan import ENERGY_MOMENTUM, NAME as ALPHA, solve_implicit
from implicit.rigs import Equations

Array = np.ndarray
G = 9.81
INERTIA = np.diag([0.5, 0.4, 0.6]).tolist()
FREE_BODY = parts.RigidBody(mass=3.0, inertia=INERTIA, angular_velocity=(0.2, 0.1, 3.0))
SPINNING = parts.RigidBody(motion="spin", inertia=INERTIA, axis=(0.0, 0.0, 1.0), rate=3.0)


def thread_on(body: parts.RigidBody, drive: Any, *, gravity: Any = (0.0, 0.0, 0.0), **thread: Any) -> System:
    """A thread of four segments of 0.25 m along x from a reel on a body."""
    system = System(gravity=gravity)
    system.add(body, "hub")
    system.add(parts.Reel(body="hub", centre=(0.3, 0.0, -0.1), radius=0.1, drive=drive), "reel")
    own = {"length": 1.0, "line_density": 0.1, "tip_mass": 0.2, "nodes": 4} | thread
    system.add(parts.Thread(reel="reel", segments="inextensible", **own), "thread")
    return system


PAID_OUT = parts.ConstantDrive(rate=2.0, angle=2.0)
#: Systems in which nodes leave or come back within 1.5 s, or the whole thread leaves.
SYSTEMS = {
    "paid out on a free body": lambda: thread_on(FREE_BODY, PAID_OUT, wound_mass="carried"),
    "two threads, a tape, on a body that spins": lambda: thread_on(
        SPINNING, PAID_OUT, multiplicity=2, thickness=2e-3
    ),
    "a free spool": lambda: thread_on(
        FREE_BODY, parts.FreeSpool(inertia=0.02, angle=2.0, rate=1.0, viscous_damping=1e-3), wound_mass="carried"
    ),
    "a thread that leaves": lambda: thread_on(
        SPINNING, parts.ConstantDrive(rate=2.0, angle=1.0), length=0.35, nodes=2, separates=True
    ),
    "taken up": lambda: thread_on(SPINNING, parts.ConstantDrive(rate=-2.5, angle=6.0), wound_mass="carried"),
}  # fmt: skip
TIMES = np.linspace(0.0, 1.5, 16)


@dataclasses.dataclass
class Compared:
    """Solutions of one system: by dopri5, and by method and number of steps."""

    exact: Solution
    found: dict[tuple[str, int], Solution]

    def error(self, method: str, steps: int, field: str) -> float:
        """Largest difference of an observation from that of dopri5, beside the largest value there."""
        exact = getattr(self.exact.observations, field)
        return float(np.abs(getattr(self.found[method, steps].observations, field) - exact).max() / np.abs(exact).max())


@pytest.fixture(scope="module", params=SYSTEMS)
def compared(request: pytest.FixtureRequest) -> Compared:
    """A system under all methods."""
    assembly = SYSTEMS[request.param]().assemble()
    exact = solve(assembly, samples=TIMES, method="dopri5", rtol=1e-9, atol=1e-11)
    found = {
        (method, steps): solve_implicit(assembly, samples=TIMES, method=method, step=TIMES[-1] / steps)
        for method in (ALPHA, ENERGY_MOMENTUM)
        for steps in ((300, 4800) if request.param == "taken up" else (150, 300))
    }  # fmt: skip
    for one in (exact, *found.values()):
        assert one.success, one.message
    return Compared(exact, found)


@pytest.mark.slow
@pytest.mark.parametrize("method", [ALPHA, ENERGY_MOMENTUM])
def test_motions_are_those_of_dopri5(compared: Compared, method: str) -> None:
    """Positions, velocities, tensions and rates, of second order in the step, over nodes that leave and come back.

    The last link of a node that comes back swings ever faster: only steps far below 1 ms resolve it.
    """
    coarse, fine = sorted({steps for _, steps in compared.found})
    for field in ("position", "velocity", "tension", "body_rate", "spool"):
        errors = [compared.error(method, steps, field) for steps in (coarse, fine)]
        if fine == 4800:
            assert errors[0] < 2e-2, field
            assert errors[1] < 5e-4, field
        else:
            assert errors[1] < 5e-4, field
            assert errors[1] < 0.4 * errors[0] or errors[1] < 5e-5, field
    found, exact = compared.found[method, fine], compared.exact
    assert found.event_kinds.tolist() == exact.event_kinds.tolist() != []
    assert found.event_times == pytest.approx(exact.event_times, abs=1e-4)


@pytest.mark.slow
@pytest.mark.parametrize("method", [ALPHA, ENERGY_MOMENTUM])
def test_energies_and_momenta_close(compared: Compared, method: str) -> None:
    """The spool's work is that of dopri5; energy-momentum closes its balance where nothing holds bodies."""
    found, exact = compared.found[method, max(steps for _, steps in compared.found)], compared.exact
    free = bool(np.all(found.model.bodies["motion"] == rigid.FREE))
    assert found.statistics["energy_defect"] < (1e-8 if method == ENERGY_MOMENTUM and free else 1e-3)
    moved = float(found.statistics["energy_moved"])
    for name in ("kinetic", "spools", "released", "by_springs"):
        assert np.abs(found.balance[name] - exact.balance[name]).max() < 2e-3 * moved, name
    momentum = found.momentum
    size = np.abs(momentum.angular).max()
    assert np.abs(momentum.angular - exact.momentum.angular).max() < 2e-3 * size
    assert np.abs(momentum.drift_angular[:, 2]).max() < 1e-3 * size


@pytest.mark.slow
@pytest.mark.parametrize("name", ["two threads, a tape, on a body that spins", "taken up"])
def test_what_is_lost_is_the_filter_of_held_systems(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Without it energy-momentum closes the balance of a spinning body to round-off too, over its events."""
    for module in ("setup", "run"):
        monkeypatch.setattr(f"evolvent.solvers.time.implicit.{module}.acts_from_outside", lambda *_: False)
    found = solve_implicit(SYSTEMS[name]().assemble(), samples=TIMES, method=ENERGY_MOMENTUM, step=0.01)
    assert found.success, found.message
    assert found.statistics["energy_defect"] < 1e-8


@pytest.mark.slow
def test_energy_momentum_keeps_momenta_to_round_off() -> None:
    """At the ends of steps, as long as no node leaves."""
    times = np.linspace(0.0, 0.2, 5)
    found = solve_implicit(SYSTEMS["paid out on a free body"]().assemble(), samples=times, method=ENERGY_MOMENTUM,
                           step=0.025)  # fmt: skip
    assert found.success, found.message
    momentum = found.momentum
    assert np.abs(momentum.drift_angular).max() < 1e-10 * np.abs(momentum.angular).max()
    assert np.abs(momentum.drift_linear).max() < 1e-10 * np.abs(momentum.angular).max()


@pytest.mark.parametrize("rates", [0.0, 0.3])
@pytest.mark.parametrize("name", SYSTEMS)
def test_the_tangent_is_that_of_the_residual(name: str, rates: float, rng: np.random.Generator) -> None:
    """By differences, multipliers and the mass wound on a free spool included; at rest, and with rates."""
    assembly = with_positions(SYSTEMS[name]().assemble())
    model, y = assembly.model, assembly.y.copy()
    n_q, n_v = int(model.info.nq), int(model.info.nv)
    model.switches[:] = assembly.s
    first, count = int(model.threads["iq"][0]), 3 * int(assembly.s[0])
    y[first : first + count] += 0.02 * np.sin(1.0 + np.arange(count))
    y[n_q:] = 0.0
    y[n_q : n_q + n_v] = rates * rng.standard_normal(n_v)
    la = np.where(model.constraints["until"] > 0.0, 1.3 + np.arange(model.constraints.size), 0.0)
    equations = Equations(assembly, 0.0, y, rates * rng.standard_normal(n_v), 1e2, 10.0 * rates)
    found, exact = equations.tangent(la), equations.differences(la, np.full(n_v, 0.1))
    assert np.count_nonzero(model.constraints["until"] > 0.0) == assembly.s[0]
    assert np.abs(found - exact).max() < 1e-9 * np.abs(exact).max()


# ------------------------------------------------------------------------------------------------ equilibria, modes


def chain(*, direction: Any = (0.0, 0.0, -1.0), gravity: Any = (0.0, 0.0, -G), body: Any = None, **more: Any) -> System:
    """Four segments and a half of six, out of a reel at the origin."""
    system = System(gravity=gravity)
    system.add(body or parts.RigidBody(motion="driven"), "hub")
    drive = parts.ConstantDrive(rate=0.0, angle=9.0)
    system.add(parts.Reel(body="hub", centre=(0.0, 0.0, -0.1), radius=0.1, drive=drive), "reel")
    own = {"length": 1.2, "line_density": 0.2, "tip_mass": 0.3, "nodes": 6} | more
    system.add(parts.Thread(reel="reel", segments="inextensible", direction=direction, **own), "thread")
    return system


#: Its masses from the tip on, and the lengths of the segments inwards of them.
MASSES, LENGTHS = np.array([0.32, 0.04, 0.04, 0.04, 0.04]), np.array([0.2, 0.2, 0.2, 0.2, 0.1])


def across(tension: Array) -> Array:
    """Stiffness of the chain across itself under tensions of its segments."""
    k = tension / LENGTHS
    return np.diag(k) + np.diag(np.append(0.0, k[:-1])) - np.diag(k[:-1], 1) - np.diag(k[:-1], -1)


@pytest.mark.parametrize("direction", [(0.0, 0.0, -1.0), (1.0, 0.0, 0.0), (0.3, 0.1, 0.95)])
def test_a_chain_hangs_and_swings(direction: Any) -> None:
    """From any direction at the start it hangs by its weight; its modes are those of rigid links on point masses."""
    system = chain(direction=tuple(np.array(direction) / np.linalg.norm(direction)))
    assembly = system.assemble()
    found = solve_static(assembly)
    assert found.success, found.message
    assert found.path.unstable == 0
    tension = G * np.cumsum(MASSES)
    seen = found.observations
    assert seen.tension[-1] == pytest.approx([*tension, 0.0], rel=1e-9, abs=1e-12)
    z = -np.cumsum(LENGTHS[::-1])[::-1]
    assert seen.position[-1, :5] == pytest.approx(np.stack([0.0 * z, 0.0 * z, z], axis=1), abs=1e-9)
    w = np.sqrt(np.sort(np.linalg.eigvals(across(tension) / MASSES[:, None]).real))
    vibrating = modes(assembly, equilibrium=found, count=20)
    assert vibrating.frequency == pytest.approx(np.repeat(w, 2), rel=1e-8)  # none along it
    assert np.abs(vibrating["thread"].displacement[0]).max() > 0.0


def test_a_chain_in_the_wind() -> None:
    """Every segment lies along the sum of what pulls on the nodes outside it."""
    wind = 3.0
    system = chain()
    system.add(parts.Load(along="thread", force=(wind, 0.0, 0.0)), "wind")
    found = solve_static(system.assemble())
    assert found.success, found.message
    spans = np.array([0.1, 0.2, 0.2, 0.2, 0.2])
    pull = np.cumsum(np.stack([wind * spans, 0.0 * spans, -G * MASSES], axis=1), axis=0)
    tension = np.linalg.norm(pull, axis=1)
    steps = pull / tension[:, None] * LENGTHS[:, None]
    assert found.observations.tension[-1, :5] == pytest.approx(tension, rel=1e-9)
    assert found.observations.position[-1, :5] == pytest.approx(np.cumsum(steps[::-1], axis=0)[::-1], abs=1e-9)


def test_a_chain_that_turns() -> None:
    """Tensions by the turn; across its plane the chain is stiffer than in it by W^2 m (no hub)."""
    W = 2.0
    body = parts.RigidBody(motion="driven", rate=W, axis=(0.0, 0.0, 1.0))
    system = chain(direction=(1.0, 0.0, 0.0), gravity=(0.0, 0.0, 0.0), body=body)
    found = solve_static(system.assemble(), rotating="hub")
    assert found.success, found.message
    x = np.cumsum(LENGTHS[::-1])[::-1]
    tension = W**2 * np.cumsum(MASSES * x)
    assert found.observations.tension[-1, :5] == pytest.approx(tension, rel=1e-9)
    squares = np.linalg.eigvals(across(tension) / MASSES[:, None]).real
    wanted = np.sort(np.concatenate([squares, squares - W**2]))
    vibrating = modes(system.assemble(), rotating="hub", count=10)
    assert np.sort(vibrating.frequency**2) == pytest.approx(wanted, rel=1e-7, abs=1e-7 * W**2)


def test_states_of_other_methods_are_taken() -> None:
    """A state of dopri5 has directions: the equilibrium from there is that from the start."""
    system = chain(direction=(1.0, 0.0, 0.0))
    assembly = system.assemble()
    run = solve(assembly, samples=np.array([0.0, 0.2]), method="dopri5")
    found = solve_static(assembly, y=run.y[-1])
    assert found.success, found.message
    assert found.observations.tension[-1, :5] == pytest.approx(G * np.cumsum(MASSES), rel=1e-8)


def test_a_free_spool_has_no_equilibrium() -> None:
    with pytest.raises(InputError, match="'thread' is a thread with segments of fixed length on a free spool, which "
                                         "equilibrium does not support"):  # fmt: skip
        solve_static(SYSTEMS["a free spool"]().assemble())


def test_redundant_constraints_are_refused() -> None:
    system = SYSTEMS["paid out on a free body"]()
    system.add(parts.Joint(a="ground", b="hub", type="clamp", position=(0.0, 0.0, 0.0)), "clamp")
    system.add(parts.Joint(a="ground", b="hub", position=(0.0, 0.0, 0.0)), "ball")
    with pytest.raises(InputError, match="is redundant: the other constraints already imply it, which the thread "
                                         "'thread' with segments of fixed length"):  # fmt: skip
        solve_implicit(system.assemble(), samples=TIMES, step=0.01)


def test_segments_stand_behind_the_joints_of_parts() -> None:
    """Rows of parts keep their numbers; those of wound nodes do not hold."""
    system = SYSTEMS["paid out on a free body"]()
    system.add(parts.Joint(a="hub", b=(0.0, 0.0, 2.0), type="link", length=2.0), "link")
    assembly = system.assemble()
    found = with_positions(assembly)
    assert found.row_parts == [*assembly.row_parts, *["thread"] * 4]
    own = found.model.joints["kind"] == joint.SEGMENT
    assert own.tolist() == [False, True, True, True, True]
    assert (found.model.constraints["until"][own] > 0.0).tolist() == [True, False, False, False]
    assert with_positions(found) is found


@pytest.mark.parametrize("body", [FREE_BODY, SPINNING], ids=["free", "spinning"])
@pytest.mark.parametrize("drive", [PAID_OUT, parts.FreeSpool(inertia=0.02, angle=2.0)], ids=["driven", "free"])
def test_the_cost_of_a_step_is_linear_in_the_number_of_nodes(body: parts.RigidBody, drive: Any) -> None:
    """Also where the multipliers of all segments join their nodes to a body that moves, and to the spool."""
    found = [
        operations(matrix_of(pattern_of(with_positions(thread_on(body, drive, nodes=n).assemble()).model)))
        for n in (20, 40, 80)
    ]
    assert found[2] - found[1] == 2 * (found[1] - found[0])
