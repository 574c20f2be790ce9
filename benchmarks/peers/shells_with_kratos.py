"""Kratos Multiphysics: corotational shells, Newton with the sparse LU of Eigen, Bossak's scheme."""

from __future__ import annotations

import itertools
import time
from collections.abc import Callable
from typing import Any

import KratosMultiphysics as Kratos
import KratosMultiphysics.LinearSolversApplication
import KratosMultiphysics.StructuralMechanicsApplication as Structures
from KratosMultiphysics import python_linear_solver_factory

#: Convergence: residual over the first one of the step, and N; iterations at most.
ABSOLUTE, ITERATIONS = 1e-9, 30


def version() -> str:
    return str(Kratos.KratosGlobals.Kernel.Version()).replace('"', "").split("-")[0]


def components(variable: str) -> list[Any]:
    return [getattr(Kratos, f"{variable}_{axis}") for axis in "XYZ"]


def built(spec: dict[str, Any], options: dict[str, Any]) -> Any:
    """The model, which owns its part "shell", with supports and conditions for loads."""
    Kratos.ParallelUtilities.SetNumThreads(1)
    Kratos.Logger.GetDefaultOutput().SetSeverity(Kratos.Logger.Severity.WARNING)
    model = Kratos.Model()
    part = model.CreateModelPart("shell")
    part.SetBufferSize(2)
    variables = ["DISPLACEMENT", "ROTATION", "REACTION", "REACTION_MOMENT", "VOLUME_ACCELERATION", "VELOCITY"]
    for name in (*variables, "ACCELERATION", "ANGULAR_VELOCITY", "ANGULAR_ACCELERATION"):
        part.AddNodalSolutionStepVariable(getattr(Kratos, name))
    for variable in (Structures.POINT_LOAD, Structures.POINT_MOMENT):
        part.AddNodalSolutionStepVariable(variable)
    properties = part.GetProperties()[1]
    thick = "Thick" in options["element"]
    law = "ReissnerMindlinShellElasticConstitutiveLaw" if thick else "LinearElasticPlaneStress2DLaw"
    for variable, value in (
        (Kratos.YOUNG_MODULUS, spec["E"]), (Kratos.POISSON_RATIO, spec["nu"]), (Kratos.THICKNESS, spec["thickness"]),
        (Kratos.DENSITY, spec.get("density", 1.0)), (Kratos.CONSTITUTIVE_LAW, getattr(Structures, law)()),
    ):  # fmt: skip
        properties.SetValue(variable, value)
    for k, place in enumerate(itertools.chain.from_iterable(spec["nodes"]), 1):
        part.CreateNewNode(k, *place)
    for variable, reaction in (("DISPLACEMENT", "REACTION"), ("ROTATION", "REACTION_MOMENT")):
        for one, other in zip(components(variable), components(reaction), strict=True):
            Kratos.VariableUtils().AddDof(one, other, part)
    for k, quad in enumerate(spec["quads"], 1):
        part.CreateNewElement(options["element"], k, [1 + node for node in quad], properties)
    for node, held in spec["held"]:
        for variable, fixed in zip(components("DISPLACEMENT") + components("ROTATION"), held, strict=True):
            if fixed:
                part.Nodes[node + 1].Fix(variable)
    kinds = [("force", "PointLoadCondition3D1N"), ("torque", "PointMomentCondition3D1N")]
    loads = [(kind, node) for name, kind in kinds for node, _ in spec[name]]
    for k, (kind, node) in enumerate(loads, 1):
        part.CreateNewCondition(kind, k, [node + 1], properties)
    return model


def strategy(part: Any, scheme: Any, relative: float) -> Any:
    linear = python_linear_solver_factory.ConstructSolver(
        Kratos.Parameters('{"solver_type": "LinearSolversApplication.sparse_lu"}')
    )
    found = Kratos.ResidualBasedNewtonRaphsonStrategy(
        part, scheme, Kratos.ResidualCriteria(relative, ABSOLUTE), Kratos.ResidualBasedBlockBuilderAndSolver(linear),
        ITERATIONS, False, False, True,
    )  # fmt: skip
    found.SetEchoLevel(0)
    found.Initialize()
    found.Check()
    return found


def advance(part: Any, solver: Any, t: float, number: int) -> int:
    """One step of time or load: its iterations."""
    part.CloneTimeStep(t)
    part.ProcessInfo[Kratos.STEP] = number
    solver.InitializeSolutionStep()
    solver.Predict()
    if not solver.SolveSolutionStep():
        raise RuntimeError(f"Newton's iteration did not converge in step {number}, at {t:.4g}")
    solver.FinalizeSolutionStep()
    return int(part.ProcessInfo[Kratos.NL_ITERATION_NUMBER])


def static(spec: dict[str, Any], options: dict[str, Any]) -> Callable[[], dict[str, Any]]:
    model = built(spec, options)
    solver = strategy(model.GetModelPart("shell"), Kratos.ResidualBasedIncrementalUpdateStaticScheme(), 1e-7)

    def run() -> dict[str, Any]:
        part, began, iterations = model.GetModelPart("shell"), time.process_time(), 0
        for k in range(1, options["steps"] + 1):
            share = k / options["steps"]
            for name, variable in (("force", Structures.POINT_LOAD), ("torque", Structures.POINT_MOMENT)):
                for node, load in spec[name]:
                    part.Nodes[node + 1].SetSolutionStepValue(variable, [share * x for x in load])
            iterations += advance(part, solver, share, k)
        cpu = time.process_time() - began
        moved = [part.Nodes[k + 1].GetSolutionStepValue(Kratos.DISPLACEMENT)[axis] for k, axis in spec["watched"]]
        return {"values": moved, "cpu": cpu, "iterations": iterations}

    return run


def dynamic(spec: dict[str, Any], options: dict[str, Any], step: float) -> Callable[[], dict[str, Any]]:
    model = built(spec, options)
    part = model.GetModelPart("shell")
    part.ProcessInfo[Structures.RAYLEIGH_ALPHA] = part.ProcessInfo[Structures.RAYLEIGH_BETA] = 0.0
    part.ProcessInfo[Kratos.DELTA_TIME] = step
    settings = f'{{"damp_factor_m": {options["bossak"]!r}, "newmark_beta": 0.25, "projection_variables_list": []}}'
    solver = strategy(
        part, Structures.StructuralMechanicsBossakScheme(Kratos.Parameters(settings)), options["relative"]
    )
    part.ProcessInfo[Kratos.DOMAIN_SIZE] = 3
    for node in part.Nodes:
        fall = [0.0, 0.0, -spec["gravity"]]
        node.SetSolutionStepValue(Kratos.VOLUME_ACCELERATION, fall)
        if not node.IsFixed(Kratos.DISPLACEMENT_Z):  # nothing is strained yet
            node.SetSolutionStepValue(Kratos.ACCELERATION, fall)

    def run() -> dict[str, Any]:
        part, places, iterations, number = model.GetModelPart("shell"), [], 0, 0
        began = time.process_time()
        for t in spec["samples"][1:]:
            while number < round(t / step):
                number += 1
                iterations += advance(part, solver, number * step, number)
            tip = part.Nodes[spec["tip"] + 1]
            places.append([tip.X, tip.Y, tip.Z])
        return {
            "places": places, "cpu": time.process_time() - began, "steps": number, "iterations": iterations / number
        }  # fmt: skip

    return run


def prepare(work: str, spec: dict[str, Any], options: dict[str, Any], step: float) -> Callable[[], dict[str, Any]]:
    return static(spec, options) if work == "static" else dynamic(spec, options, step)
