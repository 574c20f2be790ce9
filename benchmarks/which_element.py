"""One structure by each kind of element: error against the finest shell beside CPU time of a step.

    python benchmarks/which_element.py [-o benchmarks/which_element.json] [--repeat 2]

1. A tape spring of steel, 0.5 m long (radius 15 mm, 90 degrees, 0.1 mm), clamped at its root, with 20 g at its tip,
   which a force of 50 mN pushes to its convex side: small motions.
2. A strip of film, 1 m x 30 mm x 50 um, pulled by 0.5 N at a mass of 10 g at its tip, which a torque of 1 uN m twists
   by 1.5 degrees: the tension makes it some 30 times as stiff in twist.

Error: the tip's displacement or twist in equilibrium against the limit of the two finest shells (error of
second order). CPU time of a step: the loads act suddenly, 100 steps of energy-momentum, least of the runs after one
that is not counted. The reduced body is that of a shell, by Craig and Bampton with both ends as its interface.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import pathlib
import sys
import tempfile
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from evolvent import System, parts
from evolvent.elements import Arc, Material, Rectangle, Strip, TapeSection

STEEL = Material(young_modulus=210e9, poisson_ratio=0.3, density=7850.0)
FILM = Material(young_modulus=2.5e9, poisson_ratio=0.34, density=1420.0)
RADIUS, ANGLE, WALL, BOOM = 0.015, 0.5 * math.pi, 1e-4, 0.5
LENGTH, WIDTH, FOIL = 1.0, 0.03, 5e-5
#: Meshes; the limit of the last two of each is the reference. The reduced body is that of the second one.
BOOMS, STRIPS = ((20, 6), (40, 8), (60, 12)), ((20, 2), (40, 4), (80, 8))
#: Elements of rods, and modes of the reduced body.
ELEMENTS, MODES = 20, 6


def clamped(system: System, node: str) -> System:
    """The system, clamped to the ground at the origin."""
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b=node, type="clamp"), "clamp")
    return system


def pushed(system: System, tip: str) -> System:
    """The boom with its force."""
    system.add(parts.Load(at=tip, force=(0.0, 0.0, 0.05)), "push")
    return system


def twisted(system: System, tip: str) -> System:
    """The strip with its tension and torque."""
    system.add(parts.Load(at=tip, force=(0.5, 0.0, 0.0)), "tension")
    system.add(parts.Load(at=tip, torque=(1e-6, 0.0, 0.0)), "torque")
    return system


def boom_of_shell(mesh: tuple[int, int]) -> System:
    """A free boom between two bodies, whose edges are in planes; the axis is that of the centroids."""
    x = np.linspace(0.0, BOOM, mesh[0] + 1)[:, None]
    turn = np.linspace(-0.5 * ANGLE, 0.5 * ANGLE, mesh[1] + 1)
    zero, centroid = 0.0 * x * turn, RADIUS * math.sin(0.5 * ANGLE) / (0.5 * ANGLE)
    nodes: Any = np.stack([x + zero, RADIUS * np.sin(turn) + zero, RADIUS * np.cos(turn) - centroid + zero], axis=-1)
    normals: Any = np.stack([zero, np.sin(turn) + zero, np.cos(turn) + zero], axis=-1)
    shell = parts.Shell(nodes=nodes, normals=normals, elements=mesh, thickness=WALL, material=STEEL)
    return between_bodies(shell, BOOM, mass=0.02, inertia=1e-5)


def strip_of_shell(mesh: tuple[int, int]) -> System:
    """A free strip between two bodies."""
    shell = parts.Shell(
        size=(LENGTH, WIDTH), position=(0.0, -0.5 * WIDTH, 0.0), elements=mesh, thickness=FOIL, material=FILM,
        mass_damping=2.0,
    )  # fmt: skip
    return between_bodies(shell, LENGTH, mass=0.01, inertia=3e-6)


def between_bodies(shell: parts.Shell, length: float, mass: float, inertia: float) -> System:
    """A shell along x with a body at each end."""
    system = System()
    system.add(shell, "shell")
    system.add(parts.RigidBody(mass=mass, inertia=inertia), "root")
    system.add(parts.RigidBody(mass=mass, inertia=inertia, position=(length, 0.0, 0.0)), "tip")
    system.add(parts.Seam(a="shell.x0", b="root", type="clamp"), "root seam")
    system.add(parts.Seam(a="shell.x1", b="tip", type="clamp"), "tip seam")
    return system


def of_rod(rod: parts.Rod, mass: float, inertia: float) -> System:
    """A clamped rod with a body at its tip."""
    system = System()
    system.add(rod, "rod")
    system.add(parts.RigidBody(mass=mass, inertia=inertia, at="rod.tip"), "tip")
    return clamped(system, "rod.root")


def boom_of_rod(section: Any) -> System:
    rod = parts.Rod(length=BOOM, section=section, material=STEEL, elements=ELEMENTS, normal=(0.0, 0.0, 1.0))
    return of_rod(rod, 0.02, 1e-5)


def strip_of_rod(section: Any) -> System:
    rod = parts.Rod(
        length=LENGTH, section=section, material=FILM, elements=ELEMENTS, normal=(0.0, 0.0, 1.0), mass_damping=2.0
    )
    return of_rod(rod, 0.01, 3e-6)


def reduced(free: System, folder: str) -> System:
    """The reduced body of a free structure, clamped at its root."""
    path = str(pathlib.Path(folder) / "reduced.npz")
    linear = free.linearize([], [], modes=MODES, method="craig-bampton", boundary=["root", "tip"])
    linear.reduced_body({"root": "root", "tip": "tip"}, path)
    system = System()
    system.add(parts.ReducedBody(file=path), "panel")
    return clamped(system, "panel.root")


def height(run: Any) -> float:
    """Displacement of the tip along z, m."""
    if "tip" in run.children:
        return float(run["tip"]["position"].values[-1, 2])
    return float(run["panel"]["interface_position"].values[-1, 1, 2])


def twist(run: Any) -> float:
    """Twist of the tip about x, rad."""
    if "tip" in run.children:
        turn = run["tip"]["attitude"].values[-1]
        return float(2.0 * np.arctan2(turn[1], turn[0]))
    return float(run["panel"]["rotation"].values[-1, 1, 0])


def solved(found: Any, what: str) -> Any:
    """What was found, or an error that says why not."""
    if found.attrs["status"] != "success":
        raise RuntimeError(f"{what}: {found.attrs['message']}")
    return found


def rows_of(
    name: str, systems: dict[str, System], read: Callable[[Any], float], step: float, repeat: int, finer: float
) -> list[dict[str, Any]]:
    """Error and CPU time of a step of each system; the last two are shells, the last one `finer` times as fine."""
    values: list[float] = []
    rows: list[dict[str, Any]] = []
    for label, system in systems.items():
        values.append(read(solved(system.equilibrium(), f"{name}, {label}")))
        least = math.inf
        for k in range(repeat + 1):  # the first is not counted: it may compile
            began = time.process_time()
            run = solved(system.simulate(until=100 * step, every=10 * step, method="energy-momentum", step=step), label)
            cpu = time.process_time() - began
            if k:
                least = min(least, cpu / json.loads(run.attrs["statistics"])["steps"])
        rows.append({"structure": name, "element": label, "value": values[-1], "ms": 1e3 * least})
    reference = values[-1] + (values[-1] - values[-2]) / (finer**2 - 1.0)
    for row in rows:
        row["error"] = row["value"] / reference - 1.0
        print(f"{name:24}{row['element']:32}{100.0 * row['error']:+10.2f} %{row['ms']:10.3f} ms", flush=True)
    return rows


def main() -> int:
    """Print the table and write the JSON file."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("-o", "--output", type=pathlib.Path, default=pathlib.Path(__file__).with_suffix(".json"))
    parser.add_argument("--repeat", type=int, default=2)
    options = parser.parse_args()
    load = os.getloadavg()
    print(f"load {load[0]:.2f}")
    tape = {"radius": RADIUS, "angle": ANGLE, "thickness": WALL}
    with tempfile.TemporaryDirectory() as folder:
        booms = {
            "rod, section arc": pushed(boom_of_rod(Arc(**tape)), "tip"),
            "rod, section tape": pushed(boom_of_rod(TapeSection(**tape)), "tip"),
            "reduced body of the shell": pushed(reduced(boom_of_shell(BOOMS[1]), folder), "panel.tip"),
        }
        for mesh in BOOMS:
            booms[f"shell {mesh[0]} x {mesh[1]}"] = pushed(clamped(boom_of_shell(mesh), "root"), "tip")
        rows = rows_of("tape as a boom", booms, height, 1e-3, options.repeat, finer=1.5)
        sides = {"thickness": FOIL, "width": WIDTH}
        strips = {
            "rod, section rectangle": twisted(strip_of_rod(Rectangle(**sides)), "tip"),
            "rod, section strip": twisted(strip_of_rod(Strip(**sides)), "tip"),
            "reduced body of the shell": twisted(reduced(strip_of_shell(STRIPS[1]), folder), "panel.tip"),
        }
        for mesh in STRIPS:
            strips[f"shell {mesh[0]} x {mesh[1]}"] = twisted(clamped(strip_of_shell(mesh), "root"), "tip")
        rows += rows_of("film strip, twist", strips, twist, 2e-3, options.repeat, finer=2.0)
    options.output.write_text(json.dumps({"load": [load, os.getloadavg()], "rows": rows}, indent=1) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
