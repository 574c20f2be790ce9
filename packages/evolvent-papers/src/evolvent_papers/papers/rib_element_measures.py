"""Numbers of the ledger on Yi, Yuan, Dong & Li (2017), computed again: elements, their damping, data of figure 5."""

from __future__ import annotations

import functools
import itertools
from typing import Any

import numpy as np

from evolvent import System, cases, parts
from evolvent.elements import Material, Rectangle, axis_shape, beam_form, bending_stiffness_ratio, coil, straight_beam
from evolvent.kernels.ancf import beam_shape
from evolvent.solvers.modal.modes import modes
from evolvent.solvers.static.static import solve_static
from evolvent_papers.papers.rib_schematics import straddling_distances

Array = np.ndarray
Values = dict[str, float]
#: Length, height and width of the paper's element, m; E (Pa) and nu; radius of the hub, m.
LENGTH, THICKNESS, WIDTH, E, NU, R = 1.2, 0.0003, 0.03, 5e6, 0.3, 0.6
#: Step of central differences.
STEP = 1e-3


def _materials(nu: float = NU) -> tuple[Any, Any]:
    return Rectangle(thickness=THICKNESS, width=WIDTH), Material(young_modulus=E, poisson_ratio=nu, density=1600.0)


# ------------------------------------------------------------------------------------------------ element


def _short_element() -> tuple[float, Any, Any]:
    """An element of comparable sizes, on which no product is lost in round-off: length, section, material."""
    material = Material(young_modulus=2.0, poisson_ratio=NU, density=1.7)
    return 1.3, Rectangle(thickness=0.4, width=0.7), material


@functools.cache
def _gradients(length: float, section: Any) -> list[tuple[float, list[Array]]]:
    """Weights and matrices S,x, S,y, S,z (3, 24) at Gauss's points of the volume."""

    def rule(n: int, low: float, high: float) -> list[tuple[float, float]]:
        at, weight = np.polynomial.legendre.leggauss(n)
        half = 0.5 * (high - low)
        return [(low + half * (1.0 + a), half * w) for a, w in zip(at, weight, strict=True)]

    t, w = 0.5 * section.thickness, 0.5 * section.width
    found = []
    for x, wx in rule(5, 0.0, length):
        xi = x / length
        for y, wy in rule(3, -t, t):
            for z, wz in rule(3, -w, w):
                Sx = [(6 * xi**2 - 6 * xi) / length, 1 - 4 * xi + 3 * xi**2, -y / length, -z / length,
                      (6 * xi - 6 * xi**2) / length, 3 * xi**2 - 2 * xi, y / length, z / length]  # fmt: skip
                Sy, Sz = [0, 0, 1 - xi, 0, 0, 0, xi, 0], [0, 0, 0, 1 - xi, 0, 0, 0, xi]
                every = [np.kron(np.array(S, dtype=float), np.eye(3)) for S in (Sx, Sy, Sz)]
                found.append((wx * wy * wz, every))
    return found


def _table(e: Array, u: Array, length: float, section: Any, material: Any) -> tuple[Array, Array, Array]:
    """K_e(e), sum_j e_j [(C^ij + C^ij^T) e]_k and sum_s (d K_is / d e_k) u_s by the formulas of the paper."""
    nu = material.nu
    lam, mu = material.E * nu / ((1.0 + nu) * (1.0 - 2.0 * nu)), 0.5 * material.E / (1.0 + nu)
    K, T, D = np.zeros((24, 24)), np.zeros((24, 24)), np.zeros((24, 24))
    for weight, S in _gradients(length, section):
        for a in range(3):
            Saa = S[a].T @ S[a]
            K -= weight * 0.5 * (3.0 * lam + 2.0 * mu) * Saa
            for b in range(3):
                Sbb, Sab = S[b].T @ S[b], S[a].T @ S[b]
                for factor, A, B in ((0.5 * lam, Saa, Sbb), (mu, Sab, Sab)):
                    w = weight * factor
                    K += w * np.outer(A @ e, B @ e)
                    T += w * (A * (e @ B @ e) + np.outer(A @ e, B.T @ e))
                    D += w * (A * (u @ B @ e) + np.outer(A @ e, B.T @ u))
    return K, T, D


@functools.cache
def _formulas() -> Values:
    """Force, Jacobian and damping Jacobian by the paper's formulas beside our form and differences, relative."""
    length, section, material = _short_element()
    rng = np.random.default_rng(5)
    e = straight_beam(length) + rng.uniform(-0.3, 0.3, 24)
    u = rng.uniform(-1.0, 1.0, 24)
    form = beam_form("full", length, section, material)

    def force(e: Array) -> Array:
        return np.array([1e30 * form.energy(e + 1e-30j * d).imag for d in np.eye(24)])

    def derivative(function: Any) -> Array:
        near, far = (
            np.stack([function(e + h * d) - function(e - h * d) for d in np.eye(24)], axis=1)
            for h in (STEP, 2.0 * STEP)
        )
        return np.asarray((8.0 * near - far) / (12.0 * STEP))

    K, T, D = _table(e, u, length, section, material)
    F, J = force(e), derivative(force)
    along = rng.uniform(-1.0, 1.0, 24)
    ends = [_table(e + h * along, u, length, section, material)[0] @ u for h in (STEP, -STEP)]
    drag = (ends[0] - ends[1]) / (2.0 * STEP)  # exact: K_e is of the second degree
    return {
        "force": float(np.abs(K @ e - F).max() / np.abs(F).max()),
        "jacobian": float(np.abs(K + T - J).max() / np.abs(J).max()),
        "damping": float(np.abs(D @ along - drag).max() / np.abs(drag).max()),
    }


def elastic_force() -> Values:
    """The force K_e e beside the derivative of our energy, relative."""
    return {"force": _formulas()["force"]}


def jacobian() -> Values:
    """The Jacobian of the elastic force beside differences of ours, relative."""
    return {"jacobian": _formulas()["jacobian"]}


def damping_jacobian() -> Values:
    """The part of the damping's Jacobian with the rates beside differences of K_e e', relative."""
    return {"damping": _formulas()["damping"]}


def coordinates() -> Values:
    """Coordinates of an element, and vectors of its nodes."""
    e = straight_beam(LENGTH)
    return {"coordinates": float(e.size), "vectors": float(e.size // 3)}


def shape_functions() -> Values:
    """Largest difference of the paper's S1 to S8 from ours at points of an element, and of S1 + S5 from 1."""
    off, one, S = 0.0, 0.0, np.zeros(8)
    for xi, y, z in np.random.default_rng(3).uniform(0.0, 1.0, (20, 3)):
        eta, zeta, length = y / LENGTH, z / LENGTH, LENGTH
        beam_shape(length, xi, y, z, S)
        paper = [1 - 3 * xi**2 + 2 * xi**3, length * (xi - 2 * xi**2 + xi**3), length * (eta - xi * eta),
                 length * (zeta - xi * zeta), 3 * xi**2 - 2 * xi**3, length * (-(xi**2) + xi**3), length * xi * eta,
                 length * xi * zeta]  # fmt: skip
        off, one = max(off, float(np.abs(S - paper).max())), max(one, abs(float(S[0] + S[4]) - 1.0))
    return {"off": float(off), "one": float(one)}


def spinning() -> Values:
    """Power of damping on an undeformed element that spins at 1 rad/s: of b K_e e', of the objective form, over E V b.

    And `drag`, the power that a M e' takes, over a times its moment of inertia.
    """
    length, section, material = _short_element()
    t, w = section.thickness, section.width
    e = straight_beam(length)
    x = e.reshape(8, 3)
    u = np.cross([0.0, 0.0, 1.0], x).ravel()
    K, _, _ = _table(e, u, length, section, material)
    g = x @ u.reshape(8, 3).T  # rates of all inner products of the vectors
    taken, S = 0.0, np.zeros(8)
    at, weight = np.polynomial.legendre.leggauss(3)
    for (a, wa), (b, wb), (c, wc) in itertools.product(zip(at, weight, strict=True), repeat=3):
        beam_shape(length, 0.5 + 0.5 * a, 0.5 * t * b, 0.5 * w * c, S)
        taken += 0.125 * wa * wb * wc * length * t * w * float(np.sum((S @ u.reshape(8, 3)) ** 2))
    return {
        "paper": float(-u @ K @ u / (material.E * length * t * w)),
        "objective": float(np.abs(g + g.T).max()),
        "drag": taken / float(t * w * length**3 / 3.0 + t**3 * w / 12.0 * length),
    }


def ratio(formulation: str, elements: int, nu: float = NU) -> float:
    """Effective over true bending stiffness of a rib's element bent to the hub's radius."""
    found: float = bending_stiffness_ratio(formulation, 12.0 / elements, *_materials(nu), R)
    return found


def mesh() -> Values:
    """Bending stiffness of the paper's mesh and of ours, over the rib's."""
    return {"full10": ratio("full", 10), "full80": ratio("full", 80), "cable40": ratio("cable", 40)}


def poisson() -> Values:
    """Bending stiffness of a very fine mesh of `full` elements over the rib's, and of one with nu = 0 (`none`)."""
    return {
        "ratio": ratio("full", 1280),
        "none": ratio("full", 1280, 0.0),
        "theory": (1.0 - NU) / ((1.0 + NU) * (1.0 - 2.0 * NU)),
    }


# ------------------------------------------------------------------------------------------------ cost of the force


def tables() -> Values:
    """Multiplications of an elastic force by tables of i, j, k, l = 1..24, by Gauss's points and by our form.

    `off` is the difference of the force by tables from that by points, relative.
    """
    length, section, material = _short_element()
    nu = material.nu
    lam, mu = material.E * nu / ((1.0 + nu) * (1.0 - 2.0 * nu)), 0.5 * material.E / (1.0 + nu)
    points = _gradients(length, section)
    weight = np.array([w for w, _ in points])
    G = np.array([[S[::3, ::3][0] for S in each] for _, each in points])  # (points, 3 directions, 8 functions)
    Saa = [np.array([(each[a].T @ each[b]).ravel() for _, each in points]) for a in range(3) for b in range(3)]
    C = np.zeros((576, 576))
    for a in range(3):
        for b in range(3):
            same = 0.5 * lam * (Saa[4 * a].T * weight) @ Saa[4 * b]
            C += same + mu * (Saa[3 * a + b].T * weight) @ Saa[3 * a + b]
    C = np.ascontiguousarray(C.reshape(24, 24, 24, 24).transpose(0, 2, 1, 3).reshape(576, 576))
    trace = np.stack([np.tensordot(weight, Saa[4 * a], 1) for a in range(3)]).sum(axis=0)
    K1 = -0.5 * (3.0 * lam + 2.0 * mu) * trace.reshape(24, 24)
    e = np.random.default_rng(5).uniform(-0.3, 0.3, 24)

    def by_tables() -> Array:
        return (K1 + (C @ np.outer(e, e).ravel()).reshape(24, 24)) @ e

    def by_points() -> Array:
        F = G @ e.reshape(8, 3)
        strain = 0.5 * (F @ F.transpose(0, 2, 1) - np.eye(3))
        stress = 2.0 * mu * strain + lam * np.trace(strain, axis1=1, axis2=2)[:, None, None] * np.eye(3)
        force: Array = np.tensordot(weight[:, None, None] * G, stress @ F, ([0, 1], [0, 1])).ravel()
        return force

    return {
        "tables": 24.0**4 + 24.0**2,
        "points": weight.size * (2.0 * 72.0 + 18.0 + 27.0),
        "form": 28.0 * 3.0 + 28.0**2 + 49.0 * 3.0,
        "off": float(np.abs(by_tables() - by_points()).max() / np.abs(by_points()).max()),
    }


# ------------------------------------------------------------------------------------------------ inertia


def stiffening() -> Values:
    """Slowest frequencies across and in the plane of a rib spinning at 0.3 rad/s, and of bending alone, by the rate."""
    rate, system = 0.3, System()
    section, material = _materials()
    system.add(parts.RigidBody(motion="driven", rate=rate), "hub")
    beam = {"length": 12.0, "elements": 20, "formulation": "cable", "position": (0.0, 0.0, 0.0)}
    system.add(parts.Beam(section=section, material=material, **beam), "rib")
    system.add(parts.Joint(a=("hub", (0.0, 0.0, 0.0)), b="rib.root", type="clamp"), "root")
    assembly = system.assemble()
    found = modes(assembly, equilibrium=solve_static(assembly, rotating="hub"), count=4).frequency / rate
    EI = E * WIDTH * THICKNESS**3 / 12.0
    bending = 3.516 * (EI / (1600.0 * WIDTH * THICKNESS * 12.0**4)) ** 0.5 / rate
    return {"first": float(found[1]), "plane": float(found[2]), "second": float(found[3]), "bending": bending}


def constant_mass() -> Values:
    """Kinetic energies of a straight and a coiled rib of `full` elements with the same rates, relative difference."""
    section, material = _materials()
    rates = np.random.default_rng(2).uniform(-1.0, 1.0, (5, 4, 3))
    energies = []
    for radius in (1e6, R):
        nodes = coil("full", 4, LENGTH, section, material, radius=radius)
        system = System()
        beam = {"length": 4.0 * LENGTH, "elements": 4, "formulation": "full"}
        system.add(parts.Beam(section=section, material=material, nodes=nodes, rates=rates, **beam), "rib")
        run = system.simulate(until=1e-6, every=1e-6)
        energies.append(float(run["rib"].energy_kinetic[0]))
    return {"energy": energies[0], "off": float(abs(energies[1] / energies[0] - 1.0))}


# ------------------------------------------------------------------------------------------------ data


def masses() -> Values:
    """Masses of the rib and of the hub (kg), the tip's distance from the axis at the start (m), elements."""
    case = cases.load("wrapped-rib-paper", {"hub.density": 7810.0, "hub.motion": "free"})
    return {
        "rib": case.strip.line_density * case.rib.length,
        "hub": case.hub.given_mass,
        "tip": case.hub.radius + case.rib.length,
        "elements": float(case.rib.elements),
    }


def weight() -> Values:
    """Moment of the rib's weight at its root on the ground, over what bends it to the hub's radius: with 5 MPa, 50 GPa.

    `sag` is how far the tip of one of 50 GPa sags on its edge by linear theory, over its length; `air` is the mass of
    the air that moves with the rib across it, over its own.
    """
    line_density = 1600.0 * WIDTH * THICKNESS
    moment = 0.5 * line_density * 9.81 * 12.0**2
    stiffness = WIDTH * THICKNESS**3 / 12.0 / R
    sag = line_density * 9.81 * 12.0**3 / (8.0 * 50e9 * THICKNESS * WIDTH**3 / 12.0)
    air = 1.2 * np.pi * WIDTH**2 / 4.0 / line_density
    return {"soft": moment / (E * stiffness), "carbon": moment / (50e9 * stiffness), "sag": sag, "air": float(air)}


def stowage() -> Values:
    """Diameter of a reflector with the paper's ribs, m, over that of its hub with the turns of a rib, by thickness."""
    turns = 12.0 / (2.0 * np.pi * R)
    open_, wound = 2.0 * (R + 12.0), 2.0 * (R + turns * THICKNESS)
    return {"diameter": open_, "ratio": float(open_ / wound)}


def search() -> Values:
    """Distance of the paper's nodes from the hub's surface when the middle of their element touches, m."""
    return {"outside": straddling_distances(LENGTH)[0] - R}


def spread() -> Values:
    """Sum of the forces S^T f on the nodes of an element over f, and their moment about the origin over that of f."""
    section, material = _materials()
    a, b = coil("cable", 1, LENGTH, section, material, radius=R)
    vectors, f = np.stack([a[0], a[1], b[0], b[1]]), np.array([0.3, -0.8, 0.2])
    S = np.array(axis_shape(LENGTH, np.array([0.3])))[:, 0]
    moment = np.cross(vectors, S[:, None] * f).sum(axis=0)
    whole = np.cross(S @ vectors, f)
    return {"sum": float(S[0] + S[2]), "moment": float(np.abs(moment - whole).max())}
