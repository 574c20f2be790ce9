"""The segment at the spool with the stiffness of its length: closed forms, energy, tangents, explicit steps."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import evolvent
from evolvent import InputError, System, cases, parts
from evolvent.assembly.assembled import Assembly
from evolvent.equations import energy_momentum as flow
from evolvent.families.threads.part import Thread
from evolvent.kernels.thread import boundary
from evolvent.solvers import solve
from evolvent.solvers.common.matrices import matrix_of
from evolvent.solvers.common.observations import observe
from evolvent.solvers.static.work import sparse_of
from evolvent.solvers.time.explicit.plan import stable_step
from evolvent.solvers.time.implicit import energy_momentum
from evolvent.solvers.time.implicit.energy_momentum import solve_energy
from evolvent.solvers.time.implicit.plan import solve_implicit
from evolvent_papers.papers.thread_variants import Data, deploy
from helpers import Array, Run, heliogyro, run, tangent_columns

#: E A of the thread, N; its mass per length, kg/m.
EA, RHO = 50.0, 0.4
BY_LENGTH = {"boundary_segment": "by-length"}
SPOOL = {"inertia": 0.01, "rate": 0.3, "viscous_damping": 0.01}


def craft(angle: float, *, free: bool = True, nodes: int = 4, length: float = 1.0, **thread: Any) -> Assembly:
    """A reel of radius 0.1 m on a body at rest, with 0.1 `angle` of a thread out along x."""
    system = System()
    system.add(parts.RigidBody(motion="driven", rate=0.0), "hub")
    drive = parts.FreeSpool(angle=angle, **SPOOL) if free else parts.ConstantDrive(rate=0.0, angle=angle)
    system.add(parts.Reel(body="hub", radius=0.1, centre=(0.0, 0.0, -0.1), drive=drive), "reel")
    given = {"line_density": RHO, "stiffness": EA * nodes / length, "wound_mass": "carried"} | BY_LENGTH | thread
    system.add(parts.Thread(reel="reel", length=length, nodes=nodes, **given), "thread")
    return system.assemble()


# ------------------------------------------------------------------------------------------------ closed forms


@pytest.mark.slow
@pytest.mark.parametrize(("nodes", "out"), [(1, 0.3), (4, 0.63), (7, 0.63)])
def test_a_light_thread_of_any_length_is_one_spring(nodes: int, out: float) -> None:
    """EA/out, whatever the segments: elongation m g out/EA, frequency sqrt(EA/(m out))."""
    system, m, g = System(gravity=(0.0, 0.0, -9.81)), 0.5, 9.81
    system.add(parts.RigidBody(motion="driven"), "hub")
    drive = parts.ConstantDrive(rate=0.0, angle=10.0 * out)
    reel = parts.Reel(body="hub", radius=0.1, payout_axis=(0.0, 0.0, -1.0), spool_axis=(0.0, 1.0, 0.0), drive=drive)
    system.add(reel, "reel")
    system.add(
        parts.Thread(reel="reel", length=1.0, line_density=1e-9, tip_mass=m, nodes=nodes, stiffness=EA * nodes),
        "thread",
    )  # fmt: skip
    still = system.equilibrium()
    z = still["thread"].tip_position.values[-1, 2]
    assert z == pytest.approx(-out - m * g * out / EA, rel=1e-6)
    assert still["thread"].energy_elastic.values[-1] == pytest.approx(0.5 * (m * g) ** 2 * out / EA, rel=1e-6)
    found = system.modes(count=3).frequency_hz
    assert np.abs(found * 2.0 * math.pi - math.sqrt(EA / (m * out))).min() < 1e-4 * math.sqrt(EA / (m * out))


def test_a_mass_reeled_in_and_out_as_one_equation_has_it() -> None:
    """m x'' = -EA (x - b)/b with b(t) given; the drive does the work of T (1 + strain/2)."""
    m, end, b0, speed = 0.5, 3.0, 0.6, -0.15
    system = System()
    system.add(parts.RigidBody(motion="driven"), "hub")
    drive = parts.RampDrive(rate=0.0, angle=b0 / 0.1, steps=[(0.2, 0.5, speed / 0.1)])
    system.add(parts.Reel(body="hub", radius=0.1, centre=(0.0, 0.0, -0.1), drive=drive), "reel")
    thread = {"line_density": 1e-12, "tip_mass": m, "nodes": 1, "stiffness": EA}
    system.add(parts.Thread(reel="reel", length=1.0, **thread, **BY_LENGTH), "thread")
    assembly = system.assemble()
    q, v = int(assembly.model.threads["iq"][0]), int(assembly.model.threads["iv"][0])
    assembly.y[q], assembly.y[v] = 1.2 * b0, 0.0

    def length(t: float) -> tuple[float, float]:
        s = min(max((t - 0.2) / 0.5, 0.0), 1.0)
        paid = speed * (0.5 * s**4 * (2.5 - 3.0 * s + s * s) + max(t - 0.7, 0.0))
        return b0 + paid, speed * s**3 * (10.0 - 15.0 * s + 6.0 * s * s)

    def slope(t: float, y: Array) -> list[float]:
        b, rate = length(t)
        strain = (y[0] - b) / b
        return [y[1], -EA * strain / m, -EA * strain * (1.0 + 0.5 * strain) * rate]

    t = np.linspace(0.0, end, 16)
    exact = solve_ivp(slope, (0.0, end), [1.2 * b0, 0.0, 0.0], t_eval=t, rtol=1e-11, atol=1e-13, max_step=0.01).y
    assert length(end)[0] < 0.3
    found = run(assembly, t, rtol=1e-10, atol=1e-12)
    assert found.y[:, q] == pytest.approx(exact[0], abs=1e-7)
    assert found.accounts[:, 1] == pytest.approx(exact[2], abs=1e-7)
    assert np.abs(found.energy_defect).max() < 1e-8
    implicit = solve_implicit(assembly, samples=t, step=2e-4, spectral_radius=1.0)
    assert implicit.y[:, q] == pytest.approx(exact[0], abs=1e-4)
    kept = solve_energy(assembly, samples=t, step=1e-3, spectral_radius=1.0)
    assert kept.y[:, q] == pytest.approx(exact[0], abs=1e-3)
    assert kept.statistics["energy_defect"] < 1e-12


# ------------------------------------------------------------------------------------------------ energy


def turning(motion: str, drive: Any, **thread: Any) -> Assembly:
    """A tumbling body whose thread passes a release and the shortest length that counts."""
    own = {"free": {"mass": 5.0, "inertia": (0.3, 0.4, 0.5), "angular_velocity": (0.1, 0.05, 1.5)}}
    turn = own.get(motion, {"motion": motion, "inertia": 0.5, "axis": (0.0, 0.0, 1.0), "rate": 1.5})
    system = System()
    system.add(parts.RigidBody(**turn), "hub")
    system.add(parts.Reel(body="hub", centre=(0.3, 0.05, -0.1), radius=0.1, drive=drive), "reel")
    given = {"wound_mass": "carried", "stiffness": 200.0, "damping": 0.5, "shortest_fraction": 0.3}
    system.add(
        parts.Thread(reel="reel", length=1.5, nodes=6, line_density=0.4, tip_mass=0.1, **given, **BY_LENGTH, **thread),
        "thread",
    )
    return system.assemble()


CASES = {
    "driven spool": ("spin", parts.RampDrive(rate=0.0, angle=4.0, steps=[(0.1, 0.4, 10.0)]), {}),
    "slack": ("free", parts.RampDrive(rate=0.0, angle=4.0, steps=[(0.1, 0.4, 10.0)]), {"slack": True}),
    "free spool": ("free", parts.FreeSpool(inertia=0.002, angle=4.0, rate=3.0, torque=1e-2), {}),
    "tape on a free spool": ("free", parts.FreeSpool(inertia=0.002, angle=4.0, rate=3.0), {"thickness": 1e-3}),
    "reeled in": ("free", parts.ConstantDrive(rate=-4.0, angle=6.0), {}),
}


@pytest.mark.parametrize("name", CASES)
def test_energy_closes_in_all_formulations(name: str) -> None:
    """To round-off with energy-momentum, by the tolerance with the others; all have the same motion."""
    motion, drive, thread = CASES[name]
    assembly, t = turning(motion, drive, **thread), np.linspace(0.0, 0.6, 7)
    n = int(assembly.model.info.nq)
    exact = solve(assembly, samples=t, method="dopri5", rtol=1e-9, atol=1e-11)
    seen = Run(assembly, exact, observe(assembly.model, exact.t, exact.y, exact.s))
    assert exact.event_times.size == 1
    assert np.abs(seen.energy_defect).max() < 5e-7
    kept = solve_energy(assembly, samples=t, step=1e-3, spectral_radius=1.0)
    assert kept.success, kept.message
    assert kept.statistics["energy_defect"] < 1e-12
    assert np.abs(kept.y - exact.y)[-1, :n].max() < 3e-4
    alpha = solve_implicit(assembly, samples=t, step=1e-3, spectral_radius=0.9)
    assert alpha.success, alpha.message
    assert np.abs(alpha.y - exact.y)[-1, :n].max() < 1e-3
    assert np.abs(alpha.energy_defect).max() < 1e-3 * alpha.energy.max()


@pytest.mark.slow
def test_the_independent_model_of_the_paper_agrees() -> None:
    """`papers.thread_variants` in rotating axes, with steps that end at releases, over 10 s."""
    own = deploy(Data(stiffness=1e3), "scaled", until=10.0)
    case = {"blade.stiffness": 1e3, "blade.boundary_segment": "by-length", "blade.shortest_fraction": 0.2}
    changes = {"solver.duration": float(own.t[40]), "output.every": float(own.t[1]), "output.fine": False}
    engine = evolvent.run("heliogyro", case | changes)
    assert engine.body_rate.values == pytest.approx(own.rate[:41], rel=2e-6)
    assert np.degrees(engine.tip_lag.values[1:, 0]) == pytest.approx(own.lag[1:41], abs=2e-3)


# ------------------------------------------------------------------------------------------------ tangents


#: Angle, thread, stretch: long, slack and stretched, below the shortest length, slack and short.
STATES = {
    "long": (6.5, {}, 0.2),
    "slack thread": (6.5, {"slack": True}, 0.17),
    "below the shortest": (5.1, {"shortest_fraction": 0.3}, 0.2),
    "contracted": (6.5, {"slack": True}, -0.2),
}


def stretched(name: str) -> tuple[Assembly, int]:
    """A straight thread on a free spool, its segments stretched much; first coordinate among the velocities."""
    angle, thread, stretch = STATES[name]
    assembly = craft(angle, damping=0.7, **thread)
    threads, out = assembly.model.threads, 3 * int(assembly.s[0])
    q, v = int(threads["iq"][0]), int(threads["iv"][0])
    assembly.y[q : q + out : 3] *= 1.0 + stretch
    assembly.y[v : v + out : 3] += 0.1 * np.arange(out // 3, 0, -1)
    return assembly, v - int(assembly.model.info.nq)


@pytest.mark.parametrize("name", STATES)
def test_the_tangent_of_a_state_is_exact(name: str, rng: np.random.Generator) -> None:
    """Of a straight thread; of others in `test_paid_out_aslant`."""
    assembly, _ = stretched(name)
    found, differences = tangent_columns(assembly, assembly.y, rng)
    assert np.abs(found - differences).max() < 1e-7 * np.abs(found).max()


@pytest.mark.parametrize("change", [0.07, 0.0, -0.1, -0.14])
@pytest.mark.parametrize("name", STATES)
def test_the_tangent_of_a_step_is_exact(name: str, change: float) -> None:
    """Along the thread and of the spool, which pays out `change` m; some reel in past the shortest length."""
    assembly, first = stretched(name)
    plan = energy_momentum.plan(assembly, samples=[0.0, 1.0], step=0.1)
    model, work = plan.assembly.model, plan.workspace().step
    if 0.1 * STATES[name][0] + change - 0.25 * (int(assembly.s[0]) - 1) <= 0.0:
        pytest.skip("the segment has no length at the end")
    work.step.t, work.step.h, work.step.ratio = 0.0, 0.1, 0.0
    flow.measure(0, model, work)
    n, out = int(model.info.nv), 3 * int(assembly.s[0])
    spool = int(model.threads["spool_v"][0]) - int(model.info.nq)
    at = [*range(first, first + out, 3), spool]
    dq = np.zeros(n)
    dq[at[:-1]] = 0.019 * np.arange(out // 3, 0, -1)
    dq[spool] = 10.0 * change

    def residual(d: Array) -> Array:
        work.dq[:] = dq + d
        flow.residual(model, work)
        return 2.0 * np.array(work.r)

    columns = []
    for e in 1e-4 * np.eye(n)[at]:
        pairs = ((1, 45.0), (2, -9.0), (3, 1.0))
        columns.append(sum(w * (residual(i * e) - residual(-i * e)) for i, w in pairs) / 60e-4)
    residual(np.zeros(n))
    matrix = matrix_of(model)
    flow.tangent(1.0, model, work, matrix)
    exact = np.array(columns).T[at]
    np.testing.assert_allclose(sparse_of(matrix).toarray()[np.ix_(at, at)], exact, atol=1e-8 * np.abs(exact).max())


# ------------------------------------------------------------------------------------------------ explicit steps


@pytest.mark.parametrize("shortest", [0.05, 0.3, 1.0])
def test_the_step_limit_follows_the_stiffest_segment(shortest: float) -> None:
    """The bound of the frequency is above that of the tangent where a segment is shortest, by 42 % at most.

    The tip has half the mass of a node.
    """
    thread = {"nodes": 5, "shortest_fraction": shortest}
    first, limit = stable_step(craft(6.5, free=False, **thread), "rk4", 10.0)
    largest = 0.0
    for nodes in range(4):
        short = craft(10.0 * (0.2 * nodes + 0.2 * shortest * (1.0 - 1e-9)), free=False, **thread)
        found, _ = tangent_columns(short, short.y, np.random.default_rng(0), mass=0.0, rate=0.0)
        threads, out = short.model.threads, 3 * int(short.s[0])
        at = np.arange(out // 3) * 3 + int(threads["iv"][0]) - int(short.model.info.nq)
        root = np.sqrt(short.model.nodes["mass"][: out // 3])
        largest = max(largest, math.sqrt(np.linalg.eigvalsh(found[np.ix_(at, at)] / np.outer(root, root)).max()))
    assert largest <= first.frequency <= 1.42 * largest
    assert limit == pytest.approx(2.0 * math.sqrt(2.0) / first.frequency, rel=0.02)


@pytest.mark.parametrize(("damping", "factor"), [(0.0, math.sqrt(5.5)), (3.0, 5.5)])
def test_the_step_is_shorter_by_what_limits_it(damping: float, factor: float) -> None:
    """(1 + l0/S)/2 where damping limits it, its root where stiffness does; l0/S is 10."""
    steps = [
        stable_step(heliogyro(segments="springs", stiffness=1e4, damping=damping, **own), "rk4", 10.0)[1]
        for own in ({}, BY_LENGTH)
    ]
    assert steps[0] / steps[1] == pytest.approx(factor, rel=0.01)


def test_a_segment_after_a_take_back_is_longer_than_a_whole_one() -> None:
    """By the capture fraction; with `shortest_fraction` 1 it is softer by as much, and stiffer never."""
    system = System()
    system.add(parts.RigidBody(motion="driven", rate=0.0), "hub")
    drive = parts.ConstantDrive(rate=-1.0, angle=5.5)
    system.add(parts.Reel(body="hub", radius=0.1, centre=(0.0, 0.0, -0.1), drive=drive), "reel")
    own = {"line_density": RHO, "stiffness": 4 * EA, "wound_mass": "carried", "capture_fraction": 0.05, "damping": 0.5}
    system.add(parts.Thread(reel="reel", length=1.0, nodes=4, shortest_fraction=1.0, **own, **BY_LENGTH), "thread")
    assembly = system.assemble()
    found = solve(assembly, samples=[0.0, 0.3, 0.6], method="dopri5", rtol=1e-8, atol=1e-10)
    assert found.event_times == pytest.approx([0.375], abs=1e-6)
    threads, l0 = assembly.model.threads, 0.25
    factors = [boundary.length_factor(threads, 0, share * l0)[0] for share in (0.5, 1.0, 1.05)]
    assert factors == pytest.approx([1.0, 1.0, 1.0 / 1.05], rel=1e-14)


def test_a_step_that_a_constant_stiffness_allows_is_refused() -> None:
    allowed = stable_step(heliogyro(segments="springs"), "rk4", 10.0)[1]
    with pytest.raises(InputError, match=r"step is .* above the stability limit"):
        solve(heliogyro(segments="springs", **BY_LENGTH), samples=[0.0, 1.0], method="rk4", step=0.9 * allowed)


def _paid_out(**keys: Any) -> tuple[Array, Array]:
    """Rate of the body (rad/s) and lag of the tip (deg) from 7 to 30 s."""
    case = {"blade.stiffness": 1e3, "solver.duration": 30.0, "output.fine": False, **keys}
    found = evolvent.run("heliogyro", case)
    return found.body_rate.values[70:], np.degrees(found.tip_lag.values[70:, 0])


@pytest.mark.slow
def test_the_default_shortest_length_is_short_enough() -> None:
    """A fifth of it changes the motion by a tenth of what the stiffness by length does: rate, rad/s, and lag, deg."""
    rate, lag = _paid_out(**{"blade.boundary_segment": "by-length"})
    for keys, least, most in (
        ({"blade.boundary_segment": "by-length", "blade.shortest_fraction": 0.02}, 0.0, 1.0),
        ({}, 5.0, 20.0),
    ):
        other, apart = _paid_out(**keys)
        assert least <= np.abs(other - rate).max() / 1e-5 <= most
        assert least <= np.abs(apart - lag).max() / 1e-3 <= most


def test_the_heliogyro_has_the_keys_of_the_thread() -> None:
    """The paper's choice is that of its case; a thread by itself has the stiffness of its length."""
    fields = cases.system("heliogyro").Case.model_fields["blade"].annotation.model_fields
    assert fields["shortest_fraction"].default == Thread.model_fields["shortest_fraction"].default
    assert (fields["boundary_segment"].default, Thread.model_fields["boundary_segment"].default) == (
        "constant", "by-length",
    )  # fmt: skip


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (BY_LENGTH | {"segments": "inextensible"}, "needs .*segments 'springs', not 'inextensible'"),
        (BY_LENGTH | {"shortest_fraction": 1.5}, "shortest_fraction is 1.5; .*above 0 and at most 1"),
        (BY_LENGTH | {"shortest_fraction": 0.0}, "shortest_fraction is 0"),
        ({"shortest_fraction": 0.2}, "shortest_fraction is 0.2; it needs .*boundary_segment 'by-length'"),
        ({"boundary_segment": "by-lenght"}, "by-length"),
    ],
)
def test_what_does_not_fit_is_refused(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        evolvent.run("heliogyro", {f"blade.{key}": value for key, value in changes.items()})
