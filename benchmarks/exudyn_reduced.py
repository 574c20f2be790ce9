"""Benchmark of reduced flexible bodies: the same finite-element model in evolvent and in Exudyn.

    python benchmarks/exudyn_reduced.py [-o benchmarks/exudyn_reduced.json] [--repeat 5] [--step 1e-3]

A bar of hexahedra (1 m x 0.05 m x 0.02 m) with rigid end faces is reduced to both faces and `MODES` modes with these
held (Craig and Bampton): by Exudyn's `ComputeHurtyCraigBamptonModes` (RBE2), and here for `ReducedBody`. It floats
freely; a torque at one face and a force at the other, smooth pulses, bend it and set it in rotation.
Both programs integrate by generalized-alpha with the same step. Compared: frequencies of the free body, the place of
the other face at the end beside the largest deflection, and the time of a step (the loop alone here, the call of the
solver there).
"""

from __future__ import annotations

import argparse
import importlib
import json
import os
import pathlib
import sys
import tempfile
import time
import warnings
from typing import Any

import numpy as np
import scipy.linalg
import scipy.sparse

from evolvent import System, parts
from evolvent.elements.reduced_files import write_model
from evolvent.elements.reduced_models import ReducedModel

Array = np.ndarray
SIDES, CELLS = (1.0, 0.05, 0.02), (16, 2, 2)
YOUNG, POISSON, DENSITY, MODES = 70e9, 0.3, 2700.0, 8
UNTIL, EVERY, RADIUS = 2.0, 0.1, 0.9
#: Torque about y at the first face (N m) and force along z at the last (N) over time: a push and its end.
TORQUE, FORCE, PUSH = 8.0, 20.0, np.linspace(0.0, 0.4, 41)


def pulse(t: float) -> float:
    """A smooth pulse of height 1, straight between the times `PUSH`."""
    return float(np.interp(t, PUSH, np.sin(np.pi * PUSH / PUSH[-1]) ** 2))


def brick(sides: Array) -> tuple[Array, Array]:
    """Stiffness and consistent mass (24, 24) of a hexahedron by 2 x 2 x 2 points."""
    corners = np.array([[-1, -1, -1], [1, -1, -1], [1, 1, -1], [-1, 1, -1],
                        [-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]], dtype=float)  # fmt: skip
    shear = YOUNG / (2.0 * (1.0 + POISSON))
    lame = YOUNG * POISSON / ((1.0 + POISSON) * (1.0 - 2.0 * POISSON))
    D = np.diag([2.0 * shear] * 3 + [shear] * 3)
    D[:3, :3] += lame
    K, M, weight = np.zeros((24, 24)), np.zeros((24, 24)), float(np.prod(sides)) / 8.0
    for at in corners / np.sqrt(3.0):
        factors = 1.0 + corners * at
        N = factors.prod(axis=1) / 8.0
        d = np.stack([corners[:, i] * factors[:, (i + 1) % 3] * factors[:, (i + 2) % 3] / 8.0 for i in range(3)])
        d *= 2.0 / sides[:, None]
        B = np.zeros((6, 24))
        for i in range(3):
            B[i, i::3] = d[i]
        for row, (i, j) in enumerate(((1, 2), (0, 2), (0, 1))):
            B[3 + row, i::3], B[3 + row, j::3] = d[j], d[i]
        K += weight * B.T @ D @ B
        M += weight * DENSITY * np.kron(np.outer(N, N), np.eye(3))
    return K, M


def mesh() -> tuple[Array, Array, Array, Array]:
    """Places (n, 3) of the nodes, nodes (m, 8) of the hexahedra, stiffness and mass (3 n, 3 n)."""
    counts = np.array(CELLS) + 1
    grid = np.stack(np.meshgrid(*(np.arange(c) for c in counts), indexing="ij"), axis=-1).reshape(-1, 3)
    sides = np.array(SIDES) / CELLS
    number = {tuple(place): k for k, place in enumerate(grid.tolist())}
    around = ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1))
    cells = np.array([
        [number[i + a, j + b, k + c] for a, b, c in around]
        for i in range(CELLS[0]) for j in range(CELLS[1]) for k in range(CELLS[2])
    ])  # fmt: skip
    k, m = brick(sides)
    K, M = np.zeros((3 * len(grid),) * 2), np.zeros((3 * len(grid),) * 2)
    for own in cells:
        rows = (3 * own[:, None] + np.arange(3)).ravel()
        K[np.ix_(rows, rows)] += k
        M[np.ix_(rows, rows)] += m
    return grid * sides - [0.0, 0.5 * SIDES[1], 0.5 * SIDES[2]], cells, K, M


def reduced(places: Array, faces: list[Array], K: Array, M: Array) -> ReducedModel:
    """The bar by its end faces, which are rigid, and modes with these held."""
    inner = np.setdiff1d(np.arange(len(places)), np.concatenate(faces))
    rows = (3 * inner[:, None] + np.arange(3)).ravel()
    T, centres = np.zeros((len(K), 12 + rows.size)), []
    for k, face in enumerate(faces):
        centre = places[face].mean(axis=0)
        centres.append(centre)
        for node in face:
            own = T[3 * node : 3 * node + 3, 6 * k : 6 * k + 6]
            own[:, :3], own[:, 3:] = np.eye(3), np.cross(np.eye(3), places[node] - centre).T
    T[rows, 12 + np.arange(rows.size)] = 1.0
    K, M = T.T @ K @ T, T.T @ M @ T
    modes = scipy.linalg.eigh(K[12:, 12:], M[12:, 12:], subset_by_index=[0, MODES - 1])[1]
    basis = np.zeros((len(K), 12 + MODES))
    basis[:12, :12] = np.eye(12)
    basis[12:, :12], basis[12:, 12:] = -np.linalg.solve(K[12:, 12:], K[12:, :12]), modes
    K, M = basis.T @ K @ basis, basis.T @ M @ basis
    return ReducedModel(
        0.5 * (K + K.T), 0.5 * (M + M.T), np.array(centres), ("root", "tip"), np.zeros((0, len(K)))
    )  # fmt: skip


def of_evolvent(model: ReducedModel, step: float) -> tuple[float, Array, float, Array]:
    """Time of a step (s), places of the tip (m, 3), the largest deflection (m), and frequencies (Hz)."""
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "bar.npz")
        write_model(path, model)
        system = System()
        system.add(parts.ReducedBody(file=path), "bar")
        for kind, at, axis, size in (
            (parts.Load, "bar.root", (0, 1, 0), TORQUE), (parts.Load, "bar.tip", (0, 0, 1), FORCE)
        ):  # fmt: skip
            key = "axis" if kind is parts.Load else "direction"
            profile = [(float(t), size * pulse(t)) for t in PUSH]
            system.add(kind(at=at, profile=profile, **{key: axis}), at.partition(".")[2])
        run = system.simulate(until=UNTIL, every=EVERY, method="generalized-alpha", step=step, spectral_radius=RADIUS)
        frequencies = system.modes(count=12).frequency_hz[6:]
    at = run["time"].values
    rows = [
        int(np.argmin(np.abs(at - t))) for t in np.arange(round(UNTIL / EVERY) + 1) * EVERY
    ]  # changes of loads, too
    tip = run["bar"]["interface_position"].values[rows, 1]
    deflection = float(np.abs(run["bar"]["displacement"].values).max())
    return float(run.attrs["wall_time_s"]) / (UNTIL / step), tip, deflection, frequencies


def of_exudyn(places: Array, cells: Array, faces: list[Array], K: Array, M: Array, step: float) -> Any:
    """The same by Exudyn; the solver's own time of a step."""
    import exudyn as exu

    fem_module, items = importlib.import_module("exudyn.FEM"), importlib.import_module("exudyn.itemInterface")
    fem = fem_module.FEMinterface()
    fem.nodes, fem.elements = {"Position": places}, [{"Name": "bar", "Hex8": cells}]
    fem.surface = [{"Name": "bar", "Trigs": [], "Quads": []}]
    fem.massMatrix, fem.stiffnessMatrix = (scipy.sparse.csr_matrix(one) for one in (M, K))
    fem.ComputeHurtyCraigBamptonModes(
        boundaryNodesList=[face.tolist() for face in faces], nEigenModes=MODES, useSparseSolver=True,
        computationMode=fem_module.HCBstaticModeSelection.RBE2,
    )  # fmt: skip
    mbs = exu.SystemContainer().AddSystem()
    body = fem_module.ObjectFFRFreducedOrderInterface(fem).AddObjectFFRFreducedOrder(mbs)
    markers = [
        mbs.AddMarker(items.MarkerSuperElementRigid(
            bodyNumber=body["oFFRFreducedOrder"], meshNodeNumbers=face.tolist(),
            weightingFactors=[1.0 / face.size] * face.size,
        ))
        for face in faces
    ]  # fmt: skip
    mbs.AddLoad(items.LoadTorqueVector(
        markerNumber=markers[0], loadVector=[0, TORQUE, 0],
        loadVectorUserFunction=lambda _, t, load: [pulse(t) * x for x in load],
    ))  # fmt: skip
    mbs.AddLoad(items.LoadForceVector(
        markerNumber=markers[1], loadVector=[0, 0, FORCE],
        loadVectorUserFunction=lambda _, t, load: [pulse(t) * x for x in load],
    ))  # fmt: skip
    sensor = mbs.AddSensor(items.SensorMarker(
        markerNumber=markers[1], outputVariableType=exu.OutputVariableType.Position, storeInternal=True
    ))  # fmt: skip
    mbs.Assemble()
    settings = exu.SimulationSettings()
    settings.timeIntegration.numberOfSteps = round(UNTIL / step)
    settings.timeIntegration.endTime = UNTIL
    settings.timeIntegration.generalizedAlpha.spectralRadius = RADIUS
    settings.timeIntegration.newton.useModifiedNewton = True
    settings.timeIntegration.newton.relativeTolerance = 1e-11
    settings.timeIntegration.newton.absoluteTolerance = 1e-12
    settings.timeIntegration.verboseMode = 0
    settings.solutionSettings.writeSolutionToFile = False
    settings.solutionSettings.sensorsWritePeriod = EVERY
    began = time.perf_counter()
    mbs.SolveDynamic(settings)
    seconds = time.perf_counter() - began
    return seconds / (UNTIL / step), np.array(mbs.GetSensorStoredData(sensor))[:, 1:4]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("-o", "--output", type=pathlib.Path, default=pathlib.Path(__file__).with_suffix(".json"))
    parser.add_argument("--repeat", type=int, default=5)
    parser.add_argument("--step", type=float, default=1e-3)
    options = parser.parse_args()
    before = os.getloadavg()[0]
    places, cells, K, M = mesh()
    faces = [np.flatnonzero(np.isclose(places[:, 0], x)) for x in (0.0, SIDES[0])]
    model = reduced(places, faces, K, M)
    ours, theirs = [], []
    for _ in range(options.repeat):  # interleaved
        seconds, tip, deflection, frequencies = of_evolvent(model, options.step)
        ours.append(seconds)
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                seconds, peer = of_exudyn(places, cells, faces, K, M, options.step)
        except ImportError:
            peer = None
            continue
        theirs.append(seconds)
    figures: dict[str, Any] = {
        "step_s": options.step, "load": [before, os.getloadavg()[0]], "deflection_m": deflection,
        "frequencies_hz": frequencies.tolist(), "evolvent_us": 1e6 * float(np.median(ours)),
    }  # fmt: skip
    if peer is None:
        figures["Exudyn"] = "not installed"
    else:
        figures["exudyn_us"] = 1e6 * float(np.median(theirs))
        figures["difference_m"] = float(np.abs(tip - peer).max())
        figures["difference / deflection"] = figures["difference_m"] / deflection
        figures["difference / way of the tip"] = figures["difference_m"] / float(np.abs(tip - tip[0]).max())
    options.output.write_text(json.dumps(figures, indent=1) + "\n", encoding="utf-8")
    print(json.dumps(figures, indent=1))
    return 0


if __name__ == "__main__":
    sys.exit(main())
