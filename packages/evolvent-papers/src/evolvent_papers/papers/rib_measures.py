"""Numbers of the ledger on Yi, Yuan, Dong & Li (2017), computed again: windings, the wound rib, its release."""

from __future__ import annotations

import math
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

import evolvent
from evolvent import cases, closed_forms, parts, results
from evolvent.elements import bending_stiffness_ratio
from evolvent_papers.papers.rib_figures import departure
from evolvent_papers.papers.rib_runs import ALPHAS, simulated, winding
from evolvent_papers.wrapped_rib.initial_state import initial_state
from evolvent_papers.wrapped_rib.structure import build

Values = dict[str, float]
#: Radius of the hub, m; the torque, N m; the rib's length, m.
R, TORQUE, LENGTH = 0.6, 0.2, 12.0
#: Elements of the cable that make the paper's first one, of 1.2 m.
FIRST = (1, 2, 3, 4)


def _of_alpha(alpha: float) -> Any:
    return winding(damping__alpha=alpha, solver__duration=ALPHAS[alpha])


def tip() -> Values:
    """Times and sizes of the largest tip speed for the three dampings, and for 0.5 1/s on the paper's first element."""
    found: Values = {}
    for name, alpha in (("0", 0.0), ("2", 0.2), ("5", 0.5)):
        run = _of_alpha(alpha)
        found |= {f"t{name}": float(run.t[run.peak]), f"v{name}": float(run.speed[run.peak])}
    hinge = _first_element()
    return found | {"t_hinge": float(hinge.t[hinge.peak]), "v_hinge": float(hinge.speed[hinge.peak])}


def _first_element() -> Any:
    """The winding with damping of the paper's element at the hub alone."""
    return winding(damping__alpha=0.5, damping__elements=FIRST, solver__duration=ALPHAS[0.0])


def string() -> Values:
    """Times at which a string without bending stiffness is wound to 98 %, and of the fastest tip, s, three dampings."""
    found: Values = {}
    for name, alpha in (("0", 0.0), ("2", 0.2), ("5", 0.5)):
        run = _of_alpha(alpha)
        found |= {f"s{name}": run.case.string.end_time, f"t{name}": float(run.t[run.peak])}
    return found


def layers() -> Values:
    """Times of the fastest tip where turns lie on one another, and where contact is that with the hub alone, s."""
    run, hub = winding(damping__alpha=0.2, solver__duration=68.0, contact__self=True), _of_alpha(0.2)
    return {"time": float(run.t[run.peak]), "hub": float(hub.t[hub.peak])}


def force() -> Values:
    """Impulse to the peak, and largest mean over 10 ms, of the contact force for the three dampings.

    `m_first` is the mean with 0.5 1/s in the first element alone.
    """
    found: Values = {}
    for name, alpha in (("0", 0.0), ("2", 0.2), ("5", 0.5)):
        run = _of_alpha(alpha)
        found |= {f"j{name}": float(run.impulse[run.peak]), f"m{name}": run.largest_mean_force}
    return found | {"m_first": _first_element().largest_mean_force}


def growing_force() -> Values:
    """Means of the contact force about several times before the whip, at it and at rest, N, alpha = 0.2 1/s."""
    run = _of_alpha(0.2)

    def mean(at: float, half: float) -> float:
        gained = np.interp([at - half, at + half], run.t, run.impulse)
        return float(gained[1] - gained[0]) / (2.0 * half)

    found = {f"at{t}": mean(t, 1.0) for t in (20, 35, 57, 65)}
    return found | {"whip": mean(run.t[run.peak] - 0.4, 0.1), "rest": float(run.force[-1])}


def shapes() -> Values:
    """Turns wound at several times, alpha = 0.2 1/s."""
    run = _of_alpha(0.2)
    found = {f"at{t}": float(np.interp(t, run.t, run.turns)) for t in (30, 50, 60, 65)}
    return found | {"end": float(run.turns[-1])}


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
    run = _of_alpha(0.2)
    places = run.touching[-1].reshape(run.case.rib.elements, -1)
    found = {f"p{k + 1}": float(count) for k, count in enumerate(places.sum(axis=0))}
    return found | {
        "touch": float(places.sum()),
        "elements": float(places.any(axis=1).sum()),
        "departure": 1e6 * departure(run),
        "sunk": 1e6 * TORQUE / R**2 * run.case.contact_spacing / run.case.contact_stiffness,
    }


def finer_points_at_rest() -> Values:
    """The same with 80 elements, of 320 points, and with 40 elements and a contact of 1e4 N/m."""
    fine = winding(damping__alpha=0.2, solver__duration=ALPHAS[0.2], rib__elements=80)
    hard = winding(damping__alpha=0.2, solver__duration=ALPHAS[0.2], contact__stiffness=1e4)
    return {"fine": float(fine.points[-1]), "hard": float(hard.points[-1])}


def at_rest() -> Values:
    """Sum of the contact forces of the wound rib at rest over T L / 2 R^2."""
    run = _of_alpha(0.2)
    return {"ratio": float(run.force[-1]) / (TORQUE * LENGTH / (2.0 * R**2))}


def root_damping() -> Values:
    """Winding without damping, with it in the paper's first element alone, and with dampers in the hinge."""
    dampers = [
        winding(damping__alpha=0.0, solver__duration=ALPHAS[0.0], rib__root_damping=damping) for damping in (0.05, 1.0)
    ]
    found: Values = {}
    for name, run in zip(
        ("none", "first", "weak", "strong"), (_of_alpha(0.0), _first_element(), *dampers), strict=True
    ):
        found |= {f"t_{name}": float(run.t[run.peak]), f"m_{name}": run.largest_mean_force}
    return found


def contact_stiffness() -> Values:
    """Time of the fastest tip with contacts of 1e2 and 1e4 N/m, s, alpha = 0.2 1/s."""
    found = [winding(damping__alpha=0.2, solver__duration=70.0, contact__stiffness=K) for K in (1e2, 1e4)]
    return {name: float(run.t[run.peak]) for name, run in zip(("soft", "hard"), found, strict=True)}


def meshes() -> Values:
    """Time and size of the largest tip speed with 20 and 80 elements, alpha = 0.2 1/s."""
    values: Values = {}
    for n in (20, 80):
        run = winding(damping__alpha=0.2, solver__duration=70.0, rib__elements=n)
        values |= {f"t{n}": float(run.t[run.peak]), f"v{n}": float(run.speed[run.peak])}
    return values


def paper_mesh() -> Values:
    """The paper's mesh under 0.2 N m, alpha = 0.5 1/s: turns, points that touch, radius of the tip (m) at the end.

    And the work to lay it on the hub and that of the torque over the whole rib, J.
    """
    run = _paper(TORQUE)
    rib, strip = run.case.rib, run.case.strip
    ratio = bending_stiffness_ratio("full", rib.element_length, rib.profile, rib.material, R)
    return {
        "turns": float(run.turns[-1]),
        "points": float(run.points[-1]),
        "tip": float(np.hypot(*run.x[-1, -1, 0, :2])),
        "needed": ratio * strip.bending_stiffness * LENGTH / (2.0 * R**2),
        "given": TORQUE * LENGTH / R,
    }


def greater_torques() -> Values:
    """Turns of the paper's mesh under greater torques: least and most of the last 30 s."""
    found: Values = {}
    for torque in (1, 10):
        run = _paper(float(torque))
        late = run.turns[run.t > 120.0]
        found |= {f"least{torque}": float(late.min()), f"most{torque}": float(late.max())}
    return found


def _paper(torque: float) -> Any:
    return winding(
        "wrapped-rib-paper", solver__method="energy-momentum", solver__step="auto", drive__torque=torque,
        damping__alpha=0.5, solver__duration=150.0,
    )  # fmt: skip


def couple() -> Values:
    """A couple of 1e-3 N m on the root in place of the field torque, over 60 s: most turns, angle of the root, rad."""
    case = cases.load("wrapped-rib", {"drive.torque": 1e-9, "solver.duration": 60.0})
    system = build(case, initial_state(case))
    system.add(parts.Load(at="rib-1.root", torque=(0.0, 0.0, 1e-3), ramp=5.0), "couple")
    run = simulated(system.assemble(), case)
    angle = np.unwrap(np.arctan2(run.x[:, 0, 1, 1], run.x[:, 0, 1, 0]))
    needed = case.strip.bending_stiffness * case.rib.length / (2.0 * R**2)
    return {
        "turns": float(run.turns.max()),
        "root": float(angle[-1]),
        "needed": 1e6 * needed,
        "field": float(_of_alpha(0.2).turns[-1]),
    }


def deployment() -> Values:
    """Tip of a released rib at 1000 s over the closed form, and the closed form's speed, m/s, and end, s."""
    case = cases.load("wrapped-rib-deploy")
    run = evolvent.run("wrapped-rib-deploy", {"solver.duration": 1000, "output.every": 100})
    closed = float(closed_forms.deployed_tip_radius(case.strip, np.array(1000.0)))
    return {
        "ratio": float(run.tip_radius[-1, 0]) / closed,
        "speed": closed_forms.deployment_speed(case.strip),
        "end": closed_forms.deployment_time(case.strip),
    }


def long_tail() -> tuple[list[float], list[float], float]:
    """Distances of a deployed tail's line from the axis over R, means of 1/r of its tip, and a rate, of 160 elements.

    The line is that of the piece farthest from the axis. Means are those of 1000 to 2000, 4000, 6000 and 8000 s; the
    rate is that of the angular momentum from 4000 s on, over 2 EI/R.
    """
    keys = {"rib.elements": 160, "solver.tolerance": 1e-5, "solver.duration": 8000, "output.every": 50}
    run, strip = evolvent.run("wrapped-rib-deploy", keys), cases.load("wrapped-rib-deploy").strip
    t, x = run.time.values, run["rib-1"]["position"].values[:, :, :2]
    piece, middle = np.diff(x, axis=1), 0.5 * (x[:, 1:] + x[:, :-1])
    cross = middle[..., 0] * piece[..., 1] - middle[..., 1] * piece[..., 0]
    line = np.max(np.abs(cross) / np.linalg.norm(piece, axis=-1), axis=1) / strip.radius
    inside = [(t >= low) & (t < high) for low, high in ((1e3, 2e3), (2e3, 4e3), (4e3, 6e3), (6e3, 8e3))]
    means = [float(line[some].mean()) for some in inside]
    over = [float(np.mean(1.0 / run.tip_radius.values[some, 0])) for some in inside]
    late = t > 4e3
    rate = np.polyfit(t[late], np.abs(run.angular_momentum.values[late, 2]), 1)[0]
    return means, over, float(rate * strip.radius / (2.0 * strip.bending_stiffness))


def elastica() -> Values:
    """Distance of a tail's line from the axis over R, first, last and of the limit of a long tail; rate over 2 EI/R."""
    means, over, rate = long_tail()
    return {"near": means[0], "far": means[-1], "distance": float(np.polyfit(over, means, 1)[1]), "rate": rate}


# ------------------------------------------------------------------------------------------------ beside the figures


def folded() -> Values:
    """The wound rib at rest: turns that touch, mean curvature times R, largest gap at the nodes but the tip, mm."""
    run = _of_alpha(0.2)
    slope, off = run.x[-1, :, 1, :2], np.hypot(*run.x[-1, :-1, 0, :2].T) - R
    angle = np.unwrap(np.arctan2(slope[:, 1], slope[:, 0]))
    return {
        "turns": float(run.touching_turns[-1]),
        "curvature": float(angle[-2] - angle[1]) / (LENGTH * (1.0 - 2.0 / (angle.size - 1))) * R,
        "off": 1e3 * float(np.abs(off).max()),
    }


def process() -> Values:
    """Angle by which the tip's direction turns in the winding, rad, and the strain of the surface by bending, %.

    `half` is the part of the bending that is there when half of this angle is turned.
    """
    run = _of_alpha(0.2)
    slope = run.x[:, :, 1, :2]
    angle = np.unwrap(np.arctan2(slope[..., 1], slope[..., 0]), axis=1)
    turned, bent = angle[:, -1] - angle[0, -1], (np.diff(angle, axis=1) ** 2).sum(axis=1)
    at = int(np.argmax(turned > 0.5 * turned[-1]))
    return {
        "turned": float(turned[-1]),
        "half": float(bent[at] / bent[-1]),
        "bending": 100.0 * run.case.rib.thickness / (2.0 * R),
    }


def helix() -> Values:
    """A rib wound as a helix of 0.04 m a turn: turns, height that it takes, m, and that of its closed form, m.

    `flat` is the height under a torque about the axis alone, m.
    """
    run = winding(damping__alpha=0.2, solver__duration=150.0, rib__pitch=0.04)
    height, flat = (float(one.x[-1, -1, 0, 2] - one.x[-1, 0, 0, 2]) for one in (run, _of_alpha(0.2)))
    return {"turns": float(run.turns[-1]), "height": height, "closed": run.case.rise, "flat": flat}


def torques() -> Values:
    """Peak times under 0.1, 0.2 and 0.4 N m over those of a string, and largest means of the force, N.

    `least` is the torque whose work on the hub is that of bending, EI/2R, uN m.
    """
    found: Values = {}
    for name, torque, end in (("1", 0.1, 130.0), ("2", TORQUE, 70.0), ("4", 0.4, 42.0)):
        run = winding(damping__alpha=0.2, solver__duration=end, drive__torque=torque)
        found |= {f"t{name}": float(run.t[run.peak]), f"s{name}": run.case.string.end_time}
        found[f"m{name}"] = run.largest_mean_force
    return found | {"least": 1e6 * run.case.strip.bending_stiffness / (2.0 * R)}


def modulus() -> Values:
    """Strains of the rib at the whip, %, with E = 5 MPa and 5 GPa, peak time (s) and time of unwinding (s) of each.

    `mean` is that of an element; with 5 MPa also `point`, the largest at two points of each, and `before`, the mean
    0.1 s before the whip. With 5 GPa round-off decides these.
    """
    found: Values = {}
    for name, E in (("5m", 5e6), ("5g", 5e9)):
        run = winding(damping__alpha=0.2, solver__duration=70.0, rib__young_modulus=E)
        strain, mean = _strains(run)
        early = run.t < run.t[run.peak] - 0.1
        found |= {f"mean{name}": 100.0 * mean.max(), f"time{name}": float(run.t[run.peak])}
        found[f"open{name}"] = closed_forms.deployment_time(run.case.strip)
        if E < 1e9:
            found |= {"point5m": 100.0 * strain.max(), "before5m": 100.0 * mean[early].max()}
    return found


def _strains(run: Any) -> tuple[np.ndarray, np.ndarray]:
    """Axial strains at two points of each element (nt, n, 2), and their means over each (nt, n)."""
    xi, length = 0.5 + np.array([-0.5, 0.5]) / math.sqrt(3.0), run.case.rib.element_length
    slopes = np.stack([
        (6.0 * xi**2 - 6.0 * xi) / length, 1.0 - 4.0 * xi + 3.0 * xi**2, (6.0 * xi - 6.0 * xi**2) / length,
        3.0 * xi**2 - 2.0 * xi,
    ])  # fmt: skip
    ends = np.concatenate([run.x[:, :-1], run.x[:, 1:]], axis=2)
    found = np.linalg.norm(np.einsum("jk,tnji->tnki", slopes, ends), axis=-1) - 1.0
    return found, found.mean(axis=2)


def released_from_wound() -> Values:
    """A winding of 90 s as the start of a deployment of 10 s: membrane over bending energy in the wound rib.

    `start`: elastic energy at the start of the deployment over that at the end of the winding; `opened`: turns by which
    the rib has unwound.
    """
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "wound.nc"
        wound = evolvent.run("wrapped-rib", {"solver.duration": 90})
        results.save(wound, file)
        keys = {"phase": "deploy", "start": str(file), "drive": None, "solver.duration": 10.0, "damping.beta": 0.02}
        run = evolvent.run("wrapped-rib", keys)
        elastic, bending = (float(wound["rib-1"][f"energy_{kind}"][-1]) for kind in ("elastic", "bending"))
        turns = run.wrap_angle.values[:, 0] / (2.0 * math.pi)
        return {
            "ratio": elastic / bending - 1.0,
            "start": float(run["rib-1"].energy_elastic[0]) / elastic,
            "opened": float(turns[0] - turns[-1]),
        }
