"""Winding of the built-in wrapped rib by the energy-momentum method, over the length of its fixed steps.

Columns: the step; mean step that was taken, for steps that Newton's method does not solve are divided; largest gain of
the energy balance, and what the steps took from it, in per cent of the largest energy or work; iterations a step;
divided steps; when the tip is fastest (s); CPU time (s, of one core, without compilation).

    python benchmarks/winding_steps.py [step ...]
"""

from __future__ import annotations

import sys
import time

import numpy as np

from evolvent import cases
from evolvent.solvers import energy_momentum

END, STEPS = 80.0, (0.5, 0.2, 0.1, 0.05, 0.02, 0.01, 0.005, 0.002, 0.001)


def main(steps: list[float]) -> None:
    case = cases.load("wrapped-rib")
    assembly = cases.system("wrapped-rib").build(case).assemble()
    samples = np.linspace(0.0, END, 8001)
    tip = int(assembly.model.flexible.beams["iv"][0]) + 6 * case.rib.elements
    energy_momentum.solve_energy(assembly, samples=[0.0, 0.1], step=0.05)  # compiles
    print("| step, s | mean step, s | gain, % | taken, % | iterations a step | divided | fastest at, s | CPU, s |")
    print("|---|---|---|---|---|---|---|---|")
    for step in steps:
        began = time.process_time()
        found = energy_momentum.solve_energy(assembly, samples=samples, step=step, newton=1e-9)
        used = time.process_time() - began
        count = found.statistics
        largest = max(np.abs(found.energy).max(), np.abs(found.balance.loads).max())
        speed = np.linalg.norm(found.y[:, tip : tip + 3], axis=1)
        print(
            f"| {step:g} | {count['mean_step']:.3g} | {100 * max(found.energy_defect.max(), 0.0) / largest:.1g} "
            f"| {-100 * found.energy_defect.min() / largest:.2g} | {count['iterations'] / count['steps']:.1f} "
            f"| {count['divided_steps']} | {found.t[speed.argmax()]:.2f} | {used:.1f} |",
            flush=True,
        )


if __name__ == "__main__":
    main([float(word) for word in sys.argv[1:]] or list(STEPS))
