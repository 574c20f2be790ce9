"""A tape spring as a shell: its peak moment and the moments at which folds grow, beside the section theory.

    python benchmarks/tape_shell.py [-o benchmarks/tape_shell.json]

Steel, radius 15 mm, 90 degrees, 0.1 mm. Ends are clamped to rigid bodies, which are free to move in the plane of
bending; a quarter is modelled, so that folds are symmetric and the tape does not twist. The peak is that of the static
path under a moment, by arc length, of a tape of 300 mm. For the propagation moment the ends of a tape of 160 mm are
turned by 10 rad/s against one another, in steps of energy-momentum with damping of the wall; it is the slope of the
elastic energy over the angle from 100 to 150 degrees. In equal sense a force flattens the middle for the first 30 ms,
where the fold is to form. The case `tape-hinge-shell` follows, whose folds open a hinge; then a coarse one of it that
was folded for ten years, with the Prony series of the case `tape-hinge-stored`.

The reference is the theory of a section in uniform bending, without that of shallow arcs, on which the closed form of
Wuest (1954) rests: the angle of the wall along the section is that of least energy.
"""

from __future__ import annotations

import argparse
import json
import math
import pathlib
import sys
import time
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import least_squares, minimize_scalar

import evolvent
from evolvent import System, parts
from evolvent.closed_forms.tapes import snap
from evolvent.elements import Material, TapeSection
from evolvent.elements.viscoelastic import Viscoelastic
from evolvent.solvers.static.static import solve_static

Array = np.ndarray
STEEL = Material(young_modulus=210e9, poisson_ratio=0.3, density=7850.0)
TAPE = TapeSection(radius=0.015, angle=0.5 * math.pi, thickness=1e-4)
#: Meshes of a quarter: of the peak and of the folds.
PEAKS, FOLDS = ((40, 6), (60, 8), (90, 12)), ((40, 8), (64, 12))
#: Keys of a shell's start, and the results that they are.
STARTS = {"start": "position", "start_normals": "normal"}
#: Relaxation of the tapes that are stored, of the case `tape-hinge-stored`, and their mesh.
AGED, COARSE = Viscoelastic(prony=[(0.04, "1 h"), (0.06, "30 days"), (0.08, "3 years")]), (20, 4)
#: Angles between the ends, deg, from and to which the slope of the energy is taken.
RANGE = (100.0, 150.0)


class Uniform(NamedTuple):
    """Moment, N m, and energy per length, J/m, of uniform bending, and the angles of the wall."""

    moment: float
    energy: float
    angles: Array


def uniform_bending(curvature: float, angles: Array | None = None, parts_of_half: int = 80) -> Uniform:
    """Uniform bending of the tape, of a curvature (1/m) above 0 in opposite sense.

    A fibre at the height z of the section, from its mean, is longer by curvature z; the wall is bent by curvature times
    the cosine of its angle along the tape, and across it by the change of the slope of the angle.
    """
    n, nu, t = parts_of_half, STEEL.nu, TAPE.thickness
    h = 0.5 * TAPE.radius * TAPE.angle / n
    D = STEEL.E * t**3 / (12.0 * (1.0 - nu**2))

    def strains(free: Array) -> tuple[Array, Array, Array]:
        """Heights, cosines of angles, changes of curvature across."""
        phi = np.concatenate([[0.0], free])
        middle, rise = 0.5 * (phi[1:] + phi[:-1]), h * np.sin(0.5 * (phi[1:] + phi[:-1]))
        z = np.cumsum(rise) - 0.5 * rise
        return z - z.mean(), np.cos(middle), np.diff(phi) / h - 1.0 / TAPE.radius

    def residuals(free: Array) -> Array:
        z, cosines, across = strains(free)
        along = curvature * cosines
        return np.concatenate([
            math.sqrt(STEEL.E * t * h) * curvature * z, math.sqrt(D * h * (1.0 - nu**2)) * along,
            math.sqrt(D * h) * (across - nu * along),
        ])  # fmt: skip

    start = np.arange(1, n + 1) * h / TAPE.radius if angles is None else angles
    found = least_squares(residuals, start, x_scale="jac", xtol=1e-12, ftol=1e-12, gtol=1e-12)
    z, cosines, across = strains(found.x)
    slope = STEEL.E * t * curvature * z**2 + D * (curvature * cosines**2 - nu * cosines * across)
    return Uniform(2.0 * h * float(slope.sum()), 2.0 * float(found.cost), found.x)


def propagation(sense: float) -> float:
    """Least energy per angle of a fold, N m."""
    angles: list[Array | None] = [None]

    def ratio(k: float) -> float:
        found = uniform_bending(sense * k, angles[0])
        return found.energy / k

    for k in np.geomspace(0.5, 60.0, 12):
        angles[0] = uniform_bending(sense * k, angles[0]).angles
    return float(minimize_scalar(ratio, bounds=(50.0, 80.0), method="bounded", options={"xatol": 0.1}).fun)


def quarter(half: float, elements: tuple[int, int], **keys: Any) -> System:
    """A quarter of a tape along x, from its middle to a rigid body at its end; convex side up, finer at the edge."""
    n1, n2 = elements
    x = np.linspace(0.0, half, n1 + 1)[:, None]
    turn = 0.5 * TAPE.angle * (1.0 - (1.0 - np.linspace(0.0, 1.0, n2 + 1)) ** 1.5)
    zero, R = 0.0 * x * turn, TAPE.radius
    nodes: Any = np.stack([x + zero, R * np.sin(turn) + zero, R * np.cos(turn) - R + zero], axis=-1)
    normals: Any = np.stack([zero, np.sin(turn) + zero, np.cos(turn) + zero], axis=-1)
    shell = parts.Shell(
        nodes=nodes, normals=normals, elements=elements, thickness=TAPE.thickness, material=STEEL, **keys
    )
    system = System()
    system.add(shell, "tape")
    system.add(parts.RigidBody(mass=5e-3, inertia=(1e-6,) * 3, position=(half, 0.0, 0.0)), "grip")
    system.add(parts.Seam(a="tape.x1", b="grip", type="clamp"), "end")
    middle = parts.Joint(type="guide", a=(0.0, 0.0, 0.0), b="tape[0]", axis=(0.0, 0.0, 1.0))
    system.add(middle, "height")
    _keep_symmetric(system, shell)
    return system


def _keep_symmetric(system: System, shell: parts.Shell) -> None:
    """Keep the nodes of two edges in planes across axes 1 and 2."""
    x, R = shell.mesh()[:2]
    held: set[tuple[int, frozenset[int]]] = set()
    for edge, axis in (("x0", 0), ("y0", 1)):
        for node in shell.edge(edge):
            for other in range(3):
                if (int(node), frozenset((axis, other))) in held:
                    continue
                held.add((int(node), frozenset((axis, other))))
                keys: Any = {} if other == axis else {"axis_b": tuple(R[node][:, other])}
                guide = parts.Joint(
                    type="guide", a=tuple(x[node]), b=f"tape[{node}]", axis=tuple(R[node][:, axis]), **keys
                )
                system.add(guide, f"{edge} {node} {other}")


class Path(NamedTuple):
    """Moments, N m, and curvatures, 1/m, in the middle of a tape along its static path."""

    moment: Array
    curvature: Array


def bent(half: float, elements: tuple[int, int], sense: float = 1.0, steps: int = 60) -> Path:
    """Bend a tape by a moment, along an arc, to its peak at least."""
    system = quarter(half, elements)
    system.add(parts.Load(at="grip", torque=(0.0, -0.5 * sense, 0.0)), "moment")
    assembly = system.assemble()
    found = solve_static(assembly, arc_length=True, load_steps=elements[0] // 4, most_steps=steps)
    assert found.path is not None
    node = 2 * (elements[1] + 1)  # the second one of the middle line
    q = int(assembly.model.bodies["iq"][1 + node])
    turned = 2.0 * np.arctan2(-found.y[:, q + 5], found.y[:, q + 3]) * sense
    return Path(np.asarray(found.path.factor), turned * elements[0] / (2.0 * half))


class Released(NamedTuple):
    """Slope of the energy of both tapes over the angle, N m; of each; CPU time, s; defect of the balance."""

    moment: float
    opposite: float
    equal: float
    straight: float
    cpu: float
    defect: float


def released() -> Released:
    """The built-in case `tape-hinge-shell`: from 150 to 40 degrees after its release at 1.4 s."""
    began = time.process_time()
    run = evolvent.run("tape-hinge-shell", {"simulate.every": 0.01})
    cpu = time.process_time() - began
    straight = json.loads(run.attrs["events"])["time"][0] - 1.4
    defect = float(np.abs(run["energy_defect"].values).max() / run["energy_moved"].values.max())
    run = run.ev.regular()
    turns = run["panel"]["attitude"].values
    angle = np.degrees(np.unwrap(2.0 * np.arctan2(turns[:, 3], turns[:, 0])))
    inside = (run["time"].values > 1.41) & (angle < 150.0) & (angle > 40.0)
    tapes = [run[f"tape {k}"]["energy_elastic"].values[inside] for k in (1, 2)]
    one, two = (float(np.polyfit(np.radians(angle[inside]), energy, 1)[0]) for energy in tapes)
    return Released(one + two, one, two, straight, cpu, defect)


class Stored(NamedTuple):
    """What ten years leave of the moments of both tapes, and of their energy; CPU time of the storage, s.

    `straight`, `aged`: time from the release until the hinge is in line, s, without storage and after it; `cpu`, of
    these two runs.
    """

    left: float
    energy: float
    storage: float
    straight: float
    aged: float
    cpu: float


def stored() -> Stored:
    """The case `tape-hinge-shell` with a coarse mesh, held folded by 180 degrees for ten years, then released."""
    keys: Any = {f"parts.tape {k}.elements": COARSE for k in (1, 2)}
    fold = evolvent.run("tape-hinge-shell", keys | {"simulate.until": 1.39, "simulate.every": 0.1})

    def system(sections: Any) -> System:
        found, case = System(sections=sections), evolvent.load("tape-hinge-shell").parts
        for name in ("tape 1", "tape 2"):
            start = {key: fold[name][of].values[-1].tolist() for key, of in STARTS.items()}
            aged = {"elements": COARSE, "material": STEEL.replaced(viscoelastic=AGED)}
            found.add(case[name].replaced(**start, **aged), name)
        at, turned = (tuple(fold["panel"][of].values[-1].tolist()) for of in ("position", "attitude"))
        found.add(case["panel"].replaced(position=at, orientation=turned), "panel")
        for name in ("tip 1", "tip 2"):
            found.add(case[name], name)
        found.add(parts.Joint(type="clamp", a=at, b="panel", until=0.01), "hold-down")
        found.add(parts.Event(law="min(t - 0.01, 0.01 - y)", variables={"y": "panel.position.y"}), "straight")
        return found

    began = time.process_time()
    over = system({"store": {"time": "10 years"}}).storage().run
    cpu = time.process_time() - began
    moments = np.stack([over[f"tape {k}"]["principal_moment"].values[[0, -1]] for k in (1, 2)], axis=1)
    energy = sum(over[f"tape {k}"]["energy_elastic"].values for k in (1, 2))
    began, times = time.process_time(), []
    for sections in ({}, {"store": {"time": "10 years"}}):
        run = system(sections).simulate(until=1.4, every=0.1, method="energy-momentum", step=1e-3)
        times.append(json.loads(run.attrs["events"])["time"][0] - 0.01)
    left = float(np.linalg.norm(moments[1]) / np.linalg.norm(moments[0]))
    return Stored(left, float(energy[-1] / energy[0]), cpu, times[0], times[1], time.process_time() - began)


class Grown(NamedTuple):
    """Slope of the energy over the angle, N m; CPU time, s; defect of the balance beside the energy moved."""

    moment: float
    cpu: float
    defect: float


def grown(half: float, elements: tuple[int, int], sense: float, until: float = 0.3, every: float = 1.5e-3) -> Grown:
    """Turn the ends of a tape against one another by 10 rad/s, and measure the fold that grows."""
    system = quarter(half, elements, stiffness_damping=1e-4)
    at, axis = (half, 0.05, 0.0), (0.0, -1.0, 0.0)
    system.add(parts.RigidBody(motion="spin", inertia=1e-4, axis=axis, position=at), "shaft")
    drive: Any = {"expression": f"{5.0 * sense} * (t - 0.02*(1 - exp(-t/0.02)))"}
    system.add(parts.Joint(type="revolute", a=at, b="shaft", axis=axis, drive=drive), "drive")
    turn = parts.JointSpring(a="shaft", b="grip", axis=axis, motion="rotation", stiffness=20.0, damping=0.01)
    system.add(turn, "turn")
    length = half / elements[0]
    for i in range(1 + int(8e-3 / length) if sense < 0.0 else 0):
        force = (0.0, 0.0, 500.0 * length * (0.5 if i == 0 else 1.0))
        node = i * (elements[1] + 1) + elements[1]
        system.add(parts.Load(at=f"tape[{node}]", force=force, until=0.03, ramp=0.01), f"force {i}")
    began = time.process_time()
    run = system.simulate(until=until, every=every, method="energy-momentum", step=1e-3).ev.regular()
    cpu, turns = time.process_time() - began, run["grip"]["attitude"].values
    angle = np.degrees(4.0 * np.arctan2(-turns[:, 2], turns[:, 0])) * sense
    energy = 4.0 * run["tape"]["energy_elastic"].values
    inside = (angle > RANGE[0]) & (angle < RANGE[1])
    slope = float(np.polyfit(np.radians(angle[inside]), energy[inside], 1)[0])
    return Grown(slope, cpu, float(np.abs(run["energy_defect"].values).max() / run["energy_moved"].values.max()))


def main() -> int:
    """Print the table and write the JSON file."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("-o", "--output", type=pathlib.Path, default=pathlib.Path(__file__).with_suffix(".json"))
    options = parser.parse_args()
    rows: list[dict[str, Any]] = []
    section = 0.0
    angles: Array | None = None
    for k in np.linspace(0.5, 1.0, 21):
        bending = uniform_bending(float(k), angles)
        section, angles = max(section, bending.moment), bending.angles
    rod = snap(TAPE, STEEL).peak_moment
    print(f"peak: section {section:.5f} N m, shallow section, Wuest and rod {rod:.5f} N m")
    for mesh in PEAKS:
        began = time.process_time()
        peak = float(bent(0.15, mesh).moment.max())
        cpu = time.process_time() - began
        rows.append({"case": "peak", "mesh": mesh, "moment": peak, "section": section, "rod": rod, "cpu": cpu})
        print(f"  {mesh[0]:3} x {mesh[1]:2}  {peak:.5f} N m, {peak / section - 1.0:+.2%}, {cpu:.1f} s")
    for sense, name in ((1.0, "opposite"), (-1.0, "equal")):
        section, rod = propagation(sense), snap(TAPE, STEEL, int(sense)).propagation_moment
        print(f"propagation, {name} sense: section {section:.5f} N m, rod {rod:.5f} N m")
        for mesh in FOLDS:
            found = grown(0.08, mesh, sense)
            rows.append(
                {"case": f"fold, {name} sense", "mesh": mesh, "section": section, "rod": rod, **found._asdict()}
            )
            print(f"  {mesh[0]:3} x {mesh[1]:2}  {found.moment:.5f} N m, {found.moment / section - 1.0:+.2%}, "
                  f"{found.cpu:.0f} s, defect {found.defect:.1e}", flush=True)  # fmt: skip
    tape = TAPE.model_copy(update={"angle": math.pi / 3.0, "thickness": 1.5e-4})
    rods = sum(snap(tape, STEEL, one).propagation_moment for one in (1, -1))
    hinge = released()
    rows.append({"case": "tape-hinge-shell", "rods": rods, **hinge._asdict()})
    print(f"case tape-hinge-shell, both folds: rods {rods:.5f} N m\n   40 x  6  {hinge.moment:.5f} N m, "
          f"{hinge.moment / rods - 1.0:+.2%}, straight after {hinge.straight:.2f} s, {hinge.cpu:.0f} s, defect "
          f"{hinge.defect:.1e}")  # fmt: skip
    aged, years = stored(), 10 * 365.25 * 86_400.0
    law = float(AGED.modulus(np.array([years]))[0])
    rows.append({"case": "tape-hinge-shell, ten years", "mesh": COARSE, "law": law, **aged._asdict()})
    print(f"case tape-hinge-shell, folded for ten years, {COARSE[0]} x {COARSE[1]}: moments {aged.left:.5f} of the "
          f"first, law {law:.5f}; energy {aged.energy:.5f}\n   straight after {aged.straight:.3f} s, {aged.aged:.3f} s "
          f"when stored; {aged.storage:.1f} s of CPU time for the storage, {aged.cpu:.0f} s for both runs")  # fmt: skip
    options.output.write_text(json.dumps(rows, indent=2) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
