"""Benchmark of systems of many bodies and joints: frames by their size, and four-bars in a row beside Exudyn.

    python benchmarks/frames.py [-o benchmarks/frames.json] [--repeat 3]

Frame: two legs of n cable elements with a bar between their tips, a rigid body jointed to each node; generalized-alpha,
200 steps of 1 ms. The time of a step should grow in proportion to n.

Four-bars: the IFToMM benchmark A02 with 40 loops, 81 rigid bodies in space; generalized-alpha, spectral radius 0.9,
2000 steps of 0.5 ms, one core, nothing written, our Newton's method to 1e-10 of the system's size. Exudyn's bodies have
rotation vectors (Lie group) in space with revolute and spherical joints, and in its own row three coordinates in
the plane with revolute joints, which is less work; it solves with EigenSparse and its modified Newton method. Errors
are those of the first rod's tip after 1 s against the equation of one angle.
"""

from __future__ import annotations

import argparse
import importlib
import json
import os
import pathlib
import sys
import time
import warnings
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from evolvent import System, elements, parts
from evolvent.assembly.assembled import Assembly
from evolvent.solvers.time.implicit.plan import solve_implicit

G, LOOPS, END, STEP, RADIUS = 9.81, 40, 1.0, 5e-4, 0.9
THIN = 1e-3
SIZES = (5, 10, 20, 40)


def frame(n: int) -> Assembly:
    """A frame with n elements a leg."""
    system = System(gravity=(3.0, 2.0, -G))
    material, section = (
        elements.Material(young_modulus=7e10, poisson_ratio=0.3, density=2700.0),
        elements.Rectangle(thickness=0.01, width=0.02),
    )
    for leg in range(2):
        beam = parts.Beam(
            length=1.0, section=section, material=material, elements=n, formulation="cable",
            position=(float(leg), 0.0, 0.0), direction=(0.0, 0.0, 1.0),
        )  # fmt: skip
        system.add(beam, f"leg{leg}")
        system.add(parts.Joint(a=(float(leg), 0.0, 0.0), b=f"leg{leg}.root"))
        for k in range(1, n + 1):
            system.add(
                parts.RigidBody(mass=0.05, inertia=(1e-4, 1.1e-4, 1.2e-4), position=(float(leg), 0.0, k / n)),
                f"body{leg}-{k}",
            )
            system.add(parts.Joint(a=f"leg{leg}[{k}]", b=f"body{leg}-{k}"))
    system.add(parts.RigidBody(mass=1.0, inertia=(0.01, 0.08, 0.08), position=(0.5, 0.0, 1.0)), "bar")
    for leg in range(2):
        system.add(parts.Joint(a=f"leg{leg}.tip", b=("bar", (leg - 0.5, 0.0, 0.0))))
    return system.assemble()


def four_bars() -> Assembly:
    """Upright rods on hinges, their tops joined by level ones; 1 m/s at the tops."""
    system = System(gravity=(0.0, -G, 0.0))
    for k in range(LOOPS + 1):
        system.add(
            parts.RigidBody(
                mass=1.0, inertia=(1.0 / 12.0, THIN, 1.0 / 12.0), position=(k, 0.5, 0.0), velocity=(0.5, 0.0, 0.0),
                angular_velocity=(0.0, 0.0, -1.0),
            ),
            f"up{k}",
        )  # fmt: skip
        system.add(parts.Joint(a=(float(k), 0.0, 0.0), b=(f"up{k}", (0.0, -0.5, 0.0)), type="revolute"))
    for k in range(LOOPS):
        system.add(
            parts.RigidBody(
                mass=1.0, inertia=(THIN, 1.0 / 12.0, 1.0 / 12.0), position=(k + 0.5, 1.0, 0.0), velocity=(1.0, 0.0, 0.0)
            ),
            f"level{k}",
        )
        for side in range(2):
            system.add(parts.Joint(a=(f"up{k + side}", (0.0, 0.5, 0.0)), b=(f"level{k}", (side - 0.5, 0.0, 0.0))))
    return system.assemble()


def ours(assembly: Assembly, end: float, step: float, repeat: int, **options: Any) -> tuple[dict[str, Any], np.ndarray]:
    """Best time of a run, and the state at its end."""
    best: dict[str, Any] = {"run_s": np.inf}
    for _ in range(repeat):
        found = solve_implicit(assembly, samples=[0.0, end], step=step, **options)
        if not found.success:
            raise RuntimeError(found.message)
        steps = found.statistics["steps"]
        if found.wall_time < best["run_s"]:
            best = {
                "run_s": found.wall_time,
                "step_us": 1e6 * found.wall_time / steps,
                "iterations_a_step": found.statistics["iterations"] / steps,
            }
    return {"unknowns": found.acceleration.shape[1] + found.la.shape[1], **best}, found.y[-1]


def _space(mbs: Any, exu: Any) -> tuple[int, list[float]]:
    """Rods as rigid bodies in space; the first rod and the place of its tip."""
    utilities = importlib.import_module("exudyn.utilities")
    ground = mbs.CreateGround()

    def rod(inertia: list[float], **start: Any) -> int:
        return int(
            mbs.CreateRigidBody(
                inertia=utilities.RigidBodyInertia(mass=1.0, inertiaTensor=np.diag(inertia)), gravity=[0, -G, 0],
                nodeType=exu.NodeType.RotationRotationVector, **start,
            )
        )  # fmt: skip

    turn = {"initialVelocity": [0.5, 0, 0], "initialAngularVelocity": [0, 0, -1.0]}
    up = [rod([1.0 / 12.0, THIN, 1.0 / 12.0], referencePosition=[k, 0.5, 0.0], **turn) for k in range(LOOPS + 1)]
    for k in range(LOOPS + 1):
        mbs.CreateRevoluteJoint(bodyNumbers=[ground, up[k]], position=[k, 0, 0], axis=[0, 0, 1])
    for k in range(LOOPS):
        level = rod([THIN, 1.0 / 12.0, 1.0 / 12.0], referencePosition=[k + 0.5, 1.0, 0.0], initialVelocity=[1.0, 0, 0])
        for side in range(2):
            mbs.CreateSphericalJoint(bodyNumbers=[up[k + side], level], position=[k + side, 1.0, 0.0])
    return up[0], [0.0, 0.5, 0.0]


def _plane(mbs: Any, items: Any) -> tuple[int, list[float]]:
    """Rods as rigid bodies in the plane."""
    ground = mbs.AddObject(items.ObjectGround())

    def rod(x: float, y: float, v: float, w: float) -> int:
        node = mbs.AddNode(items.NodeRigidBody2D(referenceCoordinates=[x, y, 0], initialVelocities=[v, 0, w]))
        body = mbs.AddObject(items.ObjectRigidBody2D(physicsMass=1.0, physicsInertia=1.0 / 12.0, nodeNumber=node))
        centre = mbs.AddMarker(items.MarkerBodyPosition(bodyNumber=body))
        mbs.AddLoad(items.LoadForceVector(markerNumber=centre, loadVector=[0, -G, 0]))
        return int(body)

    def pin(a: int, at: list[float], b: int, of: list[float]) -> None:
        markers = [
            mbs.AddMarker(items.MarkerBodyPosition(bodyNumber=a, localPosition=at)),
            mbs.AddMarker(items.MarkerBodyPosition(bodyNumber=b, localPosition=of)),
        ]
        mbs.AddObject(items.ObjectJointRevolute2D(markerNumbers=markers))

    up = [rod(k, 0.5, 0.5, -1.0) for k in range(LOOPS + 1)]
    for k in range(LOOPS + 1):
        pin(ground, [k, 0, 0], up[k], [0, -0.5, 0])
    for k in range(LOOPS):
        level = rod(k + 0.5, 1.0, 1.0, 0.0)
        for side in range(2):
            pin(up[k + side], [0, 0.5, 0], level, [side - 0.5, 0, 0])
    return up[0], [0.0, 0.5, 0.0]


def peer(kind: str, repeat: int) -> tuple[dict[str, Any], np.ndarray]:
    """Exudyn's best time, and the tip of the first rod."""
    import exudyn as exu

    best, place = np.inf, np.zeros(3)
    for _ in range(repeat):
        mbs = exu.SystemContainer().AddSystem()
        tip, at = _space(mbs, exu) if kind == "space" else _plane(mbs, importlib.import_module("exudyn.itemInterface"))
        mbs.Assemble()
        settings = exu.SimulationSettings()
        scheme = settings.timeIntegration
        scheme.numberOfSteps, scheme.endTime, scheme.verboseMode = round(END / STEP), END, 0
        scheme.generalizedAlpha.spectralRadius = RADIUS
        scheme.newton.useModifiedNewton = True
        settings.solutionSettings.writeSolutionToFile = False
        settings.solutionSettings.sensorsWritePeriod = 1e9
        settings.linearSolverType = exu.LinearSolverType.EigenSparse
        began = time.perf_counter()
        mbs.SolveDynamic(settings)
        best = min(best, time.perf_counter() - began)
        place = np.array(mbs.GetObjectOutputBody(tip, exu.OutputVariableType.Position, localPosition=at))
    return {"run_s": best, "step_us": 1e6 * best * STEP / END}, place


def tip_angle() -> float:
    """Angle of the rods at the end, by the equation of their one motion."""
    inertia, weight = (LOOPS + 1) / 3.0 + LOOPS, G * (0.5 * (LOOPS + 1) + LOOPS)
    found = solve_ivp(lambda t, y: [y[1], weight / inertia * np.sin(y[0])], (0.0, END), [0.0, 1.0], rtol=1e-11)
    return float(found.y[0, -1])


def main() -> int:
    """Print the tables and write the JSON file."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("-o", "--output", type=pathlib.Path, default=pathlib.Path(__file__).with_suffix(".json"))
    parser.add_argument("--repeat", type=int, default=3)
    options = parser.parse_args()
    before, report = os.getloadavg(), {}
    print("frame, elements a leg   unknowns    run, s   step, us")
    for n in SIZES:
        assembly = frame(n)
        solve_implicit(assembly, samples=[0.0, 2e-3], step=1e-3)
        report[f"frame {n}"], _ = f, _ = ours(assembly, 0.2, 1e-3, options.repeat)
        print(f"{n:22} {f['unknowns']:10} {f['run_s']:9.4f} {f['step_us']:10.1f}", flush=True)
    exact = np.array([np.sin(tip_angle()), np.cos(tip_angle())])
    print(f"four-bars, {LOOPS} loops           run, s   step, us      error, m")
    assembly = four_bars()
    solve_implicit(assembly, samples=[0.0, 2e-3], step=1e-3)
    f, y = ours(assembly, END, STEP, options.repeat, spectral_radius=RADIUS, newton=1e-10)
    at = int(assembly.model.bodies["iq"][assembly.index("up0", "bodies")])
    rows = [("evolvent", f, 2.0 * y[at : at + 2])]
    try:
        import exudyn  # noqa: F401
    except ImportError:
        print("Exudyn is not installed")
    else:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            rows += [(f"Exudyn, {kind}", *peer(kind, options.repeat)) for kind in ("space", "plane")]
    for name, f, place in rows:
        f["error_m"] = float(np.abs(place[:2] - exact).max())
        f["over_ours"] = f["step_us"] / rows[0][1]["step_us"]
        report[name] = f
        print(f"{name:24} {f['run_s']:9.3f} {f['step_us']:10.1f} {f['error_m']:13.1e}   x {f['over_ours']:.1f}")
    whole = {"load": [before, os.getloadavg()], "figures": report}
    options.output.write_text(json.dumps(whole, indent=2) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
