"""Benchmark of copies side by side: time of a step of eight copies in lanes beside that of eight alone.

    python benchmarks/lanes.py [-o benchmarks/lanes.json] [--repeat 300] [--only NAME ...]

The loop of explicit methods with fixed steps (RK4) on a rod, a thread, a body on springs and a chain on hinges: eight
copies that differ by some percent in stiffness, alone one after the other, then in lanes; the best of many short parts
of a run, so that other processes disturb little. `same_bits` tells whether all copies end with the bits that they have
alone; `side_by_side` is the share of the steps of a short run that copies went in lanes, the rest alone. `whole` is the
ratio of the processor times of that run with what Python does for it: samples, balances, what moves in and out.
"""

from __future__ import annotations

import argparse
import json
import pathlib
import time
from collections.abc import Callable
from typing import Any

import numpy as np

import evolvent
from evolvent import System, elements, parts
from evolvent.compiled.lane_types import WIDTH
from evolvent.compiled.lanes import PARTED
from evolvent.solvers.time.explicit import lanes
from evolvent.solvers.time.explicit.plan import plan
from evolvent.solvers.time.explicit.run import ExplicitRun

G = (0.0, -9.81, 0.0)
CHANGES = np.linspace(0.95, 1.05, WIDTH)
#: Steps of a part that is timed, less than a slice of the processor's time.
STEPS = 12


def rod(factor: float) -> Any:
    """A rod of 20 elements that hangs on a spherical joint."""
    system, side = System(gravity=G), 0.02
    material = elements.Material(young_modulus=2e7 * factor, poisson_ratio=0.3, density=7200.0)
    section = elements.Rectangle(thickness=side, width=side)
    system.add(parts.Rod(length=1.0, section=section, material=material, elements=20), "rod")
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="rod.root"))
    return system.assemble()


def springs(factor: float) -> Any:
    """A body on four springs."""
    system = System(gravity=G)
    system.add(parts.RigidBody(mass=2.0, inertia=(0.1, 0.2, 0.3), position=(0.02, -1.0, 0.01)), "body")
    for k, (x, z) in enumerate(((1.0, 1.0), (-1.0, 1.0), (1.0, -1.0), (-1.0, -1.0))):
        b = ("body", (0.2 * x, 0.0, 0.2 * z))
        system.add(parts.Spring(a=(x, 0.0, z), b=b, stiffness=300.0 * factor, damping=0.4), f"spring {k}")
    return system.assemble()


def _case(name: str, key: str, value: float) -> Callable[[float], Any]:
    def build(factor: float) -> Any:
        return evolvent.load(name).with_values({key: value * factor}).assemble()

    return build


#: Builder of a copy, step and duration, s.
CASES: dict[str, tuple[Callable[[float], Any], float, float]] = {
    "rod": (rod, 1e-5, 0.2),
    "thread": (_case("heliogyro", "blade-1.stiffness", 1e4), 1.8e-4, 10.0),
    "springs": (springs, 1e-3, 30.0),
    "hinges": (_case("solar-array", "hinge 1.stiffness", 0.2), 1e-3, 8.0),
}


def measure(name: str, repeat: int) -> dict[str, Any]:
    """Times of steps, and what became of a run."""
    build, step, end = CASES[name]
    assemblies = [build(factor) for factor in CHANGES]

    def plans() -> list[Any]:
        return [plan(one, samples=np.linspace(0.0, end, 11), step=step) for one in assemblies]

    runs = [ExplicitRun(one) for one in plans()]
    if why := lanes.reason_alone(runs):
        raise RuntimeError(f"{name}: {why}")
    began = time.process_time()
    alone = [one.run() for one in plans()]
    between = time.process_time()
    together = lanes.run_together(plans())
    ended = time.process_time()
    same = all(np.array_equal(a.y, b.y) and a.status == b.status for a, b in zip(alone, together, strict=True))
    group = lanes.Lanes(runs)
    group.advance(range(WIDTH), int(end / step / 2))
    best = [np.inf, np.inf]
    one = ExplicitRun(plans()[0])
    one.advance(one.work, 100)
    for _ in range(repeat):
        first = time.perf_counter()
        one.advance(one.work, STEPS)
        second = time.perf_counter()
        code = group.step(STEPS)
        third = time.perf_counter()
        best[0] = min(best[0], second - first)
        if code > PARTED:
            best[1] = min(best[1], third - second)
    steps = group.counts["side by side"] + group.counts["alone"]
    return {
        "alone_us": 1e6 * best[0] / STEPS, "eight_in_lanes_us": 1e6 * best[1] / STEPS,
        "ratio": WIDTH * best[0] / best[1], "whole": (between - began) / (ended - between),
        "side_by_side": group.counts["side by side"] / steps, "parted": group.counts["parted"], "same_bits": same,
    }  # fmt: skip


def main() -> None:
    """Print a table and write JSON."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("-o", default=str(pathlib.Path(__file__).with_suffix(".json")))
    parser.add_argument("--repeat", type=int, default=300)
    parser.add_argument("--only", nargs="*", default=list(CASES), choices=list(CASES))
    options = parser.parse_args()
    found = {}
    for name in options.only:
        found[name] = row = measure(name, options.repeat)
        print(name, ", ".join(f"{key} {value:.3g}" for key, value in row.items()), flush=True)
    pathlib.Path(options.o).write_text(json.dumps(found, indent=1) + "\n")


if __name__ == "__main__":
    main()
