"""Exudyn: `ObjectANCFThinPlate` on nodes with two slopes, generalized-alpha of spectral radius 0.9."""

from __future__ import annotations

import itertools
import time
import warnings
from collections.abc import Callable
from typing import Any

import exudyn as exu
import exudyn.itemInterface as items  # noqa: N813
import numpy as np


def version() -> str:
    return exu.GetVersionString()


def prepare(work: str, spec: dict[str, Any], options: dict[str, Any], step: float) -> Callable[[], dict[str, Any]]:
    """The plate in motion; it is flat, and its elements are squares."""
    container = exu.SystemContainer()
    mbs = container.AddSystem()
    x = np.reshape(spec["nodes"], (-1, 3))
    h, E, nu = spec["thickness"], spec["E"], spec["nu"]
    plane = E / (1.0 - nu**2) * np.array([[1.0, nu, 0.0], [nu, 1.0, 0.0], [0.0, 0.0, 0.5 * (1.0 - nu)]])
    nodes = [mbs.AddNode(items.NodePointSlope12(referenceCoordinates=[*place, 1, 0, 0, 0, 1, 0])) for place in x]
    for quad in spec["quads"]:
        plate = mbs.AddObject(
            items.ObjectANCFThinPlate(
                thickness=h, density=spec["density"], strainCoefficients=exu.Matrix3DList([plane * h]),
                curvatureCoefficients=exu.Matrix3DList([plane * h**3 / 12.0]), nodeNumbers=[nodes[k] for k in quad],
                useReducedOrderIntegration=options["integration"],
            )
        )  # fmt: skip
        mass = mbs.AddMarker(items.MarkerBodyMass(bodyNumber=plate))
        mbs.AddLoad(items.LoadMassProportional(markerNumber=mass, loadVector=[0, 0, -spec["gravity"]]))
    ground = mbs.AddNode(items.NodePointGround(referenceCoordinates=[0, 0, 0]))
    fixed = mbs.AddMarker(items.MarkerNodeCoordinate(nodeNumber=ground, coordinate=0))
    for node, axis in itertools.product(spec["pinned"], range(3)):
        marker = mbs.AddMarker(items.MarkerNodeCoordinate(nodeNumber=nodes[node], coordinate=axis))
        mbs.AddObject(items.ObjectConnectorCoordinate(markerNumbers=[fixed, marker]))
    mbs.Assemble()
    settings = exu.SimulationSettings()
    scheme = settings.timeIntegration
    scheme.generalizedAlpha.spectralRadius = 0.9
    scheme.newton.useModifiedNewton = options["modified"]
    scheme.verboseMode = 0
    settings.solutionSettings.writeSolutionToFile = False
    settings.solutionSettings.sensorsWritePeriod = 1e9
    settings.displayStatistics = settings.displayComputationTime = False
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        settings.linearSolverType = exu.LinearSolverType.EigenSparse

    def run() -> dict[str, Any]:
        places, steps, cpu = [], 0, 0.0
        for a, b in itertools.pairwise(spec["samples"]):
            count = round((b - a) / step)
            scheme.numberOfSteps, scheme.startTime, scheme.endTime = count, a, b
            began = time.process_time()
            mbs.SolveDynamic(settings, solverType=exu.DynamicSolverType.GeneralizedAlpha, updateInitialValues=True)
            cpu += time.process_time() - began
            steps += count
            places.append(mbs.GetNodeOutput(nodes[spec["tip"]], exu.OutputVariableType.Position).tolist())
        return {"places": places, "cpu": cpu, "steps": steps}

    return run
