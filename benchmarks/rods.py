"""Benchmark of the geometrically exact rod: a flexible pendulum beside Exudyn's ObjectBeamGeometricallyExact.

    python benchmarks/rods.py [-o benchmarks/rods.json] [--repeat 3]

A rod of 1 m, 0.02 m x 0.02 m, E = 20 MPa, nu = 0.3, 7200 kg/m3, falls from the horizontal, its end held in place (its
rotation is free); 1000 steps of 1 ms, one core, nothing written. Both take generalized-alpha with the spectral radius
0.9, this package the energy-momentum step as well. Exudyn's nodes are NodeRigidBodyRotVecLG; it solves with EigenSparse
and its modified Newton method. Errors are those of the tip after 1 s against the tip of this package's rod with 160
elements at a quarter of the step (of the peer also against its own 160 elements).
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

from evolvent import System, elements, parts
from evolvent.solvers.energy_momentum import solve_energy
from evolvent.solvers.implicit import solve_implicit

LENGTH, SIDE, E, NU, DENSITY, G = 1.0, 0.02, 2e7, 0.3, 7200.0, 9.81
STEP, RADIUS, END = 1e-3, 0.9, 1.0
COUNTS, FINEST = (10, 20, 40), 160
SECTION = elements.Rectangle(thickness=SIDE, width=SIDE)
MATERIAL = elements.Material(young_modulus=E, poisson_ratio=NU, density=DENSITY)
SOLVERS = {"generalized-alpha": solve_implicit, "energy-momentum": solve_energy}


def ours(method: str, n: int, repeat: int, step: float = STEP) -> tuple[float, float, np.ndarray]:
    """Time of a step, us, iterations of a step, and the tip after 1 s."""
    system = System(gravity=(0.0, -G, 0.0))
    system.add(parts.Rod(length=LENGTH, section=SECTION, material=MATERIAL, elements=n), "rod")
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="rod.root"))
    assembly = system.assemble()
    best, tip, iterations = np.inf, np.zeros(3), 0.0
    for _ in range(repeat):
        found = SOLVERS[method](assembly, samples=(0.0, END), step=step, spectral_radius=RADIUS)
        if not found.success:
            raise RuntimeError(found.message)
        best = min(best, found.wall_time / found.statistics["steps"])
        iterations = found.statistics["iterations"] / found.statistics["steps"]
        tip = place(assembly, found.y[-1])
    return 1e6 * best, iterations, tip


def place(assembly: Any, y: np.ndarray) -> np.ndarray:
    """Place of the tip."""
    from evolvent.solvers.places import places

    return places(assembly, y)["rod.tip"].position


def peer(n: int, repeat: int) -> tuple[float, np.ndarray]:
    """Time of a step, us, and the tip after 1 s, of Exudyn."""
    best, tip = np.inf, np.zeros(3)
    for _ in range(repeat):
        seconds, tip = _peer(n)
        best = min(best, seconds / END * STEP)
    return 1e6 * best, tip


def _peer(n: int) -> tuple[float, np.ndarray]:
    import exudyn as exu

    items = importlib.import_module("exudyn.itemInterface")
    mbs = exu.SystemContainer().AddSystem()
    s, G_ = SECTION.properties(NU), MATERIAL.shear_modulus
    places = [[LENGTH * i / n, 0, 0, 0, 0, 0] for i in range(n + 1)]
    nodes = [mbs.AddNode(items.NodeRigidBodyRotVecLG(referenceCoordinates=place)) for place in places]
    section = exu.BeamSection()
    shear = s.shear_y * G_ * s.area
    section.stiffnessMatrix = np.diag([E * s.area, shear, shear, G_ * s.J, E * s.Iy, E * s.Iz])
    section.massPerLength = DENSITY * s.area
    section.inertia = DENSITY * np.diag([s.Iy + s.Iz, s.Iy, s.Iz])
    for i in range(n):
        new = items.ObjectBeamGeometricallyExact(
            nodeNumbers=[nodes[i], nodes[i + 1]], length=LENGTH / n, sectionData=section
        )
        marker = mbs.AddMarker(items.MarkerBodyMass(bodyNumber=mbs.AddObject(new)))
        mbs.AddLoad(items.LoadMassProportional(markerNumber=marker, loadVector=[0, -G, 0]))
    ground = mbs.AddNode(items.NodePointGround(referenceCoordinates=[0, 0, 0]))
    fixed = mbs.AddMarker(items.MarkerNodeCoordinate(nodeNumber=ground, coordinate=0))
    for c in range(3):
        marker = mbs.AddMarker(items.MarkerNodeCoordinate(nodeNumber=nodes[0], coordinate=c))
        mbs.AddObject(items.ObjectConnectorCoordinate(markerNumbers=[fixed, marker]))
    mbs.Assemble()
    settings = exu.SimulationSettings()
    settings.timeIntegration.numberOfSteps = round(END / STEP)
    settings.timeIntegration.endTime = END
    settings.timeIntegration.generalizedAlpha.spectralRadius = RADIUS
    settings.timeIntegration.newton.useModifiedNewton = True
    settings.timeIntegration.verboseMode = 0
    settings.solutionSettings.writeSolutionToFile = False
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        settings.linearSolverType = exu.LinearSolverType.EigenSparse
    began = time.perf_counter()
    mbs.SolveDynamic(settings)
    seconds = time.perf_counter() - began
    return seconds, np.array(mbs.GetNodeOutput(nodes[-1], exu.OutputVariableType.Position))


def main() -> int:
    """Print the table and write the JSON file."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("-o", "--output", type=pathlib.Path, default=pathlib.Path(__file__).with_suffix(".json"))
    parser.add_argument("--repeat", type=int, default=3)
    options = parser.parse_args()
    load, rows = os.getloadavg(), []
    limit = ours("generalized-alpha", FINEST, 1, 0.25 * STEP)[2]
    print(f"load {load[0]:.2f}\n{'':20}{'elements':>9}{'us a step':>11}{'iterations':>12}{'tip error, mm':>15}")
    theirs: dict[int, tuple[float, np.ndarray]] = {}
    try:
        theirs = {n: peer(n, options.repeat) for n in (*COUNTS, FINEST)}
    except ImportError as error:
        print(f"no comparison with Exudyn: {error}", file=sys.stderr)
    for method in SOLVERS:
        for n in COUNTS:
            us, iterations, tip = ours(method, n, options.repeat)
            row: dict[str, Any] = {"method": method, "elements": n, "us_a_step": us, "iterations": iterations}
            row["tip_error_m"] = float(np.linalg.norm(tip - limit))
            text = f"{method:20}{n:9}{us:11.1f}{iterations:12.2f}{1e3 * row['tip_error_m']:15.4f}"
            if theirs:
                row["peer_us_a_step"], row["ratio"] = theirs[n][0], theirs[n][0] / us
                row["peer_tip_error_m"] = float(np.linalg.norm(theirs[n][1] - limit))
                row["peer_tip_error_own_m"] = float(np.linalg.norm(theirs[n][1] - theirs[FINEST][1]))
                text += f"   peer {theirs[n][0]:8.1f} us, {1e3 * row['peer_tip_error_m']:.4f} mm"
                text += f" ({1e3 * row['peer_tip_error_own_m']:.4f} of its own limit), {row['ratio']:.1f} times"
            print(text)
            rows.append(row)
    options.output.write_text(json.dumps({"load": [load, os.getloadavg()], "rows": rows}, indent=2) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
