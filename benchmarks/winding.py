"""Benchmark of winding with contact: a turning hub winds up a taut rib, beside Exudyn's cable and circle.

    python benchmarks/winding.py [-o benchmarks/winding.json] [--span 20] [--elements 40]

A rib of 12 m x 0.03 m x 0.3 mm, E = 5 MPa, 1600 kg/m3, tangent to a hub of 0.6 m that turns at 0.2 rad/s and pulls it
in against 1/3 N at its tip, as the torque of 0.2 N m does on the wrapped rib; four contact points an element, 1e4 N/m.
Ours: `cable_stretch`, hunt-crossley contact in 3-D, fixed steps and steps by tolerance. The peer: ANCFCable2D with
ObjectContactFrictionCircleCable2D, in a plane, without friction, generalized-alpha with the same spectral radius, at
1, 2 and 5 ms. The tip's place at the end is the only thing compared, and it rings by centimetres along the rib, so that
equal accuracy is not established; the peer has half of our coordinates. 1/3 N stretches the rib by 9 cm.
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
from evolvent.solvers.implicit import solve_implicit

LENGTH, WIDTH, THICKNESS, E, DENSITY = 12.0, 0.03, 0.0003, 5e6, 1600.0
HUB, RATE, FORCE, STIFFNESS, POINTS, RADIUS = 0.6, -0.2, 1.0 / 3.0, 1e4, 4, 0.3


def ours(n: int, span: float, *, step: float | None = None, tolerance: float = 1e-4) -> dict[str, Any]:
    """Time of a run and where its tip ends."""
    system = System()
    system.add(parts.RigidBody(motion="driven", rate=RATE), "hub")
    rates = np.zeros((n + 1, 2, 3))
    rates[:, 0, 1] = RATE * HUB
    rib = parts.Beam(
        length=LENGTH,
        section=elements.Rectangle(thickness=THICKNESS, width=WIDTH),
        material=elements.Material(young_modulus=E, poisson_ratio=0.3, density=DENSITY),
        elements=n,
        formulation="cable_stretch",
        position=(HUB, 0.0, 0.0),
        direction=(0.0, 1.0, 0.0),
        normal=(-1.0, 0.0, 0.0),
        rates=rates,
    )
    system.add(rib, "rib")
    system.add(parts.Joint(a=("hub", (HUB, 0.0, 0.0)), b="rib.root"))
    system.add(parts.CylinderContact(body="hub", beams=["rib"], radius=HUB, stiffness=STIFFNESS, points=POINTS))
    system.add(parts.Force(at="rib.tip", force=(0.0, FORCE, 0.0)))
    assembly = system.assemble()
    found = solve_implicit(
        assembly, samples=[0.0, span], step=step, tolerance=tolerance, spectral_radius=RADIUS
    )  # fmt: skip
    return {
        "status": found.status,
        "seconds": found.wall_time,
        "steps": int(found.statistics["steps"]),
        "tip_y_m": float(found.y[-1, 6 * n + 1]) if found.success else float("nan"),
    }


def peer(n: int, span: float, step: float) -> dict[str, Any]:
    """The same of Exudyn."""
    import exudyn as exu

    items = importlib.import_module("exudyn.itemInterface")
    mbs = exu.SystemContainer().AddSystem()
    rising, turning = [0, RATE * HUB, 0, 0], [0, 0, RATE]
    nodes = [
        mbs.AddNode(items.NodePoint2DSlope1(referenceCoordinates=[HUB, LENGTH * i / n, 0, 1], initialVelocities=rising))
        for i in range(n + 1)
    ]
    hub = mbs.AddNode(items.NodeRigidBody2D(referenceCoordinates=[0, 0, 0], initialVelocities=turning))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        body = mbs.AddObject(items.ObjectRigidBody2D(physicsMass=1e9, physicsInertia=1e9, nodeNumber=hub))
        circle = mbs.AddMarker(items.MarkerBodyRigid(bodyNumber=body, localPosition=[0, 0, 0]))
        for i in range(n):
            cable = mbs.AddObject(
                items.ObjectANCFCable2D(
                    physicsLength=LENGTH / n,
                    physicsMassPerLength=DENSITY * WIDTH * THICKNESS,
                    physicsBendingStiffness=E * WIDTH * THICKNESS**3 / 12.0,
                    physicsAxialStiffness=E * WIDTH * THICKNESS,
                    nodeNumbers=[nodes[i], nodes[i + 1]],
                )
            )
            shape = mbs.AddMarker(items.MarkerBodyCable2DShape(bodyNumber=cable, numberOfSegments=POINTS))
            data = mbs.AddNode(
                items.NodeGenericData(
                    initialCoordinates=[0.1] * POINTS + [-2] * POINTS + [0] * POINTS, numberOfDataCoordinates=3 * POINTS
                )
            )
            mbs.AddObject(
                items.ObjectContactFrictionCircleCable2D(
                    markerNumbers=[circle, shape],
                    nodeNumber=data,
                    numberOfContactSegments=POINTS,
                    contactStiffness=STIFFNESS,
                    contactDamping=0.0,
                    frictionCoefficient=0.0,
                    frictionVelocityPenalty=0.0,
                    circleRadius=HUB,
                )
            )
        rim = mbs.AddMarker(items.MarkerBodyPosition(bodyNumber=body, localPosition=[HUB, 0, 0]))
        root = mbs.AddMarker(items.MarkerNodePosition(nodeNumber=nodes[0]))
        mbs.AddObject(items.ObjectJointRevolute2D(markerNumbers=[rim, root]))
        tip = mbs.AddMarker(items.MarkerNodePosition(nodeNumber=nodes[-1]))
        mbs.AddLoad(items.LoadForceVector(markerNumber=tip, loadVector=[0, FORCE, 0]))
        mbs.Assemble()
        settings = exu.SimulationSettings()
        settings.timeIntegration.numberOfSteps = round(span / step)
        settings.timeIntegration.endTime = span
        settings.timeIntegration.generalizedAlpha.spectralRadius = RADIUS
        settings.timeIntegration.newton.useModifiedNewton = True
        settings.timeIntegration.verboseMode = 0
        settings.solutionSettings.writeSolutionToFile = False
        settings.linearSolverType = exu.LinearSolverType.EigenSparse
    began = time.perf_counter()
    try:
        mbs.SolveDynamic(settings)
    except (RuntimeError, ValueError):
        return {"status": "failed", "seconds": time.perf_counter() - began, "tip_y_m": float("nan")}
    seconds = time.perf_counter() - began
    place = mbs.GetNodeOutput(nodes[-1], exu.OutputVariableType.Position)
    return {"status": "success", "seconds": seconds, "steps": round(span / step), "tip_y_m": float(place[1])}


def main() -> int:
    """Print the table and write the JSON file."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("-o", "--output", type=pathlib.Path, default=pathlib.Path(__file__).with_suffix(".json"))
    parser.add_argument("--span", type=float, default=20.0, help="s")
    parser.add_argument("--elements", type=int, default=40)
    options = parser.parse_args()
    n, span = options.elements, options.span
    load = os.getloadavg()
    end = LENGTH + RATE * HUB * span + LENGTH * FORCE / (E * WIDTH * THICKNESS)
    print(f"load {load[0]:.2f}, {n} elements, {span:g} s; the tip should be near {end:.2f} m")
    rows = {f"ours, step {step:g} s": ours(n, span, step=step) for step in (1e-3, 2e-3, 5e-3)}
    rows |= {f"ours, tolerance {tol:g}": ours(n, span, tolerance=tol) for tol in (1e-3, 1e-4)}
    try:
        rows |= {f"Exudyn, step {step:g} s": peer(n, span, step) for step in (1e-3, 2e-3, 5e-3)}
    except ImportError as error:
        print(f"no comparison with Exudyn: {error}", file=sys.stderr)
    for name, row in rows.items():
        print(f"{name:26}{row['status']:9}{row['seconds']:9.3f} s {row['tip_y_m']:9.4f} m")
    options.output.write_text(json.dumps({"load": [load, os.getloadavg()], "rows": rows}, indent=2) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
