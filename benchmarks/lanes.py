"""Benchmark of copies side by side: processor time of a batch in the lanes of vector instructions beside one without.

    python benchmarks/lanes.py [-o benchmarks/lanes.json] [--copies 16] [--repeat 3] [--only NAME ...]

Batches by explicit methods with fixed steps, on one thread: rods of 20 and 40 elements, a body on springs, a thread, a
chain on hinges, of copies that differ by some percent in a stiffness or a torque. Each runs alternately with its copies
side by side and one after the other; the least processor times count, with all that Python does. `side_by_side` is the
share of the steps that copies went in lanes, `parted` how often they parted; the states must have the same bits.
"""

from __future__ import annotations

import argparse
import json
import os
import pathlib
import time
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

import evolvent
from evolvent import System, elements, parts
from evolvent.solvers.time.explicit import lanes

G = (0.0, -9.81, 0.0)


class Case(NamedTuple):
    """A system, the key in which its copies differ, or a body on which torques differ, a value, step and end, s."""

    build: Callable[[], System]
    key: str
    value: float
    step: float
    until: float


def rod(count: int) -> System:
    """A rod of some elements that hangs on a spherical joint."""
    system, side = System(gravity=G), 0.02
    material = elements.Material(young_modulus=2e7, poisson_ratio=0.3, density=7200.0)
    section = elements.Rectangle(thickness=side, width=side)
    system.add(parts.Rod(length=1.0, section=section, material=material, elements=count), "rod")
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="rod.root"))
    system.add(parts.Spring(a=(1.0, 0.2, 0.0), b="rod.tip", stiffness=1.0, length=0.1), "spring")
    return system


def springs() -> System:
    """A body on four springs."""
    system = System(gravity=G)
    system.add(parts.RigidBody(mass=2.0, inertia=(0.1, 0.2, 0.3), position=(0.02, -1.0, 0.01)), "body")
    for k, (x, z) in enumerate(((1.0, 1.0), (-1.0, 1.0), (1.0, -1.0), (-1.0, -1.0))):
        b = ("body", (0.2 * x, 0.0, 0.2 * z))
        system.add(parts.Spring(a=(x, 0.0, z), b=b, stiffness=300.0, damping=0.4), f"spring {k}")
    return system


CASES = {
    "rod of 20 elements": Case(lambda: rod(20), "spring.stiffness", 1.0, 1e-5, 0.05),
    "rod of 40 elements": Case(lambda: rod(40), "spring.stiffness", 1.0, 5e-6, 0.0125),
    "body on springs": Case(springs, "spring 1.stiffness", 300.0, 1e-3, 30.0),
    "thread": Case(lambda: evolvent.load("heliogyro"), "body", 1e-3, 1.8e-4, 2.0),
    "chain on hinges": Case(lambda: evolvent.load("solar-array"), "hinge 1.stiffness", 0.2, 1e-3, 6.0),
}


def measure(case: Case, count: int, repeat: int) -> dict[str, Any]:
    """Times of a batch side by side and one after the other."""
    inputs, values = () if "." in case.key else case.key, case.value * np.linspace(0.95, 1.05, count)
    batch = case.build().batch(count, until=case.until, method="rk4", step=case.step, inputs=inputs, workers=1)
    if not inputs:
        batch.expand(case.key, values)

    def start() -> None:
        batch.reset()
        if inputs:
            batch.wrench(case.key)[1][:, 2] = values

    stepper: lanes.Lanes = batch._copies._lanes  # type: ignore[attr-defined]
    if stepper.why_alone:
        raise RuntimeError(stepper.why_alone)
    start()
    batch.run()  # all functions are loaded
    spent: dict[str, list[float]] = {"": [], "asked to": []}
    states, taken = {}, (0, 0)
    for why in ("", "asked to") * repeat:
        start()
        stepper.why_alone, before = why, (stepper.together, stepper.parted)
        began = time.process_time()
        batch.run()
        spent[why].append(time.process_time() - began)
        states[why] = batch.states.tobytes()
        if not why:
            taken = stepper.together - before[0], stepper.parted - before[1]
    together, alone = min(spent[""]), min(spent["asked to"])
    steps = int(batch._copies.loop["steps"].sum())
    batch.close()
    return {
        "alone_us": 1e6 * alone / steps, "together_us": 1e6 * together / steps, "ratio": alone / together,
        "steps_per_s": steps / together, "side_by_side": taken[0] / steps, "parted": taken[1],
        "same_bits": len({*states.values()}) == 1,
    }  # fmt: skip


def main() -> None:
    """Print a table and write JSON."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("-o", "--output", type=pathlib.Path, default=pathlib.Path(__file__).with_suffix(".json"))
    parser.add_argument("--copies", type=int, default=16)
    parser.add_argument("--repeat", type=int, default=3)
    parser.add_argument("--only", nargs="*", default=list(CASES), choices=list(CASES))
    options = parser.parse_args()
    lanes.COMPILE = 0.0  # functions are compiled in any case
    found: dict[str, Any] = {"load_before": os.getloadavg()[0] if hasattr(os, "getloadavg") else 0.0}
    for name in options.only:
        found[name] = row = measure(CASES[name], options.copies, options.repeat)
        print(name, ", ".join(f"{key} {value:.3g}" for key, value in row.items()), flush=True)
    options.output.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
