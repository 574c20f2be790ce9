"""evolvent: the part `Shell`; in motion energy-momentum or generalized-alpha of spectral radius 0.9."""

from __future__ import annotations

import itertools
import time
from collections.abc import Callable
from typing import Any

import numpy as np

import evolvent
from evolvent import System, elements, parts
from evolvent.solvers.time.implicit.energy_momentum import solve_energy
from evolvent.solvers.time.implicit.plan import solve_implicit

SOLVERS = {"generalized-alpha": solve_implicit, "energy-momentum": solve_energy}


def version() -> str:
    return evolvent.__version__


def built(spec: dict[str, Any]) -> System:
    """The shell with its supports."""
    material = elements.Material(young_modulus=spec["E"], poisson_ratio=spec["nu"], density=spec.get("density", 1000.0))
    shell = parts.Shell(
        nodes=spec["nodes"], normals=spec["normals"], elements=tuple(spec["n"]), thickness=spec["thickness"],
        material=material, clamped=tuple(spec["clamped"]),
    )  # fmt: skip
    system = System(gravity=(0.0, 0.0, -spec.get("gravity", 0.0)))
    system.add(shell, "shell")
    x = list(itertools.chain.from_iterable(spec["nodes"]))
    done: set[Any] = set()
    for edge, axis in spec["symmetric"].items():
        for node in map(int, shell.edge(edge)):
            for other in range(3):
                held = (node, axis if other == axis else frozenset((axis, other)))
                if held in done:
                    continue
                done.add(held)
                axes = np.eye(3)
                keys: Any = {} if other == axis else {"axis_b": tuple(axes[other])}
                guide = parts.Joint(type="guide", a=tuple(x[node]), b=f"shell[{node}]", axis=tuple(axes[axis]), **keys)
                system.add(guide, f"{edge} {node} {other}")
    for node in spec["pinned"]:
        system.add(parts.Joint(a=tuple(x[node]), b=f"shell[{node}]"), f"pin {node}")
    for kind in ("force", "torque"):
        for node, load in spec[kind]:
            keys = {kind: tuple(load)}
            system.add(parts.Load(at=f"shell[{node}]", **keys), f"{kind} {node}")
    return system


def static(spec: dict[str, Any], options: dict[str, Any]) -> Callable[[], dict[str, Any]]:
    system = built(spec)

    def run() -> dict[str, Any]:
        began = time.process_time()
        found = system.equilibrium(load_steps=options["steps"])
        cpu = time.process_time() - began
        if found.attrs["status"] != "success":
            raise RuntimeError(found.attrs["message"])
        moved = found["shell"]["position"].values[-1] - np.reshape(spec["nodes"], (-1, 3))
        return {"values": [float(moved[node, axis]) for node, axis in spec["watched"]], "cpu": cpu}

    return run


def dynamic(spec: dict[str, Any], options: dict[str, Any], step: float) -> Callable[[], dict[str, Any]]:
    assembly = built(spec).assemble()
    node = 7 * spec["tip"]

    def run() -> dict[str, Any]:
        began = time.process_time()
        found = SOLVERS[options["method"]](assembly, samples=tuple(spec["samples"]), step=step, spectral_radius=0.9)
        cpu = time.process_time() - began
        if not found.success:
            raise RuntimeError(found.message)
        counts = found.statistics
        places = [y[node : node + 3].tolist() for y in found.y[1:]]
        return {
            "places": places,
            "cpu": cpu,
            "steps": counts["steps"],
            "iterations": counts["iterations"] / counts["steps"],
        }

    return run


def prepare(work: str, spec: dict[str, Any], options: dict[str, Any], step: float) -> Callable[[], dict[str, Any]]:
    return static(spec, options) if work == "static" else dynamic(spec, options, step)
