"""A rib wound up by a turning hub, beside Exudyn: CPU time at equal error of the tip's path over time.

    python benchmarks/winding.py [-o benchmarks/winding.json] [--span 100] [--elements 40] [--repeat 1]

A taut rib of 12 m x 0.03 m x 0.3 mm, E = 5 MPa, 1600 kg/m3, tangent to a hub of 0.6 m that turns at 0.2 rad/s and pulls
it in against 1/3 N at its tip, until all of it is wound (100 s); four contact points an element, 1e4 N/m. Ours:
`cable_stretch`, hunt-crossley contact with 0.5 s/m, in three dimensions. The peer: ANCFCable2D (reduced integration),
ObjectContactFrictionCircleCable2D, in a plane, without friction and damping, generalized-alpha.

Both programs start with the strain of the pull, so that no wave along the rib rings. The error is the root of the mean
square over time of the tip's distance from the same program's run with its shortest step, up to 95 s (before the tip
comes to the hub) and up to the end. Contacts of the two differ (points of ours, straight segments of the peer's), so
that their converged tips are apart by up to 24 mm. The ratio is the peer's CPU time over ours at the peer's error, ours
interpolated between its runs.

The peer's settings are the fastest that were found: version without checks of ranges, sparse solver that keeps its
pattern, modified Newton with a tolerance of 1e-6, contact iterations to 0.1, spectral radius 0.3 (0 and 0.15: same time
for the same error; 0.45: twice the time; 0.6 and 0.9: contacts chatter and the rib flies off).
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
from evolvent.assembly.assembled import Assembly
from evolvent.solvers.time.implicit.energy_momentum import solve_energy
from evolvent.solvers.time.implicit.plan import solve_implicit

LENGTH, WIDTH, THICKNESS, E, DENSITY = 12.0, 0.03, 0.0003, 5e6, 1600.0
HUB, RATE, FORCE, STIFFNESS, DAMPING, POINTS = 0.6, -0.2, 1.0 / 3.0, 1e4, 0.5, 4
STRAIN = FORCE / (E * WIDTH * THICKNESS)
#: Time between samples, and the time before which the tip is far from the hub, s.
EVERY, BEFORE = 0.05, 95.0
SOLVERS = {"energy-momentum": solve_energy, "generalized-alpha": solve_implicit}
#: Correction at which Newton's method of energy-momentum has converged; errors are those of 1e-9 to three digits.
NEWTON = 1e-7
#: Runs of each: options of ours, steps (s) of the peer; the first is the reference.
OURS = {
    "energy-momentum": [{"step": h, "newton": NEWTON} for h in (5e-4, 2e-3, 5e-3, 0.01, 0.025)]
    + [{"tolerance": tolerance, "newton": NEWTON} for tolerance in (1e-3, 1e-4)],
    "generalized-alpha": [{"step": h} for h in (5e-4, 2e-3, 5e-3, 0.01, 0.02)]
    + [{"tolerance": tolerance} for tolerance in (1e-3, 1e-4)],
}
PEER = (5e-4, 2e-3, 5e-3, 0.01, 0.02)
Array = np.ndarray


def assembled(n: int) -> Assembly:
    """The rib and the hub."""
    system = System()
    system.add(parts.RigidBody(motion="driven", rate=RATE), "hub")
    nodes, rates = np.zeros((2, n + 1, 2, 3))
    nodes[:, 0, 0], nodes[:, 0, 1] = HUB, np.linspace(0.0, LENGTH * (1.0 + STRAIN), n + 1)
    nodes[:, 1, 1], rates[:, 0, 1] = 1.0 + STRAIN, RATE * HUB
    rib = parts.Beam(
        length=LENGTH,
        section=elements.Rectangle(thickness=THICKNESS, width=WIDTH),
        material=elements.Material(young_modulus=E, poisson_ratio=0.3, density=DENSITY),
        elements=n,
        formulation="cable_stretch",
        nodes=nodes,
        rates=rates,
    )
    system.add(rib, "rib")
    system.add(parts.Joint(a=("hub", (HUB, 0.0, 0.0)), b="rib.root"))
    system.add(
        parts.Contact(
            a="rib", b="hub", shape=parts.Cylinder(radius=HUB), stiffness=STIFFNESS, points=POINTS, damping=DAMPING
        )
    )
    system.add(parts.Load(at="rib.tip", force=(0.0, FORCE, 0.0)))
    return system.assemble()


def ours(assembly: Assembly, n: int, span: float, method: str, options: dict[str, float]) -> tuple[float, str, Array]:
    """CPU time (s), status, and time and place of the tip (nt, 3)."""
    samples = np.linspace(0.0, span, round(span / EVERY) + 1)
    began = time.process_time()
    found = SOLVERS[method](assembly, samples=samples, **options)
    spent = time.process_time() - began
    return spent, found.status, np.column_stack([found.t, found.y[:, 6 * n : 6 * n + 2]])


def peer_model(exu: Any, n: int) -> tuple[Any, int]:
    """The same in Exudyn: the system, and the sensor of the tip's place."""
    items = importlib.import_module("exudyn.itemInterface")
    mbs = exu.SystemContainer().AddSystem()
    rising, turning = [0, RATE * HUB, 0, 0], [0, 0, RATE]
    nodes = [
        mbs.AddNode(
            items.NodePoint2DSlope1(
                referenceCoordinates=[HUB, LENGTH * i / n, 0, 1],
                initialCoordinates=[0, STRAIN * LENGTH * i / n, 0, STRAIN],
                initialVelocities=rising,
            )
        )
        for i in range(n + 1)
    ]
    hub = mbs.AddNode(items.NodeRigidBody2D(referenceCoordinates=[0, 0, 0], initialVelocities=turning))
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
                useReducedOrderIntegration=1,
            )
        )
        shape = mbs.AddMarker(items.MarkerBodyCable2DShape(bodyNumber=cable, numberOfSegments=POINTS))
        start = [0.1] * POINTS + [-2] * POINTS + [0] * POINTS
        data = mbs.AddNode(items.NodeGenericData(initialCoordinates=start, numberOfDataCoordinates=3 * POINTS))
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
    position = exu.OutputVariableType.Position
    sensor = mbs.AddSensor(items.SensorNode(nodeNumber=nodes[-1], outputVariableType=position, storeInternal=True))
    mbs.Assemble()
    return mbs, sensor


def peer(n: int, span: float, step: float) -> tuple[float, str, Array]:
    """As `ours`, of Exudyn."""
    sys.exudynFast = True  # type: ignore[attr-defined]
    import exudyn as exu

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        mbs, sensor = peer_model(exu, n)
        settings = exu.SimulationSettings()
        scheme = settings.timeIntegration
        scheme.numberOfSteps, scheme.endTime, scheme.verboseMode = round(span / step), span, 0
        scheme.generalizedAlpha.spectralRadius = 0.3
        scheme.newton.useModifiedNewton, scheme.newton.relativeTolerance = True, 1e-6
        scheme.discontinuous.iterationTolerance = 0.1
        settings.linearSolverType = exu.LinearSolverType.EigenSparse
        settings.linearSolverSettings.reuseAnalyzedPattern = True
        settings.solutionSettings.writeSolutionToFile = False
        settings.solutionSettings.sensorsWritePeriod = EVERY
    began = time.process_time()
    status = "success"
    try:
        mbs.SolveDynamic(settings)
    except (RuntimeError, ValueError):
        status = "failed"
    spent = time.process_time() - began
    return spent, status, mbs.GetSensorStoredData(sensor)[:, :3]


def errors(path: Array, reference: Array, span: float) -> tuple[float, float]:
    """Root of the mean square of the distance, m, before the tip comes to the hub and to the end."""
    distance = np.linalg.norm(path[:, 1:] - np.column_stack(
        [np.interp(path[:, 0], reference[:, 0], reference[:, k]) for k in (1, 2)]), axis=1)  # fmt: skip
    found = [float(np.sqrt(np.mean(distance[path[:, 0] <= until + 1e-6] ** 2))) for until in (min(BEFORE, span), span)]
    return found[0], found[1]


def ladder(name: str, runs: list[tuple[str, Any]], repeat: int, span: float) -> list[dict[str, Any]]:
    """Rows of one program's runs, whose first is the reference."""
    rows: list[dict[str, Any]] = []
    reference: Array | None = None
    for label, call in runs:
        found = [call() for _ in range(repeat)]
        cpu, status, path = min(found, key=lambda one: one[0])
        row = {"who": name, "run": label, "cpu_s": cpu, "status": status}
        if reference is None:
            reference = path
        elif status == "success":
            row["error_before_m"], row["error_m"] = errors(path, reference, span)
        rows.append(row)
        print(f"  {name}, {label}: {status}, {cpu:.3g} s", file=sys.stderr, flush=True)
    return rows


def ratio(row: dict[str, Any], rows: list[dict[str, Any]], key: str) -> float:
    """The peer's CPU time over that of rows at its error, interpolated in logarithms; NaN outside their errors."""
    ends = [(one[key], one["cpu_s"]) for one in rows if key in one and "step" in one["run"]]
    if key not in row or len(ends) < 2:
        return float("nan")
    error, cpu = np.log(np.array(sorted(ends))).T
    at = np.log(row[key])
    return float(row["cpu_s"] / np.exp(np.interp(at, error, cpu, left=np.nan, right=np.nan)))


def main() -> int:
    """Print the table and write the JSON file."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("-o", "--output", type=pathlib.Path, default=pathlib.Path(__file__).with_suffix(".json"))
    parser.add_argument("--span", type=float, default=100.0, help="s")
    parser.add_argument("--elements", type=int, default=40)
    parser.add_argument("--repeat", type=int, default=1, help="runs of each, the shortest counts")
    options = parser.parse_args()
    n, span, load = options.elements, options.span, os.getloadavg()
    assembly = assembled(n)
    tables: dict[str, list[dict[str, Any]]] = {}
    for method, each in OURS.items():
        ours(assembly, n, 2.0 * EVERY, method, {"step": EVERY})  # compiles
        runs = [
            (", ".join(f"{k} {v:g}" for k, v in given.items() if k != "newton"),
             lambda given=given, method=method: ours(assembly, n, span, method, given))
            for given in each
        ]  # fmt: skip
        tables[method] = ladder(method, runs, options.repeat, span)
    try:
        runs = [(f"step {step:g}", lambda step=step: peer(n, span, step)) for step in PEER]
        tables["Exudyn"] = ladder("Exudyn", runs, options.repeat, span)
    except ImportError as error:
        print(f"no comparison with Exudyn: {error}", file=sys.stderr)
    print("| program, method | step or tolerance | CPU time, s | error to 95 s, mm | error to the end, mm | ", end="")
    print("Exudyn over energy-momentum | Exudyn over generalized-alpha |\n|---|---|---|---|---|---|---|")
    for name, rows in tables.items():
        for row in rows:
            cells = [f"{1e3 * row[key]:.2g}" if key in row else "" for key in ("error_before_m", "error_m")]
            if row is rows[0]:
                cells = ["reference", "reference"]
            for method in OURS:
                if name != "Exudyn":
                    cells.append("")
                    continue
                both = [ratio(row, tables[method], key) for key in ("error_before_m", "error_m")]
                row[f"over_{method}"] = both
                cells.append(" / ".join("-" if np.isnan(one) else f"{one:.1f}" for one in both))
            status = "" if row["status"] == "success" else f", {row['status']}"
            print(f"| {name}{status} | {row['run']} | {row['cpu_s']:.3g} | {' | '.join(cells)} |")
    options.output.write_text(json.dumps({"load": [load, os.getloadavg()], "rows": tables}, indent=2) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
