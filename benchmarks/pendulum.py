"""Benchmark of the implicit engine: a flexible pendulum beside Exudyn's ANCFCable and ANCFBeam.

    python benchmarks/pendulum.py [-o benchmarks/pendulum.json] [--repeat 3]

A cable of 2 m, 0.02 m x 0.02 m, E = 2 MPa, 1000 kg/m3 falls from the horizontal, pinned at one end; generalized-alpha,
spectral radius 0.9, 2000 steps of 1 ms, one core, nothing written. `cable_stretch` has the peer's measures of strain
and curvature, `cable` Green's; `assumed_strain` has 24 coordinates an element, the peer's beam 18. Errors are those of
the tip after 1 s against each one's own 160 elements (40 of the beams). Exudyn solves with EigenSparse and its modified
Newton method.
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
from evolvent.solvers.time.implicit.plan import solve_implicit

LENGTH, SIDE, E, NU, DENSITY, G = 2.0, 0.02, 2e6, 0.3, 1000.0, 9.81
STEP, RADIUS, SAMPLES = 1e-3, 0.9, (0.0, 1.0, 2.0)
CABLES, BEAMS = (10, 20, 40, 80, 160), (10, 20, 40)


def ours(formulation: str, n: int, repeat: int) -> tuple[float, np.ndarray]:
    """Time of a step, us, and the tip after 1 s."""
    system = System(gravity=(0.0, -G, 0.0))
    material = elements.Material(young_modulus=E, poisson_ratio=NU, density=DENSITY)
    section = elements.Rectangle(thickness=SIDE, width=SIDE)
    beam = parts.Beam(length=LENGTH, section=section, material=material, elements=n, formulation=formulation)
    system.add(beam, "beam")
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="beam.root"))
    assembly = system.assemble()
    best, place = np.inf, np.zeros(3)
    for _ in range(repeat):
        found = solve_implicit(assembly, samples=SAMPLES, step=STEP, spectral_radius=RADIUS)
        if not found.success:
            raise RuntimeError(found.message)
        best = min(best, found.wall_time / found.statistics["steps"])
        tip = 3 * beam.vectors * n
        place = found.y[1, tip : tip + 3]
    return 1e6 * best, place


def peer(kind: str, n: int, repeat: int) -> tuple[float, np.ndarray]:
    """The same of Exudyn."""
    best, place = np.inf, np.zeros(3)
    for _ in range(repeat):
        seconds, _ = _peer(kind, n, SAMPLES[-1])
        best = min(best, seconds / SAMPLES[-1] * STEP)
    place = _peer(kind, n, SAMPLES[1])[1]
    return 1e6 * best, place


def _peer(kind: str, n: int, end: float) -> tuple[float, np.ndarray]:
    area, moment = SIDE**2, SIDE**4 / 12.0
    slopes = [1, 0, 0] if kind == "ANCFCable" else [0, 1, 0, 0, 0, 1]
    shear = 10.0 * (1.0 + NU) / (12.0 + 11.0 * NU) * E / (2.0 * (1.0 + NU)) * area
    torsion = E / (2.0 * (1.0 + NU)) * 0.1406 * SIDE**4
    section = (
        [E * area, shear, shear, torsion, E * moment, E * moment],
        DENSITY * area,
        [DENSITY * x for x in (2.0 * moment, moment, moment)],
    )

    def element(items: Any, ends: list[Any], own: Any) -> Any:
        if kind == "ANCFCable":
            return items.ObjectANCFCable(
                physicsLength=LENGTH / n,
                physicsMassPerLength=DENSITY * area,
                physicsBendingStiffness=E * moment,
                physicsAxialStiffness=E * area,
                nodeNumbers=ends,
            )
        return items.ObjectANCFBeam(
            physicsLength=LENGTH / n, nodeNumbers=ends, sectionData=own, crossSectionPenaltyFactor=[1, 1, 1]
        )

    node = "NodePointSlope1" if kind == "ANCFCable" else "NodePointSlope23"
    places = [[LENGTH * i / n, 0, 0, *slopes] for i in range(n + 1)]
    return pendulum(places, node, element, section, gravity=G, end=end, step=STEP, radius=RADIUS)


def main() -> int:
    """Print the table and write the JSON file."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("-o", "--output", type=pathlib.Path, default=pathlib.Path(__file__).with_suffix(".json"))
    parser.add_argument("--repeat", type=int, default=3)
    options = parser.parse_args()
    rows: list[dict[str, Any]] = []
    load = os.getloadavg()
    print(
        f"load {load[0]:.2f}\n{'':16}{'elements':>9}{'us a step':>11}{'tip error, mm':>15}{'peer, us':>10}{'error':>8}"
    )
    for kind, names, sizes in (
        ("ANCFCable", ("cable_stretch", "cable"), CABLES),
        ("ANCFBeam", ("assumed_strain",), BEAMS),
    ):
        try:
            theirs = {n: peer(kind, n, options.repeat) for n in sizes}
        except ImportError as error:
            print(f"no comparison with Exudyn: {error}", file=sys.stderr)
            theirs = {}
        for name in names:
            mine = {n: ours(name, n, options.repeat) for n in sizes}
            for n in sizes:
                row = {
                    "formulation": name,
                    "elements": n,
                    "us_a_step": mine[n][0],
                    "tip_error_m": float(np.linalg.norm(mine[n][1] - mine[sizes[-1]][1])),
                }
                text = f"{name:16}{n:9}{row['us_a_step']:11.1f}{1e3 * row['tip_error_m']:15.3f}"
                if theirs:
                    row |= {
                        "peer": kind,
                        "peer_us_a_step": theirs[n][0],
                        "peer_tip_error_m": float(np.linalg.norm(theirs[n][1] - theirs[sizes[-1]][1])),
                        "ratio": theirs[n][0] / mine[n][0],
                    }
                    text += f"{row['peer_us_a_step']:10.1f}{1e3 * row['peer_tip_error_m']:8.3f}"
                    text += f"  {row['ratio']:.1f} times faster"
                print(text)
                rows.append(row)
    options.output.write_text(json.dumps({"load": [load, os.getloadavg()], "rows": rows}, indent=2) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
