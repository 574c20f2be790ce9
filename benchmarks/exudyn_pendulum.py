"""The peer's side of the benchmarks of flexible pendulums: Exudyn's set-up that they share."""

from __future__ import annotations

import importlib
import itertools
import time
import warnings
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np


def pendulum(
    places: Sequence[Any],
    node: str,
    element: Callable[[Any, list[Any], Any], Any],
    section: tuple[Sequence[float], float, Sequence[float]],
    *,
    gravity: float,
    end: float,
    step: float,
    radius: float,
) -> tuple[float, np.ndarray]:
    """Wall time, s, of a run of Exudyn, and the last node's position at its end.

    Parameters
    ----------
    places : reference coordinates of the nodes, which are in a line; node : str, their kind
    element : function of the module of items, the two nodes and the section, that returns the element between them
    section : diagonal of the stiffness matrix, mass per length, and moments of inertia per length
    gravity : float, m/s2, along -y; end, step : float, s; radius : float, spectral radius
    """
    import exudyn as exu

    items = importlib.import_module("exudyn.itemInterface")
    mbs = exu.SystemContainer().AddSystem()
    nodes = [mbs.AddNode(getattr(items, node)(referenceCoordinates=place)) for place in places]
    made = exu.BeamSection()
    made.stiffnessMatrix = np.diag(section[0])
    made.massPerLength = section[1]
    made.inertia = np.diag(section[2])
    for first, second in itertools.pairwise(nodes):
        new = element(items, [first, second], made)
        marker = mbs.AddMarker(items.MarkerBodyMass(bodyNumber=mbs.AddObject(new)))
        mbs.AddLoad(items.LoadMassProportional(markerNumber=marker, loadVector=[0, -gravity, 0]))
    ground = mbs.AddNode(items.NodePointGround(referenceCoordinates=[0, 0, 0]))
    fixed = mbs.AddMarker(items.MarkerNodeCoordinate(nodeNumber=ground, coordinate=0))
    for c in range(3):
        marker = mbs.AddMarker(items.MarkerNodeCoordinate(nodeNumber=nodes[0], coordinate=c))
        mbs.AddObject(items.ObjectConnectorCoordinate(markerNumbers=[fixed, marker]))
    mbs.Assemble()
    settings = exu.SimulationSettings()
    settings.timeIntegration.numberOfSteps = round(end / step)
    settings.timeIntegration.endTime = end
    settings.timeIntegration.generalizedAlpha.spectralRadius = radius
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
