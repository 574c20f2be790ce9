"""evolvent: the three works of parts."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

import evolvent
from evolvent import System, elements, parts
from evolvent.solvers import solve
from evolvent.solvers.time.implicit.plan import solve_implicit


def version() -> str:
    return evolvent.__version__


def cable(spec: dict[str, Any], options: dict[str, Any]) -> tuple[Any, Callable]:
    system = System(gravity=(0.0, -spec["gravity"], 0.0))
    beam = parts.Beam(
        length=spec["length"],
        section=elements.Rectangle(thickness=spec["side"], width=spec["side"]),
        material=elements.Material(young_modulus=spec["E"], poisson_ratio=spec["nu"], density=spec["density"]),
        elements=spec["elements"],
        formulation=options["formulation"],
    )
    system.add(beam, "cable")
    kind = "revolute" if beam.formulation == "assumed_strain" else "spherical"
    # explicit methods hold no constraints on nodes of beams: the pin is a spring then
    stiffness = 1e6 if options.get("method") == "rk4" else 0.0
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="cable.root", type=kind, stiffness=stiffness))
    tip = 3 * beam.vectors * spec["elements"]
    return system.assemble(), lambda y: y[tip : tip + 3]


def rod(spec: dict[str, Any], options: dict[str, Any]) -> tuple[Any, Callable]:
    """The cable as a geometrically exact rod with shear and rotary inertia; a constraint holds its root."""
    from evolvent.solvers.modal.positions import linearized_points

    system = System(gravity=(0.0, -spec["gravity"], 0.0))
    own = parts.Rod(
        length=spec["length"],
        section=elements.Rectangle(thickness=spec["side"], width=spec["side"]),
        material=elements.Material(young_modulus=spec["E"], poisson_ratio=spec["nu"], density=spec["density"]),
        elements=spec["elements"],
    )
    system.add(own, "cable")
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="cable.root", type="spherical"))
    assembly = system.assemble()
    return assembly, lambda y: linearized_points(assembly, y)["cable.tip"].position


def line(spec: dict[str, Any], options: dict[str, Any]) -> tuple[Any, Callable]:
    system = System(gravity=(0.0, 0.0, -spec["gravity"]))
    n = spec["segments"]
    h = spec["length"] / n
    before: Any = tuple(spec["nodes"][0])
    for i, place in enumerate(spec["nodes"][1:], 1):
        mass = spec["density"] * h * (1.0 if i < n else 0.5) + (0.0 if i < n else spec["bob"])
        point = system.add(parts.Point(mass=mass, position=place), f"p{i}")
        system.add(parts.Spring(a=before, b=point, stiffness=spec["EA"] / h, damping=spec["BA"] / h, length=h))
        before = point
    return system.assemble(), lambda y: y[3 * n - 3 : 3 * n]


def hanging(spec: dict[str, Any]) -> System:
    """The body on its springs."""
    system = System(gravity=(0.0, 0.0, -spec["gravity"]))
    system.add(parts.RigidBody(mass=spec["mass"], inertia=spec["inertia"], angular_velocity=spec["spin"]), "body")
    for corner in spec["corners"]:
        system.add(
            parts.Spring(
                a=(corner[0], corner[1], spec["height"]),
                b=("body", corner),
                stiffness=spec["stiffness"],
                length=spec["natural"],
            )
        )
    return system


def body(spec: dict[str, Any], options: dict[str, Any]) -> tuple[Any, Callable]:
    from evolvent.kernels.rotations import rotation_from_quaternion

    def place(y: np.ndarray) -> np.ndarray:
        R = np.empty((3, 3))
        rotation_from_quaternion(*(y[3:7] / np.linalg.norm(y[3:7])), R)
        return y[:3] + R @ spec["corners"][0]

    return hanging(spec).assemble(), place


def variants(spec: dict[str, Any], options: dict[str, Any], step: float) -> Callable[[], dict[str, Any]]:
    """All masses by one call; it builds the variants, checks them, and keeps values, within the time."""
    system, until = hanging(spec), spec["samples"][-1]
    kept = {axis: f"body.position.{axis}.last" for axis in "xyz"}

    def run() -> dict[str, Any]:
        found = evolvent.simulate_many(
            system, {"body.mass": spec["masses"]}, list(kept.values()), workers=options["threads"], until=until,
            every=until, method="rk4", step=step,
        )  # fmt: skip
        places = np.stack([found[name.replace(".", "_")].values for name in kept.values()], axis=1)
        failed = [str(one) for one in found["reason"].values if str(one)]
        return {
            "places": places.tolist(), "steps": len(places) * round(until / step),
            "stopped": failed[0] if failed else None,
        }  # fmt: skip

    return run


def prepare(work: str, spec: dict[str, Any], options: dict[str, Any], step: float) -> Callable[[], dict[str, Any]]:
    """One run; its stepping is timed by the solver itself, its checks beforehand count only in all."""
    if work == "variants":
        return variants(spec, options, step)
    build = {"cable": rod if options.get("part") == "rod" else cable, "line": line, "body": body}[work]
    assembly, place = build(spec, options)

    def run() -> dict[str, Any]:
        times = spec["samples"]
        if work == "cable" and options.get("method") != "rk4":
            found = solve_implicit(assembly, samples=times, step=step, spectral_radius=0.9)
        else:
            found = solve(assembly, samples=times, method="rk4", step=step)
        return {
            "places": [place(y).tolist() for y in found.y[1:]],
            "steps": int(found.statistics["steps"]),
            "stepping": found.wall_time,
            "stopped": None if found.success else found.message,
        }

    return run
