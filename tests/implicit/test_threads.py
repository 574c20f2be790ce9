"""Reeled threads on stiff springs under generalized-alpha, with steps far above those that explicit methods bear."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import evolvent
from book import Book
from evolvent import parts
from evolvent.analysis.system import System
from evolvent.assembly.assembled import Assembly
from evolvent.solvers.common.observations import observe
from evolvent.solvers.time.explicit.plan import choose_step
from evolvent.solvers.time.implicit.plan import solve_implicit
from helpers import END, L0, RHO, TIP, L, R, Run, fitted_order, heliogyro, run, tangent_error

#: N/m; RK4 would need steps below 6 us.
STIFF = 1e7


def implicit(assembly: Assembly, samples: Any, step: float, **options: Any) -> Run:
    """Solve and observe; the run must end well."""
    found = solve_implicit(assembly, samples=samples, step=step, **options)
    assert found.success, found.message
    return Run(assembly, found, observe(assembly.model, found.t, found.y, found.s))  # type: ignore[arg-type]


def craft() -> Assembly:
    """A free body that carries one reel: nothing is symmetric."""
    system = System()
    system.add(
        parts.RigidBody(motion="free", mass=0.5, inertia=(0.004, 0.005, 0.006), angular_velocity=(0.1, 0.0, 6.0)), "hub"
    )
    drive = parts.ConstantDrive(rate=3.5, angle=2.3 / R)
    system.add(parts.Reel(body="hub", centre=(L0, 0.0, 0.0), radius=R, drive=drive), "reel")
    system.add(
        parts.Thread(
            reel="reel", length=L, line_density=RHO, tip_mass=TIP, nodes=8, stiffness=1e3, damping=1e-3,
            wound_mass="carried",
        ),
        "blade",
    )  # fmt: skip
    return system.assemble()


@pytest.mark.parametrize("motion", ["spin", "free"])
def test_tangent(motion: str, rng: np.random.Generator) -> None:
    """Against central differences of the residual, all unknowns."""
    assembly = craft() if motion == "free" else heliogyro(segments="springs", out=2.9, nodes=6, stiffness=1e3)
    y, out = assembly.y.copy(), 3 * int(assembly.s[0])
    y[int(assembly.model.threads["iq"][0]) :][:out] += 0.01 * rng.standard_normal(out)
    assert tangent_error(assembly, y, rng) < 1e-4


@pytest.mark.slow
def test_order_against_the_chain_of_fixed_links(book: Book) -> None:
    """At 1e7 N/m the springs are as good as links; the lag's error is of order 2 in the step, through releases."""
    samples = np.linspace(0.0, 12.0, 61)
    exact = run(heliogyro(out=1.1), samples, "dopri5", rtol=1e-10, atol=1e-12)
    late = samples > 2.0  # what starts without stretch rings at first
    errors, steps = [], [1e-2, 5e-3, 2.5e-3]
    for step in steps:
        found = implicit(heliogyro(segments="springs", stiffness=STIFF, out=1.1), samples, step)
        assert found.solution.event_times == pytest.approx(exact.solution.event_times, abs=1e-9)
        errors.append(np.abs(found.lag() - exact.lag())[late].max())
        # what is out follows from the drive alone, however large the step
        assert np.array_equal(found.solution.s, exact.solution.s)
        assert np.abs(found.solution.energy_defect).max() < 0.1 * step * found.energy[0]
    assert errors[-1] < 0.02  # deg
    assert fitted_order(steps, errors) == pytest.approx(2.0, abs=0.3)
    book(
        "Threads, reels, tethers", "Deployment on springs of 1e7 N/m (generalized-alpha, 2.5 ms): lag",
        reference="chain of fixed links", source="Dormand-Prince, 1e-10", error=errors[-1], allowed=0.02, unit="deg",
        order=fitted_order(steps, errors), wanted="2",
    )  # fmt: skip


@pytest.mark.slow
def test_soft_springs_as_rk4_has_them() -> None:
    samples = np.linspace(0.0, 4.0, 21)
    system = heliogyro(segments="springs", stiffness=1e2, damping=0.02, out=1.1)
    exact = run(system, samples, "rk4", step=0.2 * choose_step(system, "rk4", None, 4.0)[1])
    found = implicit(system, samples, 2e-4, spectral_radius=0.8)
    assert np.abs(found.lag() - exact.lag())[2:].max() < 5e-3
    assert np.abs(found.rate() - exact.rate()).max() < 1e-4


@pytest.mark.parametrize("carried", ["ignored", "carried"])
def test_momentum_account(carried: str) -> None:
    """Angular momentum, less what releases bring in, is kept to the error of the steps."""
    found = implicit(
        heliogyro(segments="springs", stiffness=STIFF, out=1.1, wound_mass=carried), np.linspace(0.0, 10.0, 21), 2.5e-3
    )
    total = found.momentum - found.jumps
    if carried == "carried":
        total = total + found.wound_momentum
    assert np.abs(total[:, 2] - total[0, 2]).max() < 1e-4 * total[0, 2]
    assert np.abs(found.energy_defect).max() < 2e-3 * found.energy[0]


def test_free_craft() -> None:
    """A free body: linear and angular momentum with the wound thread carried."""
    found = implicit(craft(), np.linspace(0.0, 12.0, 25), 2e-3)
    assert found.solution.event_times.size > 0
    total = found.momentum + found.wound_momentum - found.jumps
    assert np.abs(total - total[0]).max() < 1e-3 * np.linalg.norm(total[0])
    # linear momentum comes in by no release; that of the wound thread is the body's
    P = found.linear_momentum
    assert np.abs(P - P[0]).max() < 1e-3 * np.abs(found.linear_momentum).max() + 1e-6


def test_reels_in_again() -> None:
    """A drive that turns back takes nodes up; the explicit method does so at the same times."""
    drive = parts.RampDrive(rate=3.5, angle=1.1 / R, steps=[(6.0, 1.0, -3.5)])
    samples = np.linspace(0.0, 14.0, 29)
    explicit = run(heliogyro(drive=drive), samples, "dopri5", rtol=1e-9, atol=1e-11)
    found = implicit(heliogyro(segments="springs", stiffness=STIFF, drive=drive), samples, 2.5e-3)
    assert found.solution.event_kinds.tolist() == explicit.solution.event_kinds.tolist()
    assert np.array_equal(found.solution.s, explicit.solution.s)


@pytest.mark.slow
def test_the_whole_deployment_of_the_system(book: Book) -> None:
    """The case heliogyro at 1e7 N/m and steps of 2.5 ms: mean lags of the reference, in seconds not minutes."""
    found = evolvent.run(
        "heliogyro",
        {"solver.method": "generalized-alpha", "solver.step": "2.5 ms", "blade.stiffness": "1e7 N/m"},
    )
    assert found.attrs["status"] == "success"
    assert float(found.time[-1]) == pytest.approx(END, rel=1e-6)
    lag = np.degrees(found.tip_lag.isel(blade=0).values)
    t = found.time.values
    offs = []
    for (low, high), value in {(7, 20): 13.46, (20, 60): 13.32, (60, 100): 12.94, (100, 142): 12.3}.items():
        offs.append(abs(lag[(t >= low) & (t <= high)].mean() - value))
        assert offs[-1] < (0.02 if low < 100 else 0.06)
    assert float(np.abs(found.momentum_balance).max()) < 1e-3
    book(
        "Threads, reels, tethers", "Whole deployment, generalized-alpha at 2.5 ms: mean lags in four windows",
        reference="13.46, 13.32, 12.94, 12.3 deg", source="independent computation", error=max(offs), allowed=0.06,
        unit="deg",
    )  # fmt: skip


def test_a_thread_separates_at_its_end() -> None:
    """The last node leaves just as the run ends, as it does under the explicit methods."""
    given = {"out": 4.9, "separates": True, "nodes": 20}
    samples = np.linspace(0.0, (L - 4.9) / (R * 3.5), 5)
    explicit = run(heliogyro(**given), samples, "dopri5")
    found = implicit(heliogyro(segments="springs", stiffness=STIFF, **given), samples, 2.5e-3)
    assert found.solution.s[-1].tolist() == explicit.solution.s[-1].tolist() == [20, 1]


@pytest.mark.slow
def test_the_heliogyro_with_segments_of_fixed_length() -> None:
    """A deployment of 1 m in 10 segments, which leave the spool one by one: lag, rate and tension are dopri5's."""
    given = {"blade.segments": "inextensible", "blade.length": "1 m", "blade.nodes": 10, "output.every": "0.1 s"}
    exact = evolvent.run("heliogyro", given | {"solver.method": "dopri5"})
    found = evolvent.run("heliogyro", given | {"solver.method": "generalized-alpha", "solver.step": "2.5 ms"})
    assert found.attrs["status"] == exact.attrs["status"] == "success"
    lag, wanted = np.degrees(found["blade-1"].tip_lag.values), np.degrees(exact["blade-1"].tip_lag.values)
    assert np.nanmax(np.abs(lag - wanted)) < 0.02
    assert found.body_rate.values == pytest.approx(exact.body_rate.values, abs=1e-3)
    tension, seen = (np.delete(one["blade-1"].hub_tension.values, 200) for one in (exact, found))
    # at 20 s a node leaves, and the tension jumps: dopri5 has its value after that, the implicit method before
    assert seen == pytest.approx(tension, abs=2e-3 * float(tension.max()))
