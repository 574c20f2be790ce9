"""Exudyn: the three works of its items; settings are its fastest that we found."""

from __future__ import annotations

import itertools
import warnings
from collections.abc import Callable
from typing import Any

import exudyn as exu
import exudyn.itemInterface as items  # noqa: N813
import numpy as np


def version() -> str:
    return exu.GetVersionString()


def cable(mbs: Any, spec: dict[str, Any], options: dict[str, Any]) -> int:
    n, kind, side, E, nu = spec["elements"], options["element"], spec["side"], spec["E"], spec["nu"]
    area, moment, shear, long = side**2, side**4 / 12.0, E / (2.0 * (1.0 + nu)), spec["length"] / n
    slopes = [1, 0, 0] if kind == "ANCFCable" else [0, 1, 0, 0, 0, 1]
    node = items.NodePointSlope1 if kind == "ANCFCable" else items.NodePointSlope23
    nodes = [mbs.AddNode(node(referenceCoordinates=[long * i, 0, 0, *slopes])) for i in range(n + 1)]
    section = exu.BeamSection()
    across = 10.0 * (1.0 + nu) / (12.0 + 11.0 * nu) * shear * area
    section.stiffnessMatrix = np.diag([E * area, across, across, 0.1406 * shear * side**4, E * moment, E * moment])
    section.massPerLength = spec["density"] * area
    section.inertia = spec["density"] * np.diag([2.0 * moment, moment, moment])
    for i in range(n):
        ends = [nodes[i], nodes[i + 1]]
        if kind == "ANCFCable":
            new = items.ObjectANCFCable(
                physicsLength=long,
                physicsMassPerLength=spec["density"] * area,
                physicsBendingStiffness=E * moment,
                physicsAxialStiffness=E * area,
                nodeNumbers=ends,
            )
        else:
            new = items.ObjectANCFBeam(
                physicsLength=long, nodeNumbers=ends, sectionData=section, crossSectionPenaltyFactor=[1, 1, 1]
            )
        marker = mbs.AddMarker(items.MarkerBodyMass(bodyNumber=mbs.AddObject(new)))
        mbs.AddLoad(items.LoadMassProportional(markerNumber=marker, loadVector=[0, -spec["gravity"], 0]))
    ground = mbs.AddNode(items.NodePointGround(referenceCoordinates=[0, 0, 0]))
    fixed = mbs.AddMarker(items.MarkerNodeCoordinate(nodeNumber=ground, coordinate=0))
    for c in range(3):
        marker = mbs.AddMarker(items.MarkerNodeCoordinate(nodeNumber=nodes[0], coordinate=c))
        mbs.AddObject(items.ObjectConnectorCoordinate(markerNumbers=[fixed, marker]))
    return nodes[-1]


def line(mbs: Any, spec: dict[str, Any], options: dict[str, Any]) -> int:
    n = spec["segments"]
    h = spec["length"] / n
    ground = mbs.AddObject(items.ObjectGround())
    before = mbs.AddMarker(items.MarkerBodyPosition(bodyNumber=ground, localPosition=spec["nodes"][0]))
    for i, place in enumerate(spec["nodes"][1:], 1):
        mass = spec["density"] * h * (1.0 if i < n else 0.5) + (0.0 if i < n else spec["bob"])
        node = mbs.AddNode(items.NodePoint(referenceCoordinates=place))
        mbs.AddObject(items.ObjectMassPoint(physicsMass=mass, nodeNumber=node))
        marker = mbs.AddMarker(items.MarkerNodePosition(nodeNumber=node))
        mbs.AddLoad(items.LoadForceVector(markerNumber=marker, loadVector=[0, 0, -mass * spec["gravity"]]))
        mbs.AddObject(
            items.ObjectConnectorSpringDamper(
                markerNumbers=[before, marker], referenceLength=h, stiffness=spec["EA"] / h, damping=spec["BA"] / h
            )
        )
        before = marker
    return node


def body(mbs: Any, spec: dict[str, Any], options: dict[str, Any]) -> int:
    ground = mbs.AddObject(items.ObjectGround())
    node = mbs.AddNode(
        items.NodeRigidBodyRotVecLG(referenceCoordinates=[0.0] * 6, initialVelocities=[0.0, 0.0, 0.0, *spec["spin"]])
    )
    new = mbs.AddObject(
        items.ObjectRigidBody(
            physicsMass=spec["mass"], physicsInertia=[*spec["inertia"], 0.0, 0.0, 0.0], nodeNumber=node
        )
    )
    centre = mbs.AddMarker(items.MarkerBodyMass(bodyNumber=new))
    mbs.AddLoad(items.LoadMassProportional(markerNumber=centre, loadVector=[0, 0, -spec["gravity"]]))
    for corner in spec["corners"]:
        above = [corner[0], corner[1], spec["height"]]
        ends = [
            mbs.AddMarker(items.MarkerBodyPosition(bodyNumber=ground, localPosition=above)),
            mbs.AddMarker(items.MarkerBodyPosition(bodyNumber=new, localPosition=corner)),
        ]
        mbs.AddObject(
            items.ObjectConnectorSpringDamper(
                markerNumbers=ends, referenceLength=spec["natural"], stiffness=spec["stiffness"]
            )
        )
    return new


def prepare(work: str, spec: dict[str, Any], options: dict[str, Any], step: float) -> Callable[[], dict[str, Any]]:
    """One solve for each stretch between samples; generalized-alpha for the cable, RK44 for the others."""
    container = exu.SystemContainer()
    mbs = container.AddSystem()
    end = {"cable": cable, "line": line, "body": body}[work](mbs, spec, options)
    mbs.Assemble()
    settings = exu.SimulationSettings()
    scheme = settings.timeIntegration
    scheme.generalizedAlpha.spectralRadius = 0.9
    scheme.newton.useModifiedNewton = True
    scheme.explicit.computeEndOfStepAccelerations = False
    scheme.explicit.computeMassMatrixInversePerBody = work == "line"
    scheme.explicit.useLieGroupIntegration = work == "body"
    scheme.verboseMode = 0
    settings.solutionSettings.writeSolutionToFile = False
    settings.solutionSettings.sensorsWritePeriod = 1e9
    settings.displayStatistics = False
    settings.displayComputationTime = False
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        settings.linearSolverType = exu.LinearSolverType.EigenSparse
    solver = exu.DynamicSolverType.GeneralizedAlpha if work == "cable" else exu.DynamicSolverType.RK44

    def place() -> list[float]:
        kind = exu.OutputVariableType.Position
        if work == "body":
            return list(mbs.GetObjectOutputBody(end, kind, localPosition=spec["corners"][0]))
        return list(mbs.GetNodeOutput(end, kind))

    def run() -> dict[str, Any]:
        times, places, steps = spec["samples"], [], 0
        for a, b in itertools.pairwise(times):
            count = round((b - a) / step)
            scheme.numberOfSteps, scheme.startTime, scheme.endTime = count, a, b
            mbs.SolveDynamic(settings, solverType=solver, updateInitialValues=True)
            steps += count
            places.append(place())
        return {"places": places, "steps": steps}

    return run
