"""Benchmark of the block-tridiagonal LU: one factorisation and one solution, beside SciPy's banded solver.

    python benchmarks/blocks.py [-o benchmarks/blocks.json] [--repeat 20]

One core throughout. n blocks of m unknowns, each coupled to its two neighbours, and k border unknowns at the first
block (the joint at a rib's root). Ours: `factor` with a copy of the matrix in, the copy alone (taken off in the table,
not in the ratios), and `solve`, repeated within compiled code as in a time step. `SciPy`: `scipy.linalg.solve_banded`
of the same blocks without the border, whose matrix is already stored by diagonals; `gbsv` is LAPACK's routine by
itself, without the checks around it, its copy included. The ratios are to copying, factoring and solving together.
Best of `--repeat` samples, taken in turns. All must solve their system to 1e-9.
"""

from __future__ import annotations

import argparse
import json
import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import pathlib
import sys
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from scipy import linalg

from evolvent.jit import kernel
from evolvent.kernels import blocks

#: Shortest time of one sample, s.
SAMPLE = 0.005


@kernel
def copy(source, target):
    """The entries of flat arrays into others: an assignment would make room for temporary ones."""
    for k in range(len(source)):
        a, b = source[k], target[k]
        for i in range(a.size):
            b[i] = a[i]


@kernel
def copies(source, target, times):
    """Copy a matrix `times` times."""
    for _ in range(times):
        copy(source, target)


@kernel
def factorisations(source, target, matrix, times):
    """Copy and factor `times` times."""
    for _ in range(times):
        copy(source, target)
        blocks.factor(matrix)


@kernel
def solutions(matrix, b, x, times):
    """Solve `times` times."""
    for _ in range(times):
        copy((b,), (x,))
        blocks.solve(matrix, x)


def flat(matrix: blocks.Bordered) -> tuple[np.ndarray, ...]:
    """Views of its entries."""
    return tuple(part.reshape(-1) for part in (matrix.A, matrix.B, matrix.C, matrix.E))


def blocks_of(rng: np.random.Generator, n: int, m: int, k: int) -> blocks.Bordered:
    """A random system whose blocks need interchanges; the border is a saddle point at the first block."""
    matrix = blocks.bordered(n, m, k)
    matrix.A[:] = rng.standard_normal(matrix.A.shape)
    matrix.A[0, :, :m] = matrix.A[-1, :, 2 * m :] = 0.0
    matrix.A[:, :, m : 2 * m] += 3.0 * m * np.eye(m)[rng.permutation(m)]
    matrix.B[:m, :k] = matrix.C[:m, :k] = rng.standard_normal((m, k))
    return matrix


def product(matrix: blocks.Bordered, x: np.ndarray) -> np.ndarray:
    """The whole matrix, as given, times x."""
    n, m, _ = matrix.A.shape
    inner, border = x[: n * m], x[n * m :]
    padded = np.concatenate([np.zeros(m), inner, np.zeros(m)])
    windows = np.stack([padded[i * m : (i + 3) * m] for i in range(n)])
    rows = np.einsum("irc,ic->ir", matrix.A, windows).ravel() + matrix.B @ border
    return np.concatenate([rows, matrix.C.T @ inner + matrix.E @ border])


def banded(matrix: blocks.Bordered) -> np.ndarray:
    """The blocks by diagonals, as `solve_banded` wants them."""
    n, m, _ = matrix.A.shape
    width = 2 * m - 1
    bands = np.zeros((2 * width + 1, n * m))
    for i in range(n):
        for r in range(m):
            for c in range(3 * m):
                row, column = i * m + r, (i - 1) * m + c
                if 0 <= column < n * m and matrix.A[i, r, c] != 0.0:
                    bands[width + row - column, column] = matrix.A[i, r, c]
    return bands


def times_of(calls: dict[str, Callable[[int], None]], repeat: int) -> dict[str, float]:
    """Best time of each, us, in `repeat` samples taken in turns; a call receives how often to do its work."""
    counts, best = {}, {}
    for name, call in calls.items():
        count, spent = 1, 0.0
        call(1)
        while spent < SAMPLE:
            count *= 2
            began = time.perf_counter()
            call(count)
            spent = time.perf_counter() - began
        counts[name], best[name] = count, spent / count
    for _ in range(repeat):
        for name, call in calls.items():
            began = time.perf_counter()
            call(counts[name])
            best[name] = min(best[name], (time.perf_counter() - began) / counts[name])
    return {name: 1e6 * value for name, value in best.items()}


def often(work: Callable[[], Any]) -> Callable[[int], None]:
    """A call that does `work` as often as it is told."""

    def call(times: int) -> None:
        for _ in range(times):
            work()

    return call


def measure(n: int, m: int, k: int, repeat: int) -> dict[str, Any]:
    """All times of one size, us."""
    rng = np.random.default_rng(1000 * n + 10 * m + k)
    source, matrix = blocks_of(rng, n, m, k), blocks.bordered(n, m, k)
    expected = rng.standard_normal(n * m + k)
    b, x = product(source, expected), np.empty(n * m + k)
    given, target = flat(source), flat(matrix)
    calls: dict[str, Callable[[int], None]] = {
        "copy": lambda times: copies(given, target, times),
        "factor": lambda times: factorisations(given, target, matrix, times),
        "solve": lambda times: solutions(matrix, b, x, times),
    }
    width, bands = 2 * m - 1, banded(source)
    inner = product(source, np.concatenate([expected[: n * m], np.zeros(k)]))[: n * m]
    room = np.zeros((3 * width + 1, n * m), order="F")
    filled = room.copy(order="F")
    filled[width:] = bands

    def lapack() -> Any:
        room[:] = filled
        return linalg.lapack.dgbsv(width, width, room, inner, overwrite_ab=True)

    def scipy() -> Any:
        return linalg.solve_banded((width, width), bands, inner)

    calls["scipy"], calls["gbsv"] = often(scipy), often(lapack)
    best = times_of(calls, repeat)
    for name, solution, size in (("ours", x, n * m + k), ("SciPy", scipy(), n * m), ("LAPACK", lapack()[2], n * m)):
        gap = float(np.abs(solution - expected[:size]).max())
        if not gap < 1e-9:
            raise SystemExit(f"{name} is wrong by {gap:.1e} at n = {n}, m = {m}, k = {k}")
    whole = best["factor"] + best["solve"]
    return {
        "n": n,
        "m": m,
        "k": k,
        "copy_us": best["copy"],
        "factor_us": best["factor"] - best["copy"],
        "solve_us": best["solve"],
        "factor_and_solve_us": whole - best["copy"],
        "scipy_solve_banded_us": best["scipy"],
        "lapack_gbsv_us": best["gbsv"],
        "scipy_over_ours": best["scipy"] / whole,
        "lapack_over_ours": best["gbsv"] / whole,
    }


def main() -> int:
    """Take all figures."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    default = pathlib.Path(__file__).with_name("blocks.json")
    parser.add_argument("-o", "--output", type=pathlib.Path, default=default)
    parser.add_argument("--repeat", type=int, default=20)
    options = parser.parse_args()
    before = os.getloadavg()
    print(f"{'m':>3} {'n':>4} {'k':>2} {'copy':>7} {'factor':>8} {'solve':>7} {'SciPy':>8} {'gbsv':>8}  us;  over ours")
    figures = []
    for m in (6, 12):
        for n in (10, 20, 40, 80, 160):
            for k in (0, 5):
                f = measure(n, m, k, options.repeat)
                figures.append(f)
                print(
                    f"{m:3} {n:4} {k:2} {f['copy_us']:7.2f} {f['factor_us']:8.2f} {f['solve_us']:7.2f} "
                    f"{f['scipy_solve_banded_us']:8.1f} {f['lapack_gbsv_us']:8.1f}      "
                    f"{f['scipy_over_ours']:4.1f} {f['lapack_over_ours']:4.1f}",
                    flush=True,
                )
    report = {"load": [before, os.getloadavg()], "figures": figures}
    options.output.write_text(json.dumps(report, indent=2) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
