"""Equilibria and modes of threads: chains, strings, tethers that turn, and what a reel's body does."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from evolvent import InputError, System, parts
from evolvent.results.observe import observe
from evolvent.solvers import solve
from evolvent.solvers.common.standing import at_time
from evolvent.solvers.modal.modes import modes
from evolvent.solvers.static.static import solve_static
from helpers import derivative
from static.composing import solved

G = 9.81


def reeled(*, out: float, gravity: Any = (0.0, 0.0, 0.0), body: Any = None, at: float = 0.0, **thread: Any) -> System:
    """A thread along x from a reel whose departure point is at `at` on x."""
    system = System(gravity=gravity)
    system.add(body or parts.RigidBody(motion="driven"), "hub")
    drive = parts.ConstantDrive(rate=0.0, angle=out / 0.1)
    system.add(parts.Reel(body="hub", centre=(at, 0.0, -0.1), radius=0.1, drive=drive), "reel")
    system.add(parts.Thread(reel="reel", **thread), "thread")
    return system


def test_a_chain_hangs() -> None:
    """Every segment carries what hangs below it, however stiff it is; wound nodes count for nothing."""
    n, c, rho = 12, 1e6, 0.2
    system = reeled(out=2.0, gravity=(0.0, 0.0, -G), length=3.0, nodes=n, line_density=rho, stiffness=c, tip_mass=0.3,
                    direction=(0.0, 0.0, -1.0))  # fmt: skip
    assembly = system.assemble()
    found = solved(solve_static(assembly))
    released, l0 = 8, 0.25
    masses = np.append(0.3 + 0.5 * rho * l0, np.full(released - 1, rho * l0))
    tension = G * np.cumsum(masses)
    assert found.s[-1].tolist() == [released, 0]
    z = -np.cumsum((l0 + tension / c)[::-1])[::-1]
    nodes = found.y[-1][int(assembly.model.threads["iq"][0]) :][: 3 * n].reshape(n, 3)
    assert nodes[:released, 2] == pytest.approx(z, rel=1e-9)
    assert np.abs(nodes[:released, :2]).max() < 1e-9
    assert found.observations.tension[-1][:released] == pytest.approx(tension, rel=1e-5)


def test_a_chain_swings_down_to_where_it_hangs() -> None:
    """From a line across gravity, where nothing is in tension, and with the weight of a load on its tip."""
    system = reeled(out=1.0, gravity=(0.0, 0.0, -G), length=1.0, nodes=4, line_density=0.2, stiffness=1e4,
                    slack=True)  # fmt: skip
    system.add(parts.Load(at="thread.tip", force=(0.0, 0.0, -2.0)), "load")
    found = solved(solve_static(system.assemble()))
    masses = np.array([0.025, 0.05, 0.05, 0.05])
    tension = 2.0 + G * np.cumsum(masses)
    assert found.observations.position[-1][0] == pytest.approx([0.0, 0.0, -1.0 - tension.sum() / 1e4], abs=1e-8)


def test_a_taut_string() -> None:
    """Between two walls: 2 sqrt(k/m) sin(i pi/2n), k = T/l across and c along."""
    n, c, rho, strain = 10, 500.0, 0.1, 0.05
    system = System()
    system.add(parts.RigidBody(motion="driven"), "hub")
    system.add(parts.RigidBody(motion="driven", points={"hook": (1.0 + strain, 0.0, 0.0)}), "wall")
    drive = parts.ConstantDrive(rate=0.0, angle=10.0)
    system.add(parts.Reel(body="hub", centre=(0.0, 0.0, -0.1), radius=0.1, drive=drive), "reel")
    system.add(parts.Thread(reel="reel", length=1.0, nodes=n, line_density=rho, stiffness=c, end="wall.hook"), "thread")
    found = modes(system.assemble(), count=3 * (n - 1))
    m, l0 = rho / n, 1.0 / n
    across = c * strain * l0 / (l0 * (1.0 + strain))
    waves = 2.0 * np.sin(np.arange(1, n) * np.pi / (2 * n))
    wanted = np.concatenate([waves * np.sqrt(across / m)] * 2 + [waves * np.sqrt(c / m)])
    assert found.frequency == pytest.approx(np.sort(wanted), rel=1e-8)
    first = found["thread"].displacement[0]
    assert np.abs(first[1:]).max() > 0.0
    assert np.all(first[0] == 0.0)  # at the wall
    assert found["thread[3]"].displacement[0] == pytest.approx(first[3])


def test_a_tether_that_turns() -> None:
    """Without a hub: W sqrt(n (2 n - 1)) across the plane of the turn, one W^2 less in it."""
    W, n = 2.0, 40
    body = parts.RigidBody(motion="driven", rate=W, axis=(0.0, 0.0, 1.0))
    system = reeled(out=1.0, body=body, length=1.0, nodes=n, line_density=0.1, stiffness=1e6)
    found = modes(system.assemble(), rotating="hub", count=6)
    square = (found.frequency / W) ** 2
    assert square[:2] == pytest.approx([0.0, 1.0], abs=1e-6)  # exactly, of any chain that stays straight
    assert square[2:] == pytest.approx([5.0, 6.0, 14.0, 15.0], rel=0.06)


def test_a_hub_with_two_threads() -> None:
    """A point mass on each: the lag swings at W sqrt(L0 (Jb + I + 2 L0 S) S/(I Jb - L0^2 S^2)) beside a free turn."""
    W, J, L0, m, l, c = 3.0, 0.4, 0.2, 0.5, 1.0, 1e6  # noqa: E741
    body = parts.RigidBody(motion="spin", inertia=J, axis=(0.0, 0.0, 1.0), rate=W)
    system = reeled(out=l, body=body, at=L0, length=l, nodes=1, line_density=0.1, tip_mass=m - 0.05, stiffness=c,
                    multiplicity=2)  # fmt: skip
    found = modes(system.assemble(), rotating=(0.0, 0.0, W), count=3)
    S, inertia, Jb = m * l, m * l * l, 0.5 * J + m * L0**2
    lag = W * np.sqrt(L0 * S * (Jb + inertia + 2.0 * L0 * S) / (inertia * Jb - (L0 * S) ** 2))
    flap = W * np.sqrt(1.0 + L0 / l)
    assert np.sort(found.frequency) == pytest.approx(np.sort([0.0, lag, flap]), rel=2e-5, abs=1e-5)


def test_spools_stand_at_the_time_of_the_equilibrium() -> None:
    """Two states of one time: placed by the drive, and reached by a run; both come to the same equilibrium."""
    system = System(gravity=(G, 0.0, 0.0))
    system.add(parts.RigidBody(motion="driven"), "hub")
    drive = parts.ConstantDrive(rate=2.0, angle=3.0)
    system.add(parts.Reel(body="hub", centre=(0.0, 0.0, -0.1), radius=0.1, drive=drive), "reel")
    system.add(parts.Thread(reel="reel", length=2.0, nodes=8, line_density=0.4, stiffness=2e3, damping=1.0), "thread")
    assembly, time = system.assemble(), 3.0
    run = solve(assembly, samples=np.array([0.0, time]), method="dopri5", rtol=1e-8, atol=1e-10)
    found = [solved(solve_static(assembly, y=y, time=time)) for y in (None, run.y[-1])]
    assert [list(one.s[-1]) for one in found] == [[4, 0]] * 2 == [list(run.s[-1])] * 2
    nodes = slice(int(assembly.model.threads["iq"][0]), int(assembly.model.threads["iq"][0]) + 12)
    assert found[0].y[-1][nodes] == pytest.approx(found[1].y[-1][nodes], abs=1e-9)
    masses = np.array([0.05, 0.1, 0.1, 0.1])
    assert found[0].observations.tension[-1][:4] == pytest.approx(G * np.cumsum(masses), rel=1e-9)  # no damping


def test_light_on_a_thread_turns_with_it() -> None:
    """Modes of a string under light by what the nodes feel: as the differences of the rates that dopri5 takes."""
    system = reeled(out=1.0, gravity=(0.0, 0.0, -G), length=1.0, nodes=2, line_density=0.5, stiffness=300.0,
                    direction=(0.0, 0.0, -1.0))  # fmt: skip
    light = parts.Radiation(along="thread", pressure=0.4, width=1.0, specular=0.6, direction=(1.0, 0.5, 0.3))
    system.add(light, "light")
    assembly = system.assemble()
    equilibrium = solved(solve_static(assembly))
    found = modes(assembly, equilibrium=equilibrium, count=6)
    K = differences(assembly, equilibrium)
    squares = np.linalg.eigvals(K)
    assert np.sort(found.square) == pytest.approx(np.sort(squares.real), rel=1e-5)


def differences(assembly: Any, equilibrium: Any) -> np.ndarray:
    """-d(accelerations)/d(positions) of all nodes by the explicit right-hand side."""
    rate, iq, iv = derivative(assembly), int(assembly.model.threads["iq"][0]), int(assembly.model.threads["iv"][0])
    n = 3 * int(assembly.model.threads["n"][0])
    K, h, y = np.zeros((n, n)), 1e-5, equilibrium.y[-1]
    for c in range(n):
        ends = []
        for sign in (1.0, -1.0):
            moved = y.copy()
            moved[iq + c] += sign * h
            ends.append(rate(0.0, moved)[iv : iv + n].copy())
        K[:, c] = -(ends[0] - ends[1]) / (2.0 * h)
    return K


def test_mass_on_a_free_body_in_a_steady_turn_is_refused() -> None:
    body = parts.RigidBody(mass=2.0, inertia=(1.0, 1.0, 1.0))
    system = reeled(out=1.0, body=body, length=2.0, nodes=2, line_density=0.1, stiffness=1e3, wound_mass="carried")
    with pytest.raises(InputError, match="'thread' has mass on a free body"):
        solve_static(system.assemble(), rotating=(0.0, 0.0, 1.0))


def test_no_damper_acts_in_an_equilibrium_on_a_body_that_moves() -> None:
    """A thread and a spring hang on a driven body whose points would rise by its rate: tensions are weights."""
    body = parts.RigidBody(motion="driven", rate=0.5, axis=(0.0, 1.0, 0.0), points={"hook": (0.5, 0.0, 0.0)})
    system = reeled(out=1.0, gravity=(0.0, 0.0, -G), body=body, at=0.3, length=1.0, nodes=2, line_density=0.2,
                    stiffness=1e4, damping=50.0, direction=(0.0, 0.0, -1.0))  # fmt: skip
    system.add(parts.Point(mass=0.4, position=(0.5, 0.0, -1.0)), "weight")
    system.add(parts.Spring(a="hub.hook", b="weight", stiffness=1e3, length=1.0, damping=50.0), "spring")
    found = solved(solve_static(system.assemble()))
    seen = observe(found)
    assert seen["thread"].variables["tension"].values[-1] == pytest.approx(G * np.array([0.05, 0.15]), rel=1e-9)
    assert found.observations.tension[-1] == pytest.approx(G * np.array([0.05, 0.15]), rel=1e-9)
    assert seen["spring"].variables["force"].values[-1] == pytest.approx(0.4 * G, rel=1e-9)


def test_loads_are_those_of_the_load_factor_without_ramps() -> None:
    """Light on a thread, a force on its tip and one on a point mass: what is shown balances at every factor."""
    system = reeled(out=1.0, length=1.0, nodes=2, line_density=0.5, stiffness=300.0)
    light = {"pressure": 0.4, "width": 1.0, "specular": 0.6, "direction": (1.0, 0.0, -0.5)}
    system.add(parts.Radiation(along="thread", **light), "light")
    system.add(parts.Load(at="thread.tip", force=(2.0, 0.0, 0.0), ramp=3.0), "pull")
    system.add(parts.Point(mass=0.4, position=(2.0, 0.0, 0.0)), "mass")
    system.add(parts.Spring(a=(1.0, 0.0, 0.0), b="mass", stiffness=1e3, length=1.0), "spring")
    system.add(parts.Load(at="mass", force=(5.0, 0.0, 0.0), ramp=3.0), "push")
    found = solved(solve_static(system.assemble(), load_steps=2))
    seen, factor = observe(found), found.path.factor[:, None]
    assert {0.5, 1.0} <= set(found.path.factor)
    assert seen["pull"].variables["force"].values == pytest.approx(factor * [2.0, 0.0, 0.0])
    assert seen["push"].variables["force"].values == pytest.approx(factor * [5.0, 0.0, 0.0])
    held = seen["thread"].variables["hub_force"].values
    whole = seen["light"].variables["force"].values + seen["pull"].variables["force"].values
    assert np.abs(whole - held)[found.path.factor > 0.0].max() < 1e-8


def test_positions_that_a_state_has_are_kept() -> None:
    """Nodes that have left the spool since the start stay where a given state has them; others are placed."""
    system = System(gravity=(G, 0.0, 0.0))
    system.add(parts.RigidBody(motion="driven"), "hub")
    drive = parts.ConstantDrive(rate=2.0, angle=3.0)
    system.add(parts.Reel(body="hub", centre=(0.0, 0.0, -0.1), radius=0.1, drive=drive), "reel")
    system.add(parts.Thread(reel="reel", length=2.0, nodes=8, line_density=0.4, stiffness=2e3), "thread")
    assembly = system.assemble()
    y, first = assembly.y.copy(), int(assembly.model.threads["iq"][0])
    bent = np.array([[0.6, 0.2, 0.0], [0.4, 0.15, 0.0], [0.2, 0.1, 0.0]])  # of four nodes at 3 s
    y[first : first + 9] = bent.ravel()
    still, placed = at_time(assembly, y, 3.0)
    nodes = placed[first : first + 24].reshape(8, 3)
    assert still.s.tolist() == [4, 0]
    assert assembly.s.tolist() == [2, 0]
    assert nodes[:3] == pytest.approx(bent, abs=0.0)
    assert nodes[3] == pytest.approx(bent[2] * (0.9 - 3 * 0.25) / (0.9 - 2 * 0.25))  # on the line to the spool


def test_a_field_is_that_of_the_load_factor() -> None:
    """It pulls a mass on a spring: its resultant grows with the factor, as the force of the spring does."""
    system = System()
    system.add(parts.Field(law=["2", "0", "0"]), "field")
    system.add(parts.Point(mass=2.0, position=(1.0, 0.0, 0.0)), "mass")
    system.add(parts.Spring(a=(0.0, 0.0, 0.0), b="mass", stiffness=1e3, length=1.0), "spring")
    found = solved(solve_static(system.assemble(), load_steps=2))
    seen, factor = observe(found), found.path.factor
    assert seen["field"].variables["force"].values[:, 0] == pytest.approx(4.0 * factor)
    assert seen["spring"].variables["force"].values[factor > 0.0] == pytest.approx(4.0 * factor[factor > 0.0], rel=1e-6)
