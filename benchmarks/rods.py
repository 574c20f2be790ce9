"""Benchmark of the geometrically exact rod: a flexible pendulum beside Exudyn's ObjectBeamGeometricallyExact.

    python benchmarks/rods.py [-o benchmarks/rods.json] [--repeat 3]

A rod of 1 m, 0.02 m x 0.02 m, E = 20 MPa, nu = 0.3, 7200 kg/m3, falls from the horizontal, its end held in place (its
rotation is free); 1000 steps of 1 ms, one core, nothing written. Both take generalized-alpha with the spectral radius
0.9, this package the energy-momentum step as well. Exudyn's nodes are NodeRigidBodyRotVecLG; it solves with EigenSparse
and its modified Newton method. Errors are those of the tip after 1 s against the tip of this package's rod with 160
elements at a quarter of the step (of the peer also against its own 160 elements).
"""

from __future__ import annotations

import argparse
import json
import os
import pathlib
import sys
from typing import Any

import numpy as np
from exudyn_pendulum import pendulum

from evolvent import System, elements, parts
from evolvent.solvers.time.implicit.energy_momentum import solve_energy
from evolvent.solvers.time.implicit.plan import solve_implicit

LENGTH, SIDE, E, NU, DENSITY, G = 1.0, 0.02, 2e7, 0.3, 7200.0, 9.81
STEP, RADIUS, END = 1e-3, 0.9, 1.0
COUNTS, FINEST = (10, 20, 40), 160
SECTION = elements.Rectangle(thickness=SIDE, width=SIDE)
MATERIAL = elements.Material(young_modulus=E, poisson_ratio=NU, density=DENSITY)
SOLVERS = {"generalized-alpha": solve_implicit, "energy-momentum": solve_energy}


def ours(method: str, n: int, repeat: int, step: float = STEP) -> tuple[float, float, np.ndarray]:
    """Time of a step, us, iterations of a step, and the tip after 1 s."""
    system = System(gravity=(0.0, -G, 0.0))
    system.add(parts.Rod(length=LENGTH, section=SECTION, material=MATERIAL, elements=n), "rod")
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="rod.root"))
    assembly = system.assemble()
    best, tip, iterations = np.inf, np.zeros(3), 0.0
    for _ in range(repeat):
        found = SOLVERS[method](assembly, samples=(0.0, END), step=step, spectral_radius=RADIUS)
        if not found.success:
            raise RuntimeError(found.message)
        best = min(best, found.wall_time / found.statistics["steps"])
        iterations = found.statistics["iterations"] / found.statistics["steps"]
        tip = position(assembly, found.y[-1])
    return 1e6 * best, iterations, tip


def position(assembly: Any, y: np.ndarray) -> np.ndarray:
    """LinearizedPoint of the tip."""
    from evolvent.solvers.modal.positions import linearized_points

    return linearized_points(assembly, y)["rod.tip"].position


def peer(n: int, repeat: int) -> tuple[float, np.ndarray]:
    """Time of a step, us, and the tip after 1 s, of Exudyn."""
    best, tip = np.inf, np.zeros(3)
    for _ in range(repeat):
        seconds, tip = _peer(n)
        best = min(best, seconds / END * STEP)
    return 1e6 * best, tip


def _peer(n: int) -> tuple[float, np.ndarray]:
    s, G_ = SECTION.properties(NU), MATERIAL.shear_modulus
    shear = s.shear_y * G_ * s.area
    section = (
        [E * s.area, shear, shear, G_ * s.J, E * s.Iy, E * s.Iz],
        DENSITY * s.area,
        [DENSITY * x for x in (s.Iy + s.Iz, s.Iy, s.Iz)],
    )

    def element(items: Any, ends: list[Any], own: Any) -> Any:
        return items.ObjectBeamGeometricallyExact(nodeNumbers=ends, length=LENGTH / n, sectionData=own)

    places = [[LENGTH * i / n, 0, 0, 0, 0, 0] for i in range(n + 1)]
    return pendulum(places, "NodeRigidBodyRotVecLG", element, section, gravity=G, end=END, step=STEP, radius=RADIUS)


def main() -> int:
    """Print the table and write the JSON file."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("-o", "--output", type=pathlib.Path, default=pathlib.Path(__file__).with_suffix(".json"))
    parser.add_argument("--repeat", type=int, default=3)
    options = parser.parse_args()
    load, rows = os.getloadavg(), []
    limit = ours("generalized-alpha", FINEST, 1, 0.25 * STEP)[2]
    print(f"load {load[0]:.2f}\n{'':20}{'elements':>9}{'us a step':>11}{'iterations':>12}{'tip error, mm':>15}")
    theirs: dict[int, tuple[float, np.ndarray]] = {}
    try:
        theirs = {n: peer(n, options.repeat) for n in (*COUNTS, FINEST)}
    except ImportError as error:
        print(f"no comparison with Exudyn: {error}", file=sys.stderr)
    for method in SOLVERS:
        for n in COUNTS:
            us, iterations, tip = ours(method, n, options.repeat)
            row: dict[str, Any] = {"method": method, "elements": n, "us_a_step": us, "iterations": iterations}
            row["tip_error_m"] = float(np.linalg.norm(tip - limit))
            text = f"{method:20}{n:9}{us:11.1f}{iterations:12.2f}{1e3 * row['tip_error_m']:15.4f}"
            if theirs:
                row["peer_us_a_step"], row["ratio"] = theirs[n][0], theirs[n][0] / us
                row["peer_tip_error_m"] = float(np.linalg.norm(theirs[n][1] - limit))
                row["peer_tip_error_own_m"] = float(np.linalg.norm(theirs[n][1] - theirs[FINEST][1]))
                text += f"   peer {theirs[n][0]:8.1f} us, {1e3 * row['peer_tip_error_m']:.4f} mm"
                text += f" ({1e3 * row['peer_tip_error_own_m']:.4f} of its own limit), {row['ratio']:.1f} times"
            print(text)
            rows.append(row)
    options.output.write_text(json.dumps({"load": [load, os.getloadavg()], "rows": rows}, indent=2) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
