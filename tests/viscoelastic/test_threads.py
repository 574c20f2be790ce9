"""Viscoelastic threads: held, loaded, paid out and reeled in."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
import scipy

from book import Book
from evolvent import System, parts
from evolvent.elements.viscoelastic import Viscoelastic
from evolvent.solvers.modal.modes import modes
from evolvent.solvers.static.static import solve_static
from evolvent.solvers.static.storage import store
from evolvent_base.errors import InputError

CHAPTER = "Relaxation and storage"
PRONY = [(0.3, 0.05), (0.3, 0.5)]
STIFFNESS, TIP, LENGTH, NODES, DENSITY, RADIUS = 400.0, 0.5, 1.5, 3, 1.0, 0.05
SEGMENT = LENGTH / NODES


def tether(out: float = 0.7, rate: float = 0.0, *, g: float = 9.81, drive: Any = None, **keys: Any) -> System:
    """A mass that hangs along x on a thread from a reel on the ground."""
    system = System(gravity=(g, 0, 0))
    turned = drive or parts.RampDrive(angle=out / RADIUS, rate=rate / RADIUS)
    system.add(parts.Reel(body="ground", radius=RADIUS, drive=turned), "reel")
    own: dict[str, Any] = {"viscoelastic": {"prony": PRONY}} | keys
    system.add(
        parts.Thread(
            reel="reel",
            length=LENGTH,
            line_density=DENSITY,
            nodes=NODES,
            tip_mass=TIP,
            **({"stiffness": STIFFNESS} | own),
        ),
        "line",
    )
    return system


def integrated(out: float, rate: float, until: float, shortest: float = 0.1, prony: Any = PRONY) -> np.ndarray:
    """Positions of two nodes, from the departure, by SciPy; nodes are released with what is out at the start."""
    share, time = np.array(prony).T
    mass = np.array([DENSITY * SEGMENT * 0.5 + TIP, DENSITY * SEGMENT])

    def rates(t: float, z: Any) -> np.ndarray:
        x, v, w = z[:2], z[2:4], z[4:].reshape(2, -1)
        b = out + rate * t - SEGMENT
        f = SEGMENT / max(b, shortest * SEGMENT) if shortest else 1.0
        slope = -f / b if shortest and b > shortest * SEGMENT else 0.0
        e = np.array([x[0] - x[1] - SEGMENT, x[1] - b])
        X = np.array([e[0], f * e[1]])
        X_rate = np.array([v[0] - v[1], f * (v[1] - rate) + slope * rate * e[1]])
        T = STIFFNESS * ((1.0 - share.sum()) * X + w @ share)
        a = 9.81 + np.array([-T[0], T[0] - T[1]]) / mass
        return np.concatenate([v, a, (X_rate[:, None] - w / time).ravel()])

    start = np.concatenate([[out, out - SEGMENT, rate, rate], np.zeros(2 * share.size)])
    found = scipy.integrate.solve_ivp(rates, (0.0, until), start, rtol=1e-11, atol=1e-13)
    return np.asarray(found.y[:2, -1])


@pytest.mark.parametrize(("boundary", "shortest"), [("by-length", 0.1), ("by-length", 0.7), ("constant", 0.0)])
@pytest.mark.parametrize("method", ["rk4", "generalized-alpha", "energy-momentum"])
def test_a_thread_is_paid_out_as_in_a_second_implementation(
    method: str, boundary: str, shortest: float, book: Book
) -> None:
    exact, errors = integrated(0.6, 0.5, 0.6, shortest), []
    keys: dict[str, Any] = {"boundary_segment": boundary} | ({"shortest_fraction": shortest} if shortest else {})
    for step in (0.002, 0.001):
        options: dict[str, Any] = {} if method == "rk4" else {"spectral_radius": 1.0}
        run = tether(0.6, 0.5, **keys).simulate(until=0.6, every=0.1, fine=False, method=method, step=step, **options)
        x = run["line"].position.values[-1, :2, 0]
        errors.append(np.abs(x - exact).max())
    if method == "rk4":
        assert errors[1] < (1e-6 if shortest == 0.7 else 1e-9)  # less where the stiffness begins to follow the length
        book(
            CHAPTER, f"Thread paid out at 0.5 m/s, two branches, segment at the spool {boundary} {shortest}",
            source="second implementation", reference="SciPy, lumped masses", error=errors[1], allowed=1e-6,
        )  # fmt: skip
    else:
        assert 3.5 < errors[0] / errors[1] < 4.5  # second order
    defect = np.abs(run.energy_defect.values).max()
    assert defect < {"rk4": 1e-4, "generalized-alpha": 1e-3, "energy-momentum": 1e-11}[method]
    assert float(run.energy_dissipated.values[-1]) > 0.02


#: Pays out past a node, stops, and reels in past two.
THERE_AND_BACK = parts.RampDrive(
    angle=0.8 / RADIUS, rate=0.0, steps=[(0.0, 0.2, 0.6 / RADIUS), (0.5, 0.2, 0.0), (0.8, 0.2, -0.8 / RADIUS)]
)


@pytest.mark.parametrize("slack", [False, True])
@pytest.mark.parametrize("method", ["rk4", "generalized-alpha", "energy-momentum"])
def test_nodes_leave_and_come_back_with_the_balance(method: str, slack: bool) -> None:
    """What remains of rk4 are the kinks of slack segments, and where the stiffness begins to follow the length."""
    options: dict[str, Any] = {} if method == "rk4" else {"spectral_radius": 1.0}
    run = tether(drive=THERE_AND_BACK, slack=slack).simulate(
        until=1.6, every=0.02, fine=False, method=method, step=0.001, **options
    )
    assert np.nanmin(run["line"].deployed_length.values[40:]) < 0.6
    assert np.nanmax(run["line"].deployed_length.values) > 1.05
    defect = np.abs(run.energy_defect.values).max()
    assert defect < {"rk4": 2e-3, "generalized-alpha": 5e-3, "energy-momentum": 1e-10}[method]
    assert np.all(np.diff(run.energy_dissipated.values) >= -1e-12)
    assert float(run.energy_dissipated.values[-1]) > 0.02


def test_a_free_spool_pays_out_with_the_balance() -> None:
    def free(step: float) -> Any:
        drive = parts.FreeSpool(inertia=1e-3, angle=0.7 / RADIUS, friction_torque=0.2)
        return tether(drive=drive).simulate(until=0.5, every=0.05, fine=False, method="rk4", step=step)

    run, finer = free(0.001), free(0.0005)
    assert float(run["line"].deployed_length.values[-1]) > 1.0  # past a node
    assert float(run["line"].deployed_length.values[-1]) == pytest.approx(
        float(finer["line"].deployed_length.values[-1]), abs=1e-5
    )
    assert np.abs(finer.energy_defect.values).max() < 1e-4
    with pytest.raises(InputError, match="viscoelastic thread on a free spool"):
        tether(drive=parts.FreeSpool(inertia=1e-3, angle=0.7 / RADIUS)).simulate(
            until=0.1, method="generalized-alpha", step=0.001
        )


@pytest.mark.parametrize("slack", [False, True])
def test_a_thread_creeps_under_a_load(slack: bool, book: Book) -> None:
    """Strain (1/E_inf)(1 - (E_1/E_0) exp(-t E_inf/(E_0 tau))) sigma of each segment; modes by the law."""
    prony, time, out = [(0.6, 1.0)], 1.5, 0.8
    first = 9.81 * np.array([TIP + 0.5 * DENSITY * SEGMENT, TIP + 1.5 * DENSITY * SEGMENT]) / STIFFNESS
    first[1] *= (out - SEGMENT) / SEGMENT
    system = tether(out, viscoelastic={"prony": prony}, slack=slack)
    found = store(system.assemble(), time, tolerance=1e-8)
    x = found.solution.y[-1, [0, 3]]
    creep = (1.0 - 0.6 * math.exp(-0.4 * time)) / 0.4
    found = np.array([x[0] - x[1] - SEGMENT, x[1] - (out - SEGMENT)])
    book(
        CHAPTER, f"Thread under its weight for 1.5 relaxation times{', which may go slack' if slack else ''}: creep",
        source="closed form", reference="(1 - 0.6 exp(-0.4 t/tau))/0.4",
        error=np.max(np.abs(found / (creep * first) - 1.0)), allowed=1e-6,
    )  # fmt: skip
    relaxed = solve_static(system.assemble(), relaxed=True)
    assert float(relaxed.y[-1, 0]) - out == pytest.approx(first.sum() / 0.4, rel=1e-9)


def test_a_mode_of_a_thread_follows_the_law() -> None:
    prony = [(0.6, 1.0)]
    system = System(gravity=(9.81, 0, 0))
    system.add(parts.Reel(body="ground", radius=RADIUS, drive=parts.RampDrive(angle=0.5 / RADIUS)), "reel")
    system.add(
        parts.Thread(reel="reel", length=0.5, line_density=1e-9, nodes=1, tip_mass=TIP, stiffness=STIFFNESS,
                     viscoelastic={"prony": prony}),
        "line",
    )  # fmt: skip
    s = complex(modes(system.assemble(), damped=True, count=3).pole[2])  # behind the two of a pendulum
    law = Viscoelastic(prony=prony)
    assert abs(TIP * s * s + STIFFNESS * complex(law.dynamic_modulus(np.array(s)))) < 1e-5


def test_a_held_thread_relaxes_between_two_places() -> None:
    """Tension of a thread that is stretched at the start and held: that of the series."""
    out, stretch = 1.2, 0.05
    system = System()
    system.add(parts.RigidBody(motion="driven", rate=0.0), "hub")
    system.add(parts.Reel(body="hub", radius=RADIUS, drive=parts.RampDrive(angle=out / RADIUS)), "reel")
    system.add(
        parts.Thread(
            reel="reel", length=LENGTH, line_density=DENSITY, nodes=NODES, stiffness=STIFFNESS,
            end=(out * (1.0 + stretch), 0.0, RADIUS), viscoelastic={"prony": PRONY},
        ),
        "line",
    )  # fmt: skip
    exact = STIFFNESS * SEGMENT * stretch
    for method, step in (("rk4", 0.002), ("energy-momentum", 0.05), ("generalized-alpha", 0.05)):
        run = system.simulate(until=0.4, every=0.2, fine=False, method=method, step=step)
        left = 1.0 - sum(share * (1.0 - math.exp(-0.4 / time)) for share, time in PRONY)
        assert float(run["line"].hub_tension.values[-1]) == pytest.approx(exact * left, rel=1e-6), method


def test_threads_that_cannot_relax_are_refused() -> None:
    with pytest.raises(InputError, match=r"line\.viscoelastic"):
        tether(segments="inextensible").assemble()
    with pytest.raises(InputError, match=r"line\.viscoelastic"):
        tether(mesh="moving").assemble()


def test_a_spring_relaxes_over_steps_after_a_release() -> None:
    """An event is evaluated by the strains of its state; the steps that follow let time pass again."""
    system = tether(drive=THERE_AND_BACK, viscoelastic=None)
    system.add(parts.Point(mass=1.0, position=(0, 1.0, 0)), "mass")
    spring = parts.Spring(a=(0.0, 0, 0), b="mass", stiffness=50.0, length=0.9, viscoelastic={"prony": PRONY})
    system.add(spring, "spring")
    run = system.simulate(until=1.0, every=0.1, fine=False, method="energy-momentum", step=0.002, spectral_radius=1.0)
    alone = System(gravity=(9.81, 0, 0))
    alone.add(parts.Point(mass=1.0, position=(0, 1.0, 0)), "mass")
    alone.add(spring, "spring")
    exact = alone.simulate(until=1.0, every=0.1, fine=False, method="rk4", step=0.001)
    assert float(run["spring"].force.values[-1]) == pytest.approx(float(exact["spring"].force.values[-1]), rel=1e-3)
    assert np.abs(run.energy_defect.values).max() < 1e-10
