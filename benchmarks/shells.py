"""Benchmark of the geometrically exact shell: a swinging plate, and its factorisation beside SuperLU's.

    python benchmarks/shells.py [-o benchmarks/shells.json] [--repeat 3]

A plate of 1 m x 1 m, 10 mm thick, E = 20 MPa, nu = 0.3, 1000 kg/m3, falls from the horizontal, held at one corner (its
rotation is free); 100 steps of 1 ms, one core, nothing written. Generalized-alpha and the energy-momentum step take the
spectral radius 0.9. Then the parts of an iteration: residual, tangent, factorisation and solution. SuperLU factors the
same matrix by COLAMD, and by minimum degree of A^T + A with pivots on the diagonal where they serve; its fill is that
of L and U.
"""

from __future__ import annotations

import argparse
import functools
import json
import os
import pathlib
import sys
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import scipy

from evolvent import System, elements, parts
from evolvent.algebra import ordering, sparse_lu
from evolvent.equations import energy_momentum as flow
from evolvent.solvers.static.work import sparse_of
from evolvent.solvers.time.implicit import energy_momentum
from evolvent.solvers.time.implicit.energy_momentum import solve_energy
from evolvent.solvers.time.implicit.plan import solve_implicit

STEP, RADIUS, END = 1e-3, 0.9, 0.1
COUNTS = (8, 16, 32)
#: CPU time of a step that is aimed at with 16 x 16 elements, ms.
GOAL = 15.0
MATERIAL = elements.Material(young_modulus=2e7, poisson_ratio=0.3, density=1000.0)
SOLVERS = {"generalized-alpha": solve_implicit, "energy-momentum": solve_energy}
SUPERLU: dict[str, dict[str, Any]] = {
    "COLAMD": {"permc_spec": "COLAMD"},
    "MMD": {"permc_spec": "MMD_AT_PLUS_A", "options": {"SymmetricMode": True}, "diag_pivot_thresh": 0.01},
}


def plate(n: int) -> Any:
    """The assembled plate of n x n elements."""
    system = System(gravity=(0.0, 0.0, -9.81))
    system.add(parts.Shell(size=(1.0, 1.0), elements=(n, n), thickness=0.01, material=MATERIAL), "plate")
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="plate[0]"))
    return system.assemble()


def steps(assembly: Any, method: str, repeat: int) -> tuple[float, float, float]:
    """CPU time of a step, ms, its iterations and its factorisations."""
    best = np.inf
    counts: dict[str, Any] = {}
    for _ in range(repeat):
        began = time.process_time()
        found = SOLVERS[method](assembly, samples=(0.0, END), step=STEP, spectral_radius=RADIUS)
        seconds = time.process_time() - began
        if not found.success:
            raise RuntimeError(found.message)
        counts = found.statistics
        best = min(best, seconds / counts["steps"])
    return 1e3 * best, counts["iterations"] / counts["steps"], counts["factorizations"] / counts["steps"]


def least(call: Callable[[], Any], repeat: int, prepare: Callable[[], Any] = lambda: None) -> float:
    """Least CPU time of a call, ms."""
    best = np.inf
    for _ in range(repeat):
        prepare()
        began = time.process_time()
        call()
        best = min(best, time.process_time() - began)
    return 1e3 * best


def iteration(assembly: Any, repeat: int) -> dict[str, float]:
    """Times of the parts of an iteration, ms, and the fill, of this package and of SuperLU."""
    plan = energy_momentum.plan(assembly, samples=[0.0, END], step=STEP, spectral_radius=RADIUS)
    model, step, matrix = plan.assembly.model, plan.workspace().step, plan.matrix
    step.step.h = STEP
    flow.measure(0, model, step)
    step.dq[:] = 1e-5 * np.random.default_rng(0).standard_normal(step.dq.size)
    row = {"residual_ms": least(lambda: flow.residual(model, step), repeat)}
    row["tangent_ms"] = least(lambda: flow.tangent(1.0, model, step, matrix), repeat)
    A, kept = sparse_of(matrix).tocsc(), matrix.values.copy()
    A.sum_duplicates()
    A.eliminate_zeros()

    def restore() -> None:
        matrix.values[:] = kept

    row["factor_ms"] = least(lambda: sparse_lu.factor(matrix), repeat, restore)
    f = np.random.default_rng(1).standard_normal(A.shape[0])
    x = f.copy()
    sparse_lu.solve(matrix, x)
    row["solve_ms"] = least(lambda: sparse_lu.solve(matrix, f.copy()), repeat)
    row["fill"], row["operations"] = matrix.values.size, ordering.operations(matrix)
    for name, options in SUPERLU.items():
        lu = scipy.sparse.linalg.splu(A, **options)
        if np.abs(lu.solve(f) - x).max() > 1e-6 * np.abs(x).max():
            raise RuntimeError(f"the solutions of this package and of SuperLU ({name}) differ")
        row[f"{name}_ms"] = least(functools.partial(scipy.sparse.linalg.splu, A, **options), repeat)
        row[f"{name}_fill"] = lu.L.nnz + lu.U.nnz
    return row


def main() -> int:
    """Print the table and write the JSON file."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("-o", "--output", type=pathlib.Path, default=pathlib.Path(__file__).with_suffix(".json"))
    parser.add_argument("--repeat", type=int, default=3)
    options = parser.parse_args()
    load, rows = os.getloadavg(), []
    print(f"load {load[0]:.2f}\n{'':20}{'elements':>9}{'ms a step':>11}{'iterations':>12}{'factored':>10}")
    for n in COUNTS:
        assembly = plate(n)
        for method in SOLVERS:
            ms, iterations, factored = steps(assembly, method, options.repeat)
            rows.append({"method": method, "elements": n, "ms_a_step": ms, "iterations": iterations})
            goal = f"   goal {GOAL:g}" if n == 16 else ""
            print(f"{method:20}{n:5} x{n:3}{ms:11.2f}{iterations:12.2f}{factored:10.2f}{goal}")
        row: dict[str, Any] = {"elements": n} | iteration(assembly, options.repeat)
        rows.append(row)
        for name in ("", *SUPERLU):
            ms, fill = (row["factor_ms"], row["fill"]) if not name else (row[f"{name}_ms"], row[f"{name}_fill"])
            print(f"    {f'SuperLU, {name}' if name else 'factorisation':24}{ms:9.2f} ms{fill:11} entries")
        print("    " + ", ".join(f"{key} {row[f'{key}_ms']:.2f} ms" for key in ("residual", "tangent", "solve")))
    options.output.write_text(json.dumps({"load": [load, os.getloadavg()], "rows": rows}, indent=2) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
