"""Turns that lie on one another: gaps, forces, tangents and momenta of spirals."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from evolvent import InputError, System, elements, parts
from evolvent.algebra import sparse
from evolvent.assembly.assembled import Assembly
from evolvent.equations import implicit
from evolvent.kernels.rotations import rotation_from_quaternion
from evolvent.solvers.static.work import sparse_of
from evolvent.solvers.time.implicit.plan import matrix_of
from implicit.rigs import RUBBER, Equations, run, start_step

Array = np.ndarray
RADIUS, THICK, LENGTH, N, TURNS = 0.6, 0.002, 9.0, 60, 2.43
STIFFNESS = 500.0
STRIP = elements.Rectangle(thickness=THICK, width=0.03)


def spiral(pitch: float, *, start: float = 0.0, sense: int = 1, turns: float = TURNS, rise: float = 0.0) -> Array:
    """Nodes (n + 1, 2, 3) of a spiral about z that grows by `pitch` a turn and rises by `rise` of its length."""
    angle, growth = np.linspace(0.0, 2.0 * np.pi * turns, N + 1), pitch / (2.0 * np.pi)
    r, at, zero = RADIUS + growth * angle, sense * (angle + start), 0.0 * angle
    places = np.stack([r * np.cos(at), r * np.sin(at), rise * RADIUS * angle], axis=1)
    out, on = np.stack([np.cos(at), np.sin(at), zero], axis=1), np.stack([-np.sin(at), np.cos(at), zero], axis=1)
    by_angle = growth * out + sense * r[:, None] * on + [0.0, 0.0, rise * RADIUS]
    return np.stack([places, by_angle * 2.0 * np.pi * turns / LENGTH], axis=1)


def wound(pitch: float, *, count: int = 1, sense: int = 1, rise: float = 0.0, **fields: Any) -> Assembly:
    """Cables wound round a free hub."""
    system = System()
    system.add(parts.RigidBody(mass=3.0, inertia=0.4), "hub")
    for b in range(count):
        nodes = spiral(pitch, start=2.0 * np.pi * b / count, sense=sense, rise=rise)
        beam = parts.Beam(
            length=LENGTH, section=STRIP, material=RUBBER, elements=N, formulation="cable", nodes=nodes, rest="start"
        )
        system.add(beam, f"rib-{b}")
    given = {"thickness": THICK, "stiffness": STIFFNESS, "sense": sense} | fields
    for b in range(count):
        system.add(parts.Contact(a=f"rib-{b}", b=f"rib-{(b + 1) % count}", around="hub", **given), f"layer-{b}")
    return system.assemble()


def layer_forces(assembly: Assembly, y: Array, step: float = 0.0) -> tuple[Array, float]:
    """Generalised forces that layers put on the left of the equations, and their energy."""
    model = assembly.model
    n_v, rows, found = int(model.info.nv), model.contact_surfaces, []
    for stiffness in (STIFFNESS, 0.0):
        rows["stiffness"] = stiffness
        equations = Equations(assembly, 0.0, y, np.zeros(n_v), 0.0, 0.0, step)
        found.append(equations.residual(np.zeros(n_v), np.zeros(0)))
        if stiffness:
            energy = float(rows["energy"].sum())
    rows["stiffness"] = STIFFNESS
    return found[0] - found[1], energy


@pytest.mark.slow
@pytest.mark.parametrize("sense", [1, -1])
def test_gap_of_a_spiral(sense: int) -> None:
    """All of the second turn and what there is of the third lie a pitch above the turn below; the first has none."""
    assembly = wound(0.0015, sense=sense)
    start_step(assembly, assembly.y)
    gap, checks = assembly.model.contact_points["gap"], 2 * N
    over = np.arange(1, checks + 1) / checks * TURNS > 1.0
    assert np.all(np.isinf(gap[~over]))
    assert gap[over] == pytest.approx(0.0015 - THICK, abs=2e-5)
    assert assembly.model.contact_surfaces["touching"][0] == over.sum()


@pytest.mark.slow
@pytest.mark.parametrize("sense", [1, -1])
def test_gap_of_neighbours(sense: int) -> None:
    """Three ribs wind over one another: each lies a third of the pitch above the next, from a third of a turn on."""
    assembly = wound(0.0045, count=3, sense=sense)
    start_step(assembly, assembly.y)
    for row in assembly.model.contact_surfaces:
        assert row["shift"] == pytest.approx(2.0 * np.pi / 3.0)
        gap = assembly.model.contact_points["gap"][row["first"] : row["last"]]
        over = np.arange(1, 2 * N + 1) / (2 * N) * TURNS > 1.0 / 3.0
        assert gap[over] == pytest.approx(0.0015 - THICK, abs=2e-5)
        assert np.all(np.isinf(gap[~over]))


def test_turns_side_by_side_do_not_touch() -> None:
    assembly = wound(0.0015, rise=0.02, width=0.03)
    start_step(assembly, assembly.y)
    assert assembly.model.contact_surfaces["touching"][0] == 0.0


def moved(assembly: Assembly, rng: np.random.Generator, size: float = 1e-5) -> Array:
    """The start a little disturbed, with the hub turned a little."""
    n_q = int(assembly.model.info.nq)
    y = assembly.y.copy()
    beams = assembly.model.beams
    for row in beams:
        q = slice(row["iq"], row["iq"] + 6 * row["nodes"])
        y[q] += size * rng.standard_normal(q.stop - q.start)
    hub = assembly.model.bodies[assembly.index("hub", "bodies")]
    q = y[hub["iq"] + 3 : hub["iq"] + 7]
    q += 0.01 * rng.standard_normal(4)
    q /= np.linalg.norm(q)
    y[n_q : n_q + int(assembly.model.info.nv)] += 1e-3 * rng.standard_normal(int(assembly.model.info.nv))
    return y


def test_forces_are_the_slope_of_the_energy(rng: np.random.Generator) -> None:
    assembly = wound(0.0015)
    y = assembly.y
    beam = assembly.model.beams[0]
    force, _ = layer_forces(assembly, y)
    at, n_q = int(beam["iv"]), int(assembly.model.info.nq)
    for _ in range(5):
        d = np.zeros_like(y)
        d[beam["iq"] : beam["iq"] + 6 * beam["nodes"]] = 1e-7 * rng.standard_normal(6 * beam["nodes"])
        change = layer_forces(assembly, y + d)[1] - layer_forces(assembly, y - d)[1]
        work = 2.0 * force[at - n_q : at - n_q + 6 * (N + 1)] @ d[beam["iq"] : beam["iq"] + 6 * (N + 1)]
        assert work == pytest.approx(change, rel=1e-4, abs=1e-14)


@pytest.mark.parametrize("friction", [0.0, 0.4])
def test_momenta_are_kept(friction: float, rng: np.random.Generator) -> None:
    """Forces and torques on the coil and the hub cancel, out of the plane too."""
    assembly = wound(
        0.0015, count=2, rise=1e-3, friction=friction, damping=2.0, bristle_stiffness=100.0, thickness=0.004
    )
    start_step(assembly, assembly.y)
    y = moved(assembly, rng)
    force, _ = layer_forces(assembly, y, 1e-3 if friction else 0.0)
    model = assembly.model
    n_q, total, torque, size = int(model.info.nq), np.zeros(3), np.zeros(3), 0.0
    for row in model.beams:
        f = force[row["iv"] - n_q :][: 6 * row["nodes"]].reshape(-1, 3)
        total += f[::2].sum(axis=0)
        torque += np.cross(y[row["iq"] :][: 6 * row["nodes"]].reshape(-1, 3), f).sum(axis=0)
        size += np.abs(f[::2]).sum()
    hub = model.bodies[assembly.index("hub", "bodies")]
    R, at = np.zeros((3, 3)), int(hub["iv"]) - n_q
    rotation_from_quaternion(*y[hub["iq"] + 3 : hub["iq"] + 7], R)
    assert size > 1.0
    assert total + force[at : at + 3] == pytest.approx(0.0, abs=1e-12 * size)
    assert torque + R @ force[at + 3 : at + 6] == pytest.approx(0.0, abs=1e-10 * size)


@pytest.mark.parametrize("friction", [0.0, 0.4])
def test_tangent(friction: float, rng: np.random.Generator) -> None:
    """Against differences, but for what turns with the lower beam: force by its element's length."""
    assembly = wound(0.0015, friction=friction, damping=2.0, bristle_stiffness=100.0)
    start_step(assembly, assembly.y)
    y, model = moved(assembly, rng, 1e-6), assembly.model
    n_v, step = int(model.info.nv), 1e-3
    beam = model.beams[0]
    first = int(beam["iv"]) - int(model.info.nq)
    own = slice(first, first + 6 * (N + 1))
    found, exact = [], []
    for stiffness in (STIFFNESS, 0.0):
        model.contact_surfaces["stiffness"] = stiffness
        equations = Equations(assembly, 0.0, y, np.zeros(n_v), 0.0, 50.0, step)
        matrix = matrix_of(model)
        equations.residual(np.zeros(n_v), np.zeros(0))
        implicit.tangent(0.0, y, np.zeros(0), 0.0, 50.0, 1.0, model, matrix)
        assert (matrix.counts[sparse.INNER] > 0) == (stiffness > 0.0)
        found.append(sparse_of(matrix).toarray()[own, own])
        columns = []
        for k in range(own.start, own.stop):
            d = np.zeros(n_v)
            d[k] = 1e-8
            columns.append((equations.residual(d, np.zeros(0)) - equations.residual(-d, np.zeros(0)))[own] / 2e-8)
        exact.append(np.array(columns).T)
    tangent, differences = found[0] - found[1], exact[0] - exact[1]
    assert np.abs(differences).max() > 100.0
    assert np.abs(tangent - differences).max() < 0.02 * np.abs(differences).max()


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ({"law": "conservative"}, "layer-0.law is 'conservative', which a contact of turns of beams does not support"),
        ({"sense": 2}, "Contact.sense is 2; it must be 1 or -1"),
        ({"thickness": 0.0}, "Contact.thickness is 0.0; it must be a length above 0"),
        ({"thickness": (1e-3, 2e-3)}, "layer-0.thickness has 2 values; it must be one value, or 60 of them"),
        ({"width": 0.0}, "Contact.width is 0.0"),
        ({"points": 0}, "Contact.points is 0"),
    ],
)
def test_refusals(fields: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=words):
        wound(0.0015, **fields)


@pytest.mark.slow
def test_a_pressed_coil_springs_apart_without_gaining() -> None:
    """A free coil whose turns are pressed into one another: what the account gains falls with the step's square."""
    gained = []
    for step in (5e-4, 2.5e-4):
        assembly = wound(0.0015)
        solution = run(assembly, np.linspace(0.0, 0.5, 11), spectral_radius=1.0, step=step)
        assert solution.forces["contact_surfaces"]["touching"][0, 0] > 60.0
        assert solution.forces["contact_surfaces"]["touching"][-1, 0] == 0.0
        gained.append(np.abs(solution.energy_defect).max() / layer_forces(assembly, assembly.y)[1])
    assert gained[0] < 0.01
    assert gained[1] < 0.3 * gained[0]


def test_stuck_turns_stay_stuck_where_the_coil_turns_on_its_hub() -> None:
    """What the bristles hold is that of the turns against one another, wherever the coil stands."""
    assembly = wound(0.0015, friction=0.4, bristle_stiffness=100.0)
    start_step(assembly, assembly.y)
    model, beam = assembly.model, assembly.model.beams[0]
    checks = model.contact_points
    checks["stick"][checks["gap"] < 0.0] = [1e-4, 0.0, 0.0]
    n_v, energies = int(model.info.nv), []
    for angle in (0.0, 0.3, 1.0, 1.5):
        y, c, s = assembly.y.copy(), np.cos(angle), np.sin(angle)
        q = y[beam["iq"] : beam["iq"] + 6 * beam["nodes"]].reshape(-1, 3)
        q[:] = q @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
        Equations(assembly, 0.0, y, np.zeros(n_v), 0.0, 0.0, 1e-3).residual(np.zeros(n_v), np.zeros(0))
        energies.append(float(model.contact_surfaces["energy"].sum()))
    assert energies == pytest.approx([energies[0]] * 4, rel=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("law", ["hunt-crossley"])
def test_the_account_of_turns_that_rub_closes(law: str) -> None:
    """A pressed coil that springs apart and rubs: what friction takes is booked, to second order in the step."""
    gained = []
    for step in (5e-4, 2.5e-4):
        assembly = wound(0.0015, friction=0.4, bristle_stiffness=100.0, law=law, damping=0.5)
        solution = run(assembly, np.linspace(0.0, 0.2, 5), spectral_radius=1.0, step=step)
        assert solution.balance.by_friction[-1] > 0.0
        gained.append(np.abs(solution.energy_defect).max() / layer_forces(assembly, assembly.y)[1])
    assert gained[0] < 0.01
    assert gained[1] < 0.5 * gained[0]
