"""Winding of the built-in wrapped rib over the length of fixed steps, by energy-momentum and by generalized-alpha.

    python benchmarks/winding_steps.py [--alpha 0.2] [--steps 0.5 0.1] [--methods energy-momentum]

For each mass damping alpha the winding is run to 20 s after the tip is fastest. Columns: step; mean step taken;
largest climb of the energy balance, and the least that it falls to, in per cent of the largest energy or work; error of
the tip's path (root of the mean square over time, against energy-momentum with the shortest step halved) up to 1 s
before the tip is fastest; iterations a step; divided steps; when the tip is fastest; CPU time of one core without
compilation; how the run ended. It prints the Markdown of docs/theory/energy-momentum.md.
"""

from __future__ import annotations

import argparse
import math
import sys

from evolvent_papers.papers.winding import ALPHA, ENERGY, Model, Trial, Winding, markdown, run_all, written

#: When the tip is fastest, s, by the mass damping, 1/s.
FASTEST = {0.0: 28.37, 0.2: 66.79, 0.5: 146.06}
STEPS = (0.5, 0.2, 0.1, 0.05, 0.02, 0.01, 0.005, 0.002, 0.001)
HEADER = (
    "method", "step, s", "mean step, s", "gained, %", "taken, %", "tip error, mm", "iterations a step", "divided",
    "fastest at, s", "CPU, s", "outcome",
)  # fmt: skip


def row(run: Winding, reference: Winding, before: float) -> list[str]:
    """A run in the table; what it has not reached is left out."""
    reached = run.t[-1] > before + 1.0
    return [
        run.trial.method,
        f"{run.step:g}",
        f"{run.mean_step:.3g}",
        written(100.0 * run.gain, least=0.01),
        written(100.0 * run.taken, least=0.01),
        written(1e3 * run.error(reference, before), least=0.01),
        f"{run.iterations:.1f}",
        str(run.divided) if run.trial.method == ENERGY else "-",
        f"{run.peak_time:.2f}" if reached else "-",
        written(run.cpu),
        run.outcome,
    ]


def main() -> int:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--alpha", type=float, nargs="*", default=list(FASTEST), choices=list(FASTEST), help="1/s")
    parser.add_argument("--steps", type=float, nargs="*", default=list(STEPS), help="s")
    parser.add_argument("--methods", nargs="*", default=[ENERGY, ALPHA], choices=[ENERGY, ALPHA])
    options = parser.parse_args()
    for alpha in options.alpha:
        end, before = math.ceil(FASTEST[alpha]) + 20.0, math.floor(FASTEST[alpha]) - 0.5
        model = Model("wrapped-rib", end, {"damping.alpha": alpha, "solver.duration": end})
        trials = [Trial(ENERGY, step=0.5 * min(options.steps))]
        trials += [Trial(method, step=step) for method in options.methods for step in options.steps]
        found = run_all(
            [(model, trial) for trial in trials], lambda sentence: print(f"  {sentence}", file=sys.stderr, flush=True)
        )
        reference = next(found)[1]
        rows = [row(run, reference, before) for _, run in found]
        print(f"\nMass damping {alpha:g} 1/s, {end:g} s; the tip of the reference is fastest at ", end="")
        print(f"{reference.peak_time:.2f} s, its path is compared up to {before:g} s:\n\n{markdown(HEADER, rows)}")
        sys.stdout.flush()
    return 0


if __name__ == "__main__":
    sys.exit(main())
