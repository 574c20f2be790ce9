"""A lenticular rib of two shells, pressed flat, wound on a turning hub, held and released: times, energies, moments.

    python benchmarks/stowing.py [-o run.nc] [--elements 16 4] [--until 1.6]

The rib of the case `rib-lenticular-shell`, with a coarser mesh, starts straight; its section goes over from flat at the
root to the lens. Pressure on both walls flattens it, springs keep the free ends of the walls apart, which have no wall
beyond them to lie on. The hub then turns by the length of the rib over its radius, a pull at the tip keeps the rib
taut. The pressure on the inner wall and the pull end, that on the outer wall, the belt, stays, and opens at last.
Prints a line of each sample, and the moment of the hub beside its closed form. No times of it are kept.
"""

from __future__ import annotations

import argparse
import time
from typing import Any

import numpy as np

import evolvent as ev
from evolvent import cases

WALLS = ("outer wall", "inner wall")
LENGTH, RADIUS, WIDTH = 0.6, 0.15016, 0.06
#: Ends of the phases, s: flattened, wound, held.
FLAT, WOUND, HELD = 0.12, 0.42, 0.58
HUB = 1e-3  # kg m2
PRESSURE, PULL, ROOT = 2000.0, 8.0, 0.2  # Pa; N/m of the edge of each wall; m, length over which the section opens


def case_of(elements: tuple[int, int], until: float, step: float = 5e-4) -> dict[str, Any]:
    """The content of the case, from straight."""
    content = cases.content_of("rib-lenticular-shell")
    parts = content["parts"]
    for name in ("mount", "belt", "out"):
        del parts[name]
    share = "(1.001 - exp(-(L*u/B)**2))"
    for name, sign in zip(WALLS, ("", "-"), strict=True):
        parts[name] = parts[name] | {
            "elements": list(elements),
            "start_formula": [
                "L*u",
                f"R/{share}*sin(A*(v - 0.5)*{share})",
                f"{sign}(R/{share}*(cos(A*(v - 0.5)*{share}) - cos(A/2*{share})) + 2*T*v*(1 - v)*exp(-(L*u/B)**2))",
            ],
            "constants": {"L": LENGTH, "R": 0.1, "A": 0.6, "T": 1.6e-4, "B": ROOT},
            "stiffness_damping": "1 ms",
        }
    shape = parts["hub"]["shape"]
    parts["hub"] = {"kind": "rigid-body", "motion": "spin", "axis": [0, 0, 1], "inertia": HUB, "shape": shape}
    part_of_turn = f"min(max((t - {FLAT})/{WOUND - FLAT}, 0), 1)"
    parts["turn"] = {
        "kind": "joint", "type": "revolute", "a": [0, 0, 0], "b": "hub", "axis": [0, 0, 1],
        "drive": {
            "expression": f"-turn*{part_of_turn}**3*(10 - 15*{part_of_turn} + 6*{part_of_turn}**2)",
            "constants": {"turn": LENGTH / RADIUS},
        },
    }  # fmt: skip
    parts["coil"] |= {"a": list(WALLS), "stiffness": 1e7}
    parts["layers"] |= {"stiffness": 1e7}
    rise = [[0.03, 0.0], [0.08, 500.0], [0.95 * FLAT, PRESSURE]]
    for name, sign, fall in (
        ("outer wall", -1, [[HELD, PRESSURE], [HELD + 1e-3, 0.0]]),
        ("inner wall", 1, [[WOUND + 0.05, PRESSURE], [WOUND + 0.1, 0.0]]),
    ):
        parts[f"pressure on {name}"] = {
            "kind": "load", "over": name, "direction": [0, 0, sign], "frame": "body", "profile": rise + fall,
        }  # fmt: skip
        pull = [[0.0, 0.0], [0.5 * FLAT, PULL], [WOUND + 0.1, PULL], [WOUND + 0.15, 0.0]]
        parts[f"pull on {name}"] = {"kind": "load", "along": f"{name}.x1", "direction": [1, 0, 0], "profile": pull}
    for k in range(1, elements[1]):
        node = elements[0] * (elements[1] + 1) + k
        ends = {"a": f"outer wall[{node}]", "b": f"inner wall[{node}]"}
        parts[f"spacer {k}"] = {"kind": "spring", **ends, "length": 1e-3, "law": "5e3*min(x, 0)"}
    content["simulate"] |= {"until": until, "every": 0.01, "step": step}
    return content


def height(run: Any, elements: tuple[int, int]) -> np.ndarray:
    """Heights of the outer wall's middle over the inner one's, m: of samples and stations."""
    shape = (run.sizes["time"], elements[0] + 1, elements[1] + 1, 3)
    outer, inner, normal = (
        run[name][of].values.reshape(shape)[:, :, elements[1] // 2]
        for name, of in ((WALLS[0], "position"), (WALLS[1], "position"), (WALLS[0], "normal"))
    )
    return np.asarray(np.einsum("tsi,tsi->ts", outer - inner, normal))


def winding_moment(time: float) -> float:
    """Moment of the hub that winds: bending and stretch of the walls, the pull, damping and inertia of the motion."""
    s, whole, turn = (time - FLAT) / (WOUND - FLAT), WOUND - FLAT, LENGTH / RADIUS
    rate, growth = (
        turn * 30.0 * s**2 * (1.0 - s) ** 2 / whole,
        turn * 60.0 * s * (1.0 - 3.0 * s + 2.0 * s**2) / whole**2,
    )
    wall = cases.load("rib-lenticular-shell").parts["outer wall"].wall()
    own, thick = wall.stiffness, 1.6e-4
    stored = WIDTH * (own[3, 3] + 8.0 / 15.0 * own[0, 0] * thick**2 / 4.0) / RADIUS
    rib = 2.0 * WIDTH * LENGTH * wall.mass * RADIUS**2
    return float(stored + 2.0 * PULL * WIDTH * RADIUS + 8.0 * rib * rate + (rib + HUB) * growth)


def main() -> None:
    """Run it and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-o", "--out")
    parser.add_argument("--elements", type=int, nargs=2, default=(16, 4))
    parser.add_argument("--until", type=float, default=1.6)
    given = parser.parse_args()
    elements = tuple(given.elements)
    began = time.process_time()
    found = ev.run(case_of(elements, given.until))
    print(f"{time.process_time() - began:.0f} s of CPU time")
    if given.out:
        ev.save(found, given.out)
    run = found.ev.regular()
    high = height(run, elements)
    print("time, s  height least, middle, tip, mm  energy, moved, dissipated, defect, mJ  moment, N m  closed form")
    for k, t in enumerate(run["time"].values):
        energies = [
            1e3 * float(run[key][k]) for key in ("energy", "energy_moved", "energy_dissipated", "energy_defect")
        ]
        heights = 1e3 * np.array([high[k, 1:].min(), high[k, elements[0] // 2], high[k, -1]])
        moment = float(run["turn"]["torque"][k])
        wound = f"{-winding_moment(t):.4f}" if FLAT < t < WOUND else ""
        print(f"{t:.3f}", *(f"{x:.2f}" for x in [*heights, *energies]), f"{moment:.4f}", wound)


if __name__ == "__main__":
    main()
