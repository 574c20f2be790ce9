"""Identification: each method's error over the Cramér-Rao bound, failures, coverage, order found, and time.

    python benchmarks/identification.py [-o benchmarks/identification.json] [--trials 500]

Three set-ups (tests/massprops/identification/setups.py of its package):
12.24 s, four sensors, white noise of 1 % of the largest
amplitude of any mode at any sensor, N = 100 (8.17 Hz; the fastest mode has 2.1 samples a period) and N = 1000 (81.7
Hz). A trial fails where the method raises, or its worst frequency is off by more than half the distance to the next
mode. The ratio is the worst mode's root mean square error of frequency, over the trials that did not fail, to its
bound for all four sensors. Times are of one call, warm: the tenth percentile, since a machine has other things to do
as well, and the median. Run with OPENBLAS_NUM_THREADS=1 for one core.
"""

from __future__ import annotations

import argparse
import importlib.util
import json
import os
import pathlib
import platform
import sys
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import scipy

from evolvent_base.errors import InputError
from evolvent_massprops.identification import (
    IdentifiedModes,
    cramer_rao,
    esprit,
    identify,
    matrix_pencil,
    prony,
    tls_prony,
    varpro,
)

ROOT = pathlib.Path(__file__).resolve().parent.parent
TESTS = ROOT / "packages" / "evolvent-massprops" / "tests" / "massprops" / "identification"
_spec = importlib.util.spec_from_file_location("setups", TESTS / "setups.py")
assert _spec is not None
assert _spec.loader is not None
setups = importlib.util.module_from_spec(_spec)
sys.modules["setups"] = setups
_spec.loader.exec_module(setups)

METHODS: dict[str, tuple[Callable[..., IdentifiedModes], dict[str, Any], slice]] = {
    "varpro": (varpro, {}, slice(None)),
    "esprit": (esprit, {}, slice(None)),
    "matrix pencil": (matrix_pencil, {}, slice(None)),
    "matrix pencil, one sensor": (matrix_pencil, {}, slice(0, 1)),
    "tls prony": (tls_prony, {}, slice(None)),
    "tls prony, one sensor": (tls_prony, {}, slice(0, 1)),
    "prony, decimated": (prony, {}, slice(None)),
    "prony, decimated, one sensor": (prony, {}, slice(0, 1)),
    "prony, full rate": (prony, {"samples_per_period": None}, slice(None)),
}


def measure(name: str, setup: Any, length: int, trials: int) -> dict[str, float]:
    """Ratio, failures, coverage and time of one method in one set-up."""
    method, options, sensors = METHODS[name]
    m, rate = len(setup.frequency), length / setups.DURATION
    bound = cramer_rao(
        setup.frequency,
        setup.decay_rate,
        np.abs(setup.amplitude),
        phase=np.angle(setup.amplitude),
        rate=rate,
        length=length,
        noise=setup.noise,
    )
    deviation = np.sqrt(np.diag(bound)[:m])
    tolerance = 0.5 * np.diff(setup.frequency).min()
    rng = np.random.default_rng(2002)
    errors, inside, times, failures = [], [], [], 0
    for _ in range(trials):
        data = setup.samples(length, rng)[:, sensors]
        began = time.perf_counter()
        try:
            modes = method(data, m, rate=rate, **options)
        except InputError:
            failures += 1
            continue
        times.append(time.perf_counter() - began)
        error = modes.frequency - setup.frequency
        if np.abs(error).max() > tolerance:
            failures += 1
            continue
        errors.append(error)
        inside.append(np.abs(error) < 1.959964 * modes.frequency_std)
    found: dict[str, float] = {"failures": failures, "trials": trials}
    if errors:
        found["ratio"] = float((np.sqrt(np.mean(np.square(errors), axis=0)) / deviation).max())
        found["time_ms"] = 1e3 * float(np.quantile(times, 0.1))
        found["median_time_ms"] = 1e3 * float(np.median(times))
        if name == "varpro":
            found["coverage"] = float(np.mean(inside))
    return found


def measure_order(setup: Any, length: int, trials: int) -> dict[str, float]:
    """Share of records in which `identify` finds the order, and its time."""
    rng = np.random.default_rng(77)
    right, times = 0, []
    for _ in range(trials):
        data = setup.samples(length, rng)
        began = time.perf_counter()
        right += identify(data, rate=length / setups.DURATION).order == len(setup.frequency)
        times.append(time.perf_counter() - began)
    return {"right": right, "trials": trials, "time_ms": 1e3 * float(np.quantile(times, 0.1))}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-o", "--output", type=pathlib.Path)
    parser.add_argument("--trials", type=int, default=500)
    options = parser.parse_args()
    results: dict[str, Any] = {
        "python": platform.python_version(),
        "numpy": np.__version__,
        "scipy": scipy.__version__,
        "machine": platform.machine(),
        "threads": os.environ.get("OPENBLAS_NUM_THREADS", "not set"),
        "methods": {},
        "order": {},
    }
    for key, build in setups.SETUPS.items():
        setup = build()
        for length in (100, 1000):
            case = f"{key}, N = {length}"
            print(f"\n{setup.name}, N = {length}: ratio to the bound, failures, time")
            for name in METHODS:
                # the pencil of a long record is slow, and its ratio known well enough from fewer trials
                trials = options.trials if name != "matrix pencil" or length == 100 else min(options.trials, 100)
                found = measure(name, setup, length, trials)
                results["methods"].setdefault(case, {})[name] = found
                ratio = f"{found['ratio']:9.2f}" if "ratio" in found else "        -"
                cover = f"   95 % intervals cover {100 * found['coverage']:.1f} %" if "coverage" in found else ""
                spent = f"{found['time_ms']:8.2f} ms" if "time_ms" in found else "           "
                print(f"  {name:30s}{ratio}{found['failures']:6d} / {trials}{spent}{cover}")
            found = measure_order(setup, length, min(options.trials, 200))
            results["order"][case] = found
            print(f"  order found in {found['right']} of {found['trials']}, {found['time_ms']:.1f} ms each")
    if options.output:
        options.output.write_text(json.dumps(results, indent=1) + "\n")


if __name__ == "__main__":
    main()
