"""Benchmark of studies: how much faster two workers are than one, start of the processes included.

    python benchmarks/sweep.py [-o benchmarks/sweep.json] [--cases 480] [--workers 2] [--wait 600]

The study is whole deployments of blades of inextensible links, the built-in case over 20 to 23 nodes and as many feeds
as it takes. Each way is taken once, in a fresh folder, after one case that compiles; the results must have the same
bits. `start` is the time to the first finished case, `cpu` the processor time of all processes. Where other work keeps
the machine busy, wall times tell nothing; the ratio by processor time, workers x cpu of one / cpu of several, is then
what a quiet machine would reach at most. Waits until it is quiet.
"""

from __future__ import annotations

import argparse
import json
import os
import pathlib
import platform
import sys
import tempfile
import time
from typing import Any

import numpy as np

from evolvent.design import studies

GOAL = 1.7
#: Load of the machine, processes, below which it is quiet.
QUIET = 0.3


def study(cases: int) -> dict[str, Any]:
    return {
        "study": "benchmark",
        "case": "heliogyro",
        "set": {"blade.segments": "inextensible", "solver.method": "dopri5", "output.every": "1 s"},
        "over": {
            "spool.rate": {"from": "3 rad/s", "to": "4 rad/s", "points": max(1, cases // 4)},
            "blade.nodes": [20, 21, 22, 23],
        },
        "keep": ["body_rate.last", "tip_lag.last", "steps"],
    }


def load() -> float:
    return round(os.getloadavg()[0], 2) if hasattr(os, "getloadavg") else 0.0


def cpu() -> float:
    """Processor time of this process and of its children that have ended, s."""
    times = os.times()
    return times.user + times.system + times.children_user + times.children_system


def wait(seconds: float) -> None:
    """Until the machine is quiet, or time is up."""
    end = time.monotonic() + seconds
    while load() > QUIET and time.monotonic() < end:
        time.sleep(2.0)


def take(content: dict[str, Any], workers: int) -> tuple[Any, dict[str, float]]:
    """One sweep and its times."""
    seen: list[tuple[float, int]] = []
    before = load()
    began, spent = time.perf_counter(), cpu()
    with tempfile.TemporaryDirectory() as folder:
        found = studies.sweep(
            content,
            output=os.path.join(folder, "study"),
            workers=workers,
            progress=lambda done, count: seen.append((time.perf_counter() - began, done)),
        )
    wall = time.perf_counter() - began
    start = next(t for t, done in seen if done)
    return found, {"wall_s": wall, "start_s": start, "cpu_s": cpu() - spent, "load_before": before}


def main() -> int:
    parser = argparse.ArgumentParser(description="Benchmark of studies.")
    parser.add_argument("-o", "--output", default=str(pathlib.Path(__file__).with_name("sweep.json")))
    parser.add_argument("--cases", type=int, default=480)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--wait", type=float, default=600.0, help="seconds to wait for a quiet machine")
    options = parser.parse_args()
    content = study(options.cases)
    studies.sweep({**content, "over": {"spool.rate": ["3.5 rad/s"]}})
    wait(options.wait)
    if load() > QUIET:
        print(f"the machine is not quiet (load {load()}): the figures are too low", file=sys.stderr)
    one, alone = take(content, 1)
    several, together = take(content, options.workers)
    for name in one.variables:
        if not np.array_equal(one[name].values, several[name].values, equal_nan=one[name].dtype.kind == "f"):
            raise RuntimeError(f"{name} differs between one worker and {options.workers}")
    ratio = alone["wall_s"] / together["wall_s"]
    by_cpu = options.workers * alone["cpu_s"] / together["cpu_s"]
    result = {
        "cases": int(one.status.size),
        "workers": options.workers,
        "cores": os.cpu_count(),
        "machine": platform.machine(),
        "versions": json.loads(one.attrs["versions"]),
        "one": alone,
        "several": together,
        "ratio": ratio,
        "ratio_by_cpu": by_cpu,
        "goal": GOAL,
        "load_after": load(),
    }
    pathlib.Path(options.output).write_text(json.dumps(result, indent=2) + "\n", encoding="utf-8")
    print(f"{'workers':<10}{'wall, s':>10}{'start, s':>10}{'cpu, s':>10}{'load before':>13}")
    for workers, row in ((1, alone), (options.workers, together)):
        times = f"{row['wall_s']:>10.2f}{row['start_s']:>10.2f}{row['cpu_s']:>10.2f}"
        print(f"{workers:<10}{times}{row['load_before']:>13.2f}")
    print(f"ratio of wall times {ratio:.2f} (goal {GOAL}), by processor time {by_cpu:.2f}; the same bits")
    return 0


if __name__ == "__main__":
    sys.exit(main())
