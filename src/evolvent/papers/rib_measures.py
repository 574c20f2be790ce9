"""Numbers of the ledger on Yi, Yuan, Dong & Li (2017), computed again: elements, contact, steps, windings."""

from __future__ import annotations

import functools
import math
from typing import Any

import numpy as np

Array = np.ndarray
Values = dict[str, float]
#: Length, height and width of the paper's element, m; E (Pa) and nu; radius of the hub, m.
LENGTH, THICKNESS, WIDTH, E, NU, R = 1.2, 0.0003, 0.03, 5e6, 0.3, 0.6
#: Step of central differences.
STEP = 1e-3


def _materials() -> tuple[Any, Any]:
    from evolvent.elements import Material, Rectangle

    return Rectangle(thickness=THICKNESS, width=WIDTH), Material(young_modulus=E, poisson_ratio=NU, density=1600.0)


# ------------------------------------------------------------------------------------------------ element


def _short_element() -> tuple[float, Any, Any]:
    """An element of comparable sizes, on which no product is lost in round-off: length, section, material."""
    from evolvent.elements import Material, Rectangle

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
def element() -> Values:
    """Force, Jacobian and damping Jacobian by the paper's formulas beside our form and differences, relative."""
    from evolvent.elements import beam_form, straight_beam

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
        "force": _negligible(np.abs(K @ e - F).max() / np.abs(F).max()),
        "jacobian": _negligible(np.abs(K + T - J).max() / np.abs(J).max()),
        "damping": _negligible(np.abs(D @ along - drag).max() / np.abs(drag).max()),
    }


def shape_functions() -> Values:
    """Largest difference of the paper's S1 to S8 from ours at points of an element, and of S1 + S5 from 1."""
    from evolvent.kernels.ancf import beam_shape

    off, one, S = 0.0, 0.0, np.zeros(8)
    for xi, y, z in np.random.default_rng(3).uniform(0.0, 1.0, (20, 3)):
        eta, zeta, length = y / LENGTH, z / LENGTH, LENGTH
        beam_shape(length, xi, y, z, S)
        paper = [1 - 3 * xi**2 + 2 * xi**3, length * (xi - 2 * xi**2 + xi**3), length * (eta - xi * eta),
                 length * (zeta - xi * zeta), 3 * xi**2 - 2 * xi**3, length * (-(xi**2) + xi**3), length * xi * eta,
                 length * xi * zeta]  # fmt: skip
        off, one = max(off, float(np.abs(S - paper).max())), max(one, abs(float(S[0] + S[4]) - 1.0))
    return {"off": _negligible(off), "one": _negligible(one)}


def _negligible(value: float) -> float:
    """A difference, 0 below 1e-9."""
    return round(float(value), 9)


def spinning() -> Values:
    """Power of b K_e e' and of the objective damping on an undeformed element that spins at 1 rad/s, of E V b."""
    from evolvent.elements import straight_beam

    length, section, material = _short_element()
    e = straight_beam(length)
    x = e.reshape(8, 3)
    u = np.cross([0.0, 0.0, 1.0], x).ravel()
    K, _, _ = _table(e, u, length, section, material)
    scale = material.E * length * section.thickness * section.width
    g = x.reshape(8, 3) @ u.reshape(8, 3).T  # rates of all inner products of the vectors
    return {"paper": float(-u @ K @ u / scale), "objective": _negligible(np.abs(g + g.T).max())}


def ratio(formulation: str, elements: int) -> float:
    """Effective over true bending stiffness of a rib's element bent to the hub's radius."""
    from evolvent.elements import bending_stiffness_ratio

    found: float = bending_stiffness_ratio(formulation, 12.0 / elements, *_materials(), R)
    return found


def mesh() -> Values:
    """Bending stiffness of the paper's mesh and of ours, over the rib's, and the work to lay it on the hub, J."""
    found = {"full10": ratio("full", 10), "full80": ratio("full", 80), "cable40": ratio("cable", 40)}
    bending = E * WIDTH * THICKNESS**3 / 12.0 * 12.0 / (2.0 * R**2)
    return found | {"needed": found["full10"] * bending, "given": 0.2 * 12.0 / R}


def poisson() -> Values:
    """Bending stiffness of a very fine mesh of `full` elements over the rib's."""
    return {"ratio": ratio("full", 1280), "theory": (1.0 - NU) / ((1.0 + NU) * (1.0 - 2.0 * NU))}


# ------------------------------------------------------------------------------------------------ steps


def _error(radius: float, shift: float, steps: int) -> float:
    """Error of the generalized-alpha method on x'' = -x after half a period; `shift` is added to the right gamma."""
    am, af = (2.0 * radius - 1.0) / (radius + 1.0), radius / (radius + 1.0)
    beta, gamma, h = 1.0 / (1.0 + radius) ** 2, 2.0 / (1.0 + radius) - 0.5 + shift, math.pi / steps
    x, v, acc, a = 1.0, 0.0, -1.0, -1.0
    for _ in range(steps):
        # (1 - am) a1 + am a = -(1 - af) x1 + af acc, x1 = x + h v + h2 ((1/2 - beta) a + beta a1)
        start = x + h * v + h * h * (0.5 - beta) * a
        a1 = (af * acc - am * a - (1.0 - af) * start) / ((1.0 - am) + (1.0 - af) * h * h * beta)
        x = start + h * h * beta * a1
        v += h * ((1.0 - gamma) * a + gamma * a1)
        acc, a = -x, a1
    return math.hypot(x + 1.0, v)


def gamma() -> Values:
    """Order of convergence with gamma = 2/(1 + rho) - 1/2 and with the printed + 1/2, rho = 0.3."""

    def order(shift: float) -> float:
        return math.log2(_error(0.3, shift, 500) / _error(0.3, shift, 1000))

    return {"right": order(0.0), "printed": order(1.0)}


def explicit_limit() -> Values:
    """Longest stable step of rk4 on the paper's mesh, us."""
    from evolvent.papers.winding import Model, Trial

    return {"limit": 1e6 * Model("wrapped-rib-paper", 80.0).settings(Trial("rk4", share=1.0))["step"]}


def contact_law() -> Values:
    """Times at which fixed steps of the paper's set-up fail, s, and the jump of the force at 1 m/s, N."""
    from evolvent.papers.winding import ALPHA, Model, Trial

    model = Model("wrapped-rib-paper", 30.0)
    found = {f"h{k}": model.run(Trial(ALPHA, step=step)) for k, step in enumerate((0.5, 0.1, 0.02, 0.004))}
    values = {name: float(run.t[-1]) for name, run in found.items()}
    return values | {"failed": float(sum(run.status == "failed" for run in found.values())), "jump": 1e3}


def half_second() -> Values:
    """Steps of 0.5 s through the winding by 40 cable elements: where generalized-alpha fails, what the other takes."""
    from evolvent.papers.winding import ALPHA, ENERGY, Model, Trial

    model = Model("wrapped-rib", 80.0)
    alpha, energy = (model.run(Trial(method, step=0.5)) for method in (ALPHA, ENERGY))
    return {"failed": float(alpha.t[-1]), "mean": energy.mean_step, "divided": float(energy.divided)}


def implicit_and_explicit() -> Values:
    """Tip error before the whip of energy-momentum at 0.05 s and of rk4 at half its limit, mm."""
    from evolvent.papers.winding import ENERGY, Model, Trial

    model = Model("wrapped-rib", 66.0)
    fine, implicit, explicit = (
        model.run(trial) for trial in (Trial(ENERGY, step=1e-3), Trial(ENERGY, step=0.05), Trial("rk4", share=0.5))
    )
    return {name: 1e3 * run.error(fine, 65.9) for name, run in (("implicit", implicit), ("explicit", explicit))}


# ------------------------------------------------------------------------------------------------ windings


def _of_alpha(alpha: float) -> Any:
    from evolvent.papers.rib_runs import ALPHAS, winding

    return winding(damping__alpha=alpha, solver__duration=ALPHAS[alpha])


def tip() -> Values:
    """Times and sizes of the largest tip speed for the three dampings."""
    found: Values = {}
    for name, alpha in (("0", 0.0), ("2", 0.2), ("5", 0.5)):
        run = _of_alpha(alpha)
        found |= {f"t{name}": float(run.t[run.peak]), f"v{name}": float(run.speed[run.peak])}
    return found


def string() -> Values:
    """Times at which a string without bending stiffness is wound to 98 %, s, for the three dampings."""
    from evolvent import cases

    found = {name: cases.load("wrapped-rib", {"damping.alpha": a}) for name, a in (("s0", 0), ("s2", 0.2), ("s5", 0.5))}
    return {name: case.string.end_time for name, case in found.items()}


def layers() -> Values:
    """Time of the fastest tip where turns lie on one another, s, alpha = 0.2 1/s."""
    from evolvent.papers.rib_runs import winding

    run = winding(damping__alpha=0.2, solver__duration=68.0, contact__self=True)
    return {"time": float(run.t[run.peak])}


def force() -> Values:
    """Impulse to the peak, and largest mean over 10 ms and largest sample of the contact force."""
    found: Values = {}
    for name, alpha in (("0", 0.0), ("2", 0.2), ("5", 0.5)):
        run = _of_alpha(alpha)
        found |= {f"j{name}": float(run.impulse[run.peak]), f"m{name}": run.largest_mean_force}
        found[f"f{name}"] = float(run.force.max())
    return found


def shapes() -> Values:
    """Turns wound at several times, alpha = 0.2 1/s."""
    run = _of_alpha(0.2)
    return {f"at{t}": float(np.interp(t, run.t, run.turns)) for t in (30, 50, 60, 65)}


def points() -> Values:
    """Contact points that touch at several times, alpha = 0.2 1/s: means over 2 s."""
    run = _of_alpha(0.2)
    found: Values = {}
    for t in (30, 50, 60, 65):
        near = run.even & (np.abs(run.t - t) < 1.0)
        found[f"at{t}"] = float(run.points[near].mean())
    return found | {"end": float(run.points[-1])}


def points_at_rest() -> Values:
    """Contact points of each element that touch at rest, by position, and what a cubic departs from an arc, um."""
    from evolvent.papers.rib_figures import departure

    run = _of_alpha(0.2)
    places = run.touching[-1].reshape(run.case.rib.elements, -1)
    found = {f"p{k + 1}": float(count) for k, count in enumerate(places.sum(axis=0))}
    return found | {
        "touch": float(places.sum()),
        "elements": float(places.any(axis=1).sum()),
        "departure": 1e6 * departure(run),
        "sunk": 1e6 * 0.2 / R**2 * run.case.contact_spacing / run.case.contact_stiffness,
    }


def finer_points_at_rest() -> Values:
    """The same with 80 elements, of 320 points, and with 40 elements and a contact of 1e4 N/m."""
    from evolvent.papers.rib_runs import ALPHAS, winding

    fine = winding(damping__alpha=0.2, solver__duration=ALPHAS[0.2], rib__elements=80)
    hard = winding(damping__alpha=0.2, solver__duration=ALPHAS[0.2], contact__stiffness=1e4)
    return {"fine": float(fine.points[-1]), "hard": float(hard.points[-1])}


def at_rest() -> Values:
    """Sum of the contact forces of the wound rib at rest over T L / 2 R^2, and the turns wound."""
    run = _of_alpha(0.2)
    return {"ratio": float(run.force[-1]) / (0.2 * 12.0 / (2.0 * R**2)), "turns": float(run.turns[-1])}


def root_damping() -> Values:
    """Winding without damping, with it in the first element alone, and with dampers in the hinge."""
    from evolvent.papers.rib_figures import root_keys
    from evolvent.papers.rib_runs import winding

    found: Values = {}
    for name, keys in zip(("none", "first", "weak", "strong"), root_keys(), strict=True):
        run = winding(**keys)
        found |= {f"t_{name}": float(run.t[run.peak]), f"m_{name}": run.largest_mean_force}
        found[f"s_{name}"] = float(run.force[run.even].max())
    return found


def contact_stiffness() -> Values:
    """Time of the fastest tip with contacts of 1e2 and 1e4 N/m, s, alpha = 0.2 1/s."""
    from evolvent.papers.rib_runs import winding

    found = [winding(damping__alpha=0.2, solver__duration=70.0, contact__stiffness=K) for K in (1e2, 1e4)]
    return {name: float(run.t[run.peak]) for name, run in zip(("soft", "hard"), found, strict=True)}


def meshes() -> Values:
    """Time and size of the largest tip speed with 20 and 80 elements, alpha = 0.2 1/s."""
    from evolvent.papers.rib_runs import winding

    values: Values = {}
    for n in (20, 80):
        run = winding(damping__alpha=0.2, solver__duration=70.0, rib__elements=n)
        values |= {f"t{n}": float(run.t[run.peak]), f"v{n}": float(run.speed[run.peak])}
    return values


def paper_mesh() -> Values:
    """The paper's mesh under 0.2 N m, alpha = 0.5 1/s: turns, points that touch, radius of the tip (m) at the end."""
    run = _paper(0.2)
    tip = float(np.hypot(*run.x[-1, -1, 0, :2]))
    return {"turns": float(run.turns[-1]), "points": float(run.points[-1]), "tip": tip}


def greater_torques() -> Values:
    """Turns of the paper's mesh under greater torques: least and most of the last 30 s."""
    found: Values = {}
    for torque in (1, 5, 10):
        run = _paper(float(torque))
        late = run.turns[run.t > 120.0]
        found |= {f"least{torque}": float(late.min()), f"most{torque}": float(late.max())}
    return found


def _paper(torque: float) -> Any:
    from evolvent.papers.rib_runs import winding

    return winding(
        "wrapped-rib-paper", solver__method="energy-momentum", contact__law="hunt-crossley", solver__step="auto",
        drive__torque=torque, damping__alpha=0.5, solver__duration=150.0,
    )  # fmt: skip


def couple() -> Values:
    """A couple of 1e-3 N m on the root in place of the field torque, over 60 s: most turns, angle of the root, rad."""
    from evolvent import cases, parts
    from evolvent.papers.rib_runs import simulated
    from evolvent.systems.wrapped_rib.initial_state import initial_state
    from evolvent.systems.wrapped_rib.structure import build

    case = cases.load("wrapped-rib", {"drive.torque": 1e-9, "solver.duration": 60.0})
    system = build(case, initial_state(case))
    system.add(parts.Torque(at="rib-1.root", torque=(0.0, 0.0, 1e-3), ramp=5.0), "couple")
    run = simulated(system.assemble(), case)
    angle = np.unwrap(np.arctan2(run.x[:, 0, 1, 1], run.x[:, 0, 1, 0]))
    needed = case.strip.bending_stiffness * case.rib.length / (2.0 * R**2)
    return {"turns": _negligible(max(run.turns.max(), 0.0)), "root": float(angle[-1]), "needed": 1e6 * needed}


def deployment() -> Values:
    """Tip of a released rib at 1000 s over the closed form, and the closed form's speed, m/s, and end, s."""
    import evolvent
    from evolvent import cases, closed_forms

    case = cases.load("wrapped-rib-deploy")
    run = evolvent.run("wrapped-rib-deploy", {"solver.duration": 1000, "output.every": 100})
    closed = float(closed_forms.deployed_tip_radius(case.strip, np.array(1000.0)))
    return {
        "ratio": float(run.tip_radius[-1, 0]) / closed,
        "speed": closed_forms.deployment_speed(case.strip),
        "end": closed_forms.deployment_time(case.strip),
    }


def elastica() -> Values:
    """Angle (deg) by which the rib turns on where it leaves the hub, and its line's distance from the axis over R."""
    angle = math.acos(2.0 / 3.0)
    return {"angle": math.degrees(angle), "distance": 2.0 / 3.0 + 2.0 * math.sin(0.5 * angle) * math.sqrt(2.0 / 3.0)}


def hinge() -> Values:
    """Largest distance of the root from the hinge during the winding, m."""
    run = _of_alpha(0.2)
    return {"drift": _negligible(np.abs(run.x[:, 0, 0] - run.x[0, 0, 0]).max())}


def search() -> Values:
    """Distance of the paper's nodes from the hub's surface when the middle of their element touches, m."""
    from evolvent.papers.rib_schematics import straddling_distances

    return {"outside": straddling_distances(LENGTH)[0] - R}
